import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from splap_editor.core.splats.smallest_box import smallest_box

_RNG = np.random.default_rng(0)


@pytest.mark.parametrize("sides", [(3.0, 1.0, 0.2), (1.0, 1.0, 1.0), (2.0, 2.0, 0.0), (1.0, 0.0, 0.0)])
def test_a_box_at_any_angle_is_its_own_smallest_box(sides):
    corners = np.array([[i, j, k] for i in (-0.5, 0.5) for j in (-0.5, 0.5) for k in (-0.5, 0.5)]) * sides
    turn, shift = Rotation.from_rotvec([0.4, -1.1, 2.0]), np.array([5.0, -3.0, 2.0])
    center, half_axes = smallest_box(turn.apply(corners) + shift)
    np.testing.assert_allclose(center, shift, atol=1e-6)
    # The search stops at angles of 1e-8.
    np.testing.assert_allclose(2.0 * np.linalg.norm(half_axes, axis=1), sides, atol=1e-6)


def test_all_points_lie_in_the_box_and_touch_each_face():
    points = _RNG.normal(size=(500, 3)) * [3.0, 1.0, 0.5]
    center, half_axes = smallest_box(points)
    lengths = np.linalg.norm(half_axes, axis=1)
    along = (points - center) @ (half_axes / lengths[:, None]).T
    np.testing.assert_allclose(along.max(axis=0), lengths, rtol=1e-12)
    np.testing.assert_allclose(along.min(axis=0), -lengths, rtol=1e-12)
    np.testing.assert_allclose(half_axes @ half_axes.T, np.diag(lengths**2), atol=1e-12)
    assert (np.diff(lengths) <= 0.0).all()


def test_no_other_frame_has_a_much_smaller_sum_of_sides():
    points = _RNG.normal(size=(60, 3)) * [2.0, 1.5, 0.7]
    _, half_axes = smallest_box(points)
    frames = Rotation.random(20_000, random_state=0).as_matrix()
    along = np.einsum("ni,fij->fnj", points, frames)
    # The descents begin at a few of the best of a grid: they may miss a box that is a little smaller still.
    assert 2.0 * np.linalg.norm(half_axes, axis=1).sum() < 1.005 * np.ptp(along, axis=1).sum(axis=1).min()


def test_one_point_has_an_empty_box():
    center, half_axes = smallest_box(np.array([[1.0, 2.0, 3.0]]))
    np.testing.assert_allclose(center, [1.0, 2.0, 3.0])
    np.testing.assert_allclose(half_axes, 0.0, atol=1e-15)
