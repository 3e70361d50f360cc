import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from splap_editor.core.graph.splat_graph import SplatGraph
from splap_editor.core.surface.node_sampling import farthest_nodes, nearest_samples


def _graph(points, radius):
    pairs = cKDTree(points).query_pairs(radius, output_type="ndarray")
    lengths = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1)
    n = len(points)
    G = sp.csr_matrix((np.tile(lengths, 2), (pairs.T.ravel(), pairs[:, ::-1].T.ravel())), shape=(n, n))
    G.sort_indices()
    return SplatGraph(G.indptr.astype(np.int32), G.indices.astype(np.int32), G.data, None, radius)


def _points(n, seed=0):
    return np.random.default_rng(seed).random((n, 3)) * [1.0, 1.0, 0.0]


def test_samples_cover_the_graph_as_the_greedy_twin_does():
    graph = _graph(_points(200), 0.15)
    distances = dijkstra(graph.matrix())
    largest = np.flatnonzero(graph.components == 0)
    chosen = [largest[0]]
    while len(chosen) < 20:
        reach = distances[chosen][:, largest].min(axis=0)
        chosen.append(largest[np.argmax(reach)])
    assert farthest_nodes(graph, 20).tolist() == sorted(chosen)


def test_more_samples_than_nodes_gives_every_node():
    graph = _graph(_points(50), 0.5)
    assert farthest_nodes(graph, 80).tolist() == list(range(50))


def test_dust_does_not_use_up_the_samples():
    dust = np.stack([np.arange(100.0), np.zeros(100), np.ones(100)], axis=1) * 10.0
    graph = _graph(np.concatenate([dust, _points(900, seed=1)]), 0.2)
    assert (farthest_nodes(graph, 30) >= 100).all()


def test_each_large_component_gets_a_sample():
    graph = _graph(np.concatenate([_points(300), _points(300, seed=1) + 5.0, _points(300, seed=2) - 5.0]), 0.3)
    assert np.unique(farthest_nodes(graph, 4) // 300).tolist() == [0, 1, 2]


def test_nearest_samples_are_those_of_the_dijkstra_twin():
    graph = _graph(_points(200), 0.12)
    samples = farthest_nodes(graph, 25)
    near, distances = nearest_samples(graph, samples, 4)
    exact = dijkstra(graph.matrix(), indices=samples).T
    np.testing.assert_allclose(distances, np.sort(exact, axis=1)[:, :4], atol=1e-12)
    reached = near >= 0
    assert (reached == np.isfinite(distances)).all()
    np.testing.assert_allclose(np.take_along_axis(exact, near.clip(0), axis=1)[reached], distances[reached], atol=1e-12)


def test_samples_beyond_the_limit_are_not_found():
    graph = _graph(_points(200), 0.15)
    samples = farthest_nodes(graph, 10)
    near, distances = nearest_samples(graph, samples, 2, limit=0.2)
    full_near, full_distances = nearest_samples(graph, samples, 2)
    within = full_distances <= 0.2
    assert (near[within] == full_near[within]).all()
    assert (near[~within] == -1).all()
    assert np.isinf(distances[~within]).all()


def test_rejects_an_empty_count():
    with pytest.raises(ValueError, match="at least 1"):
        farthest_nodes(_graph(_points(10), 1.0), 0)
