"""A few nodes that stand for many: spread evenly along the surface, and found again from every node."""

import numba as nb
import numpy as np
from numpy.typing import NDArray

from splap_editor.core.graph.splat_graph import SplatGraph


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
def _sift_up(keys, items, i, key, item):
    """Put an entry at leaf i of a binary heap, least key first."""
    while i > 0:
        up = (i - 1) >> 1
        if keys[up] <= key:
            break
        keys[i] = keys[up]
        items[i] = items[up]
        i = up
    keys[i] = key
    items[i] = item


@nb.njit(nogil=True, cache=True)
def _sift_down(keys, items, size, key, item):
    """Put an entry in place of the first of a binary heap of ``size`` entries."""
    i = 0
    while True:
        child = 2 * i + 1
        if child >= size:
            break
        if child + 1 < size and keys[child + 1] < keys[child]:
            child += 1
        if keys[child] >= key:
            break
        keys[i] = keys[child]
        items[i] = items[child]
        i = child
    keys[i] = key
    items[i] = item


@nb.njit(nogil=True, cache=True)
def _farthest(seeds, indptr, indices, lengths, count):
    n = indptr.size - 1
    distances = np.full(n, np.inf)
    keys, items = np.empty(indices.size + n + 1), np.empty(indices.size + n + 1, np.int64)
    # Distances only fall, so a node's place among the farthest is corrected when it comes to the top.
    far_keys, far_items = np.empty(n), np.empty(n, np.int64)
    n_far = 0
    chosen = np.empty(count, np.int64)
    n_chosen = 0
    while n_chosen < count:
        if n_chosen < seeds.size:
            node = seeds[n_chosen]
        else:
            if n_chosen == seeds.size:
                for i in range(n):
                    if distances[i] < np.inf:
                        _sift_up(far_keys, far_items, n_far, -distances[i], i)
                        n_far += 1
            while n_far > 0 and -far_keys[0] > distances[far_items[0]]:
                _sift_down(far_keys, far_items, n_far, -distances[far_items[0]], far_items[0])
            if n_far == 0 or far_keys[0] == 0.0:
                break
            node = far_items[0]
        chosen[n_chosen] = node
        n_chosen += 1
        distances[node] = 0.0
        keys[0], items[0], size = 0.0, node, 1
        while size > 0:
            key, i = keys[0], items[0]
            size -= 1
            if size > 0:
                _sift_down(keys, items, size, keys[size], items[size])
            if key > distances[i]:
                continue
            for m in range(indptr[i], indptr[i + 1]):
                j = indices[m]
                distance = key + lengths[m]
                if distance < distances[j]:
                    distances[j] = distance
                    _sift_up(keys, items, size, distance, j)
                    size += 1
    return chosen[:n_chosen]


@nb.njit(nogil=True, cache=True)
def _spread_samples(samples, indptr, indices, lengths, limit, near, distances):
    """Dijkstra from all samples at once in which a node may be reached by k of them."""
    n, k = near.shape
    counts = np.zeros(n, np.int32)
    capacity = max(1024, samples.size)
    # An item is node · m + sample.
    m_samples = max(1, samples.size)
    keys, items = np.empty(capacity), np.empty(capacity, np.int64)
    size = 0
    for sample in range(samples.size):
        keys[size], items[size] = 0.0, samples[sample] * m_samples + sample
        size += 1
    while size > 0:
        key, item = keys[0], items[0]
        size -= 1
        if size > 0:
            _sift_down(keys, items, size, keys[size], items[size])
        i, sample = item // m_samples, item % m_samples
        count = counts[i]
        if count == k or _is_near(near[i], count, sample):
            continue
        near[i, count] = sample
        distances[i, count] = key
        counts[i] = count + 1
        for m in range(indptr[i], indptr[i + 1]):
            j = indices[m]
            distance = key + lengths[m]
            if distance > limit or counts[j] == k or _is_near(near[j], counts[j], sample):
                continue
            if size == keys.size:
                longer_keys, longer_items = np.empty(2 * size), np.empty(2 * size, np.int64)
                longer_keys[:size] = keys
                longer_items[:size] = items
                keys, items = longer_keys, longer_items
            _sift_up(keys, items, size, distance, j * m_samples + sample)
            size += 1


@nb.njit(nogil=True, cache=True)
def _is_near(near, count, sample):
    for c in range(count):  # noqa: SIM110 - compiled: a generator would be slow
        if near[c] == sample:
            return True
    return False
