"""Laws of who makes up the surface and who follows it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from splap_editor.core.adaptation.kernel_adaptation import adapt_kernels
from splap_editor.core.deformer import Deformation
from splap_editor.core.graph.carriers import SOLID, carriers_of, carrying
from splap_editor.core.graph.options import CARRIERS, GraphOptions
from splap_editor.core.splats.occupancy import InertReason, occupancy_ellipses
from splap_editor.core.splats.splats import Splats
from splap_editor.engine.surface import surface_of


def hazy_sheets(gap=0.2, n=18, seed=0) -> Splats:
    """Two sheets that nothing joins but the haze between them."""
    rng = np.random.default_rng(seed)
    x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1.3, n)))
    flat = np.stack([x, y, np.zeros_like(x)], 1) + rng.normal(0, 0.004, (n * n, 3))
    haze = rng.uniform(0, 1, (n * n // 2, 3)) * [1.0, 1.3, gap]
    means = np.concatenate([flat, flat + np.array([0, 0, gap]), haze])
    quats = np.tile([1.0, 0.0, 0.0, 0.0], (len(means), 1))
    quats[2 * n * n :] = rng.standard_normal((len(haze), 4))
    opacities = np.concatenate([np.full(2 * n * n, 0.9), np.full(len(haze), 0.05)])
    return Splats(
        means=means,
        log_scales=np.full((len(means), 2), np.log(0.03)),
        quats=quats,
        logit_opacities=np.log(opacities / (1 - opacities)),
        sh0=np.zeros((len(means), 3)),
        shN=np.zeros((len(means), 0, 3)),
    )


def thick(splats: Splats) -> Splats:
    """The same with a thickness, as 3DGS has it."""
    return replace(splats, log_scales=np.column_stack([splats.log_scales, splats.log_scales[:, 0] - 1.0]))


def carriers_by(splats, name, **mends):
    ellipses = occupancy_ellipses(splats)
    return carrying(ellipses, carriers_of(ellipses, splats, GraphOptions(carriers=name, **mends)))


def test_faint_splats_follow_and_the_others_carry():
    splats = hazy_sheets()
    ellipses = occupancy_ellipses(splats)
    carriers = carriers_by(splats, "solid")
    faint = splats.opacities < SOLID
    np.testing.assert_array_equal(np.sort(carriers.rows), np.flatnonzero(~faint))
    assert (carriers.inert[faint] == InertReason.FOLLOWS).all() and (carriers.inert[~faint] == 0).all()
    np.testing.assert_array_equal(carriers.centers, splats.means[carriers.rows])
    assert carriers.scene_scale == ellipses.scene_scale
    assert (ellipses.inert == 0).all()


@pytest.mark.parametrize(("name", "logit"), [("all", -4.0), ("all", 2.0), ("solid", 2.0), ("solid", -4.0)])
def test_where_all_are_alike_all_carry(name, logit):
    splats = replace(hazy_sheets(), logit_opacities=np.full(hazy_sheets().n_splats, logit))
    ellipses = occupancy_ellipses(splats)
    carries = carriers_of(ellipses, splats, GraphOptions(carriers=name))
    assert carrying(ellipses, carries) is ellipses


def test_by_default_the_faint_follow_among_thick_splats_and_carry_among_flat_ones():
    flat = hazy_sheets()
    faint = np.flatnonzero(flat.opacities < SOLID)
    assert GraphOptions().carriers == "auto"
    assert carriers_by(flat, "auto").n_nodes == flat.n_splats
    thin = replace(thick(flat), log_scales=np.add(thick(flat).log_scales, [0.0, 0.0, -3.0]))
    assert carriers_by(thin, "auto").n_nodes == flat.n_splats
    np.testing.assert_array_equal(np.sort(np.flatnonzero(carriers_by(thick(flat), "auto").inert)), faint)


def test_where_most_splats_are_faint_the_surface_is_made_of_them():
    splats = thick(hazy_sheets())
    logits = splats.logit_opacities.copy()
    logits[: int(0.6 * len(logits))] = -3.0
    mostly_faint = replace(splats, logit_opacities=logits)
    assert carriers_by(mostly_faint, "auto").n_nodes == splats.n_splats
    assert carriers_by(mostly_faint, "solid").n_nodes == np.count_nonzero(mostly_faint.opacities >= SOLID)


def test_what_an_older_mend_names_carries_by_default():
    splats = thick(hazy_sheets())
    faint = int(np.flatnonzero(splats.opacities < SOLID)[0])
    options = GraphOptions(cut=((0, faint),), add=((1, faint),))
    surface = surface_of(splats, options)
    assert surface.ellipses.node_of_row[faint] >= 0
    assert surface.ellipses.n_nodes == carriers_by(splats, "auto").n_nodes + 1
    # Going on from it or from another gives the same.
    bare = surface_of(splats, GraphOptions(), ellipses=surface.visible, near=surface)
    assert bare.ellipses.node_of_row[faint] < 0
    again = surface_of(splats, options, ellipses=surface.visible, near=bare)
    np.testing.assert_array_equal(again.L.toarray(), surface.L.toarray())
    with pytest.raises(ValueError, match="not in the file"):
        surface_of(splats, GraphOptions(cut=((0, splats.n_splats),)))


def test_no_way_leads_through_haze():
    splats = thick(hazy_sheets())
    parts = {}
    for name in CARRIERS:
        surface = surface_of(splats, GraphOptions(carriers=name))
        means = splats.means[surface.ellipses.rows]
        above = means[surface.graph.edges, 2] > 0.1
        parts[name] = np.count_nonzero(above[:, 0] != above[:, 1])
    # The sheets are 0.2 apart and their splats reach less than 0.1 out of their planes.
    assert parts["all"] > 20 and parts["solid"] == parts["auto"] == 0


def test_followers_move_and_turn_with_a_rigid_motion_of_the_carriers():
    splats = hazy_sheets()
    surface = surface_of(splats, GraphOptions(carriers="solid"))
    R, shift = Rotation.random(random_state=1).as_matrix(), np.array([0.3, -1.0, 2.0])
    n = surface.ellipses.n_nodes
    moved = Deformation(surface.rest @ R.T + shift, np.broadcast_to(R, (n, 3, 3)).copy())
    kernels = adapt_kernels(surface.binding, moved)
    np.testing.assert_allclose(kernels.means, splats.means @ R.T + shift, atol=1e-8)
    np.testing.assert_allclose(kernels.rotations, np.broadcast_to(R, kernels.rotations.shape), atol=1e-8)


def test_a_mend_goes_on_from_the_surface_before_it_and_may_not_name_a_follower():
    splats = hazy_sheets()
    ellipses = occupancy_ellipses(splats)
    before = surface_of(splats, GraphOptions(carriers="solid"), ellipses=ellipses)
    rows = tuple(before.ellipses.rows[before.graph.edges[0]].tolist())
    options = replace(before.options, cut=(rows,))
    after = surface_of(splats, options, ellipses=ellipses, near=before)
    assert after.ellipses is before.ellipses and after.graph.n_edges == before.graph.n_edges - 1
    afresh = surface_of(splats, options)
    np.testing.assert_array_equal(after.L.toarray(), afresh.L.toarray())
    with pytest.raises(ValueError, match="inert"):
        surface_of(splats, replace(before.options, cut=((0, splats.n_splats - 1),)))
