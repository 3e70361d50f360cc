import numpy as np
import pytest
from scipy.sparse.csgraph import dijkstra

from splap_editor.core.graph.splat_graph import GraphOptions, SplatGraph, splat_graph
from splap_editor.core.progress import Cancelled
from splap_editor.core.splats.occupancy import occupancy_ellipses
from splap_editor.core.surface.geodesics import geodesic_distances, geodesic_neighbors
from tests.core.splat_scenes import ball, cloud, joined, sheet, shuffled, splats_of
from tests.reference.graph import nearest_nodes


def star_graph(n_leaves: int) -> SplatGraph:
    """Node 0 joined to all others, each a little farther than the one before."""
    leaves = np.arange(1, n_leaves + 1)
    lengths = 1.0 + 0.01 * leaves
    return SplatGraph(
        indptr=np.concatenate([[0, n_leaves], n_leaves + leaves]).astype(np.int32),
        indices=np.concatenate([leaves, np.zeros(n_leaves)]).astype(np.int32),
        lengths=np.concatenate([lengths, lengths]),
        touch=None,
        epsilon=0.0,
    )


@pytest.mark.parametrize("rule", ["touch", "paper"])
@pytest.mark.parametrize("scene", [ball(200), cloud(100, size=0.1)])
def test_neighbours_are_the_twins(scene, rule):
    graph = splat_graph(occupancy_ellipses(scene), GraphOptions(rule=rule))
    neighborhoods = geodesic_neighbors(graph, 12)
    for node, twin in enumerate(nearest_nodes(graph, 12)):
        row = slice(neighborhoods.indptr[node], neighborhoods.indptr[node + 1])
        assert neighborhoods.indices[row].tolist() == [j for _, j in twin]
        np.testing.assert_allclose(neighborhoods.distances[row], [d for d, _ in twin], rtol=1e-13)


def test_distances_from_sources_are_scipys_and_end_at_the_limit():
    graph = splat_graph(occupancy_ellipses(ball(300)))
    sources = np.array([5, 250, 5])
    twin = dijkstra(graph.matrix(), directed=False, indices=sources).min(axis=0)
    np.testing.assert_allclose(geodesic_distances(graph, sources), twin, rtol=1e-13)
    limited = geodesic_distances(graph, sources, limit=0.8)
    assert np.array_equal(np.isinf(limited), twin > 0.8)
    assert np.isinf(geodesic_distances(graph, np.empty(0, int))).all()


def test_distances_do_not_leave_the_component():
    graph = splat_graph(occupancy_ellipses(joined(sheet(100), sheet(49, height=3.0))))
    distances = geodesic_distances(graph, np.flatnonzero(graph.components == 1))
    assert np.array_equal(np.isinf(distances), graph.components == 0)


def test_a_small_component_gives_fewer_neighbours_and_an_isolated_splat_none():
    lone = splats_of(np.array([[9.0, 0, 0]]), np.array([0.1, 0.1]))
    ellipses = occupancy_ellipses(joined(sheet(100), sheet(16, size=0.4, height=5.0), lone))
    neighborhoods = geodesic_neighbors(splat_graph(ellipses), 30)
    counts = np.diff(neighborhoods.indptr)[ellipses.node_of_row]
    assert (counts[:100] == 30).all() and (counts[100:116] == 15).all() and counts[116] == 0


def test_a_node_with_more_neighbours_than_the_heap_starts_with_loses_none():
    graph = star_graph(3000)
    neighborhoods = geodesic_neighbors(graph, 30)
    # Every leaf sees the hub, then the nearest of the other leaves.
    assert neighborhoods.indices[neighborhoods.indptr[0] : neighborhoods.indptr[1]].tolist() == list(range(1, 31))
    last = neighborhoods.indices[neighborhoods.indptr[3000] : neighborhoods.indptr[3001]]
    assert last.tolist() == list(range(30))
    assert np.isfinite(geodesic_distances(graph, np.array([17]))).all()


def test_equal_distances_are_settled_by_rising_node():
    graph = star_graph(40)
    even = SplatGraph(graph.indptr, graph.indices, np.ones(80), None, 0.0)
    neighborhoods = geodesic_neighbors(even, 10)
    assert neighborhoods.indices[:10].tolist() == list(range(1, 11))
    assert neighborhoods.indices[neighborhoods.indptr[40] :].tolist() == list(range(10))


def test_shuffling_the_file_leaves_the_neighbours():
    scene = ball(200)
    order = np.random.default_rng(1).permutation(200)
    one, other = occupancy_ellipses(scene), occupancy_ellipses(shuffled(scene, order))
    first, second = geodesic_neighbors(splat_graph(one)), geodesic_neighbors(splat_graph(other))
    assert np.array_equal(one.rows[first.indices], order[other.rows[second.indices]])
    assert np.array_equal(first.distances, second.distances)


def test_wrong_arguments_are_rejected():
    graph = star_graph(3)
    with pytest.raises(ValueError, match="k must be at least 1"):
        geodesic_neighbors(graph, 0)
    with pytest.raises(ValueError, match="sources must be nodes 0 to 3, got 0 to 4"):
        geodesic_distances(graph, np.array([0, 4]))


def test_cancelling_stops_the_search():
    def cancel(share: float) -> None:
        raise Cancelled

    with pytest.raises(Cancelled):
        geodesic_neighbors(star_graph(3), progress=cancel)
