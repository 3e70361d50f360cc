"""Cutting and joining the splat graph by hand: pairs of file rows, as an edit keeps them."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.graph.splat_graph import GraphOptions, SplatGraph
from splap_editor.core.index_spaces import FileMask, FileRows, RowPair
from splap_editor.core.splats.occupancy import Ellipses
from splap_editor.core.surface.joining import best_contacts, contact_order, near_pairs

FRAGMENT_SHARE = 0.01
"""A component of at most such a share of all nodes is a fragment, if it is not the largest."""

JOIN_REACH = 3.0
"""A fragment is joined where centres are no farther apart than so many times both reaches together."""

N_LINKS = 3
"""Best contacts by which a fragment is tied: one alone would let it turn freely."""


def with_cut(options: GraphOptions, pairs: Iterable[RowPair]) -> GraphOptions:
    """Cut edges between file rows; one that was added by hand is merely taken back."""
    pairs, add = _sorted_pairs(pairs), _sorted_pairs(options.add)
    cut = tuple(sorted(_sorted_pairs(options.cut) | (pairs - add)))
    return replace(options, cut=cut, add=tuple(sorted(add - pairs)))


def with_added(options: GraphOptions, pairs: Iterable[RowPair]) -> GraphOptions:
    """Add edges between file rows; one that was cut by hand is merely put back."""
    pairs, cut = _sorted_pairs(pairs), _sorted_pairs(options.cut)
    add = tuple(sorted(_sorted_pairs(options.add) | (pairs - cut)))
    return replace(options, cut=tuple(sorted(cut - pairs)), add=add)


def edges_between(ellipses: Ellipses, graph: SplatGraph, first: FileMask, second: FileMask) -> list[RowPair]:
    """Edges with one end in each of two masks (N,) over file rows, as pairs of rows."""
    rows = ellipses.rows[graph.edges]
    ends = first[rows], second[rows]
    crossing = (ends[0][:, 0] & ends[1][:, 1]) | (ends[0][:, 1] & ends[1][:, 0])
    return _as_pairs(rows[crossing])


def best_links(ellipses: Ellipses, epsilon: float, first: FileMask, second: FileMask) -> list[RowPair]:
    """Contacts by which two selections are best joined.

    See `best_contacts`.

    Parameters
    ----------
    ellipses : Ellipses
    epsilon : float
        Tolerance in units of the scene scale.
    first, second : (N,) bool
        Over file rows; what both have belongs to the first.

    Returns
    -------
    list of RowPair
        File rows; empty if a side has no active splat.
    """
    a = np.flatnonzero(first[ellipses.rows])
    b = np.flatnonzero((second & ~first)[ellipses.rows])
    return _as_pairs(ellipses.rows[best_contacts(ellipses, a, b, epsilon * ellipses.scene_scale)])


def fragments(graph: SplatGraph) -> NDArray[np.int64]:
    """Labels of the components that are small beside the whole, ascending; never the largest."""
    sizes = np.bincount(graph.components) if graph.n_nodes else np.zeros(0, np.int64)
    small = np.flatnonzero(sizes <= max(FRAGMENT_SHARE * graph.n_nodes, 1.0))
    return small[small > 0]


def fragment_links(ellipses: Ellipses, graph: SplatGraph, epsilon: float) -> tuple[list[RowPair], int]:
    """Contacts that tie each fragment to what is around it.

    Parameters
    ----------
    ellipses : Ellipses
    graph : SplatGraph
    epsilon : float
        Tolerance in units of the scene scale.

    Returns
    -------
    pairs : list of RowPair
        File rows: up to three best contacts of each fragment with components that are none.
    n_left : int
        Fragments too far from everything to be joined.
    """
    small = fragments(graph)
    is_small = np.isin(graph.components, small)
    a, b = np.flatnonzero(is_small), np.flatnonzero(~is_small)
    if not len(a) or not len(b):
        return [], len(small)
    pairs = near_pairs(ellipses, a, b)
    apart = np.linalg.norm(ellipses.centers[pairs[:, 0]] - ellipses.centers[pairs[:, 1]], axis=1)
    pairs = pairs[apart <= JOIN_REACH * ellipses.reaches[pairs].sum(axis=1)]
    pairs = pairs[contact_order(ellipses, pairs, epsilon * ellipses.scene_scale)]
    owners = graph.components[pairs[:, 0]]
    # Rank within the fragment: pairs are in order of contact, and a stable sort keeps that for each owner.
    order = np.argsort(owners, kind="stable")
    starts = np.flatnonzero(np.diff(owners[order], prepend=-1))
    ranks = np.arange(len(order)) - np.repeat(starts, np.diff(np.append(starts, len(order))))
    chosen = order[ranks < N_LINKS]
    return _as_pairs(ellipses.rows[pairs[chosen]]), len(small) - len(starts)


def _as_pairs(rows: FileRows) -> list[RowPair]:
    return sorted(_sorted_pairs(rows.tolist()))


def _sorted_pairs(pairs: Iterable[Iterable[int]]) -> set[tuple[int, int]]:
    return {(min(pair), max(pair)) for pair in map(tuple, pairs)}
