"""Distances along the splat graph."""

from collections.abc import Iterator
from dataclasses import dataclass

import numba as nb
import numpy as np
from numpy.typing import NDArray

from splap_editor.core.compressed_rows import with_rows
from splap_editor.core.graph.splat_graph import SplatGraph
from splap_editor.core.index_spaces import Nodes
from splap_editor.core.progress import Progress, no_progress
from splap_editor.core.surface.shortest_paths import heap_add, settle

_CHUNK = 16384
_BLOCK = 512


@dataclass(frozen=True, eq=False)
class Neighborhoods:
    """Nearest nodes of every node by distance along the graph, itself left out, as compressed rows.

    Parameters
    ----------
    indptr : (n + 1,) int32
        Row starts.
    indices : (nnz,) int32
        Nodes by rising distance, equal ones by rising node.
    distances : (nnz,) float64
        World units.
    """

    indptr: NDArray[np.int32]
    indices: NDArray[np.int32]
    distances: NDArray[np.float64]

    @property
    def n_nodes(self) -> int:
        """Number of nodes n."""
        return len(self.indptr) - 1


def geodesic_neighbors(
    graph: SplatGraph, k: int = 30, *, nodes: Nodes | None = None, progress: Progress = no_progress
) -> Neighborhoods:
    """Find the k nearest nodes of every node by shortest path.

    Parameters
    ----------
    graph : SplatGraph
        n nodes.
    k : int
        Number of neighbours, at least 1.
    nodes : (m,) int, optional
        Ascending; only of these.
    progress : Progress
        Called with the share done.

    Returns
    -------
    Neighborhoods
        A component of fewer than k + 1 nodes gives fewer neighbours, an isolated node none. With ``nodes`` it has m
        rows.

    Raises
    ------
    ValueError
        If ``k`` is not positive.
    """
    if k < 1:
        raise ValueError(f"k must be at least 1, got {k}")
    sources = np.arange(graph.n_nodes) if nodes is None else np.ascontiguousarray(nodes, np.int64)
    tentative = np.full((nb.get_num_threads(), graph.n_nodes), np.inf)
    counts = [np.empty(0, np.int32)]
    indices, distances = [np.empty(0, np.int32)], [np.empty(0)]
    for start in range(0, len(sources), _CHUNK):
        chunk = sources[start : start + _CHUNK]
        # A search settles its own node first.
        near, far = np.empty((len(chunk), k + 1), np.int32), np.empty((len(chunk), k + 1))
        settled = np.zeros(len(chunk), np.int32)
        _nearest(chunk, graph.indptr, graph.indices, graph.lengths, tentative, near, far, settled)
        counts.append(settled - 1)
        found = np.arange(k) < counts[-1][:, None]
        indices.append(near[:, 1:][found])
        distances.append(far[:, 1:][found])
        progress((start + len(chunk)) / len(sources))
    indptr = np.concatenate([[0], np.cumsum(np.concatenate(counts))]).astype(np.int32)
    return Neighborhoods(indptr, np.concatenate(indices), np.concatenate(distances))


def node_runs(n_nodes: int, nodes: Nodes | None, most: int) -> Iterator[tuple[int, int]]:
    """Part nodes into runs without a gap, as pairs of first and last + 1.

    Parameters
    ----------
    n_nodes : int
        Number of nodes n.
    nodes : (m,) int, optional
        Ascending; all n without.
    most : int
        Longest run.
    """
    if nodes is None:
        edges = [(0, n_nodes)] if n_nodes else []
    else:
        breaks = np.flatnonzero(np.diff(nodes) != 1) + 1
        edges = [(int(run[0]), int(run[-1]) + 1) for run in np.split(np.asarray(nodes), breaks) if len(run)]
    for first, last in edges:
        for start in range(first, last, most):
            yield start, min(start + most, last)


