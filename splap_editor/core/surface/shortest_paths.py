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
def settle(indptr, indices, lengths, limit, tentative, keys, items, size, near, far, labels=None, n_labels=1):
    """Settle nodes by rising distance, equal ones by rising node: Dijkstra, cut off at a limit or a number of nodes.

    The heap ``keys``, ``items`` holds ``size`` nodes to begin from, which ``tentative`` (n,) has at their distances
    already. A node that ``tentative`` has no farther is not entered, so a search may go on where others have been.
    Settled nodes and their distances are written to ``near`` and ``far``, as many as these hold and none beyond
    ``limit``; where ``near`` is None, ``tentative`` alone tells. Returns how many, and the heap's arrays, which may
    have grown.

    With ``labels`` (n, k) a node is settled up to k times, by the labels that reach it first: an item of the heap is
    node · ``n_labels`` + label, and a row of ``tentative`` (n, k) rises, as that of ``labels`` says whose it is.
    """
    n_settled = 0
    while size > 0:
        distance, item = keys[0], items[0]
        size -= 1
        heap_replace_first(keys, items, size, keys[size], items[size])
        # What is None is known when this is compiled: either search is made without the branches of the other.
        if labels is None:
            node = item
            if distance > tentative[node]:
                continue
        else:
            node, label = item // n_labels, item % n_labels
            if not _holds(tentative[node], labels[node], distance, label):
                continue
        if near is not None:
            near[n_settled], far[n_settled] = node, distance
        n_settled += 1
        if near is not None and n_settled == len(near):
            break
        while size + indptr[node + 1] - indptr[node] > len(keys):
            keys, items = twice_as_long(keys), twice_as_long(items)
        for e in range(indptr[node], indptr[node + 1]):
            other, reached = indices[e], distance + lengths[e]
            if labels is None:
                if reached < tentative[other] and reached <= limit:
                    tentative[other] = reached
                    heap_add(keys, items, size, reached, other)
                    size += 1
            elif reached <= limit and take(tentative[other], labels[other], reached, label):
                heap_add(keys, items, size, reached, other * n_labels + label)
                size += 1
    return n_settled, keys, items


@nb.njit(nogil=True, cache=True)
def take(distances, labels, distance, label):
    """Whether a label came nearer to a node than those that it has, (k,) rising: it then stands among them."""
    last = len(distances) - 1
    if distance > distances[last] or (distance == distances[last] and label >= labels[last]):
        return False
    # Its own farther entry is what goes, or else the last.
    for c in range(last):
        if labels[c] == label:
            if distances[c] <= distance:
                return False
            last = c
            break
    while last > 0 and (
        distance < distances[last - 1] or (distance == distances[last - 1] and label < labels[last - 1])
    ):
        distances[last], labels[last] = distances[last - 1], labels[last - 1]
        last -= 1
    distances[last], labels[last] = distance, label
    return True


@nb.njit(nogil=True, cache=True)
def _holds(distances, labels, distance, label):
    """Whether a node has a label at this distance still, not nearer and not driven out by nearer ones."""
    for c in range(len(distances)):
        if distances[c] >= distance and labels[c] == label:
            return distances[c] == distance
    return False
