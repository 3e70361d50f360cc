"""Cutting and joining the splat graph by hand: pairs of file rows, as an edit keeps them."""

from collections.abc import Iterable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from splap_editor.core.graph.splat_graph import GraphOptions, SplatGraph
from splap_editor.core.index_spaces import FileMask, FileRows, RowPair
from splap_editor.core.splats.occupancy import Ellipses
from splap_editor.core.splats.spherical_harmonics import SH_C0
from splap_editor.core.splats.splats import Splats
from splap_editor.core.surface.fragments import fragment_contacts


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


class FragmentLinks(NamedTuple):
    """Contacts that tie fragments, and what becomes of each.

    Parameters
    ----------
    pairs : list of RowPair
    n_tied, n_far, n_unlike : int
        See `FragmentContacts`.
    n_pieces : int
        Components of the graph once they are added.
    """

    pairs: list[RowPair]
    n_tied: int
    n_far: int
    n_unlike: int
    n_pieces: int


def fragment_links(splats: Splats, ellipses: Ellipses, graph: SplatGraph) -> FragmentLinks:
    """Contacts that tie each fragment that looks like a piece of the surface: see `fragment_contacts`."""
    colors = 0.5 + SH_C0 * np.asarray(splats.sh0, np.float64)[ellipses.rows]
    found = fragment_contacts(ellipses, graph, colors)
    n, (a, b) = int(graph.components.max(initial=-1)) + 1, graph.components[found.pairs].T
    n_pieces = connected_components(sp.csr_array((np.ones(len(a)), (a, b)), shape=(n, n)), directed=False)[0]
    return FragmentLinks(
        _as_pairs(ellipses.rows[found.pairs]), found.n_tied, found.n_far, found.n_unlike, int(n_pieces)
    )


def _as_pairs(rows: FileRows) -> list[RowPair]:
    return sorted(_sorted_pairs(rows.tolist()))


def _sorted_pairs(pairs: Iterable[Iterable[int]]) -> set[tuple[int, int]]:
    return {(min(pair), max(pair)) for pair in map(tuple, pairs)}
