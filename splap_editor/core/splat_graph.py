"""The splat graph: which ellipses belong to the same piece of surface."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from splap_editor.core.ellipse_offset import touch_scales
from splap_editor.core.ellipse_tree import EllipseTree, ellipse_tree, nearest_touches, offset_pairs
from splap_editor.core.occupancy import Ellipses
from splap_editor.core.progress import Progress, no_progress, part_of

N_PARTNERS = 8
"""An edge is among so many smallest touch scales of both its ends."""

PEER_RATIO = 3.0
"""A splat ranks its contacts with splats of at most so many times its reach; else the few giants that cover
everything would be everyone's best contacts."""

FRAGMENT_SIZE = 32
"""A component of at most so many nodes may be joined to another by growing its ellipses."""

FRAGMENT_REACH = 2.0
"""Largest touch scale at which a fragment is joined."""

_CHUNK = 16384
_LENGTH_FLOOR = 1e-9


@dataclass(frozen=True)
class GraphOptions:
    """What makes two splats neighbours.

    Parameters
    ----------
    rule : "touch" or "paper"
        ``touch`` (default): each splat's best contacts, as far as they are
        mutual, joined up by the best contacts between what is left apart.
        ``paper``: every pair with a normal-wise offset of at most ε.
    epsilon : float
        Tolerance along the normals in units of the scene scale.
    k : int
        Number of geodesic neighbours the Laplacian is built from.
    cut, add : tuple of (int, int)
        Edges taken out of and put into the finished graph, as pairs of file rows.
    """

    rule: Literal["touch", "paper"] = "touch"
    epsilon: float = 0.005
    k: int = 30
    cut: tuple[tuple[int, int], ...] = ()
    add: tuple[tuple[int, int], ...] = ()

    def __post_init__(self):
        if self.rule not in ("touch", "paper"):
            raise ValueError(f'rule must be "touch" or "paper", got {self.rule!r}')
        if not (np.isfinite(self.epsilon) and self.epsilon >= 0.0):
            raise ValueError(f"epsilon must be a finite number, not negative, got {self.epsilon}")
        if self.k < 3:
            raise ValueError(f"k must be at least 3, got {self.k}")


@dataclass(frozen=True, eq=False)
class SplatGraph:
    """Undirected graph on the nodes of `Ellipses` as symmetric compressed rows.

    Parameters
    ----------
    indptr : (n + 1,) int32
        Row starts.
    indices : (nnz,) int32
        Neighbours, ascending in each row; each edge appears at both ends.
    lengths : (nnz,) float64
        Distance of the centres in world units, at least 1e-9 of the scene
        scale (coinciding centres).
    touch : (nnz,) float64 or None
        Touch scale of each entry if the rule is made from them.
    epsilon : float
        Tolerance in world units.
    """

    indptr: NDArray[np.int32]
    indices: NDArray[np.int32]
    lengths: NDArray[np.float64]
    touch: NDArray[np.float64] | None
    epsilon: float

    @property
    def n_nodes(self) -> int:
        """Number of nodes n."""
        return len(self.indptr) - 1

    @property
    def n_edges(self) -> int:
        """Number of edges, each counted once."""
        return len(self.indices) // 2

    @cached_property
    def degrees(self) -> NDArray[np.int32]:
        """(n,) number of neighbours."""
        return np.diff(self.indptr)

    @cached_property
    def components(self) -> NDArray[np.int32]:
        """(n,) component of each node, numbered by falling size from 0; equal sizes by their first node."""
        return _labels_by_size(connected_components(self.matrix(), directed=False)[1])

    @cached_property
    def edges(self) -> NDArray[np.int32]:
        """(n_edges, 2) nodes i < j of each edge, ascending."""
        starts = np.repeat(np.arange(self.n_nodes, dtype=np.int32), self.degrees)
        upper = starts < self.indices
        return np.stack([starts[upper], self.indices[upper]], axis=1)

    def matrix(self) -> sp.csr_array:
        """Edge lengths as an (n, n) sparse matrix that shares this graph's arrays."""
        return sp.csr_array((self.lengths, self.indices, self.indptr), shape=(self.n_nodes, self.n_nodes))


