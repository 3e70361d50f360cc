"""The cheapest set of edges whose removal takes two parts of a graph apart."""

import numba as nb
import numpy as np
from numpy.typing import NDArray

from splap_editor.core.index_spaces import ProblemRows


def first_side(
    edges: NDArray[np.integer],
    strength: NDArray[np.integer],
    first: ProblemRows,
    second: ProblemRows,
    n: int,
) -> NDArray[np.bool_]:
    """Find which nodes stay with the first part where a minimum cut parts it from the second.

    Flow is pushed from the second part towards the first, downhill along labels that say how many edges are left to
    go [1]_; labels are made afresh whenever as many nodes as there are have been lifted [2]_. Only what reaches the
    first part is of interest, so what is held up is never led back.

    Parameters
    ----------
    edges : (E, 2) int
        Each edge once, its ends in 0 … n - 1.
    strength : (E,) int
        What it costs to cut an edge, not negative.
    first, second : (A,), (B,) int
        Nodes of the two parts, none of both.
    n : int
        Number of nodes.

    Returns
    -------
    (n,) bool
        The smallest such side, which every maximum flow leaves the same. None without a first part; without a second,
        all that hangs together with the first.

    References
    ----------
    .. [1] Goldberg and Tarjan, "A New Approach to the Maximum-Flow Problem", JACM 1988.
    .. [2] Cherkassky and Goldberg, "On Implementing the Push-Relabel Method for the Maximum Flow Problem",
       Algorithmica 1997.
    """
    part = np.zeros(n, np.int8)
    part[first], part[second] = _FIRST, _SECOND
    return _first_side(np.array(edges, np.int32), np.array(strength, np.int64), part)


_FIRST, _SECOND = 1, 2


@nb.njit(nogil=True, cache=True, error_model="numpy")
def _first_side(edges, strength, part):
    """Compile `first_side`: edges (E, 2) int32, strength (E,) int64, part (n,) int8 that each node belongs to, or 0."""
    n = len(part)
    indptr, heads, twins, room = _arcs(edges, strength, n)
    labels, queue = np.empty(n, np.int32), np.empty(n + 1, np.int32)
    excess, waits, current = np.zeros(n, np.int64), np.zeros(n, np.bool_), indptr[:-1].copy()
    for i in range(n):
        if part[i] == _SECOND:
            for arc in range(indptr[i], indptr[i + 1]):
                if part[heads[arc]] != _SECOND:
                    excess[heads[arc]] += room[arc]
                    room[twins[arc]] += room[arc]
                    room[arc] = 0
    n_lifted, begin, end = n, 0, 0
    while True:
        if n_lifted >= n:
            reached = _label(indptr, heads, twins, room, part, labels, queue)
            current[:] = indptr[:-1]
            n_lifted, begin, end = 0, 0, 0
            # Nodes in the queue are overwritten only after they were read.
            for k in range(reached):
                i = queue[k]
                waits[i] = excess[i] > 0 and part[i] == 0
                if waits[i]:
                    queue[end] = i
                    end += 1
        if begin == end:
            break
        i = queue[begin]
        begin = (begin + 1) % (n + 1)
        waits[i] = False
        while excess[i] > 0 and labels[i] < n:
            if current[i] == indptr[i + 1]:
                lowest = n
                for arc in range(indptr[i], indptr[i + 1]):
                    if room[arc] > 0:
                        lowest = min(lowest, labels[heads[arc]] + 1)
                labels[i], current[i] = lowest, indptr[i]
                n_lifted += 1
                continue
            arc = current[i]
            head = heads[arc]
            if room[arc] == 0 or labels[i] != labels[head] + 1:
                current[i] += 1
                continue
            pushed = min(excess[i], room[arc])
            room[arc] -= pushed
            room[twins[arc]] += pushed
            excess[i] -= pushed
            excess[head] += pushed
            if part[head] == 0 and not waits[head]:
                waits[head] = True
                queue[end] = head
                end = (end + 1) % (n + 1)
    _label(indptr, heads, twins, room, part, labels, queue)
    return labels < n


@nb.njit(nogil=True, cache=True, error_model="numpy")
def _arcs(edges, strength, n):
    """Both arcs of each edge by their tails: where a node's begin (n + 1,), heads, the other arc's place, and room."""
    indptr = np.zeros(n + 1, np.int64)
    for e in range(len(edges)):
        indptr[edges[e, 0] + 1] += 1
        indptr[edges[e, 1] + 1] += 1
    for i in range(n):
        indptr[i + 1] += indptr[i]
    n_arcs, free = 2 * len(edges), indptr[:-1].copy()
    heads, twins, room = np.empty(n_arcs, np.int32), np.empty(n_arcs, np.int32), np.empty(n_arcs, np.int64)
    for e in range(len(edges)):
        i, j = edges[e, 0], edges[e, 1]
        there = free[i]
        free[i] += 1
        back = free[j]
        free[j] += 1
        heads[there], twins[there], room[there] = j, back, strength[e]
        heads[back], twins[back], room[back] = i, there, strength[e]
    return indptr, heads, twins, room


@nb.njit(nogil=True, cache=True, error_model="numpy")
def _label(indptr, heads, twins, room, part, labels, queue):
    """Fill in how many arcs with room lead from each node to the first part, n where none do.

    Returns
    -------
    int
        How many nodes are reached; they begin the queue, the nearest first.
    """
    n, end = len(labels), 0
    for i in range(n):
        labels[i] = n
        if part[i] == _FIRST:
            labels[i] = 0
            queue[end] = i
            end += 1
    begin = 0
    while begin < end:
        i = queue[begin]
        begin += 1
        for arc in range(indptr[i], indptr[i + 1]):
            head = heads[arc]
            if labels[head] == n and part[head] == 0 and room[twins[arc]] > 0:
                labels[head] = labels[i] + 1
                queue[end] = head
                end += 1
    return end
