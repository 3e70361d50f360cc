"""Laws of poses: they follow similarities, and stay where a file can hold what they make."""

import numpy as np
import pytest

from splap_editor.core.pose import SCALES, Pose
from splap_editor.core.splats.rotations import quats_to_matrices
from splap_editor.core.splats.splats import LARGEST_COORDINATE

CENTER = np.array([1.0, -2.0, 0.5])


def similarity(rng, scale):
    delta = np.eye(4)
    delta[:3, :3] = scale * quats_to_matrices(rng.normal(size=(1, 4)))[0]
    delta[:3, 3] = rng.normal(size=3)
    return delta


def test_a_moved_pose_is_the_pose_and_then_the_move():
    rng = np.random.default_rng(0)
    pose = Pose().moved(similarity(rng, 1.3), CENTER)
    delta = similarity(rng, 0.7)
    np.testing.assert_allclose(pose.moved(delta, CENTER).matrix(CENTER), delta @ pose.matrix(CENTER), atol=1e-12)


@pytest.mark.parametrize("scale", [1e-6, 1e6])
@pytest.mark.parametrize("shift", [0.0, 1e30])
def test_no_series_of_moves_leads_out_of_single_precision(scale, shift):
    pose, delta = Pose(), np.eye(4) * scale
    delta[:, 3] = shift, -shift, shift, 1.0
    for _ in range(5):
        pose = pose.moved(delta, CENTER)
    assert SCALES[0] <= pose.scale <= SCALES[1]
    assert np.abs(pose.translate).max() <= LARGEST_COORDINATE
    corner = np.append(np.full(3, LARGEST_COORDINATE), 1.0)
    assert np.isfinite((pose.matrix(CENTER) @ corner).astype(np.float32)).all()
