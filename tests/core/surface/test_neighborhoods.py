"""The neighbourhoods to choose from: each against plain search, one distance at a time."""

import numpy as np
import pytest

from splap_editor.core.graph.options import NEIGHBORHOODS
from splap_editor.core.graph.splat_graph import splat_graph
from splap_editor.core.progress import no_progress
from splap_editor.core.splats.occupancy import occupancy_ellipses
from splap_editor.core.surface.local_triangulation import local_triangulations
from splap_editor.core.surface.neighborhoods import NORMAL_SHARE
from tests.core.splat_scenes import ball, cloud, joined, sheet


def found(scene, kind, k=12):
    ellipses = occupancy_ellipses(scene)
    graph = splat_graph(ellipses)
    return ellipses, graph, NEIGHBORHOODS[kind].load()(ellipses, graph, k, no_progress)


def plain_distance(ellipses, kind, i, j):
    step = ellipses.centers[j] - ellipses.centers[i]
    if kind == "space":
        return np.linalg.norm(step)
    lengths = np.linalg.norm(ellipses.semi_axes[i], axis=1)
    along = ellipses.semi_axes[i] / lengths[:, None] @ step / lengths
    return np.hypot(np.linalg.norm(along), ellipses.normals[i] @ step / (NORMAL_SHARE * lengths[1]))


@pytest.mark.parametrize("kind", ["space", "mahalanobis"])
@pytest.mark.parametrize("scene", [ball(150), cloud(120, size=0.1)])
def test_the_nearest_are_those_of_a_plain_search(scene, kind):
    ellipses, _, near = found(scene, kind)
    for i in range(ellipses.n_nodes):
        others = [j for j in range(ellipses.n_nodes) if j != i]
        distances = [plain_distance(ellipses, kind, i, j) for j in others]
        row = slice(near.indptr[i], near.indptr[i + 1])
        np.testing.assert_allclose(near.distances[row], np.sort(distances)[:12], rtol=1e-9)
        assert set(near.indices[row]) <= set(others)


def test_those_in_space_reach_across_a_gap_that_the_graph_does_not():
    scene = joined(sheet(100), sheet(100, height=0.02))
    parts = splat_graph(occupancy_ellipses(scene)).components
    ellipses, _, near = found(scene, "space")
    starts = np.repeat(np.arange(ellipses.n_nodes), np.diff(near.indptr))
    assert (parts[starts] != parts[near.indices]).any()
    _, _, along = found(scene, "geodesic")
    starts = np.repeat(np.arange(ellipses.n_nodes), np.diff(along.indptr))
    assert (parts[starts] == parts[along.indices]).all()


def test_edges_are_the_rows_of_the_graph_by_rising_length():
    _, graph, near = found(ball(150), "edges", k=3)
    np.testing.assert_array_equal(near.indptr, graph.indptr)
    for i in range(graph.n_nodes):
        row = slice(graph.indptr[i], graph.indptr[i + 1])
        assert set(near.indices[row]) == set(graph.indices[row])
        assert (np.diff(near.distances[row]) >= 0.0).all()


@pytest.mark.parametrize("kind", NEIGHBORHOODS)
@pytest.mark.parametrize("n", [1, 2, 5])
def test_few_splats_have_few_neighbours(kind, n):
    ellipses, _, near = found(cloud(n, size=2.0), kind, k=30)
    assert near.n_nodes == n
    assert (np.diff(near.indptr) <= n - 1).all()
    assert local_triangulations(ellipses, near).shape[1] == 3


@pytest.mark.parametrize("kind", ["space", "mahalanobis"])
def test_splats_in_one_place_are_each_others_neighbours_and_never_their_own(kind):
    one = ball(1)
    _, _, near = found(joined(*[one] * 20), kind, k=5)
    starts = np.repeat(np.arange(20), np.diff(near.indptr))
    assert (np.diff(near.indptr) == 5).all()
    assert (starts != near.indices).all()
