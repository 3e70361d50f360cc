"""Laws of mirrors and of the plane that is looked for."""

import numpy as np
import pytest

from splap_editor.core.splats.rotations import quats_to_matrices
from splap_editor.core.splats.symmetry import Plane, object_center, symmetry_plane


def mirrored_cloud(rng, n=600):
    """Points on both sides of x = 0.3, lopsided in y and z."""
    half = rng.normal(size=(n, 3)) * [0.5, 1.0, 2.0] + [0.0, 0.0, 1.0]
    half[:, 0] = np.abs(half[:, 0])
    half[: n // 3, 1] += 2.0
    return np.concatenate([half, half * [-1.0, 1.0, 1.0]]) + np.array([0.3, 0.0, 0.0])


def test_a_mirror_undoes_itself_and_keeps_its_plane():
    rng = np.random.default_rng(1)
    normal = rng.normal(size=3)
    plane = Plane(rng.normal(size=3), normal / np.linalg.norm(normal))
    points = rng.normal(size=(20, 3))
    np.testing.assert_allclose(plane.mirrored(plane.mirrored(points)), points, atol=1e-12)
    on = points - ((points - plane.point) @ plane.normal)[:, None] * plane.normal
    np.testing.assert_allclose(plane.mirrored(on), on, atol=1e-12)


@pytest.mark.parametrize("quat", [(1.0, 0.0, 0.0, 0.0), (0.5, 0.2, -0.7, 0.3), (0.1, 0.9, 0.3, -0.2)])
def test_the_plane_of_a_mirrored_cloud_is_found_however_it_is_turned(quat):
    rng = np.random.default_rng(2)
    R, shift = quats_to_matrices(np.array([quat]))[0], rng.normal(size=3) * 5.0
    points = mirrored_cloud(rng) @ R.T + shift
    plane = symmetry_plane(points)
    assert abs(plane.normal @ R[:, 0]) == pytest.approx(1.0, abs=1e-9)
    assert plane.normal @ (R @ [0.3, 0.0, 0.0] + shift - plane.point) == pytest.approx(0.0, abs=1e-9)
    assert plane.error == pytest.approx(0.0, abs=1e-9)


def test_floaters_and_noise_hardly_move_the_plane():
    rng = np.random.default_rng(3)
    points = np.concatenate([mirrored_cloud(rng, 1500), rng.normal(size=(100, 3)) * 20.0])
    points += rng.normal(size=points.shape) * 0.01
    plane = symmetry_plane(points)
    # The noise is a hundredth of the size.
    assert abs(plane.normal[0]) > 0.999
    assert abs(plane.normal @ (np.array([0.3, 0.0, 0.0]) - plane.point)) < 0.05


def test_a_single_point_is_mirrored_somewhere():
    assert symmetry_plane(np.zeros((1, 3))).error == 0.0


@pytest.mark.parametrize("points", [np.zeros((0, 3)), np.zeros(3), np.zeros((4, 2))])
def test_what_are_no_points_is_refused(points):
    with pytest.raises(ValueError, match="points must have shape"):
        symmetry_plane(points)


def test_the_centre_is_that_of_the_box_without_floaters():
    points = np.concatenate([np.random.default_rng(4).uniform(-1.0, 3.0, (5000, 3)), [[1e6, 0.0, 0.0]]])
    np.testing.assert_allclose(object_center(points), [1.0, 1.0, 1.0], atol=0.05)
