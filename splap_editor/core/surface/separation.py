"""Two parts taken apart: the contacts that a person means who points at both."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.compressed_rows import gathered
from splap_editor.core.graph.splat_graph import SplatGraph
from splap_editor.core.surface.geodesics import geodesic_distances
from splap_editor.core.surface.minimum_cut import first_side

FIRST_DETOUR = 1.3
"""Ways between the two parts are cut if they are at most so many times as long as the shortest."""

NEXT_DETOUR = 1.1
"""What is left is cut up to so many times the shortest way that is left."""

HARDLY_APART, APART = 1.5, 2.0
"""A seam parts two parts if the next way round is so many times as long as the longest that it cuts. Between the two
one more seam is looked at, and taken if it parts them nearly as well."""

NEARLY = 0.8

_MOST_SEAMS = 24
"""Longer and longer ways are cut so many times at most."""

_FIRST_EDGES = 16.0
"""A first look goes so many mean edges far."""

_UNIT = 1000.0
"""Capacities are whole numbers: this much is the strongest contact at the longest way's end."""


class Seam(NamedTuple):
    """Edges whose removal takes two parts apart.

    Parameters
    ----------
    edges : (E, 2) int32
        Nodes i < j, ascending.
    cut_up_to : float
        No way between the parts that is at most so long is left, in world units.
    next_way : float
        Length of the shortest way that is left; inf if there is none.
    """

    edges: NDArray[np.int32]
    cut_up_to: float
    next_way: float

    @property
    def detour(self) -> float:
        """How many times the longest way that was cut the next one is."""
        return self.next_way / self.cut_up_to


def seam_between(graph: SplatGraph, first: NDArray[np.integer], second: NDArray[np.integer], *, wider: int = 0) -> Seam:
    """Find the narrowest seam between two parts that are pointed at.

    Where a hand rests on a hip the two hang together twice: by what touches
    there, and by arm and shoulder. Only the short way is meant. So the minimum
    cut [1]_ is taken among the ways that are little longer than the shortest;
    while another way hardly longer is left, that is cut too. It ends where the
    next way is about twice as long as the longest that was cut, or where there
    is none: on two places of one piece the seam goes all the way round the neck
    between them.

    A contact counts the more the deeper its two ellipses overlap, and the
    nearer it is to a place pointed at: a circle around that place costs the
    same however small it is, so one place a part is enough.

    Parameters
    ----------
    graph : SplatGraph
        n nodes.
    first, second : (A,), (B,) int
        Nodes of the two parts that were pointed at, at least one of each and none of both.
    wider : int
        Goes on for so many seams more than the one that parts them; negative: stops so many before.

    Returns
    -------
    Seam
        Without edges if no way joins the parts.

    Raises
    ------
    ValueError
        If a part has no node, a node is none of the graph's or belongs to both parts.

    References
    ----------
    .. [1] Boykov and Kolmogorov, "An Experimental Comparison of Min-Cut/Max-Flow Algorithms", PAMI 2004.
    """
    first, second = np.unique(first), np.unique(second)
    for part in (first, second):
        if not len(part) or part[0] < 0 or part[-1] >= graph.n_nodes:
            raise ValueError(f"each part needs nodes 0 to {graph.n_nodes - 1}, got {part[:5].tolist()}")
    if len(np.intersect1d(first, second)):
        raise ValueError("the same splat is in both parts: point at two places that are farther apart")
    ways = _Ways(graph, first, second)
    next_way = ways.left(np.zeros(0, np.int64))
    seams: list[Seam] = []
    chosen: int | None = None
    while np.isfinite(next_way) and len(seams) < _MOST_SEAMS:
        seams.append(ways.cut_up_to((NEXT_DETOUR if seams else FIRST_DETOUR) * next_way))
        next_way = seams[-1].next_way
        enough = HARDLY_APART if chosen is None else NEARLY * seams[chosen].detour
        # The seam that leaves no way at all is the widest: taken only if nothing narrower parts the two.
        if enough <= seams[-1].detour < np.inf:
            chosen = len(seams) - 1
        if chosen is None or len(seams) <= chosen + wider:
            continue
        if chosen < len(seams) - 1 or seams[chosen].detour >= APART:
            break
    if not seams:
        return Seam(np.empty((0, 2), np.int32), 0.0, next_way)
    wanted = (len(seams) - 1 if chosen is None else chosen) + wider
    return seams[min(max(wanted, 0), len(seams) - 1)]


