"""Crop shapes: what a drag of a handle keeps where it is, and that the step picks what the shape holds."""

from dataclasses import replace

import numpy as np
import pytest

from splap_editor.core.removal import picked_splats
from splap_editor.core.splats.main_subject import main_subject
from splap_editor.session.crop_shape import CropKind, shape_about

POINTS = np.random.default_rng(5).normal(size=(400, 3)) * [1.0, 2.0, 3.0]


def made(kind):
    shape = shape_about(main_subject(POINTS, np.ones(len(POINTS))), kind)
    return shape.turned(np.array([0.6, 0.0, 0.8]), 0.7)


@pytest.mark.parametrize("handle", range(6))
def test_pulling_a_face_of_a_box_leaves_the_face_across_where_it_is(handle):
    box = made(CropKind.BOX)
    pulled = box.pulled(handle, 0.4)
    across = (handle + 3) % 6
    np.testing.assert_allclose(pulled.handles[handle], box.handles[handle] + 0.4 * box.normals[handle], atol=1e-12)
    a, b = pulled.handles[across], box.handles[across]
    np.testing.assert_allclose(a, b, atol=1e-12)
    thin = box.pulled(handle, -1e6)
    assert (thin.halves > 0).all()
    np.testing.assert_allclose(thin.handles[across], b, atol=1e-12)


def test_pulling_a_ball_changes_its_radius_alone():
    ball = made(CropKind.BALL)
    pulled = ball.pulled(4, -0.3)
    np.testing.assert_array_equal(pulled.center, ball.center)
    np.testing.assert_allclose(pulled.halves, ball.halves - 0.3)


def test_a_box_picks_what_is_between_its_faces():
    box = made(CropKind.BOX).pulled(0, -2.0).pulled(5, -1.0)
    faces = list(zip(box.handles, box.normals, strict=True))
    inside = np.array([all((point - at) @ normal <= 0 for at, normal in faces) for point in POINTS])
    np.testing.assert_array_equal(picked_splats(box.picked, POINTS), inside)
    assert 0 < inside.sum() < len(POINTS)


def test_ball_and_plane_pick_by_distance_and_side():
    ball, plane = made(CropKind.BALL).pulled(0, -3.0), made(CropKind.PLANE).pulled(0, 0.5)
    by_ball = np.linalg.norm(POINTS - ball.center, axis=1) <= ball.halves[0]
    np.testing.assert_array_equal(picked_splats(ball.picked, POINTS), by_ball)
    by_plane = (POINTS - plane.center) @ plane.axes[0] > 0
    np.testing.assert_array_equal(picked_splats(plane.picked, POINTS), by_plane)
    assert 0 < by_ball.sum() < 400 and 0 < by_plane.sum() < 400


@pytest.mark.parametrize("kind", list(CropKind))
def test_a_shape_begins_about_the_whole_subject(kind):
    subject = main_subject(POINTS, np.ones(len(POINTS)))
    shape = shape_about(subject, kind)
    if kind is not CropKind.PLANE:
        assert picked_splats(shape.picked, subject.corners).all()
    assert all(loop.shape[1] == 3 for loop in shape.loops)


@pytest.mark.parametrize("kind", [CropKind.BOX, CropKind.BALL])
def test_a_shape_begins_about_sparser_parts_too(kind):
    subject = main_subject(POINTS, np.ones(len(POINTS)))
    seen = replace(subject, center=subject.center + 0.4 * subject.size, half_axes=1.7 * subject.half_axes)
    shape = shape_about(replace(subject, seen=seen), kind)
    assert picked_splats(shape.picked, seen.corners).all()
