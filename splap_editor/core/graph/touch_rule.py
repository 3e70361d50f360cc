"""The touch rule: which contacts between ellipses are edges of the splat graph."""

import numba as nb
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from splap_editor.core.graph.ellipse_offset import two_way_touch
from splap_editor.core.graph.ellipse_tree import EllipseTree, may_touch, nearest_touches
from splap_editor.core.progress import Progress, part_of

N_PARTNERS = 6
"""An edge is among so many best contacts of both its ends. Fewer tear thin bars apart, more tie near surfaces
together."""

REDUNDANCY = 0.4
"""A contact is passed over if its partner and a better one are that much nearer to each other: where splats lie in
many layers, a stack of them takes one place in the ranking and not all."""

SHORT_LIST = 12
"""So many contacts are ranked before redundant ones are passed over."""

N_NEAR = 8
"""A contact among so many of both ends, redundant or not, closes a triangle of edges."""

_CLOSING_ROUNDS = 2

PEER_RATIO = 3.0
"""A splat ranks its contacts with splats of at most so many times its reach; else the few giants that cover
everything would be everyone's best contacts."""

FRAGMENT_SIZE = 32
"""A component of at most so many nodes may be joined to another by growing its ellipses."""

FRAGMENT_REACH = 2.0
"""Largest touch scale at which a fragment is joined."""

_CHUNK = 16384


def touch_edges(tree: EllipseTree, epsilon: float, progress: Progress) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """Best contacts of every ellipse, and between what they leave apart.

    Contacts are ranked by *touch scale*, the factor at which two ellipses just
    meet: small where centres lie in each other's ellipse, near 1 where only
    rims touch, as they do where splats overhang the border of their surface.
    An edge is a contact of touch scale at most 1 that is among the 6 best of
    both its ends. A partner that nearly coincides with a better one does not
    count: their own touch scale is below 0.4 of its. The components this leaves
    are joined as a minimum spanning forest by touch scale joins them: up to 1,
    so that whatever touches is connected; and up to 2 for fragments of at most
    32 nodes.

    Distances along so sparse a graph are longer than along the surface. So a
    contact among the 8 best of both ends, redundant or not, becomes an edge too
    if its ends have a neighbour in common, in two rounds: this joins nothing
    that the edges before left far apart.

    Parameters
    ----------
    tree : EllipseTree
        n ellipses.
    epsilon : float
        Tolerance along the normals in world units.
    progress : Progress
        Called with the share done.

    Returns
    -------
    edges : (E, 2) int32
        Nodes i < j, each edge once, in no order.
    touch : (E,) float64
        Touch scales.
    """
    n = len(tree.nodes)
    everything = np.arange(n)
    partners, scales = _nearest(
        tree, everything, everything, epsilon, 1.0, PEER_RATIO, SHORT_LIST, part_of(progress, 0.0, 0.8)
    )
    near = _mutual(tree, partners[:, :N_NEAR], scales[:, :N_NEAR])
    kept, kept_scales = np.empty((n, N_PARTNERS), np.int32), np.empty((n, N_PARTNERS))
    _pass_over_redundant(
        tree.discs, tree.reaches, tree.places, epsilon, REDUNDANCY, partners, scales, kept, kept_scales
    )
    edges, touch = _mutual(tree, kept, kept_scales)
    labels = connected_components(_adjacency(edges, n), directed=False)[1]
    labels, more, more_touch = _joined(tree, labels, epsilon, 1.0, n, part_of(progress, 0.8, 0.9))
    _, last, last_touch = _joined(tree, labels, epsilon, FRAGMENT_REACH, FRAGMENT_SIZE, part_of(progress, 0.9, 1.0))
    edges, touch = np.concatenate([edges, more, last]), np.concatenate([touch, more_touch, last_touch])
    return _closed(edges, touch, *near, n)


@nb.njit(nogil=True, cache=True, parallel=True, error_model="numpy")
def _pass_over_redundant(discs, reaches, places, epsilon, redundancy, partners, scales, kept, kept_scales):
    """Copy each place's contacts, except those whose partner nearly coincides with a better one's."""
    n, m = partners.shape
    for place in nb.prange(n):
        count = 0
        for a in range(m):
            if count == kept.shape[1] or partners[place, a] < 0:
                break
            other, limit = places[partners[place, a]], redundancy * scales[place, a]
            redundant = False
            for b in range(count):
                better = places[kept[place, b]]
                if (
                    may_touch(discs, reaches, other, better, epsilon, limit)
                    and two_way_touch(discs, other, better, epsilon, limit) < limit
                ):
                    redundant = True
                    break
            if not redundant:
                kept[place, count], kept_scales[place, count] = partners[place, a], scales[place, a]
                count += 1
        for a in range(count, kept.shape[1]):
            kept[place, a], kept_scales[place, a] = -1, np.inf