class _Ways:
    """The ways between two parts of a graph, looked at as far as they lead."""

    def __init__(self, graph: SplatGraph, first: NDArray[np.integer], second: NDArray[np.integer]) -> None:
        self.graph, self.first, self.second = graph, first, second
        self.lengths = graph.lengths.copy()
        self.open = replace(graph, lengths=self.lengths)

    def left(self, cut: NDArray[np.integer], radius: float | None = None) -> float:
        """Length of the shortest way without some entries of the graph's arrays; inf if there is none.

        Both parts are looked about in twice as far a ball, beginning with a radius, until the two balls hold a way or
        one of them can not grow: a small part that is off is all that is searched.
        """
        if not len(self.lengths):
            return np.inf
        self.lengths[cut] = np.inf
        radius = radius or _FIRST_EDGES * float(self.graph.lengths.mean())
        while True:
            apart = [geodesic_distances(self.open, part, limit=radius) for part in (self.first, self.second)]
            few, many = sorted(apart, key=lambda each: np.count_nonzero(each < np.inf))
            _, places, tails = gathered(self.graph.indptr, np.flatnonzero(few < np.inf))
            heads, lengths = self.graph.indices[places], self.lengths[places]
            shortest = float((few[tails] + lengths + many[heads]).min(initial=np.inf))
            # A way of two radii has an edge with one end in either ball.
            is_whole = not ((few[heads] == np.inf) & (lengths < np.inf)).any()
            if shortest <= 2.0 * radius or is_whole:
                break
            radius *= 2.0
        self.lengths[cut] = self.graph.lengths[cut]
        return shortest

    def cut_up_to(self, longest: float) -> Seam:
        """Minimum cut of all ways that are at most so long, in world units."""
        graph = self.graph
        apart = [geodesic_distances(graph, part, limit=longest) for part in (self.first, self.second)]
        nodes = np.flatnonzero(apart[0] + apart[1] <= longest)
        number = np.full(graph.n_nodes, -1, np.int32)
        number[nodes] = np.arange(len(nodes), dtype=np.int32)
        _, entries, tails = gathered(graph.indptr, nodes.astype(np.int32))
        heads = graph.indices[entries]
        within = (tails < heads) & (number[heads] >= 0)
        entries, tails, heads = entries[within], tails[within], heads[within]
        touch = 0.0 if graph.touch is None else graph.touch[entries]
        near = np.minimum(apart[0], apart[1])
        radius = np.maximum(np.maximum(near[tails], near[heads]), graph.lengths[entries])
        strength = np.ceil(_UNIT * (longest / radius) / (1.0 + touch) ** 2).astype(np.int64)
        ends = np.stack([number[tails], number[heads]], axis=1)
        # Places pointed at that no way so short leads to have no say.
        first, second = (held[held >= 0] for held in (number[self.first], number[self.second]))
        side = first_side(ends, strength, first, second, len(nodes))
        crossing = side[ends[:, 0]] != side[ends[:, 1]]
        edges = np.stack([tails, heads], axis=1)[crossing]
        # The other entry of each edge that is cut: rows of a symmetric graph are sorted.
        twins = [
            graph.indptr[j] + np.searchsorted(graph.indices[graph.indptr[j] : graph.indptr[j + 1]], i) for i, j in edges
        ]
        cut = np.concatenate([entries[crossing], np.array(twins, np.int64)])
        return Seam(edges, longest, self.left(cut, longest))