def mended_neighborhoods(
    graph: SplatGraph, before: Neighborhoods, ends: NDArray[np.integer], k: int
) -> tuple[Neighborhoods, NDArray[np.int64]]:
    """Bring neighbourhoods up to date after edges were cut or added.

    A truncated search that settles no end of a changed edge meets the same
    edges as before in the same order, so its result stands, to the bit. Only
    the other nodes are searched again.

    Parameters
    ----------
    graph : SplatGraph
        After the change.
    before : Neighborhoods
        From before it, with the same ``k``.
    ends : (m,) int
        Nodes at the ends of changed edges.
    k : int
        Number of neighbours.

    Returns
    -------
    neighborhoods : Neighborhoods
        What `geodesic_neighbors` gives.
    nodes : (a,) int64
        Those searched again, ascending.
    """
    is_end = np.zeros(graph.n_nodes, bool)
    is_end[ends] = True
    settled_one = np.searchsorted(before.indptr, np.flatnonzero(is_end[before.indices]), side="right") - 1
    nodes = np.union1d(settled_one, ends)
    found = geodesic_neighbors(graph, k, nodes=nodes)
    indptr, (indices, distances) = with_rows(
        before.indptr, (before.indices, before.distances), nodes, found.indptr, (found.indices, found.distances)
    )
    return Neighborhoods(indptr, indices, distances), nodes


def geodesic_distances(
    graph: SplatGraph, sources: NDArray[np.integer], *, limit: float = np.inf
) -> NDArray[np.float64]:
    """Distance of every node from the nearest of some nodes.

    Parameters
    ----------
    graph : SplatGraph
        n nodes.
    sources : (S,) int
        Nodes at distance 0.
    limit : float
        Largest distance of interest in world units.

    Returns
    -------
    (n,) float64
        World units; inf beyond the limit and where no path leads.

    Raises
    ------
    ValueError
        If a source is not a node.
    """
    sources = np.ascontiguousarray(sources, np.int64)
    if len(sources) and not (sources.min() >= 0 and sources.max() < graph.n_nodes):
        raise ValueError(f"sources must be nodes 0 to {graph.n_nodes - 1}, got {sources.min()} to {sources.max()}")
    return _spread(sources, graph.indptr, graph.indices, graph.lengths, float(limit))


@nb.njit(nogil=True, cache=True, parallel=True)
def _nearest(sources, indptr, indices, lengths, tentative, near, far, counts):
    """Truncated Dijkstra from each of some nodes: rows of itself and the k nearest, and how many that is.

    ``tentative`` has a row per thread that is inf everywhere, before and after. In Morton order the part of it one
    search touches stays in the processor's cache, which makes a plain array faster than a hash table.
    """
    for block in nb.prange((len(near) + _BLOCK - 1) // _BLOCK):
        best = tentative[nb.get_thread_id()]
        keys, items = np.empty(1024), np.empty(1024, np.int32)
        for row in range(block * _BLOCK, min((block + 1) * _BLOCK, len(near))):
            best[sources[row]] = 0.0
            keys[0], items[0] = 0.0, sources[row]
            counts[row], keys, items = settle(
                indptr, indices, lengths, np.inf, best, keys, items, 1, near[row], far[row]
            )
            # What the search touched is what it settled and neighbours of that.
            for i in range(counts[row]):
                _forget(near[row, i], indptr, indices, best)


@nb.njit(nogil=True, cache=True)
def _forget(node, indptr, indices, tentative):
    """Take back what a search that settled a node wrote there and next to it."""
    tentative[node] = np.inf
    for e in range(indptr[node], indptr[node + 1]):
        tentative[indices[e]] = np.inf


@nb.njit(nogil=True, cache=True)
def _spread(sources, indptr, indices, lengths, limit):
    """Dijkstra from several sources at once: the distance of every node."""
    n = len(indptr) - 1
    tentative = np.full(n, np.inf)
    keys, items, size = np.empty(len(sources) + 1024), np.empty(len(sources) + 1024, np.int32), 0
    for source in sources:
        if tentative[source] > 0.0:
            tentative[source] = 0.0
            heap_add(keys, items, size, 0.0, np.int32(source))
            size += 1
    settle(indptr, indices, lengths, limit, tentative, keys, items, size, np.empty(n, np.int32), np.empty(n))
    return tentative
