"""Laws of the place of a whole scene."""

from dataclasses import replace

import numpy as np
import pytest

from splap_editor.core.place import (
    Place,
    file_points,
    fitted_plane,
    laid_level,
    placed_points,
    placed_pose,
    placed_splats,
    pose_in_file,
    recentred,
    recentred_on,
    sized,
    stood_up,
)
from splap_editor.core.pose import Pose
from splap_editor.core.splats.rotations import quats_to_matrices
from splap_editor.core.splats.spherical_harmonics import view_colors
from splap_editor.core.splats.splats import Splats

QUAT = tuple((np.array([0.8, 0.2, -0.4, 0.4]) / np.linalg.norm([0.8, 0.2, -0.4, 0.4])).tolist())
PLACE = Place((0.3, -0.1, 0.2), (1.0, 2.0, -0.5), QUAT, 2.5)


def splats(n_scales=3, n=40):
    rng = np.random.default_rng(0)
    return Splats(
        rng.normal(size=(n, 3)),
        rng.normal(-3.0, 0.5, (n, n_scales)),
        rng.normal(size=(n, 4)),
        rng.normal(size=n),
        rng.normal(size=(n, 3)),
        rng.normal(0.0, 0.2, (n, 8, 3)),
    )


def covariances(held):
    axes = quats_to_matrices(held.quats)[:, :, : held.n_scales] * np.exp(held.log_scales)[:, None, :]
    return axes @ axes.swapaxes(1, 2)


@pytest.mark.parametrize("n_scales", [2, 3])
def test_positions_and_covariances_follow_the_matrix_and_the_scales_stay_as_many(n_scales):
    rest = splats(n_scales)
    placed = placed_splats(rest, PLACE)
    M = PLACE.matrix
    np.testing.assert_allclose(placed.means, rest.means @ M[:3, :3].T + M[:3, 3], atol=1e-12)
    np.testing.assert_allclose(covariances(placed), M[:3, :3] @ covariances(rest) @ M[:3, :3].T, atol=1e-12)
    assert placed.n_scales == n_scales


def test_colour_turns_with_the_scene():
    rest = splats()
    placed, eye = placed_splats(rest, PLACE), np.array([4.0, 3.0, 2.0])
    eyes = np.broadcast_to(np.eye(3), (rest.n_splats, 3, 3))
    there = view_colors(*_floats(placed), eyes, placed_points(eye[None], PLACE)[0])
    np.testing.assert_allclose(there, view_colors(*_floats(rest), eyes, eye), atol=2e-5)


def _floats(held):
    return tuple(np.ascontiguousarray(part, np.float32) for part in (held.sh0, held.shN, held.means))


def test_a_place_at_rest_gives_the_same_splats_and_its_centre_says_nothing_then():
    rest = splats()
    assert placed_splats(rest, Place(center=(1.0, 2.0, 3.0))) is rest


def test_a_place_goes_on_by_a_further_similarity():
    delta = Place((0.0, 1.0, 0.0), (0.5, 0.0, 0.0), (0.6, 0.0, 0.8, 0.0), 0.5).matrix
    np.testing.assert_allclose(PLACE.followed_by(delta).matrix, delta @ PLACE.matrix, atol=1e-12)


def test_the_filter_grows_with_the_scene():
    rest = replace(splats(), filter_radii=np.full(40, 0.01))
    np.testing.assert_allclose(placed_splats(rest, PLACE).scales, 2.5 * rest.scales)


def test_a_floor_is_level_whatever_side_its_normal_points_to():
    rng = np.random.default_rng(2)
    M = PLACE.matrix
    floor = np.column_stack([rng.normal(size=(30, 2)), np.zeros(30)])
    for side in (1.0, -1.0):
        tilted, above = floor @ M[:3, :3].T + M[:3, 3], M[:3, :3] @ [0.0, 0.0, side] + M[:3, 3]
        place = laid_level(Place(), *fitted_plane(tilted), np.array([0.0, 0.0, 2.0]), above)
        down = placed_points(tilted, place)
        assert np.ptp(down[:, 2]) < 1e-9
        assert placed_points(above[None], place)[0, 2] > down[0, 2]


def test_a_measured_length_and_a_centre_come_out_as_asked():
    a, b = np.array([0.1, 0.2, 0.3]), np.array([1.0, -1.0, 0.5])
    place = recentred(sized(PLACE, a, b, 0.25), a)
    ends = placed_points(np.array([a, b]), place)
    assert np.linalg.norm(ends[1] - ends[0]) == pytest.approx(0.25)
    np.testing.assert_allclose(ends[0], 0.0, atol=1e-12)


def test_points_on_a_line_are_no_floor():
    with pytest.raises(ValueError, match="do not lie on a line"):
        fitted_plane(np.outer(np.arange(4.0), [1.0, 2.0, 3.0]))


def test_file_points_are_where_placed_points_come_from():
    points = np.random.default_rng(5).normal(size=(20, 3))
    np.testing.assert_allclose(file_points(placed_points(points, PLACE), PLACE), points, atol=1e-12)


def test_a_pose_is_shown_as_what_it_does_in_the_placed_scene():
    pose, center = Pose((0.2, -0.1, 0.4), (0.5, 0.5, -0.5, 0.5), 1.5), np.array([0.1, 0.7, -0.3])
    seen, there = placed_pose(pose, PLACE), placed_points(center[None], PLACE)[0]
    np.testing.assert_allclose(seen.matrix(there) @ PLACE.matrix, PLACE.matrix @ pose.matrix(center), atol=1e-12)
    back = pose_in_file(seen, PLACE)
    np.testing.assert_allclose(back.matrix(center), pose.matrix(center), atol=1e-12)
    assert placed_pose(pose, Place()) is pose and pose_in_file(pose, Place((1.0, 2.0, 3.0))) is pose


def test_a_place_about_another_center_is_the_same_place():
    np.testing.assert_allclose(recentred_on(PLACE, np.array([3.0, -1.0, 2.0])).matrix, PLACE.matrix, atol=1e-12)


@pytest.mark.parametrize("after", [(0, 0, 1), (0, -1, 0), (1, 0, 0)])
def test_standing_up_brings_one_axis_to_another_about_a_point_that_stays(after):
    before, at = np.array([0.0, 1.0, 0.0]), np.array([0.4, 0.2, 0.1])
    stood = stood_up(PLACE, before, np.array(after), at)
    np.testing.assert_allclose(placed_points(at[None], stood), placed_points(at[None], PLACE), atol=1e-12)
    turn = stood.rotation @ PLACE.rotation.T
    np.testing.assert_allclose(turn @ before, after, atol=1e-12)
    assert stood.scale == pytest.approx(PLACE.scale)