def splat_graph(
    ellipses: Ellipses, options: GraphOptions = GraphOptions(), *, progress: Progress = no_progress
) -> SplatGraph:
    """Connect ellipses that lie on the same piece of surface.

    The paper's rule [1]_ joins every two whose normal-wise offset is at most ε
    in one direction at least. Where two surfaces pass near each other, or splats
    overhang the border of theirs, it also joins what only touches with its rim.

    The touch rule ranks contacts by *touch scale* instead, the factor at which
    two ellipses just meet: an edge is kept if it is among the 8 smallest of both
    its ends and at most 1. The components that leaves are joined as a minimum
    spanning forest by touch scale joins them, up to 1, so that whatever touches
    is connected; and fragments of up to 32 nodes up to 2, by their best contact.

    Parameters
    ----------
    ellipses : Ellipses
        Occupancy ellipses of n nodes.
    options : GraphOptions
        Rule, tolerance and mended edges.
    progress : Progress
        Called with the share done.

    Returns
    -------
    SplatGraph
        Isolated nodes have no neighbours.

    Raises
    ------
    ValueError
        If a row of ``options.cut`` or ``options.add`` is not in the file or
        belongs to an inert splat, or a pair joins a splat to itself.

    References
    ----------
    .. [1] SpLap, 3DV 2026, Sec. 4.1 and supplement B.
    """
    epsilon = options.epsilon * ellipses.scene_scale
    cut = _node_pairs(ellipses, options.cut, "cut")
    add = _node_pairs(ellipses, options.add, "add")
    tree = ellipse_tree(ellipses)
    if options.rule == "paper":
        edges, touch = _offset_edges(tree, epsilon, progress), None
    else:
        edges, touch = _touch_edges(tree, epsilon, progress)
    if len(add):
        edges = np.concatenate([edges, add])
        touch = None if touch is None else np.concatenate([touch, touch_scales(ellipses, add, epsilon)])
    if len(cut):
        kept = ~np.isin(_edge_keys(edges, ellipses.n_nodes), _edge_keys(cut, ellipses.n_nodes))
        edges, touch = edges[kept], None if touch is None else touch[kept]
    graph = _symmetric(ellipses, edges, touch, epsilon)
    progress(1.0)
    return graph


def _offset_edges(tree: EllipseTree, epsilon: float, progress: Progress) -> NDArray[np.int32]:
    """(E, 2) edges of the paper's rule."""
    buffer = np.empty((1 << 18, 2), np.int32)
    chunks, start, n = [np.empty((0, 2), np.int32)], 0, len(tree.nodes)
    while start < n:
        end, count = offset_pairs(start, *tree.arrays, epsilon, buffer)
        if end == start:
            buffer = np.empty((2 * len(buffer), 2), np.int32)
            continue
        chunks.append(buffer[:count].copy())
        start = end
        progress(0.9 * start / n)
    return np.concatenate(chunks)


