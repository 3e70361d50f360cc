import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from splap_editor.core.graph.ellipse_offset import normal_offsets, touch_scales
from splap_editor.core.splats.occupancy import Ellipses, occupancy_ellipses
from tests.core.splat_scenes import cloud, moved, splats_of
from tests.reference.graph import all_pairs, sampled_offset, searched_touch

EPSILON = 0.03


@pytest.fixture(scope="module")
def ellipses() -> Ellipses:
    return occupancy_ellipses(cloud(16, size=0.7))


def both_touches(ellipses: Ellipses, i: int, j: int) -> float:
    return max(searched_touch(ellipses, i, j, EPSILON), searched_touch(ellipses, j, i, EPSILON))


def test_offsets_are_the_sampled_twins(ellipses):
    pairs = all_pairs(ellipses.n_nodes)
    offsets = normal_offsets(ellipses, pairs)
    finite = 0
    for (i, j), (forth, back) in zip(pairs, offsets, strict=True):
        for one, other, offset in ((i, j, forth), (j, i, back)):
            sampled = sampled_offset(ellipses, one, other)
            if np.isfinite(sampled):
                finite += 1
                # The samples lie up to a hundredth of a semi-axis apart, and none lies just on the lens's rim.
                assert offset <= sampled + 1e-12
                assert sampled - offset < 0.05
    assert finite > 20


def test_touch_scales_are_the_searched_twins(ellipses):
    pairs = all_pairs(ellipses.n_nodes)[::4]
    touch = touch_scales(ellipses, pairs, EPSILON)
    # Nested searches to 1e-10 each, in a valley with a crease.
    twins = [both_touches(ellipses, i, j) for i, j in pairs]
    np.testing.assert_allclose(touch, twins, rtol=1e-5)


def test_an_offset_within_the_tolerance_and_a_touch_scale_within_1_are_the_same():
    ellipses = occupancy_ellipses(cloud(60, size=0.4))
    pairs = all_pairs(60)
    within = normal_offsets(ellipses, pairs).max(axis=1) <= EPSILON
    assert 50 < within.sum() < len(pairs) - 50
    assert np.array_equal(touch_scales(ellipses, pairs, EPSILON) <= 1.0, within)


def test_at_their_touch_scale_two_ellipses_are_just_the_tolerance_apart(ellipses):
    pairs = all_pairs(ellipses.n_nodes)
    touch = touch_scales(ellipses, pairs, EPSILON)
    for pair, f in zip(pairs, touch, strict=True):
        for factor, meets in ((f * (1.0 + 1e-9), True), (f * (1.0 - 1e-9), False)):
            grown = Ellipses(**(vars(ellipses) | {"semi_axes": factor * ellipses.semi_axes}))
            assert (normal_offsets(grown, pair[None]).max() <= EPSILON * (1.0 + 1e-9)) == meets


def test_offsets_scale_with_the_scene_and_touch_scales_do_not():
    splats = cloud(30, size=0.7)
    rotation = Rotation.from_rotvec([1.0, 0.2, -0.5])
    ellipses, others = (
        occupancy_ellipses(scene) for scene in (splats, moved(splats, rotation, 20.0, np.array([1.0, 2.0, 3.0])))
    )
    rows = all_pairs(30)
    pairs, other_pairs = ellipses.node_of_row[rows], others.node_of_row[rows]
    np.testing.assert_allclose(
        normal_offsets(others, other_pairs), 20.0 * normal_offsets(ellipses, pairs), rtol=1e-9, atol=1e-12
    )
    np.testing.assert_allclose(
        touch_scales(others, other_pairs, 20.0 * EPSILON), touch_scales(ellipses, pairs, EPSILON), rtol=1e-9
    )


def test_both_ends_of_a_pair_see_the_same_touch_scale(ellipses):
    pairs = all_pairs(ellipses.n_nodes)
    # Not bit for bit: the two directions are compared in another order.
    np.testing.assert_allclose(
        touch_scales(ellipses, pairs, EPSILON), touch_scales(ellipses, pairs[:, ::-1], EPSILON), rtol=1e-14
    )


def test_known_positions():
    flat, upright = np.eye(3), np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])
    centers = np.array([[0.0, 0, 0], [1.5, 0, 0], [0, 0, 0.5], [0.0, 0, 0.5], [2.5, 0, 0], [0, 0, 0]])
    frames = np.stack([flat, flat, flat, upright, flat, flat])
    ellipses = occupancy_ellipses(splats_of(centers, np.array([1.0, 0.25]), frames))
    node = ellipses.node_of_row

    def offset_and_touch(i: int, j: int, epsilon: float) -> tuple[float, float]:
        pair = node[[[i, j]]]
        return normal_offsets(ellipses, pair)[0, 0], touch_scales(ellipses, pair, epsilon)[0]

    in_plane, above, crossing, apart = (offset_and_touch(0, j, 0.01) for j in (1, 2, 3, 4))
    np.testing.assert_allclose(in_plane, (0.0, 0.75), atol=1e-9)
    np.testing.assert_allclose(above, (0.5, np.inf))
    # The upright one reaches 0.25 down from 0.5 to 0.25; doubled, it meets the other's centre. The tolerance does not
    # help: along the upright one's own normal the two never come nearer.
    np.testing.assert_allclose(crossing, (0.25, 2.0), atol=1e-9)
    np.testing.assert_allclose(apart, (np.inf, 1.25), atol=1e-9)
    np.testing.assert_allclose(offset_and_touch(0, 5, 0.01), (0.0, 0.0), atol=1e-12)


def test_needles_and_huge_aspect_ratios_stay_exact():
    centers = np.array([[0.0, 0, 0], [0.5, 0.5, 0]])
    turned = Rotation.from_rotvec([0, 0, np.pi / 2]).as_matrix()
    axes = np.array([[1.0, 1e-4], [1.0, 1e-4]])
    ellipses = occupancy_ellipses(splats_of(centers, axes, np.stack([np.eye(3), turned])))
    # Both shrink until their tips meet in (0.5, 0), where each is half a semi-axis long, give or take their width.
    np.testing.assert_allclose(touch_scales(ellipses, np.array([[0, 1]]), 0.0), 0.5, rtol=1e-4)


@pytest.mark.parametrize(
    ("pairs", "message"),
    [(np.zeros((3, 3), int), r"\(E, 2\), got \(3, 3\)"), (np.array([[0, 99]]), "nodes 0 to 15, got 0 to 99")],
)
def test_wrong_pairs_are_rejected(ellipses, pairs, message):
    with pytest.raises(ValueError, match=message):
        normal_offsets(ellipses, pairs)
    with pytest.raises(ValueError, match=message):
        touch_scales(ellipses, pairs, EPSILON)


def test_a_negative_tolerance_is_rejected(ellipses):
    with pytest.raises(ValueError, match="epsilon must not be negative"):
        touch_scales(ellipses, np.array([[0, 1]]), -1.0)
