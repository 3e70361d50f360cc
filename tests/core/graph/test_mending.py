"""A mended graph, its neighbourhoods and stars are those made from scratch, to the bit."""

import numpy as np
import pytest

from splap_editor.core.graph.splat_graph import GraphOptions, SplatGraph, mended_graph, splat_graph
from splap_editor.core.splats.occupancy import Ellipses, occupancy_ellipses
from splap_editor.core.surface.geodesics import Neighborhoods, geodesic_neighbors, mended_neighborhoods, node_runs
from splap_editor.core.surface.local_triangulation import local_triangulations, mended_triangulations
from tests.core.splat_scenes import cloud

K = 9


@pytest.fixture(scope="module", params=["touch", "paper"])
def scene(request) -> tuple[Ellipses, SplatGraph, str]:
    ellipses = occupancy_ellipses(cloud(160, size=0.25, seed=3))
    return ellipses, splat_graph(ellipses, GraphOptions(rule=request.param)), request.param


def mends(ellipses: Ellipses, graph: SplatGraph, seed: int, rule: str) -> GraphOptions:
    """Some edges cut, some pairs added, one of them both."""
    rng = np.random.default_rng(seed)
    cut = ellipses.rows[graph.edges[rng.choice(graph.n_edges, 4, replace=False)]]
    add = ellipses.rows[[rng.choice(ellipses.n_nodes, 2, replace=False) for _ in range(3)]]
    return GraphOptions(
        rule=rule, cut=tuple(map(tuple, cut.tolist())), add=tuple(map(tuple, [*add.tolist(), cut[0].tolist()]))
    )


def assert_same(a, b, *names):
    for name in names:
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name), err_msg=name)


@pytest.mark.parametrize("seed", range(4))
def test_mending_a_graph_is_making_it_mended(scene, seed):
    ellipses, graph, rule = scene
    options = mends(ellipses, graph, seed, rule)
    expected, found = splat_graph(ellipses, options), mended_graph(ellipses, graph, options)
    assert_same(found, expected, "indptr", "indices", "lengths")
    assert (found.touch is None) == (expected.touch is None)
    if found.touch is not None:
        np.testing.assert_array_equal(found.touch, expected.touch)


@pytest.mark.parametrize("seed", range(4))
def test_what_a_mend_does_not_reach_keeps_its_neighbours_and_the_rest_is_found_again(scene, seed):
    ellipses, graph, rule = scene
    options = mends(ellipses, graph, seed, rule)
    after = mended_graph(ellipses, graph, options)
    ends = ellipses.node_of_row[np.unique(np.array([*options.cut, *options.add]))]
    before = geodesic_neighbors(graph, K)
    found, nodes = mended_neighborhoods(after, before, ends, K)
    expected = geodesic_neighbors(after, K)
    assert_same(found, expected, "indptr", "indices", "distances")
    assert len(nodes) < ellipses.n_nodes
    stars = mended_triangulations(ellipses, found, local_triangulations(ellipses, before), nodes)
    np.testing.assert_array_equal(stars, local_triangulations(ellipses, expected))


def test_neighbours_of_some_nodes_are_those_rows_of_all(scene):
    _, graph, _ = scene
    nodes = np.array([0, 1, 2, 40, 41, 159])
    some, everyone = geodesic_neighbors(graph, K, nodes=nodes), geodesic_neighbors(graph, K)
    for row, node in enumerate(nodes):
        np.testing.assert_array_equal(of(some, row), of(everyone, node))


def of(neighborhoods: Neighborhoods, row: int) -> np.ndarray:
    return neighborhoods.indices[neighborhoods.indptr[row] : neighborhoods.indptr[row + 1]]


def test_runs_cover_each_node_once():
    nodes = np.array([0, 1, 2, 5, 7, 8, 9, 10])
    runs = list(node_runs(20, nodes, 3))
    assert np.concatenate([np.arange(a, b) for a, b in runs]).tolist() == nodes.tolist()
    assert all(0 < b - a <= 3 for a, b in runs)
    assert list(node_runs(7, None, 3)) == [(0, 3), (3, 6), (6, 7)] and list(node_runs(0, None, 3)) == []
    assert list(node_runs(7, np.zeros(0, int), 3)) == []
