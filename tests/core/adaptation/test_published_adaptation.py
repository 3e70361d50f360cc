"""The paper's own adaptation: its formula, corner by corner, and what it does to shifts and turns."""

import numpy as np
from scipy.spatial.transform import Rotation

from splap_editor.core.adaptation.kernel_adaptation import adapt_kernels
from splap_editor.core.deformer import Deformation
from tests.core.adaptation.bound_scenes import SHIFT, bent, bound, deformation_by, rigid
from tests.core.splat_scenes import ball, joined, sheet


def published_ellipse(binding, deformation, i):
    """Centre and covariance of ellipse i by Eq. 10, corner by corner."""
    ellipses, near = binding.ellipses, binding.neighborhoods
    carriers = [i, *near.indices[near.indptr[i] : near.indptr[i] + 2]]
    center, (v1, v2) = ellipses.centers[i], ellipses.semi_axes[i]
    corners = []
    for along, across in ((1.0, 0.0), (-0.5, np.sqrt(0.75)), (-0.5, -np.sqrt(0.75))):
        corner = center + along * v1 + across * v2
        weights = np.array([1.0 / np.linalg.norm(corner - ellipses.centers[j]) for j in carriers])
        shifts = deformation.positions[carriers] - ellipses.centers[carriers]
        corners.append(corner + weights @ shifts / weights.sum())
    t1, t2, t3 = corners
    mean = (t1 + t2 + t3) / 3.0
    u, w = t1 - mean, (t2 - t3) / np.sqrt(3.0)
    return mean, np.outer(u, u) + np.outer(w, w)


def test_the_published_adaptation_is_its_formula_corner_by_corner():
    binding = bound(ball(200))
    deformation = deformation_by(binding, bent(1.5))
    adapted = adapt_kernels(binding, deformation, method="paper")
    ellipses = binding.ellipses
    for i in range(0, ellipses.n_nodes, 7):
        row = ellipses.rows[i]
        mean, covariance = published_ellipse(binding, deformation, i)
        np.testing.assert_allclose(adapted.means[row], mean, atol=1e-6)
        axes = adapted.axes_f32[row] * ellipses.cutoffs[i]
        np.testing.assert_allclose(axes.T @ axes, covariance, atol=1e-5 * np.trace(covariance))


def test_the_published_adaptation_carries_a_shift_exactly_and_shrinks_what_turns():
    binding = bound(ball(200))
    shifted = adapt_kernels(binding, rigid(binding, Rotation.identity()), method="paper")
    np.testing.assert_allclose(shifted.means, binding.splats.means + SHIFT, atol=1e-12)
    np.testing.assert_allclose(shifted.log_scales, binding.splats.log_scales, atol=1e-6)
    turned = adapt_kernels(binding, rigid(binding, Rotation.from_rotvec([0.0, 0.0, 2.5])), method="paper")
    assert np.median(turned.log_scales - binding.splats.log_scales) < -0.01


def test_the_published_adaptation_keeps_what_rests():
    binding = bound(joined(sheet(100), sheet(100, height=3.0)))
    rest = binding.ellipses.centers
    moved = np.where((rest[:, 2] > 1.0)[:, None], rest + SHIFT, rest)
    adapted = adapt_kernels(binding, Deformation(moved, np.tile(np.eye(3), (len(rest), 1, 1))), method="paper")
    still = binding.splats.means[:, 2] < 1.0
    np.testing.assert_array_equal(adapted.means[still], binding.splats.means[still])
    assert not adapted.changed[still].any()
    assert adapted.changed[~still].all()
