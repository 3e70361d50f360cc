"""Laws of the numbers that splats are coloured by."""

from dataclasses import replace

import numpy as np
import pytest

from splap_editor.core.adaptation.kernel_adaptation import AdaptedKernels
from splap_editor.core.deformer import Deformation
from splap_editor.core.graph.splat_graph import GraphOptions
from splap_editor.core.handle_nodes import Region
from splap_editor.core.splats.rotations import quats_to_matrices
from splap_editor.engine.bound_edit import bind, kernels_of
from splap_editor.engine.edit import Edit, Handle, Pose
from splap_editor.engine.quantities import QUANTITIES, Snapshot, column_names, columns_of, missing, principal_stretches
from splap_editor.engine.surface import Surface, surface_of
from splap_editor.io.ply import read_ply
from splap_editor.resources import resource

AT_REST = {"displacement": 0.0, "stretch": 1.0, "least_stretch": 1.0, "rotation": 0.0}


@pytest.fixture(scope="module")
def snapshot() -> Snapshot:
    """The tube with a dozen faint splats among it, all that any quantity needs at hand."""
    splats = read_ply(resource("samples", "tube.ply")).splats
    logits = np.array(splats.logit_opacities)
    logits[::200] = -20.0
    splats = replace(splats, logit_opacities=logits)
    surface = surface_of(splats, GraphOptions())
    edit = Edit(handles=(Handle(1, "end", "#ffffff", Region(surface.ellipses.centers[0], 0.2)),), method="bbw")
    bound = bind(surface, edit)
    return Snapshot(
        splats, surface.ellipses, surface, None, bound.handles, bound.weights, 0, int(surface.ellipses.rows[0])
    )


def moved(surface: Surface, A: np.ndarray, shift: np.ndarray) -> AdaptedKernels:
    """Every node under one affine map."""
    U, _, Vt = np.linalg.svd(A)
    n = surface.ellipses.n_nodes
    deformation = Deformation(surface.ellipses.centers @ A.T + shift, np.broadcast_to(U @ Vt, (n, 3, 3)).copy())
    return kernels_of(surface, Edit(), deformation)


@pytest.mark.parametrize("name", QUANTITIES)
def test_each_is_one_number_a_splat_and_undefined_only_where_it_says_so(snapshot, name):
    values = QUANTITIES[name].values(snapshot)
    assert values.shape == (snapshot.splats.n_splats,) and values.dtype == np.float64
    inert = snapshot.ellipses.inert > 0
    assert np.isfinite(values[~inert]).all()
    if (QUANTITIES[name].needs and name != "weight") or name in ("size", "stretch", "least_stretch"):
        assert np.isnan(values[inert]).all()


@pytest.mark.parametrize("name", AT_REST)
def test_at_rest_nothing_has_changed(snapshot, name):
    values = QUANTITIES[name].values(snapshot)
    assert (values[np.isfinite(values)] == AT_REST[name]).all()


def test_a_rigid_motion_turns_and_does_not_stretch(snapshot):
    quat = np.array([[np.cos(0.35), 0.0, np.sin(0.35), 0.0]])
    R, shift = quats_to_matrices(quat)[0], np.array([0.3, -0.2, 0.1])
    posed = replace(snapshot, kernels=moved(snapshot.surface, R, shift))
    rows = snapshot.ellipses.rows
    np.testing.assert_allclose(QUANTITIES["rotation"].values(posed)[rows], np.degrees(0.7), atol=1e-6)
    # Stretches are roots of areas: they have half of the digits that the corners of the ellipse have.
    np.testing.assert_allclose(principal_stretches(posed)[rows], 1.0, atol=1e-6)
    expected = np.linalg.norm(snapshot.ellipses.centers @ (R - np.eye(3)).T + shift, axis=1)
    np.testing.assert_allclose(QUANTITIES["displacement"].values(posed)[rows], expected, atol=1e-8)


