import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from splap_editor.core.graph.splat_graph import GraphOptions, splat_graph
from splap_editor.core.progress import Cancelled
from splap_editor.core.splats.occupancy import Ellipses, occupancy_ellipses
from splap_editor.core.splats.splats import Splats
from splap_editor.core.surface import local_triangulation as module
from splap_editor.core.surface.geodesics import Neighborhoods, geodesic_neighbors
from splap_editor.core.surface.local_triangulation import local_triangulations
from tests.core.splat_scenes import ball, moved, sheet, shuffled, splats_of
from tests.reference.graph import star


def stages(splats: Splats, epsilon: float = 0.005) -> tuple[Ellipses, Neighborhoods]:
    ellipses = occupancy_ellipses(splats)
    return ellipses, geodesic_neighbors(splat_graph(ellipses, GraphOptions(epsilon=epsilon)))


@pytest.mark.parametrize("scene", [ball(150), sheet(144), sheet(100, tilt=0.2)])
def test_stars_are_the_delaunay_twins(scene):
    ellipses, neighborhoods = stages(scene)
    triangles = local_triangulations(ellipses, neighborhoods)
    assert triangles.dtype == np.int32
    for node in range(ellipses.n_nodes):
        found = triangles[triangles[:, 0] == node].tolist()
        assert {frozenset(triangle) for triangle in found} == star(ellipses, neighborhoods, node, module.HORIZON)
        assert len({frozenset(triangle) for triangle in found}) == len(found)


def test_triangles_turn_counter_clockwise_about_the_normal():
    ellipses, neighborhoods = stages(ball(200))
    i, a, b = local_triangulations(ellipses, neighborhoods).T
    crosses = np.cross(ellipses.centers[a] - ellipses.centers[i], ellipses.centers[b] - ellipses.centers[i])
    turned = np.einsum("ij,ij->i", crosses, ellipses.normals[i]) > 0.0
    # Keeping true distances bends a triangle that spans much of the ball; a few of them then turn over in space.
    assert turned.mean() > 0.99


def test_on_a_plane_nearly_all_inner_triangles_are_found_by_their_three_corners():
    ellipses, neighborhoods = stages(sheet(400))
    triangles = local_triangulations(ellipses, neighborhoods)
    inside = (np.abs(ellipses.centers[:, :2] - 0.5) < 0.35).all(axis=1)
    inner = np.sort(triangles[inside[triangles].all(axis=1)], axis=1)
    _, counts = np.unique(inner, axis=0, return_counts=True)
    # The stars at a gap in the graph see different neighbours.
    assert (counts == 3).mean() > 0.97
    # A planar triangulation has six triangles around a vertex on average.
    per_node = np.bincount(triangles[:, 0], minlength=ellipses.n_nodes)
    assert abs(per_node[inside].mean() - 6.0) < 0.2


def test_moving_and_shuffling_the_scene_leaves_the_triangles():
    scene = ball(200)
    order = np.random.default_rng(2).permutation(200)
    ellipses, neighborhoods = stages(scene)
    rows = {frozenset(triangle) for triangle in ellipses.rows[local_triangulations(ellipses, neighborhoods)].tolist()}
    turned = moved(scene, Rotation.from_rotvec([1.0, 2.0, 3.0]), 12.0, np.array([1.0, 1.0, 1.0]))
    others, near = stages(turned)
    assert rows == {frozenset(triangle) for triangle in others.rows[local_triangulations(others, near)].tolist()}
    others, near = stages(shuffled(scene, order))
    again = order[others.rows[local_triangulations(others, near)]]
    assert rows == {frozenset(triangle) for triangle in again.tolist()}


def test_splats_on_a_line_have_no_triangle():
    line = splats_of(np.linspace(0.0, 1.0, 30)[:, None] * [1.0, 0.0, 0.0], np.array([0.06, 0.06]))
    assert local_triangulations(*stages(line)).shape == (0, 3)


def test_coinciding_splats_have_no_triangle_without_area():
    flat = sheet(100)
    twice = shuffled(flat, np.repeat(np.arange(100), 2))
    ellipses, neighborhoods = stages(twice)
    triangles = local_triangulations(ellipses, neighborhoods)
    corners = ellipses.centers[triangles]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2.0
    assert (areas > 1e-9).all()
    # Both of each two have a star of their own.
    assert (np.bincount(triangles[:, 0], minlength=200) > 0).all()


def test_a_heap_of_splats_in_one_point_has_no_triangle():
    heap = splats_of(np.zeros((40, 3)), np.array([0.1, 0.1]))
    assert local_triangulations(*stages(heap)).shape == (0, 3)


def test_cancelling_stops_the_stars():
    def cancel(share: float) -> None:
        raise Cancelled

    with pytest.raises(Cancelled):
        local_triangulations(*stages(sheet(25)), progress=cancel)
