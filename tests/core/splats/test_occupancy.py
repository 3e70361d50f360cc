from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from splap_editor.core.progress import Cancelled
from splap_editor.core.splats.occupancy import InertReason, occupancy_ellipses
from tests.core.splat_scenes import SIGMA_CUT, ball, cloud, moved, shuffled, splats_of
from tests.reference.graph import occupancy_ellipse


def test_ellipses_are_the_twins():
    splats = cloud(100)
    thresholds = np.random.default_rng(0).uniform(0.0, 0.9, 100)
    for scene in (splats, replace(splats, thresholds=thresholds)):
        ellipses = occupancy_ellipses(scene)
        assert ellipses.n_nodes == 100
        for node, row in enumerate(ellipses.rows):
            semi_axes, normal = occupancy_ellipse(scene, row)
            np.testing.assert_allclose(ellipses.semi_axes[node], semi_axes, atol=1e-12)
            np.testing.assert_allclose(ellipses.normals[node], normal, atol=1e-12)


def test_a_kernel_at_the_rim_contributes_just_the_least_visible_amount():
    splats = splats_of(np.zeros((1, 3)), np.array([SIGMA_CUT, SIGMA_CUT]))
    ellipses = occupancy_ellipses(splats)
    assert np.isclose(0.9 * np.exp(-0.5 * ellipses.cutoffs[0] ** 2), 1.0 / 255.0, rtol=1e-12)


def test_three_scales_give_the_plane_of_the_two_largest_and_keep_where_they_come_from():
    splats = splats_of(np.zeros((2, 3)), np.ones(2))
    splats = replace(splats, log_scales=np.log([[0.1, 2.0, 3.0], [2.0, 0.1, 3.0]]))
    ellipses = occupancy_ellipses(splats)
    assert ellipses.axes.tolist() == [[2, 1, 0], [2, 0, 1]]
    np.testing.assert_allclose(np.abs(ellipses.normals), [[1, 0, 0], [0, 1, 0]], atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(ellipses.semi_axes, axis=2) / ellipses.cutoffs[:, None], [[3, 2], [3, 2]])
    right_handed = np.cross(ellipses.semi_axes[:, 0], ellipses.semi_axes[:, 1])
    assert (np.einsum("ij,ij->i", right_handed, ellipses.normals) > 0).all()


def test_a_layout_with_a_normal_axis_overrules_the_sizes():
    splats = replace(splats_of(np.zeros((1, 3)), np.ones(2)), log_scales=np.log([[0.1, 2.0, 3.0]]), normal_axis=2)
    assert occupancy_ellipses(splats).axes.tolist() == [[1, 0, 2]]


def test_moving_the_scene_moves_the_ellipses():
    splats = ball(80)
    rotation, shift = Rotation.from_rotvec([0.3, -0.8, 0.4]), np.array([5.0, -3.0, 2.0])
    ellipses = occupancy_ellipses(splats)
    others = occupancy_ellipses(moved(splats, rotation, 7.0, shift))
    nodes = others.node_of_row[ellipses.rows]
    np.testing.assert_allclose(others.centers[nodes], 7.0 * rotation.apply(ellipses.centers) + shift, atol=1e-12)
    turned = 7.0 * rotation.apply(ellipses.semi_axes.reshape(-1, 3)).reshape(-1, 2, 3)
    # Rotation matrix → quaternion → matrix leaves a few bits of rounding.
    np.testing.assert_allclose(others.semi_axes[nodes], turned, atol=1e-12)


def test_shuffling_the_file_changes_rows_alone():
    splats = ball(80)
    order = np.random.default_rng(0).permutation(80)
    ellipses, others = occupancy_ellipses(splats), occupancy_ellipses(shuffled(splats, order))
    assert np.array_equal(order[others.rows], ellipses.rows)
    assert np.array_equal(others.semi_axes, ellipses.semi_axes)
    assert np.array_equal(others.node_of_row[others.rows], np.arange(80))


