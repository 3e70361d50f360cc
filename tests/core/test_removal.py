"""What steps of a removal pick, against slow twins."""

import numpy as np
import pytest

from splap_editor.core.removal import (
    PickedBall,
    PickedBox,
    PickedRange,
    PickedRows,
    PickedSide,
    RemovalStep,
    picked_splats,
    removed_splats,
)
from splap_editor.core.splats.rotations import quats_to_matrices

QUAT = tuple((np.array([0.8, 0.2, -0.4, 0.4]) / np.linalg.norm([0.8, 0.2, -0.4, 0.4])).tolist())


@pytest.fixture
def means():
    return np.random.default_rng(0).normal(size=(500, 3)).astype(np.float32)


def test_a_crop_takes_what_a_plain_loop_takes(means):
    box = PickedBox((0.1, -0.2, 0.3), (1.0, 2.0, 1.5), QUAT)
    ball, side = PickedBall((0.1, 0.2, 0.3), 1.1), PickedSide((0.1, 0.0, 0.2), (1.0, -2.0, 0.5))
    R = quats_to_matrices(np.array([QUAT]))[0]
    for i, mean in enumerate(means.astype(np.float64)):
        local = R.T @ (mean - box.center)
        assert picked_splats(box, means)[i] == all(abs(local) <= np.array(box.size) / 2)
        assert picked_splats(ball, means)[i] == (np.linalg.norm(mean - ball.center) <= ball.radius)
        assert picked_splats(side, means)[i] == ((mean - side.point) @ np.array(side.normal) > 0)


def test_outside_is_the_complement_and_restoring_takes_back(means):
    box = PickedBox((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    inside = picked_splats(box, means)
    np.testing.assert_array_equal(removed_splats([RemovalStep(box, outside=True)], means), ~inside)
    both = [RemovalStep(box, outside=True), RemovalStep(box, outside=True, restores=True)]
    assert not removed_splats(both, means).any()


def test_steps_are_taken_in_their_order(means):
    ball, rows = PickedBall((0.0, 0.0, 0.0), 1.0), PickedRows(np.arange(20))
    first = removed_splats([RemovalStep(ball), RemovalStep(rows, restores=True)], means)
    second = removed_splats([RemovalStep(rows, restores=True), RemovalStep(ball)], means)
    np.testing.assert_array_equal(second, picked_splats(ball, means))
    np.testing.assert_array_equal(first, second & ~picked_splats(rows, means))


def test_what_is_picked_by_place_does_not_depend_on_the_order_of_rows(means):
    order = np.random.default_rng(1).permutation(len(means))
    for picked in (PickedBox((0.1, 0.0, 0.0), (1.0, 2.0, 1.0), QUAT), PickedBall((0.0, 0.5, 0.0), 1.0)):
        np.testing.assert_array_equal(picked_splats(picked, means[order]), picked_splats(picked, means)[order])


def test_a_range_is_found_among_what_is_left(means):
    asked = []

    def find(picked, removed):
        asked.append((picked, removed.copy()))
        return means[:, 0] > 0.0

    steps = [RemovalStep(PickedRows(np.array([3, 5]))), RemovalStep(PickedRange("alpha", most=0.1))]
    removed = removed_splats(steps, means, find)
    assert asked[0][0] == steps[1].picked
    assert np.flatnonzero(asked[0][1]).tolist() == [3, 5]
    np.testing.assert_array_equal(np.flatnonzero(removed), np.union1d([3, 5], np.flatnonzero(means[:, 0] > 0.0)))


def test_a_row_beyond_the_file_is_refused(means):
    with pytest.raises(ValueError, match="row 500 is named, but the file has rows 0 to 499"):
        picked_splats(PickedRows(np.array([1, 500])), means)
