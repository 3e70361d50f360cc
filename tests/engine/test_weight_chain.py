"""A chain of three regions along an arm, as a skeleton would have it: joints bend without a pinch."""

import numpy as np
import pytest

from splap_editor.core.bbw.options import BbwOptions
from splap_editor.core.graph.splat_graph import GraphOptions
from splap_editor.engine.bound_edit import bind, kernels_of
from splap_editor.engine.recipe_edit import edit_of
from splap_editor.engine.surface import surface_of
from splap_editor.io.ply import read_ply
from splap_editor.io.recipe import read_recipe
from splap_editor.resources import resource

TUBE = resource("samples", "tube.ply")
CHAIN = resource("samples", "tube_chain.json")


@pytest.fixture(scope="module")
def surface():
    return surface_of(read_ply(TUBE).splats, GraphOptions())


def sections(means):
    """Nodes of thin slices across the arm, from one capped end to the other."""
    t = np.linspace(-1.0, 1.0, 4001)
    curve = np.stack([1.1 * t, np.zeros_like(t), 0.55 * np.sqrt(t**2 + 0.06) - 0.3], axis=1)
    nearest = ((means[:, None, [0, 2]] - curve[None, ::10, [0, 2]]) ** 2).sum(axis=2).argmin(axis=1)
    places = t[::10][nearest]
    return [np.flatnonzero(np.abs(places - at) < 0.04) for at in np.linspace(-0.85, 0.85, 35)]


def radii(points):
    """The two half-widths of a ring of points across its own axis."""
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return spread[:2] * np.sqrt(2.0 / len(points))


def bent(surface, blending):
    edit = edit_of(read_recipe(CHAIN), surface.binding.splats).with_options(BbwOptions(blending=blending))
    deformer = bind(surface, edit).deformer
    return deformer, deformer.solve(edit.transforms), edit


def test_the_joints_of_a_chain_keep_the_girth_of_the_arm(surface):
    rest = surface.ellipses.centers
    _, deformation, edit = bent(surface, "dual-quaternion")
    assert np.linalg.norm(deformation.positions - rest, axis=1).max() > 0.5, "the arm bends"
    for nodes in sections(rest):
        ratio = radii(deformation.positions[nodes]) / radii(rest[nodes])
        # A slice has a few dozen splats; where it bends it also shears a little.
        assert np.abs(ratio - 1.0).max() < 0.1
    kernels = kernels_of(surface, edit, deformation)
    assert np.isfinite(kernels.means).all()


def test_each_joint_passes_from_one_handle_to_the_next(surface):
    weights = bent(surface, "dual-quaternion")[0].weights
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-12)
    means = np.array([weights[nodes].mean(axis=0) for nodes in sections(surface.ellipses.centers)])
    assert (np.diff(means[:, 0]) < 0.02).all() and (np.diff(means[:, 2]) > -0.02).all()
    assert means[:, 1].max() > 0.99 and means[[0, -1], 1].max() < 0.05


def test_linear_blending_pinches_more_than_dual_quaternions(surface):
    rest = surface.ellipses.centers
    thinnest = {}
    for blending in ("dual-quaternion", "linear"):
        positions = bent(surface, blending)[1].positions
        thinnest[blending] = min((radii(positions[n]) / radii(rest[n])).min() for n in sections(rest))
    assert thinnest["linear"] <= thinnest["dual-quaternion"]