def test_the_sign_and_length_of_a_quaternion_do_not_matter():
    splats = cloud(50)
    factors = np.random.default_rng(0).uniform(-9.0, 9.0, (50, 1))
    one, other = occupancy_ellipses(splats), occupancy_ellipses(replace(splats, quats=splats.quats * factors))
    np.testing.assert_allclose(other.semi_axes, one.semi_axes, atol=1e-12)


def test_each_reason_to_be_inert_is_told():
    splats = ball(12)
    opacities, scales, quats = splats.logit_opacities.copy(), splats.log_scales.copy(), splats.quats.copy()
    thresholds = np.zeros(12)
    opacities[1] = -20.0
    thresholds[2] = 1.0
    quats[3] = 0.0
    scales[4] = -np.inf
    opacities[5], scales[6, 0], quats[7, 2], scales[8, 1] = np.nan, np.nan, np.inf, 70.0
    opacities[9], scales[10, 1], scales[11, 0] = np.inf, -np.inf, -1e10
    splats = replace(splats, logit_opacities=opacities, log_scales=scales, quats=quats, thresholds=thresholds)
    ellipses = occupancy_ellipses(splats)
    reason = InertReason
    broken = [reason.NON_FINITE] * 4
    expected = [0, reason.TRANSPARENT, reason.THRESHOLD, reason.ZERO_QUATERNION, reason.ZERO_SIZE, *broken, 0, 0, 0]
    assert ellipses.inert.tolist() == expected
    assert sorted(ellipses.rows) == [0, 9, 10, 11]
    assert (ellipses.node_of_row[ellipses.inert > 0] == -1).all()
    # An opaque splat reaches where its kernel falls to 1/255; a needle keeps a little width.
    assert np.isclose(ellipses.cutoffs[ellipses.node_of_row[9]], np.sqrt(2.0 * np.log(255.0)))
    lengths = np.linalg.norm(ellipses.semi_axes[ellipses.node_of_row[[10, 11]]], axis=2)
    np.testing.assert_allclose(lengths[:, 1] / lengths[:, 0], 1e-4)


def test_a_scene_of_inert_splats_has_no_ellipse():
    splats = replace(ball(5), logit_opacities=np.full(5, -30.0))
    ellipses = occupancy_ellipses(splats)
    assert ellipses.n_nodes == 0 and ellipses.n_splats == 5 and ellipses.scene_scale > 0.0


def test_coinciding_splats_have_the_size_of_the_largest():
    ellipses = occupancy_ellipses(splats_of(np.ones((4, 3)), np.array([0.5, 0.2])))
    assert np.isclose(ellipses.scene_scale, 1.0)
    np.testing.assert_allclose(ellipses.subject.center, 1.0, atol=1e-12)


@pytest.mark.parametrize("least", [0.0, 1.0, -0.1])
def test_a_least_contribution_outside_0_to_1_is_rejected(least):
    with pytest.raises(ValueError, match="min_contribution must lie between 0 and 1"):
        occupancy_ellipses(ball(3), min_contribution=least)


def test_it_can_be_stopped_between_any_two_blocks_of_rows():
    splats = cloud(70_000)
    told = []
    ellipses = occupancy_ellipses(splats, progress=told.append)
    assert told == sorted(told) and len(told) > 40
    for at in (1, len(told) // 2, len(told) - 1):
        left = iter(range(at))

        def stop(share, left=left):
            if next(left, None) is None:
                raise Cancelled

        with pytest.raises(Cancelled):
            occupancy_ellipses(splats, progress=stop)
    # Where the blocks end makes no difference.
    rows = np.sort(ellipses.rows[::1000])
    apart, nodes = occupancy_ellipses(splats.at(rows)), ellipses.node_of_row[rows]
    np.testing.assert_array_equal(apart.semi_axes[apart.node_of_row], ellipses.semi_axes[nodes])
