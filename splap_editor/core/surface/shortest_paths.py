"""Dijkstra's search, truncated, and the heap under it: compiled, for whatever measures along edges."""

import numba as nb
import numpy as np


@nb.njit(nogil=True, cache=True)
def heap_add(keys, items, size, key, item):
    """Put an entry into a binary heap of ``size`` entries, ordered by key, then item; its arrays must have room."""
    i = size
    while i > 0:
        up = (i - 1) >> 1
        if keys[up] < key or (keys[up] == key and items[up] <= item):
            break
        keys[i], items[i] = keys[up], items[up]
        i = up
    keys[i], items[i] = key, item


@nb.njit(nogil=True, cache=True)
def twice_as_long(values):
    """Copy of an array with as much room again."""
    longer = np.empty(2 * len(values), values.dtype)
    # Assigning to a slice would have numba compile the words of its complaint about shapes, once for each type.
    for i in range(len(values)):
        longer[i] = values[i]
    return longer


@nb.njit(nogil=True, cache=True)
def heap_replace_first(keys, items, size, key, item):
    """Put an entry in place of the least of a heap of ``size`` entries; its own last one, to be rid of the least."""
    i = 0
    while True:
        down = 2 * i + 1
        if down >= size:
            break
        if down + 1 < size and (
            keys[down + 1] < keys[down] or (keys[down + 1] == keys[down] and items[down + 1] < items[down])
        ):
            down += 1
        if keys[down] > key or (keys[down] == key and items[down] >= item):
            break
        keys[i], items[i] = keys[down], items[down]
        i = down
    keys[i], items[i] = key, item


@nb.njit(nogil=True, cache=True)
def settle(indptr, indices, lengths, limit, tentative, keys, items, size, near, far):
    """Settle nodes by rising distance, equal ones by rising node: Dijkstra, cut off at a limit or a number of nodes.

    The heap ``keys``, ``items`` holds ``size`` nodes to begin from, which ``tentative`` (n,) has at their distances
    already. A node that ``tentative`` has no farther is not entered, so a search may go on where others have been.
    Settled nodes and their distances are written to ``near`` and ``far``, as many as these hold and none beyond
    ``limit``; returns how many, and the heap's arrays, which may have grown.
    """
    n_settled = 0
    while size > 0:
        distance, node = keys[0], items[0]
        size -= 1
        heap_replace_first(keys, items, size, keys[size], items[size])
        if distance > tentative[node]:
            continue
        near[n_settled], far[n_settled] = node, distance
        n_settled += 1
        if n_settled == len(near):
            break
        while size + indptr[node + 1] - indptr[node] > len(keys):
            keys, items = twice_as_long(keys), twice_as_long(items)
        for e in range(indptr[node], indptr[node + 1]):
            other, reached = indices[e], distance + lengths[e]
            if reached < tentative[other] and reached <= limit:
                tentative[other] = reached
                heap_add(keys, items, size, reached, other)
                size += 1
    return n_settled, keys, items
