import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from splap_editor.core.arap.handle_motion import eased_transforms, n_easy_stops, turns_left_open
from splap_editor.core.deformer import Handles
from tests.core.arap.arap_scenes import holding, moved, rigid

CENTER = np.array([1.0, 2.0, 3.0])
HANDLES = Handles(np.arange(1), np.zeros(1, np.int32), CENTER[None], np.full(1, np.inf))


@pytest.mark.parametrize("degrees", [0.0, 1e-7, 30.0, 120.0, 179.999999, 180.0])
def test_half_way_twice_is_the_whole_turn(degrees):
    T = rigid(degrees, [1.0, -2.0, 0.5], CENTER)[None]
    half = eased_transforms(HANDLES, T, 0.5)[0]
    # A half turn may go either way round; doing it twice brings both to the same place.
    np.testing.assert_allclose(half @ half, T[0], atol=1e-7)


def test_ease_turns_at_constant_speed_and_carries_the_center_straight():
    T = rigid(90.0, [0.0, 0.0, 1.0], CENTER, [4.0, 0.0, 0.0], scale=3.0)[None]
    quarter = eased_transforms(HANDLES, T, 0.25)[0]
    np.testing.assert_allclose(moved(quarter, CENTER), np.add(CENTER, [1.0, 0.0, 0.0]), atol=1e-12)
    expected = 1.5 * Rotation.from_rotvec([0.0, 0.0, np.pi / 8]).as_matrix()
    np.testing.assert_allclose(quarter[:3, :3], expected, atol=1e-12)


def test_ease_begins_at_rest_and_ends_at_the_very_transform():
    T = rigid(70.0, [1.0, 0.0, 1.0], CENTER, [4.0, 0.0, 0.0])[None]
    np.testing.assert_allclose(eased_transforms(HANDLES, T, 0.0)[0], np.eye(4), atol=1e-12)
    assert (eased_transforms(HANDLES, T, 1.0) == T).all()


def test_large_motions_are_cut_into_small_ones():
    assert n_easy_stops(HANDLES, np.eye(4)[None], 1.0) == 1
    assert n_easy_stops(HANDLES, rigid(179.0, [1.0, 0.0, 0.0], CENTER)[None], 1.0) == 3
    assert n_easy_stops(HANDLES, rigid(0.0, [1.0, 0.0, 0.0], CENTER, [10.0, 0.0, 0.0])[None], 20.0) == 2
    assert n_easy_stops(holding(CENTER[None], []), np.empty((0, 4, 4)), 1.0) == 1


def test_a_turn_is_left_open_by_points_on_a_line():
    rest = np.array([[0, 0, 0], [1, 1, 1], [2, 2, 2], [0, 1, 0], [5, 5, 5]], np.float64)
    masks = [np.isin(np.arange(5), nodes) for nodes in ([0, 1, 2], [3])]
    assert turns_left_open(holding(rest, masks), rest).tolist() == [True, True]
    masks = [np.isin(np.arange(5), nodes) for nodes in ([0, 1, 3], [2, 4])]
    assert turns_left_open(holding(rest, masks), rest).tolist() == [False, True]
