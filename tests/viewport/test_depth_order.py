import numpy as np
import pytest

from splap_editor.viewport.depth_order import depth_order


def test_order_is_a_permutation_that_falls_in_depth():
    rng = np.random.default_rng(0)
    means = rng.normal(size=(5000, 3)).astype(np.float32)
    direction = np.array([0.3, -0.5, 0.8])
    order = depth_order(means, direction)
    depths = means[order] @ direction
    np.testing.assert_array_equal(np.sort(order), np.arange(5000))
    # Depths are quantised to 16 bits of their range.
    assert np.diff(depths).max() <= np.ptp(depths) / 65535 * 1.01


def test_equal_depths_keep_file_order():
    means = np.zeros((100, 3), np.float32)
    np.testing.assert_array_equal(depth_order(means, np.array([0.0, 0.0, 1.0])), np.arange(100))


def test_no_and_one_splat_have_an_order():
    assert len(depth_order(np.zeros((0, 3), np.float32), np.array([0.0, 0.0, 1.0]))) == 0
    np.testing.assert_array_equal(depth_order(np.ones((1, 3), np.float32), np.array([0.0, 1.0, 0.0])), [0])


def test_rejects_double_precision():
    with pytest.raises(ValueError, match="float32"):
        depth_order(np.zeros((4, 3)), np.array([0.0, 0.0, 1.0]))


@pytest.mark.parametrize("value", [3e38, -3e38, np.inf, -np.inf, np.nan])
def test_depths_that_are_not_finite_leave_a_permutation(value):
    means = np.random.default_rng(0).normal(size=(300, 3)).astype(np.float32)
    means[::7] = value
    for direction in ((1.0, 1.0, 1.0), (0.0, 0.0, -1.0), (1e38, 1e38, 0.0)):
        order = depth_order(means, np.array(direction))
        np.testing.assert_array_equal(np.sort(order), np.arange(300))
