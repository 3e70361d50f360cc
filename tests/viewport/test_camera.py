from dataclasses import replace

import numpy as np
import pytest
from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow

from splap_editor.core.place import Place, placed_points
from splap_editor.viewport.camera import (
    Camera,
    View,
    axis_view,
    blended,
    box_corners,
    framed,
    orbited,
    panned,
    scene_axes,
    turn,
    zoomed,
)

UP = np.array([0.0, 0.0, 1.0])
VIEW = View(np.array([3.0, -4.0, 2.0]), np.array([0.2, 0.1, -0.3]), UP)


@pytest.fixture
def window():
    window = vtkRenderWindow()
    window.SetOffScreenRendering(True)
    window.SetSize(300, 200)
    yield window
    window.Finalize()


@pytest.fixture
def camera(window):
    renderer = vtkRenderer()
    window.AddRenderer(renderer)
    camera = Camera(renderer)
    camera.view = VIEW
    return camera


def frame_of(view):
    right = np.cross(view.direction, view.view_up)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(right, view.direction), -view.direction], axis=1)


def test_turn_is_a_right_handed_rotation():
    np.testing.assert_allclose(turn([0, 0, 2.0], np.pi / 2) @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], atol=1e-15)
    R = turn([1.0, 2.0, 3.0], 0.7)
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-15)
    np.testing.assert_allclose(R @ turn([1.0, 2.0, 3.0], -0.7), np.eye(3), atol=1e-15)


@pytest.mark.parametrize("up", [UP, np.array([0.0, -1.0, 0.0]), None])
def test_orbit_keeps_distance_and_focal_point(up):
    turned = orbited(VIEW, 0.4, -0.2, up)
    assert turned.distance == pytest.approx(VIEW.distance, abs=1e-12)
    np.testing.assert_allclose(turned.focal_point, VIEW.focal_point, atol=1e-12)


def test_turntable_keeps_the_horizon_level():
    view = VIEW
    for yaw, pitch in [(0.3, 0.2), (-1.0, 0.5), (2.0, -0.9)]:
        view = orbited(view, yaw, pitch, UP)
        assert frame_of(view)[:, 0] @ UP == pytest.approx(0.0, abs=1e-12)


def test_turntable_stops_short_of_the_poles():
    view = VIEW
    for _ in range(20):
        view = orbited(view, 0.0, 0.5, UP)
    assert -view.direction @ UP == pytest.approx(np.cos(np.radians(0.5)), abs=1e-9)
    assert view.view_up @ UP > 0.0


def test_positive_yaw_turns_the_scene_to_the_right_and_positive_pitch_its_top_to_the_viewer():
    near_point = VIEW.focal_point - VIEW.direction
    right, up = frame_of(VIEW)[:, 0], frame_of(VIEW)[:, 1]
    yawed, pitched = orbited(VIEW, 0.1, 0.0, UP), orbited(VIEW, 0.0, 0.1, UP)
    assert (near_point - VIEW.focal_point) @ right == pytest.approx(0.0, abs=1e-12)
    assert (near_point - yawed.focal_point) @ frame_of(yawed)[:, 0] > 0.01
    assert (VIEW.focal_point + up - pitched.position) @ pitched.direction < (
        VIEW.focal_point + up - VIEW.position
    ) @ VIEW.direction


def test_orbit_about_a_point_keeps_it_on_its_pixel(camera):
    point = np.array([0.5, 0.4, 0.3])
    before = camera.projection().pixel(point)
    camera.orbit(40.0, -25.0, point)
    np.testing.assert_allclose(camera.projection().pixel(point), before, atol=1e-6)
    camera.is_turntable = False
    camera.orbit(40.0, -25.0, point)
    np.testing.assert_allclose(camera.projection().pixel(point), before, atol=1e-6)


@pytest.mark.parametrize("is_parallel", [False, True])
def test_panned_point_follows_the_pointer(camera, is_parallel):
    camera.set_parallel(is_parallel)
    point = np.array([0.5, 0.4, 0.3])
    before = camera.projection().pixel(point)
    camera.pan(17.0, -9.0, point)
    np.testing.assert_allclose(camera.projection().pixel(point) - before, [17.0, -9.0], atol=1e-6)


