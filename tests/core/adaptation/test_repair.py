"""Laws of splitting what a deformation draws out."""

from dataclasses import replace

import numpy as np
import pytest

from splap_editor.core.adaptation.kernel_adaptation import adapt_kernels, adapted_splats
from splap_editor.core.adaptation.repair import (
    MOST_CHILDREN,
    child_offsets,
    child_opacities,
    child_width,
    repaired,
)
from splap_editor.core.progress import Cancelled
from splap_editor.core.splats.rotations import matrices_to_quats, quats_to_matrices
from tests.core.adaptation.bound_scenes import bent, bound, deformation_by, rigid
from tests.core.splat_scenes import sheet, splats_of

FIELDS = ("means", "log_scales", "quats", "logit_opacities", "sh0", "shN")
LONG = np.array([3.0, 1.0, 1.0])


def drawn(scene, mapping):
    """Kernels of a scene after a map, and its splats."""
    binding = bound(scene)
    kernels = adapt_kernels(binding, deformation_by(binding, mapping))
    return kernels, adapted_splats(scene, kernels)


def covariances(splats):
    frames = quats_to_matrices(np.asarray(splats.quats))[:, :, : splats.n_scales]
    return np.einsum("nik,nk,njk->nij", frames, splats.scales**2, frames)


def children_of(repair, row, n):
    return np.concatenate([[row], n + np.flatnonzero(repair.copied == row)])


def variants():
    scene = sheet(225)
    thick = np.column_stack([scene.log_scales, np.full(scene.n_splats, np.log(0.002))])
    cycled = quats_to_matrices(scene.quats)[:, :, [2, 0, 1]]
    return {
        "two scales": scene,
        "normal first": replace(scene, log_scales=thick[:, [2, 0, 1]], quats=matrices_to_quats(cycled)),
        "filtered": replace(scene, log_scales=thick, filter_radii=np.full(scene.n_splats, 0.01)),
        "raw quaternions": replace(scene, quats=-2.5 * scene.quats),
    }


@pytest.mark.parametrize("opacity", [0.02, 0.3, 0.7, 0.98])
@pytest.mark.parametrize("count", [3, 5, 7, MOST_CHILDREN])
def test_children_blend_to_what_their_parent_did(count, opacity):
    x, heights = np.linspace(-4.0, 4.0, 161), np.exp(-0.5 * np.linspace(0.0, 3.0, 7) ** 2)[:, None, None]
    shapes = np.exp(-0.5 * ((x - child_offsets(count)[:, None]) / child_width(count)) ** 2)
    opacities = child_opacities(count, np.array([opacity]))[0]
    found = 1.0 - np.prod(1.0 - heights * opacities[:, None] * shapes, axis=1)
    wanted = opacity * heights[:, 0] * np.exp(-0.5 * x**2)
    # Gaussians that hide each other are no Gaussian: the fit leaves this much, and next to nothing of a faint one.
    assert np.abs(found - wanted).max() < 0.08 * opacity + 0.07 * opacity**3
    np.testing.assert_allclose(opacities, opacities[::-1], atol=1e-12)
    assert (opacities > 0.0).all() and (opacities < 1.0).all()


def test_denser_parents_have_denser_children():
    opacities = child_opacities(5, np.linspace(0.0, 1.0, 60))
    assert (np.diff(opacities, axis=0) >= 0.0).all() and not opacities[0].any() and (opacities < 1.0).all()


@pytest.mark.parametrize("scale", [1.0, 3.0])
def test_what_is_moved_or_magnified_as_one_is_not_split(scale):
    binding = bound(sheet(150))
    kernels = adapt_kernels(binding, rigid(binding, scale=scale))
    assert repaired(adapted_splats(binding.splats, kernels), kernels, 1.2) is None


