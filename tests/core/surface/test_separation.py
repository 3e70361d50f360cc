"""Seams between parts: laws, and a brute-force twin of the cut."""

from itertools import combinations

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components, dijkstra

from splap_editor.core.graph.splat_graph import SplatGraph
from splap_editor.core.surface.separation import seam_between


def graph_of(points: np.ndarray, edges: np.ndarray, touch: np.ndarray | None = None) -> SplatGraph:
    """Graph of undirected edges with the distances of their ends as lengths."""
    n = len(points)
    edges = np.unique(np.sort(edges, axis=1), axis=0)
    numbers = np.arange(1, len(edges) + 1)
    both = sp.coo_array((numbers, (edges[:, 0], edges[:, 1])), shape=(n, n)).tocsr()
    both = (both + both.T).tocsr()
    both.sort_indices()
    lengths = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    at = both.data - 1
    return SplatGraph(
        both.indptr.astype(np.int32),
        both.indices.astype(np.int32),
        lengths[at],
        None if touch is None else np.asarray(touch, float)[at],
        0.01,
    )


def grid(width: int, height: int, first: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Points and edges of a unit grid with diagonals."""
    x, y = np.meshgrid(np.arange(width), np.arange(height), indexing="ij")
    points = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1).astype(float)
    at = np.arange(x.size).reshape(width, height)
    pairs = [(at[:-1], at[1:]), (at[:, :-1], at[:, 1:]), (at[:-1, :-1], at[1:, 1:]), (at[1:, :-1], at[:-1, 1:])]
    edges = np.concatenate([np.stack([a.ravel(), b.ravel()], axis=1) for a, b in pairs])
    return points, edges + first


def without(graph: SplatGraph, edges: np.ndarray) -> sp.csr_array:
    matrix = graph.matrix().tolil()
    for i, j in edges:
        matrix[i, j] = matrix[j, i] = 0.0
    matrix = matrix.tocsr()
    matrix.eliminate_zeros()
    return matrix


def horseshoe() -> tuple[SplatGraph, int, int, set]:
    """A long strip bent so that its ends lie side by side and touch in three places."""
    points, edges = grid(60, 4)
    angle = 2.0 * np.pi * points[:, 0] / 62.0
    bent = np.stack([10 * np.cos(angle), 10 * np.sin(angle), points[:, 1]], axis=1)
    contacts = [(1, 57 * 4 + 1), (2, 58 * 4 + 2), (4 + 2, 58 * 4 + 3)]
    graph = graph_of(bent, np.concatenate([edges, contacts]))
    return graph, 6 * 4 + 1, 52 * 4 + 2, {tuple(sorted(pair)) for pair in contacts}


def test_what_touches_is_cut_and_the_long_way_round_stays():
    graph, a, b, contacts = horseshoe()
    seam = seam_between(graph, np.array([a]), np.array([b]))
    assert set(map(tuple, seam.edges.tolist())) == contacts
    assert seam.next_way > 2.0 * seam.cut_up_to
    assert connected_components(without(graph, seam.edges))[0] == 1


def test_one_step_wider_cuts_the_long_way_too_and_one_narrower_less():
    graph, a, b, contacts = horseshoe()
    wide = seam_between(graph, np.array([a]), np.array([b]), wider=20)
    assert wide.next_way == np.inf
    labels = connected_components(without(graph, wide.edges))[1]
    assert labels[a] != labels[b]
    narrow = seam_between(graph, np.array([a]), np.array([b]), wider=-20)
    assert set(map(tuple, narrow.edges.tolist())) <= contacts


def test_no_way_up_to_the_given_length_is_left():
    graph, a, b, _ = horseshoe()
    for wider in (-2, -1, 0, 1):
        seam = seam_between(graph, np.array([a]), np.array([b]), wider=wider)
        left = dijkstra(without(graph, seam.edges), indices=a)[b]
        assert left == pytest.approx(seam.next_way) and left > seam.cut_up_to


def test_the_neck_of_one_piece_is_cut_all_the_way_round():
    """Two plates joined by a bar three wide: the seam crosses the bar, wherever on the plates one points."""
    left, one = grid(12, 13)
    bar, two = grid(6, 3, first=len(left))
    right, three = grid(12, 13, first=len(left) + len(bar))
    points = np.concatenate([left, bar + np.array([12, 5, 0]), right + np.array([18, 0, 0])])
    seams = [((11, y), (12, z)) for y in range(13) for z in range(5, 8) if abs(y - z) <= 1]
    seams += [((17, z), (18, y)) for y in range(13) for z in range(5, 8) if abs(y - z) <= 1]
    at = {(int(x), int(y)): i for i, (x, y, _) in enumerate(points)}
    graph = graph_of(points, np.concatenate([one, two, three, [(at[a], at[b]) for a, b in seams]]))
    for a, b in (((3, 6), (26, 6)), ((8, 2), (21, 11)), ((9, 7), (28, 3))):
        seam = seam_between(graph, np.array([at[a]]), np.array([at[b]]))
        labels = connected_components(without(graph, seam.edges))[1]
        assert labels[at[a]] != labels[at[b]]
        assert np.all((points[seam.edges][:, :, 0] >= 11) & (points[seam.edges][:, :, 0] <= 18))


def test_the_cut_is_the_cheapest_of_all_cuts():
    """Twin: every division of a small graph, with the same capacities."""
    rng = np.random.default_rng(2)
    points = rng.random((9, 3))
    edges = np.array(list(combinations(range(9), 2)))
    edges = edges[rng.random(len(edges)) < 0.5]
    touch = rng.random(len(np.unique(np.sort(edges, axis=1), axis=0)))
    graph = graph_of(points, edges, touch)
    a, b = 0, 5
    seam = seam_between(graph, np.array([a]), np.array([b]), wider=-20)
    apart = [dijkstra(graph.matrix(), indices=k, limit=seam.cut_up_to) for k in (a, b)]
    inside = apart[0] + apart[1] <= seam.cut_up_to
    upper = np.repeat(np.arange(9), graph.degrees) < graph.indices
    near = np.minimum(*apart)

    def cost(side: np.ndarray, among: np.ndarray) -> float:
        total = 0.0
        for (i, j), length, f in zip(graph.edges, graph.lengths[upper], graph.touch[upper], strict=True):
            if inside[i] and inside[j] and side[i] != side[j]:
                total += np.ceil(1000.0 * seam.cut_up_to / max(near[i], near[j], length) / (1 + f) ** 2)
        return total

    nodes = np.flatnonzero(inside)
    others = [n for n in nodes if n not in (a, b)]
    best = np.inf
    for chosen in range(2 ** len(others)):
        side = np.zeros(9, bool)
        side[a] = True
        side[[n for k, n in enumerate(others) if chosen >> k & 1]] = True
        best = min(best, cost(side, nodes))
    labels = connected_components(without(graph, seam.edges)[nodes][:, nodes])[1]
    side = np.zeros(9, bool)
    side[nodes] = labels == labels[np.flatnonzero(nodes == a)[0]]
    assert not side[b] and cost(side, nodes) == best


def test_parts_that_nothing_joins_need_no_seam():
    points, edges = grid(4, 4)
    far, more = grid(4, 4, first=16)
    graph = graph_of(np.concatenate([points, far + np.array([0, 0, 5])]), np.concatenate([edges, more]))
    seam = seam_between(graph, np.array([5]), np.array([21]))
    assert len(seam.edges) == 0 and seam.next_way == np.inf


@pytest.mark.parametrize(
    ("first", "second", "words"),
    [([], [1], "each part needs nodes"), ([0], [99], "each part needs nodes"), ([0, 1], [1], "in both parts")],
)
def test_parts_that_are_none_are_refused(first, second, words):
    points, edges = grid(4, 4)
    with pytest.raises(ValueError, match=words):
        seam_between(graph_of(points, edges), np.array(first, int), np.array(second, int))


def test_a_place_that_no_way_leads_to_changes_nothing():
    points, edges = grid(20, 4)
    apart, more = grid(3, 3, first=len(points))
    graph = graph_of(np.concatenate([points, apart + 100.0]), np.concatenate([edges, more]))
    alone = seam_between(graph, [5], [70])
    for first, second in (([5], [70, len(points)]), ([5, len(points) + 3], [70])):
        seam = seam_between(graph, np.array(first), np.array(second))
        assert len(alone.edges) and np.array_equal(seam.edges, alone.edges)
