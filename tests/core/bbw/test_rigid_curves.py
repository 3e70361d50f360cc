"""Laws of curves through motions."""

import numpy as np
import pytest

from splap_editor.core.bbw.rigid_curves import rigid_curve, rigid_exp, rigid_log, scale_curve, screw_blend
from splap_editor.core.splats.rotations import quats_to_matrices

TIMES = np.array([1.0, 4.0, 5.0, 11.0])


def motions(n, seed=0, turn=2.5):
    """(n, 4, 4) rigid motions, each turned by up to ``turn`` radians from the one before."""
    rng = np.random.default_rng(seed)
    twists = rng.normal(size=(n, 6))
    twists[:, :3] *= turn * rng.uniform(0.1, 1.0, (n, 1)) / np.linalg.norm(twists[:, :3], axis=1, keepdims=True)
    found = [rigid_exp(twists[0])]
    for twist in twists[1:]:
        found.append(found[-1] @ rigid_exp(twist))
    return np.array(found)


@pytest.mark.parametrize("angle", [0.0, 1e-13, 1e-7, 1e-3, 0.5, 2.0, 3.1415])
def test_log_undoes_exp(angle):
    rng = np.random.default_rng(3)
    axis = rng.normal(size=3)
    twist = np.concatenate([angle * axis / np.linalg.norm(axis), rng.normal(size=3)])
    # Close to a half turn the log of the matrix loses half of its digits.
    np.testing.assert_allclose(rigid_log(rigid_exp(twist)), twist, atol=1e-9)


def test_half_turns_go_the_same_way_whatever_the_last_digit():
    axis = np.array([0.0, -0.6, 0.8])
    twists = [
        rigid_log(rigid_exp(np.concatenate([(np.pi + noise) * axis, [1.0, 2.0, 3.0]])))
        for noise in (-1e-15, 0.0, 1e-15)
    ]
    np.testing.assert_allclose(twists, np.broadcast_to(twists[0], (3, 6)), atol=1e-7)


def test_a_blend_does_not_depend_on_the_frames_it_is_expressed_in():
    a, b, left, right = motions(4, seed=5)
    np.testing.assert_allclose(
        screw_blend(left @ a @ right, left @ b @ right, 0.3), left @ screw_blend(a, b, 0.3) @ right, atol=1e-12
    )


@pytest.mark.parametrize("is_smooth", [True, False])
def test_a_curve_passes_through_its_keys_and_stands_still_outside(is_smooth):
    keys = motions(4)
    for time, key in zip(TIMES, keys, strict=True):
        np.testing.assert_array_equal(rigid_curve(TIMES, keys, time, is_smooth=is_smooth), key)
        np.testing.assert_allclose(rigid_curve(TIMES, keys, time - 1e-9, is_smooth=is_smooth), key, atol=1e-7)
    np.testing.assert_array_equal(rigid_curve(TIMES, keys, -3.0, is_smooth=is_smooth), keys[0])
    np.testing.assert_array_equal(rigid_curve(TIMES, keys, 99.0, is_smooth=is_smooth), keys[-1])


@pytest.mark.parametrize("is_smooth", [True, False])
def test_rigid_stays_rigid(is_smooth):
    keys = motions(4)
    for time in np.linspace(0.0, 12.0, 61):
        motion = rigid_curve(TIMES, keys, time, is_smooth=is_smooth)
        np.testing.assert_allclose(motion[:3, :3] @ motion[:3, :3].T, np.eye(3), atol=1e-13)
        assert np.linalg.det(motion[:3, :3]) == pytest.approx(1.0)


@pytest.mark.parametrize("is_smooth", [True, False])
def test_a_curve_between_equal_keys_is_constant(is_smooth):
    first, same, last = motions(3)
    keys = np.array([first, same, same, last])
    for time in np.linspace(4.0, 5.0, 7):
        np.testing.assert_allclose(rigid_curve(TIMES, keys, time, is_smooth=is_smooth), same, atol=1e-12)


def test_a_smooth_curve_has_no_corners():
    keys = motions(4, turn=1.0)
    for time in TIMES[1:-1]:
        step = 1e-5
        before, at, after = (rigid_curve(TIMES, keys, time + d, is_smooth=True) for d in (-step, 0.0, step))
        left, right = (at - before) / step, (after - at) / step
        # First differences: their error is of the order of the step.
        np.testing.assert_allclose(left, right, atol=1e-3)


def test_a_smooth_curve_turns_with_the_world():
    keys, turned = motions(4), np.eye(4)
    turned[:3, :3] = quats_to_matrices(np.array([[0.5, 0.1, -0.7, 0.3]]))[0]
    for time in (2.0, 4.5, 9.0):
        direct = rigid_curve(TIMES, turned @ keys @ turned.T, time, is_smooth=True)
        np.testing.assert_allclose(
            direct, turned @ rigid_curve(TIMES, keys, time, is_smooth=True) @ turned.T, atol=1e-12
        )


@pytest.mark.parametrize("is_smooth", [True, False])
def test_scales_stay_between_their_keys_and_pass_through_them(is_smooth):
    rng = np.random.default_rng(8)
    for _ in range(50):
        scales = rng.uniform(0.001, 2.0, (4, 3)) ** 3
        for time, key in zip(TIMES, scales, strict=True):
            np.testing.assert_array_equal(scale_curve(TIMES, scales, time, is_smooth=is_smooth), key)
        for k in range(3):
            low, high = np.minimum(scales[k], scales[k + 1]), np.maximum(scales[k], scales[k + 1])
            for time in np.linspace(TIMES[k], TIMES[k + 1], 9):
                scale = scale_curve(TIMES, scales, time, is_smooth=is_smooth)
                assert (low <= scale).all() and (scale <= high).all()


def test_smooth_scales_rise_all_the_way_where_their_keys_do():
    scales = np.array([[1.0], [1.2], [2.0], [2.1]])
    values = [scale_curve(TIMES, scales, t, is_smooth=True)[0] for t in np.linspace(1.0, 11.0, 200)]
    assert np.all(np.diff(values) > 0.0)