@pytest.mark.parametrize("is_parallel", [False, True])
def test_zoom_keeps_the_point_under_the_pointer(camera, is_parallel):
    camera.set_parallel(is_parallel)
    point = np.array([0.5, 0.4, 0.3])
    x, y = camera.projection().pixel(point)
    camera.zoom_at(1.7, x, y, point)
    np.testing.assert_allclose(camera.projection().pixel(point), [x, y], atol=1e-6)
    camera.zoom_at(0.6, 40.0, 30.0)
    start = camera.projection().on_plane(40.0, 30.0, camera.view.focal_point, camera.view.direction)
    camera.zoom_at(1.3, 40.0, 30.0)
    np.testing.assert_allclose(camera.projection().pixel(start), [40.0, 30.0], atol=1e-6)


def test_zoom_and_pan_undo_themselves():
    there = zoomed(panned(VIEW, 0.3, -0.2), 0.5, [1.0, 1.0, 1.0])
    back = panned(zoomed(there, 2.0, [1.0, 1.0, 1.0]), -0.3, 0.2)
    np.testing.assert_allclose(back.position, VIEW.position, atol=1e-12)
    np.testing.assert_allclose(back.focal_point, VIEW.focal_point, atol=1e-12)


@pytest.mark.parametrize("is_parallel", [False, True])
@pytest.mark.parametrize("size", [(300, 200), (100, 400)])
def test_framed_points_fill_the_picture_and_lie_inside(window, camera, is_parallel, size):
    camera.vtk  # noqa: B018 - the renderer makes its camera
    window.SetSize(*size)
    camera.set_parallel(is_parallel)
    points = box_corners(np.array([[1.0, 2.0, 3.0], [4.0, 3.0, 9.0]]))
    camera.view = camera.frame(points)
    share = np.abs(camera.projection().pixels(points) / size * 2.0 - 1.0)
    assert 0.75 < share.max() < 1.0


def test_framing_one_point_keeps_room_around_it():
    view = framed(VIEW, [[1.0, 1.0, 1.0]], 1.5, room=0.5)
    np.testing.assert_allclose(view.focal_point, [1.0, 1.0, 1.0])
    assert view.half_height >= 0.5
    np.testing.assert_allclose(view.direction, VIEW.direction, atol=1e-12)


@pytest.mark.parametrize("axis", [*np.eye(3), *-np.eye(3)])
@pytest.mark.parametrize("up", [UP, np.array([0.0, -1.0, 0.0])])
def test_axis_view_looks_from_that_side_with_a_world_axis_up(axis, up):
    view = axis_view(VIEW, axis, up)
    np.testing.assert_allclose(view.direction, -axis, atol=1e-12)
    assert np.abs(view.view_up).max() == pytest.approx(1.0)
    assert view.view_up @ axis == pytest.approx(0.0, abs=1e-12)
    assert view.distance == pytest.approx(VIEW.distance)


def test_blend_starts_and_ends_at_its_ends():
    end = replace(orbited(zoomed(VIEW, 3.0), 2.5, 0.3, UP), focal_point=VIEW.focal_point + 1.0)
    for share, expected in ((0.0, VIEW), (1.0, end)):
        view = blended(VIEW, end, share)
        np.testing.assert_allclose(view.position, expected.position, atol=1e-9)
        np.testing.assert_allclose(frame_of(view), frame_of(expected), atol=1e-9)
    middle = blended(VIEW, end, 0.5)
    assert middle.distance == pytest.approx(np.sqrt(VIEW.distance * end.distance))


def test_switching_projection_keeps_the_focal_plane(camera):
    points = camera.view.focal_point + np.array([[0.2, 0.0, 0.0], [0.0, 0.0, 0.0]])
    right = frame_of(camera.view)[:, 0]
    points[0] = camera.view.focal_point + 0.2 * right
    before = camera.projection().pixels(points)
    camera.set_parallel(True)
    np.testing.assert_allclose(camera.projection().pixels(points), before, atol=1e-6)