def _mutual(
    tree: EllipseTree, partners: NDArray[np.int32], scales: NDArray[np.float64]
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """(E, 2) contacts that rank high enough at both ends, once each, and their touch scales."""
    listed = partners >= 0
    owners = np.repeat(np.arange(len(tree.nodes)), listed.sum(axis=1))
    others = tree.places[partners[listed]]
    touch = scales[listed]
    # An ellipse that is no peer of its partner does not appear in the partner's list, but must rank as high as if.
    foreign = (tree.reaches[owners] > PEER_RATIO * tree.reaches[others]) & (touch <= scales[others, -1])
    pairs = np.stack([tree.nodes[owners], tree.nodes[others]], axis=1).astype(np.int32)
    # A contact that both ends list appears twice.
    keys = edge_keys(pairs, len(tree.nodes))
    order = np.argsort(keys, kind="stable")
    second = order[1:][keys[order[1:]] == keys[order[:-1]]]
    kept = np.concatenate([second, np.flatnonzero(foreign)])
    return np.sort(pairs[kept], axis=1), touch[kept]


def edge_keys(pairs: NDArray[np.integer], n_nodes: int) -> NDArray[np.int64]:
    """One number per undirected edge.

    Parameters
    ----------
    pairs : (E, 2) int
        Nodes, in either order.
    n_nodes : int
        Number of nodes.

    Returns
    -------
    (E,) int64
        Smaller node times ``n_nodes`` plus larger node.
    """
    return np.minimum(pairs[:, 0], pairs[:, 1]).astype(np.int64) * n_nodes + np.maximum(pairs[:, 0], pairs[:, 1])


def labels_by_size(labels: NDArray[np.integer]) -> NDArray[np.int32]:
    """Renumber components by falling size, equal sizes by their first node.

    Parameters
    ----------
    labels : (n,) int
        Component of each node, numbered from 0 in any order.

    Returns
    -------
    (n,) int32
        0 is the largest.
    """
    sizes = np.bincount(labels)
    first = np.full(len(sizes), len(labels))
    np.minimum.at(first, labels, np.arange(len(labels)))
    rank = np.empty(len(sizes), np.int32)
    rank[np.lexsort((first, -sizes))] = np.arange(len(sizes))
    return rank[labels]


def _closed(
    edges: NDArray[np.int32],
    touch: NDArray[np.float64],
    near: NDArray[np.int32],
    near_touch: NDArray[np.float64],
    n_nodes: int,
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """Edges, and those of the ``near`` contacts whose ends share a neighbour, round by round."""
    for _ in range(_CLOSING_ROUNDS):
        keys, near_keys = np.sort(edge_keys(edges, n_nodes)), edge_keys(near, n_nodes)
        at = np.minimum(np.searchsorted(keys, near_keys), max(len(keys) - 1, 0))
        left = keys[at] != near_keys if len(keys) else np.ones(len(near), bool)
        near, near_touch = near[left], near_touch[left]
        upper = _adjacency(edges, n_nodes)
        adjacency = (upper + upper.T).tocsr()
        shares = np.zeros(len(near), bool)
        for start in range(0, len(near), _CHUNK):
            one, other = near[start : start + _CHUNK].T
            shares[start : start + _CHUNK] = np.diff(adjacency[one].multiply(adjacency[other]).tocsr().indptr) > 0
        edges, touch = np.concatenate([edges, near[shares]]), np.concatenate([touch, near_touch[shares]])
    return edges, touch


def _joined(
    tree: EllipseTree, labels: NDArray[np.int32], epsilon: float, limit: float, size: int, progress: Progress
) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.float64]]:
    """Join components by Borůvka's rounds: each of at most ``size`` nodes, except the largest, by its best contact.

    Returns the labels that result, the new edges and their touch scales. Contacts are ordered by touch scale, then
    nodes, so no round closes a circle.
    """
    edges, touch = [np.empty((0, 2), np.int32)], [np.empty(0)]
    n_left = len(labels)
    while True:
        labels = labels_by_size(labels)
        sizes = np.bincount(labels)
        asking = (labels != 0) & (sizes[labels] <= size)
        queries = np.sort(tree.places[asking])
        if not len(queries) or len(sizes) == n_left:
            return labels, np.concatenate(edges), np.concatenate(touch)
        n_left = len(sizes)
        partners, scales = _nearest(tree, queries, labels[tree.nodes], epsilon, limit, np.inf, 1, progress)
        found = partners[:, 0] >= 0
        pairs = np.sort(np.stack([tree.nodes[queries], partners[:, 0]], axis=1)[found], axis=1).astype(np.int32)
        own = labels[tree.nodes[queries]][found]
        order = np.lexsort((pairs[:, 1], pairs[:, 0], scales[found, 0], own))
        best = order[np.flatnonzero(np.diff(own[order], prepend=-1))]
        _, first = np.unique(edge_keys(pairs[best], len(labels)), return_index=True)
        edges.append(pairs[best[first]])
        touch.append(scales[found, 0][best[first]])
        merged = connected_components(_adjacency(labels[edges[-1]], n_left), directed=False)[1]
        labels = merged[labels]


def _nearest(
    tree: EllipseTree,
    queries: NDArray[np.int64],
    labels: NDArray[np.integer],
    epsilon: float,
    limit: float,
    ratio: float,
    m: int,
    progress: Progress,
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """(Q, m) best contacts of the queried places, chunk by chunk."""
    partners = np.empty((len(queries), m), np.int32)
    scales = np.empty((len(queries), m))
    ranges = tree.label_ranges(labels)
    labels = labels.astype(np.int32)
    for start in range(0, len(queries), _CHUNK):
        chunk = slice(start, start + _CHUNK)
        nearest_touches(
            queries[chunk], *tree.arrays, labels, ranges, epsilon, limit, ratio, partners[chunk], scales[chunk]
        )
        progress(min(1.0, (start + _CHUNK) / len(queries)))
    return partners, scales


def _adjacency(edges: NDArray[np.integer], n: int) -> sp.csr_array:
    return sp.csr_array((np.ones(len(edges), np.int8), (edges[:, 0], edges[:, 1])), shape=(n, n))