@pytest.mark.parametrize("name", variants())
def test_splats_of_a_sheet_drawn_out_evenly_become_rows_of_smaller_ones(name):
    scene = variants()[name]
    kernels, posed = drawn(scene, lambda p: p * LONG)
    repair = repaired(posed, kernels, 2.0)
    n, row = scene.n_splats, 112
    rows = children_of(repair, row, n)
    assert repair.n_split == n and repair.splats.n_splats == n + len(repair.copied) and len(rows) == 5
    made = repair.splats.at(rows)
    # The stretch and the split are known: Σ' = F (Σ - (1 - w²) r² v vᵀ) Fᵀ along the x axis.
    width, rest = child_width(len(rows)), covariances(scene.at(np.array([row])))[0]
    reach = 1.0 / np.sqrt(np.linalg.pinv(rest, rcond=1e-2)[0, 0])
    wanted = rest.copy()
    wanted[0, 0] -= (1.0 - width**2) * reach**2
    wanted *= LONG[:, None] * LONG
    # A node's own stretch is read with some damping, so it is off by some hundredths.
    for covariance in covariances(made):
        np.testing.assert_allclose(covariance[:2, :2], wanted[:2, :2], atol=0.05 * wanted.max())
    places = np.sort(made.means[:, 0]) - 3.0 * scene.means[row, 0]
    np.testing.assert_allclose(places, 3.0 * reach * child_offsets(len(rows)), atol=0.1 * reach)
    np.testing.assert_allclose(made.means[:, 1:], np.tile(scene.means[row, 1:], (len(rows), 1)), atol=0.1 * reach)
    np.testing.assert_allclose(np.linalg.norm(made.quats, axis=1), np.linalg.norm(scene.quats[row]), rtol=1e-9)
    in_order = made.opacities[np.argsort(made.means[:, 0])]
    np.testing.assert_allclose(in_order, child_opacities(len(rows), posed.opacities[[row]])[0], rtol=1e-6)
    for part in ("sh0", "shN"):
        np.testing.assert_array_equal(getattr(made, part), np.repeat(getattr(posed, part)[[row]], len(rows), axis=0))


def test_only_what_is_drawn_out_is_split_and_all_else_stays_bit_for_bit():
    scene = sheet(400)
    kernels, posed = drawn(scene, lambda p: np.column_stack([p[:, 0] + np.maximum(p[:, 0] - 0.5, 0.0) * 2.0, p[:, 1:]]))
    repair = repaired(posed, kernels, 2.0)
    split = np.unique(repair.copied)
    assert repair.n_split == len(split) and 100 < len(split) < 250
    assert scene.means[split, 0].min() > 0.4
    whole = np.setdiff1d(np.arange(scene.n_splats), split)
    for part in FIELDS:
        np.testing.assert_array_equal(getattr(repair.splats, part)[whole], getattr(posed, part)[whole])


def test_children_lie_on_the_bent_surface_that_their_parents_stand_off():
    # Long splats along a sheet that is drawn out and rolled up, among small ones that tell where it goes.
    small = sheet(400)
    long = splats_of(np.column_stack([np.full(8, 0.5), np.linspace(0.2, 0.8, 8), np.zeros(8)]), [[0.3, 0.02]])
    scene = replace(small, **{part: np.concatenate([getattr(small, part), getattr(long, part)]) for part in FIELDS})
    radius = 0.8
    kernels, posed = drawn(scene, lambda p: bent(radius)(p * LONG))
    repair = repaired(posed, kernels, 1.5)

    def farthest_off(splats):
        """Of the ends of splats, two standard deviations out, from the cylinder that the sheet is."""
        frames = quats_to_matrices(np.asarray(splats.quats))
        off = []
        for sign in (-2.0, 2.0):
            for axis in (0, 1):
                ends = splats.means + sign * frames[:, :, axis] * splats.scales[:, axis, None]
                off.append(np.abs(np.hypot(ends[:, 0], ends[:, 2] - radius) - radius))
        return np.max(off)

    rows = np.concatenate([children_of(repair, row, scene.n_splats) for row in range(400, 408)])
    assert farthest_off(repair.splats.at(rows)) < 0.5 * farthest_off(posed.at(np.arange(400, 408)))


def test_a_repair_can_be_cancelled():
    kernels, posed = drawn(sheet(49), lambda p: p * LONG)

    def cancel(share):
        raise Cancelled

    with pytest.raises(Cancelled):
        repaired(posed, kernels, 2.0, cancel)
