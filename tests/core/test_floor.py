"""A floor is found whatever stands on it."""

import numpy as np
import pytest

from splap_editor.core.floor import floor_plane
from splap_editor.core.place import Place, laid_level, placed_points
from splap_editor.core.splats.rotations import quats_to_matrices


def floor_with_clutter(seed, share):
    """A tilted floor of radius 1 with a wall and a haze on it: points, which are the floor's, its normal."""
    rng = np.random.default_rng(seed)
    n, m = 600, int(600 * share)
    floor = np.column_stack([rng.uniform(-0.7, 0.7, (n, 2)), rng.normal(0.0, 0.004, n)])
    wall = np.column_stack(
        [rng.normal(0.3, 0.004, m // 2), rng.uniform(-0.7, 0.7, m // 2), rng.uniform(0, 0.7, m // 2)]
    )
    haze = np.column_stack([rng.uniform(-0.7, 0.7, (m - m // 2, 2)), rng.uniform(0.0, 0.7, m - m // 2)])
    R = quats_to_matrices(rng.normal(size=(1, 4)))[0]
    return np.concatenate([floor, wall, haze]) @ R.T, np.arange(n + m) < n, R[:, 2]


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("share", [0.0, 0.3, 0.8])
def test_clutter_does_not_tilt_the_floor(seed, share):
    points, is_floor, normal = floor_with_clutter(seed, share)
    found = floor_plane(points, 1.0)
    assert np.degrees(np.arccos(min(abs(found.normal @ normal), 1.0))) < 0.3
    assert found.inside[is_floor].mean() > 0.99
    again = floor_plane(points, 1.0)
    np.testing.assert_array_equal(again.normal, found.normal)


def test_the_plane_turns_with_the_points():
    points, _, _ = floor_with_clutter(1, 0.5)
    R = quats_to_matrices(np.array([[0.3, -0.5, 0.7, 0.2]]))[0]
    a, b = floor_plane(points, 1.0), floor_plane(points @ R.T, 1.0)
    assert abs((R @ a.normal) @ b.normal) == pytest.approx(1.0, abs=1e-12)


def test_an_object_laid_level_stands_on_its_floor():
    points, is_floor, normal = floor_with_clutter(2, 0.8)
    found = floor_plane(points, 1.0)
    place = laid_level(Place(scale=2.0), found.middle, found.normal, np.array([0.0, -1.0, 0.0]), normal)
    heights = -placed_points(points, place)[:, 1]
    assert np.std(heights[is_floor]) < 0.02
    assert heights[~is_floor].mean() > heights[is_floor].mean()


@pytest.mark.parametrize("points", [np.zeros((2, 3)), np.arange(30.0)[:, None] * np.ones(3)])
def test_what_is_no_floor_is_refused(points):
    with pytest.raises(ValueError, match=r"floor|line"):
        floor_plane(points, 1.0)
