"""The touch rule: which contacts between ellipses are edges of the splat graph."""

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from splap_editor.core.ellipse_tree import EllipseTree, nearest_touches
from splap_editor.core.progress import Progress, part_of

N_BEST = 8
N_GOOD = 8
"""An edge is among the so many smallest touch scales of one end (`N_BEST`) and of the other (`N_GOOD`). Fewer tear
thin bars, more tie near surfaces together."""

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
    An edge is a contact of touch scale at most 1 that is among the 8 best of one
    end and the 8 best of the other. The components this leaves are joined as a
    minimum spanning forest by touch scale joins them: up to 1, so that whatever
    touches is connected; and up to 2 for fragments of at most 32 nodes.

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
        tree, everything, everything, epsilon, 1.0, PEER_RATIO, N_GOOD, part_of(progress, 0.0, 0.8)
    )
    edges, touch = _mutual(tree, partners, scales)
    labels = connected_components(_adjacency(edges, n), directed=False)[1]
    labels, more, more_touch = _joined(tree, labels, epsilon, 1.0, n, part_of(progress, 0.8, 0.9))
    _, last, last_touch = _joined(tree, labels, epsilon, FRAGMENT_REACH, FRAGMENT_SIZE, part_of(progress, 0.9, 1.0))
    return np.concatenate([edges, more, last]), np.concatenate([touch, more_touch, last_touch])


def _mutual(
    tree: EllipseTree, partners: NDArray[np.int32], scales: NDArray[np.float64]
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """(E, 2) contacts that rank high enough at both ends, once each, and their touch scales."""
    listed = partners >= 0
    owners = np.repeat(np.arange(len(tree.nodes)), listed.sum(axis=1))
    others = tree.places[partners[listed]]
    touch = scales[listed]
    good = touch <= np.maximum(scales[owners, N_BEST - 1], scales[others, N_BEST - 1])
    # An ellipse that is no peer of its partner does not appear in the partner's list, but must rank as high as if.
    foreign = (tree.reaches[owners] > PEER_RATIO * tree.reaches[others]) & (touch <= scales[others, -1]) & good
    pairs = np.stack([tree.nodes[owners], tree.nodes[others]], axis=1).astype(np.int32)
    # A contact that both ends list appears twice.
    keys = edge_keys(pairs, len(tree.nodes))
    order = np.argsort(keys, kind="stable")
    second = order[1:][keys[order[1:]] == keys[order[:-1]]]
    kept = np.concatenate([second[good[second]], np.flatnonzero(foreign)])
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