@pytest.mark.parametrize("is_parallel", [False, True])
def test_ray_through_a_pixel_meets_what_is_drawn_there(camera, is_parallel):
    camera.set_parallel(is_parallel)
    point = np.array([0.5, 0.4, 0.3])
    origin, direction = camera.ray_through(*camera.projection().pixel(point))
    assert np.linalg.norm(np.cross(point - origin, direction)) < 1e-9
    unit = camera.projection().world_per_pixel(point)
    moved = camera.projection().pixel(point + unit * camera.projection().right)
    np.testing.assert_allclose(moved - camera.projection().pixel(point), [1.0, 0.0], atol=1e-6)


def test_clipping_holds_the_box_and_never_goes_behind_the_eye(camera):
    box = np.array([[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]])
    camera.fit_clipping(box)
    near, far = camera.vtk.GetClippingRange()
    depths = camera.projection().depths(box_corners(box))
    assert 0 < near < depths.min() and depths.max() < far
    camera.view = replace(VIEW, position=np.array([0.0, -0.5, 0.0]))
    camera.fit_clipping(box)
    near, far = camera.vtk.GetClippingRange()
    assert 0.0 < near < 1e-3 * far


@pytest.mark.parametrize("up", [(0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0), (1.0, 0.0, 0.0)])
def test_axes_of_a_scene_are_right_handed_and_stand_along_its_up(up):
    axes = scene_axes(up)
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    np.testing.assert_allclose(axes[2], up)


def test_the_front_of_a_scene_that_stands_along_z_is_seen_along_y():
    np.testing.assert_allclose(scene_axes((0.0, 0.0, 1.0))[1], (0.0, 1.0, 0.0))
    # A capture with Y down was seen along Z by its cameras.
    np.testing.assert_allclose(scene_axes((0.0, -1.0, 0.0))[1], (0.0, 0.0, 1.0))


@pytest.mark.parametrize("n", [1, 7])
def test_framing_leaves_the_points_alone(n):
    points = np.asfortranarray(np.random.default_rng(0).normal(size=(n, 3)))
    before = points.copy()
    framed(VIEW, points, 1.5)
    np.testing.assert_array_equal(points, before)


PLACE = Place((0.3, -0.1, 0.2), (1.0, 2.0, -0.5), (0.8, 0.2, -0.4, 0.4), 2.5)


def in_picture(camera, points):
    return camera.projection().pixels(points)


def test_a_camera_at_rest_sees_placed_points_where_one_of_the_placed_scene_would(camera):
    points = np.random.default_rng(3).normal(size=(20, 3))
    expected = in_picture(camera, placed_points(points, PLACE))
    camera.show_place(PLACE)
    np.testing.assert_allclose(in_picture(camera, points), expected, atol=1e-6)
    camera.show_place(Place())
    np.testing.assert_allclose(camera.view.position, VIEW.position, atol=1e-12)


def test_a_camera_that_goes_along_keeps_a_point_and_the_size_of_what_turns_about_it(camera):
    at = np.array([0.2, 0.1, 0.3])
    around = at + 0.3 * np.random.default_rng(4).normal(size=(20, 3))
    before, turned = in_picture(camera, at[None]), at + (around - at) @ PLACE.rotation.T
    expected = in_picture(camera, turned)
    camera.show_place(PLACE, at)
    np.testing.assert_allclose(in_picture(camera, at[None]), before, atol=1e-6)
    np.testing.assert_allclose(in_picture(camera, around), expected, atol=1e-6)


def test_the_turntable_and_views_along_axes_are_those_of_the_placed_scene(camera):
    camera.show_place(PLACE)
    camera.orbit(40.0, -25.0)
    assert frame_of(camera.view)[:, 0] @ camera.up == pytest.approx(0.0, abs=1e-9)
    for axis in (*np.eye(3), -np.eye(3)[2]):
        np.testing.assert_allclose(PLACE.rotation @ camera.look_from(axis).direction, -axis, atol=1e-9)