def _touch_edges(
    tree: EllipseTree, epsilon: float, progress: Progress
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """(E, 2) edges of the touch rule and their touch scales."""
    n = len(tree.nodes)
    everything = np.arange(n)
    partners, scales = _nearest(
        tree, everything, everything, epsilon, 1.0, PEER_RATIO, N_PARTNERS, part_of(progress, 0.0, 0.8)
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
    n = len(tree.nodes)
    listed = partners >= 0
    owners = np.repeat(np.arange(n), listed.sum(axis=1))
    others = tree.places[partners[listed]]
    touch = scales[listed]
    # An ellipse that is no peer of its partner does not appear in the partner's list, but must rank as high as if.
    foreign = (tree.reaches[owners] > PEER_RATIO * tree.reaches[others]) & (touch <= scales[others, -1])
    pairs = np.stack([tree.nodes[owners], tree.nodes[others]], axis=1).astype(np.int32)
    # A contact that both ends list appears twice.
    keys = _edge_keys(pairs, n)
    order = np.argsort(keys, kind="stable")
    kept = order[1:][keys[order[1:]] == keys[order[:-1]]]
    kept = np.concatenate([kept, np.flatnonzero(foreign)])
    return np.sort(pairs[kept], axis=1), touch[kept]


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
        labels = _labels_by_size(labels)
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
        _, first = np.unique(_edge_keys(pairs[best], len(labels)), return_index=True)
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


def _node_pairs(ellipses: Ellipses, rows: tuple[tuple[int, int], ...], name: str) -> NDArray[np.int32]:
    """(E, 2) nodes of pairs of file rows."""
    pairs = np.array(rows, np.int64).reshape(-1, 2)
    flat = pairs.ravel()
    unknown = flat[(flat < 0) | (flat >= ellipses.n_splats)]
    if len(unknown):
        raise ValueError(f"{name}: rows {_listed(unknown)} are not in the file, which has {ellipses.n_splats} splats")
    nodes = ellipses.node_of_row[pairs]
    inert = pairs[nodes < 0]
    if len(inert):
        raise ValueError(f"{name}: rows {_listed(inert)} are inert splats, which no edge can join")
    if (pairs[:, 0] == pairs[:, 1]).any():
        raise ValueError(f"{name}: row {pairs[pairs[:, 0] == pairs[:, 1]][0, 0]} is paired with itself")
    return np.sort(nodes, axis=1).astype(np.int32)


def _listed(rows: NDArray[np.int64]) -> str:
    rows = np.unique(rows)
    return ", ".join(map(str, rows[:5])) + (f" and {len(rows) - 5} more" if len(rows) > 5 else "")


def _edge_keys(pairs: NDArray[np.integer], n_nodes: int) -> NDArray[np.int64]:
    """One number per undirected edge."""
    return np.minimum(pairs[:, 0], pairs[:, 1]).astype(np.int64) * n_nodes + np.maximum(pairs[:, 0], pairs[:, 1])


def _adjacency(edges: NDArray[np.integer], n: int) -> sp.csr_array:
    return sp.csr_array((np.ones(len(edges), np.int8), (edges[:, 0], edges[:, 1])), shape=(n, n))


def _labels_by_size(labels: NDArray[np.integer]) -> NDArray[np.int32]:
    """Renumber components by falling size; equal sizes by their first node."""
    sizes = np.bincount(labels)
    first = np.full(len(sizes), len(labels))
    np.minimum.at(first, labels, np.arange(len(labels)))
    rank = np.empty(len(sizes), np.int32)
    rank[np.lexsort((first, -sizes))] = np.arange(len(sizes))
    return rank[labels]


def _symmetric(
    ellipses: Ellipses, edges: NDArray[np.int32], touch: NDArray[np.float64] | None, epsilon: float
) -> SplatGraph:
    """Lay undirected edges out as compressed rows, each at both ends."""
    n = ellipses.n_nodes
    _, once = np.unique(_edge_keys(edges, n), return_index=True)
    edges = edges[once]
    # Zero is a legal touch scale but no legal entry of a sparse matrix: carry edge numbers instead.
    numbers = np.arange(len(edges), dtype=np.int32)
    both = sp.coo_array(
        (
            np.concatenate([numbers, numbers]),
            (np.concatenate([edges[:, 0], edges[:, 1]]), np.concatenate([edges[:, 1], edges[:, 0]])),
        ),
        shape=(n, n),
    ).tocsr()
    both.sort_indices()
    lengths = np.linalg.norm(ellipses.centers[edges[:, 0]] - ellipses.centers[edges[:, 1]], axis=1)
    lengths = np.maximum(lengths, _LENGTH_FLOOR * ellipses.scene_scale)
    return SplatGraph(
        indptr=both.indptr.astype(np.int32, copy=False),
        indices=both.indices.astype(np.int32, copy=False),
        lengths=lengths[both.data],
        touch=None if touch is None else touch[once][both.data],
        epsilon=epsilon,
    )