def test_stretches_are_the_singular_values_of_the_map_within_the_splats_plane(snapshot):
    surface = snapshot.surface
    A = quats_to_matrices(np.array([[0.9, 0.1, 0.3, -0.2]]))[0] @ np.diag([1.3, 0.8, 1.1])
    posed = replace(snapshot, kernels=moved(surface, A, np.zeros(3)))
    axes = surface.ellipses.semi_axes / np.linalg.norm(surface.ellipses.semi_axes, axis=2, keepdims=True)
    expected = np.linalg.svd(np.einsum("ij,nkj->nik", A, axes), compute_uv=False)
    # Maps of neighbourhoods are drawn to a similarity by 2 % of their spread, across the surface above all.
    found = principal_stretches(posed)[surface.ellipses.rows]
    assert np.median(np.abs(found - expected)) < 0.01
    assert np.quantile(np.abs(found - expected), 0.9) < 0.05


def test_uniform_scaling_stretches_alike_in_all_directions(snapshot):
    posed = replace(snapshot, kernels=moved(snapshot.surface, 2.0 * np.eye(3), np.zeros(3)))
    np.testing.assert_allclose(principal_stretches(posed)[snapshot.ellipses.rows], 2.0, atol=1e-6)


def test_distance_is_zero_at_the_picked_splat_and_obeys_the_triangle_inequality_along_edges(snapshot):
    values = QUANTITIES["geodesic"].values(snapshot)
    assert values[snapshot.picked] == 0.0
    graph, rows = snapshot.surface.graph, snapshot.ellipses.rows
    ends = values[rows[graph.edges]]
    lengths = graph.matrix()[graph.edges[:, 0], graph.edges[:, 1]]
    assert (np.abs(ends[:, 0] - ends[:, 1]) <= lengths + 1e-12).all()


def test_degrees_count_both_ends_of_each_edge(snapshot):
    assert np.nansum(QUANTITIES["degree"].values(snapshot)) == 2 * snapshot.surface.graph.n_edges


def test_an_inert_splat_has_the_mean_weight_of_those_that_carry_it(snapshot):
    weight, ellipses, binding = QUANTITIES["weight"].values(snapshot), snapshot.ellipses, snapshot.surface.binding
    inert = np.flatnonzero(ellipses.inert > 0)
    assert len(inert) and np.isfinite(weight).all()
    for row, carriers, shares in zip(inert, binding.inert_carriers, binding.inert_weights, strict=True):
        assert weight[row] == pytest.approx(weight[ellipses.rows[carriers]] @ shares, abs=1e-12)


def test_what_is_held_has_the_handles_whole_weight(snapshot):
    state, weight = QUANTITIES["free"].values(snapshot), QUANTITIES["weight"].values(snapshot)
    assert (weight[state == 1.0] == 1.0).all() and (state == 1.0).any() and (state == 2.0).any()


def test_flatness_of_thick_splats_is_smallest_by_middle(snapshot):
    splats = replace(snapshot.splats, log_scales=np.log([[1.0, 0.5, 0.1]] * snapshot.splats.n_splats))
    np.testing.assert_allclose(QUANTITIES["flatness"].values(replace(snapshot, splats=splats)), 0.2)


def test_what_lacks_says_what_it_waits_for(snapshot):
    bare = Snapshot(snapshot.splats, snapshot.ellipses)
    assert not missing(QUANTITIES["alpha"], bare)
    assert "surface" in missing(QUANTITIES["degree"], bare)
    assert "Inspect" in missing(QUANTITIES["geodesic"], replace(bare, surface=snapshot.surface))
    with pytest.raises(ValueError, match="'degree' needs the surface"):
        columns_of(["degree"], bare)
    with pytest.raises(ValueError, match="there is no quantity 'colour'; there are alpha"):
        column_names("size, colour")


def test_columns_are_the_values_by_name(snapshot):
    columns = columns_of(["size", "stretch"], snapshot)
    assert list(columns) == ["size", "stretch"]
    np.testing.assert_array_equal(columns["size"], QUANTITIES["size"].values(snapshot))


def test_the_pose_of_a_bent_tube_is_stretched_both_ways(snapshot):
    surface = snapshot.surface
    edit = Edit(handles=(Handle(1, "end", "#ffffff", Region(surface.ellipses.centers[0], 0.2), Pose((0.3, 0.0, 0.2))),))
    stretches = principal_stretches(replace(snapshot, kernels=bind(surface, edit).pose().kernels))[
        surface.ellipses.rows
    ]
    assert (stretches[:, 0] >= stretches[:, 1] - 1e-12).all() and (stretches > 0.0).all()
    assert stretches[:, 0].max() > 1.02 and stretches[:, 1].min() < 0.98
