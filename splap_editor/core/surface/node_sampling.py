"""A few nodes that stand for many: spread evenly along the surface, and found again from every node."""

import numba as nb
import numpy as np
from numpy.typing import NDArray

from splap_editor.core.graph.splat_graph import SplatGraph
from splap_editor.core.surface.shortest_paths import heap_add, heap_replace_first, settle, take


def farthest_nodes(graph: SplatGraph, count: int) -> NDArray[np.int64]:
    """Nodes spread evenly by distance along the graph: each is the one farthest from those before it.

    Parameters
    ----------
    graph : SplatGraph
        n nodes.
    count : int
        How many to take.

    Returns
    -------
    (≤ count,) int64
        Ascending. A component gets its first sample if it holds at least a quarter of an average sample's share of
        nodes, n / (4 count); smaller ones get none, so that dust does not use up the samples. The largest component
        always gets one.

    Raises
    ------
    ValueError
        If ``count`` is less than 1.
    """
    if count < 1:
        raise ValueError(f"count must be at least 1, got {count}")
    n = graph.n_nodes
    if n == 0:
        return np.empty(0, np.int64)
    sizes = np.bincount(graph.components)
    wanted = sizes >= max(1.0, n / (4.0 * count))
    wanted[0] = True
    _, seeds = np.unique(graph.components, return_index=True)
    seeds = seeds[wanted][:count].astype(np.int64)
    chosen = _farthest(seeds, graph.indptr, graph.indices, graph.lengths, min(count, n))
    return np.sort(chosen)


def nearest_samples(
    graph: SplatGraph, samples: NDArray[np.integer], k: int, *, limit: float = np.inf
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """The k samples nearest to every node along the graph.

    Parameters
    ----------
    graph : SplatGraph
        n nodes.
    samples : (m,) int
        Nodes, each once.
    k : int
        How many to find, at least 1.
    limit : float
        Largest distance of interest in world units.

    Returns
    -------
    near : (n, k) int32
        Positions in ``samples``, nearest first; -1 where fewer can be reached within the limit.
    distances : (n, k) float64
        World units; inf where there is none.
    """
    samples = np.ascontiguousarray(samples, np.int64)
    near = np.full((graph.n_nodes, k), -1, np.int32)
    distances = np.full((graph.n_nodes, k), np.inf)
    _spread_samples(samples, graph.indptr, graph.indices, graph.lengths, float(limit), near, distances)
    return near, distances


@nb.njit(nogil=True, cache=True)
def _farthest(seeds, indptr, indices, lengths, count):
    """Up to ``count`` nodes: the seeds, then again and again the one farthest from all so far."""
    n = indptr.size - 1
    distances = np.full(n, np.inf)
    keys, items = np.empty(1024), np.empty(1024, np.int32)
    near, far = np.empty(n, np.int32), np.empty(n)
    # Distances only fall, so a node's place among the farthest is corrected when it comes to the top.
    far_keys, far_items = np.empty(n), np.empty(n, np.int32)
    n_far = 0
    chosen = np.empty(count, np.int64)
    n_chosen = 0
    while n_chosen < count:
        if n_chosen < seeds.size:
            node = np.int32(seeds[n_chosen])
        else:
            if n_chosen == seeds.size:
                for i in range(n):
                    if distances[i] < np.inf:
                        heap_add(far_keys, far_items, n_far, -distances[i], np.int32(i))
                        n_far += 1
            while n_far > 0 and -far_keys[0] > distances[far_items[0]]:
                heap_replace_first(far_keys, far_items, n_far, -distances[far_items[0]], far_items[0])
            if n_far == 0 or far_keys[0] == 0.0:
                break
            node = far_items[0]
        chosen[n_chosen] = node
        n_chosen += 1
        distances[node] = 0.0
        keys[0], items[0] = 0.0, node
        _, keys, items = settle(indptr, indices, lengths, np.inf, distances, keys, items, 1, near, far)
    return chosen[:n_chosen]


@nb.njit(nogil=True, cache=True)
def _spread_samples(samples, indptr, indices, lengths, limit, near, distances):
    """Search from all samples at once; each of them is a label, and a node keeps the k that reach it first."""
    n_labels = max(1, samples.size)
    keys, items = np.empty(samples.size + 1024), np.empty(samples.size + 1024, np.int64)
    for sample in range(samples.size):
        take(distances[samples[sample]], near[samples[sample]], 0.0, sample)
        heap_add(keys, items, sample, 0.0, samples[sample] * n_labels + sample)
    settle(indptr, indices, lengths, limit, distances, keys, items, samples.size, None, None, near, n_labels)
