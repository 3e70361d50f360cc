"""Strokes over two parts as the edges that they cut or add."""

from collections.abc import Iterable
from dataclasses import replace
from weakref import WeakKeyDictionary

import numpy as np
from scipy.spatial import cKDTree

from splap_editor.core.graph.options import GraphOptions, Joint, Point, Separation
from splap_editor.core.graph.splat_graph import SplatGraph, mended_graph
from splap_editor.core.index_spaces import Nodes, RowPair
from splap_editor.core.splats.occupancy import Ellipses
from splap_editor.core.surface.geodesics import geodesic_distances
from splap_editor.core.surface.joining import best_contacts
from splap_editor.core.surface.separation import Seam, seam_between

RIM = 2.0
"""A joint looks for contacts up to so many times its reach from the places pointed at, along the surface."""


def stroke_mends(
    ellipses: Ellipses,
    graph: SplatGraph,
    options: GraphOptions,
    *,
    near: tuple[GraphOptions, GraphOptions, SplatGraph] | None = None,
) -> GraphOptions:
    """Turn strokes into the edges that they cut and add.

    Separations come first, in their order, each in the graph that the ones
    before it left; then joints.

    Parameters
    ----------
    ellipses : Ellipses
        n nodes.
    graph : SplatGraph
        Theirs, with nothing cut or added.
    options : GraphOptions
    near : tuple of GraphOptions, GraphOptions and SplatGraph, optional
        Others, what this function gave for them, and the graph so mended: where strokes were only added since, it is
        gone on from.

    Returns
    -------
    GraphOptions
        Without strokes; ``cut`` and ``add`` name file rows.

    Raises
    ------
    ValueError
        Both parts of a stroke are nearest to the same splat.
    """
    separate, join = options.separate, options.join
    mends = replace(options, separate=(), join=())
    mended: SplatGraph | None = None
    if near is not None and _goes_on_from(options, near[0]):
        separate, join = separate[len(near[0].separate) :], join[len(near[0].join) :]
        mends, mended = replace(mends, cut=near[1].cut, add=near[1].add), near[2]
    for stroke in separate:
        seam = stroke_seam(ellipses, mended or mended_graph(ellipses, graph, mends), stroke)
        mended, pairs = None, row_pairs(ellipses, seam.edges)
        mends = replace(mends, cut=_sorted(set(mends.cut) | pairs), add=_sorted(_ordered(mends.add) - pairs))
    for joint in join:
        tied = joint_contacts(ellipses, mended or mended_graph(ellipses, graph, mends), joint)
        mended, pairs = None, row_pairs(ellipses, tied)
        mends = replace(mends, cut=_sorted(_ordered(mends.cut) - pairs), add=_sorted(set(mends.add) | pairs))
    return mends


def stroke_seam(ellipses: Ellipses, graph: SplatGraph, stroke: Separation) -> Seam:
    """What a separation cuts in a graph; what was found last in it is found at once, as when its preview is taken.

    Raises
    ------
    ValueError
        Both parts are nearest to the same splat.
    """
    known = _LAST_SEAM.get(graph)
    if known is None or known[0] != stroke:
        first, second = nodes_at(ellipses, stroke.a), nodes_at(ellipses, stroke.b)
        known = _LAST_SEAM[graph] = stroke, seam_between(graph, first, second, wider=stroke.wider)
    return known[1]


_LAST_SEAM: WeakKeyDictionary[SplatGraph, tuple[Separation, Seam]] = WeakKeyDictionary()
"""Of graphs that are in use."""


def joint_contacts(ellipses: Ellipses, graph: SplatGraph, joint: Joint) -> Nodes:
    """(P, 2) nodes by which the two rims of a joint are best tied, and are not yet.

    A node near both belongs to the nearer part.
    """
    apart = [
        geodesic_distances(graph, nodes_at(ellipses, part), limit=RIM * joint.reach) for part in (joint.a, joint.b)
    ]
    first, second = np.flatnonzero(apart[0] < apart[1]), np.flatnonzero(apart[1] < apart[0])
    contacts = best_contacts(ellipses, first, second, graph.epsilon, reach=joint.reach)
    are_joined = [j in graph.indices[graph.indptr[i] : graph.indptr[i + 1]] for i, j in contacts]
    return contacts[~np.array(are_joined, bool)]


def nodes_at(ellipses: Ellipses, points: Iterable[Point]) -> Nodes:
    """Nodes nearest to some points, ascending, each once."""
    tree = _TREES.get(ellipses)
    if tree is None:
        # A tree that is asked but a few times need not be a good one.
        tree = _TREES[ellipses] = cKDTree(ellipses.centers, balanced_tree=False, compact_nodes=False)
    return np.unique(tree.query(np.array(list(points), np.float64).reshape(-1, 3))[1]).astype(np.int64)


_TREES: WeakKeyDictionary[Ellipses, cKDTree] = WeakKeyDictionary()
"""Over the centres of the scenes that are open: a second stroke need not wait for it."""


def row_pairs(ellipses: Ellipses, edges: Nodes) -> set[RowPair]:
    """Pairs of nodes as pairs of file rows, the smaller first."""
    return {(a, b) for a, b in np.sort(ellipses.rows[edges], axis=1).tolist()}


def _goes_on_from(options: GraphOptions, before: GraphOptions) -> bool:
    if (before.cut, before.add) != (options.cut, options.add):
        return False
    if options.separate[: len(before.separate)] != before.separate or options.join[: len(before.join)] != before.join:
        return False
    return not before.join or before.separate == options.separate


def _ordered(pairs: Iterable[RowPair]) -> set[RowPair]:
    return {(min(pair), max(pair)) for pair in pairs}


def _sorted(pairs: set[RowPair]) -> tuple[RowPair, ...]:
    return tuple(sorted(pairs))
