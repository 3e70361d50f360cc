"""Two sets tied by their best contacts, and the rims by which they face each other."""

import numpy as np
import pytest
from scipy.spatial.distance import cdist
from scipy.spatial.transform import Rotation

from splap_editor.core.graph.ellipse_offset import touch_scales
from splap_editor.core.splats.occupancy import occupancy_ellipses
from splap_editor.core.surface.joining import RIM_DEPTH, best_contacts, facing_rims
from tests.core.splat_scenes import joined, moved, sheet

EPSILON = 0.005


@pytest.fixture(scope="module")
def apart():
    """Two sheets side by side with a gap: ellipses, and the nodes of each."""
    right = moved(sheet(400, seed=2), Rotation.identity(), 1.0, np.array([1.25, 0.0, 0.0]))
    ellipses = occupancy_ellipses(joined(sheet(400, seed=1), right))
    is_left = ellipses.rows < 400
    return ellipses, np.flatnonzero(is_left), np.flatnonzero(~is_left)


def test_the_best_contact_of_all_is_among_them_and_each_node_is_joined_once(apart):
    ellipses, first, second = apart
    pairs = best_contacts(ellipses, first, second, EPSILON)
    everyone = np.stack(np.meshgrid(first, second), axis=-1).reshape(-1, 2).astype(np.int32)
    chosen = touch_scales(ellipses, pairs.astype(np.int32), EPSILON)
    assert chosen.min() == chosen[0] == touch_scales(ellipses, everyone, EPSILON).min()
    assert len(np.unique(pairs)) == pairs.size
    assert np.isin(pairs[:, 0], first).all() and np.isin(pairs[:, 1], second).all()


def test_an_empty_set_and_a_short_reach_have_no_contacts(apart):
    ellipses, first, second = apart
    assert best_contacts(ellipses, first, np.zeros(0, np.int64), EPSILON).shape == (0, 2)
    assert best_contacts(ellipses, first, second, EPSILON, reach=0.01).shape == (0, 2)


@pytest.mark.parametrize("few", [False, True])
def test_rims_are_what_is_hardly_farther_than_the_gap(apart, few):
    ellipses, first, second = apart
    if few:
        second = second[::5]
    rims = facing_rims(ellipses, first, second)
    apart_ = cdist(ellipses.centers[first], ellipses.centers[second])
    i, j = np.unravel_index(np.argmin(apart_), apart_.shape)
    within = apart_.min() + RIM_DEPTH * max(ellipses.reaches[first[i]], ellipses.reaches[second[j]])
    # Of the larger set those count that are near the other's rim, not just near the other.
    smaller = 1 if len(first) > len(second) else 0
    np.testing.assert_array_equal(rims[smaller], (first, second)[smaller][apart_.min(axis=1 - smaller) <= within])
    assert 0 < len(rims[1 - smaller]) < len((first, second)[1 - smaller])
    swapped = facing_rims(ellipses, second, first)
    if few:
        np.testing.assert_array_equal(swapped[0], rims[1])
        np.testing.assert_array_equal(swapped[1], rims[0])
