import re
from itertools import pairwise
from types import SimpleNamespace

import igl
import numpy as np
import pytest
import scipy.sparse as sp

from splap_editor.core.bbw.bbw import BbwDeformer, bbw_weights
from splap_editor.core.bbw.binding import bind_bbw
from splap_editor.core.bbw.options import BbwOptions
from splap_editor.core.bbw.weights import bbw_problem, handle_weight
from splap_editor.core.binding import Binding
from splap_editor.core.deformer import Handles
from splap_editor.core.progress import Cancelled
from tests.reference.bbw import handles_of, mesh_graph, operators, rigid, sheet, tube, weights_dense

EXACT = BbwOptions(tolerance=1e-10)
# Where the default tolerance is the subject: the weights may be off by 2e-3.
WEIGHT_ERROR = 2e-3


def bound(points, triangles, handles, options=EXACT, **keywords):
    L, M = operators(points, triangles)
    return BbwDeformer(points, L, M, handles, scene_scale=1.0, graph=mesh_graph(points, L), options=options, **keywords)


def disc(points, center, radius):
    return np.flatnonzero(np.linalg.norm(points - center, axis=1) <= radius)


def three_handles(cage=np.inf):
    """A sheet of 299 nodes with three handles and a pinned corner."""
    points, triangles = sheet(23, 13)
    regions = [disc(points, c, 0.12) for c in ([0.4, 0.6, 0], [1.3, 0.3, 0], [1.8, 1.0, 0])]
    return points, triangles, handles_of(points, regions, cage, pins=disc(points, [0, 0, 0], 0.15))


@pytest.mark.parametrize("cage", [np.inf, 0.55, 0.9])
def test_weights_equal_the_dense_reference(cage):
    points, triangles, handles = three_handles(cage)
    L, M = operators(points, triangles)
    problem = bbw_problem(points, L, M, handles, options=EXACT)
    expected = weights_dense(points, L, M, handles)
    for h in range(3):
        solved = handle_weight(problem, h)
        weight = np.zeros(len(points))
        weight[solved.nodes] = solved.values
        # The dense twin squares the condition number of the biharmonic energy.
        np.testing.assert_allclose(weight, expected[:, h], atol=1e-6)
        assert not solved.qp.fallback
        assert solved.qp.kkt_residual < 1e-8


def test_progress_names_the_handle_that_is_worked_on():
    points, triangles, handles = three_handles()
    L, M = operators(points, triangles)
    surface = SimpleNamespace(rest=points, L=L, M=M, graph=mesh_graph(points, L))
    told = []
    bind_bbw(surface, handles, EXACT, Binding(stages=lambda words: lambda share: told.append((words, share))))
    named = [re.fullmatch(r"weights: handle (\d) of 3, (\d+) %", words) for words, _ in told]
    assert all(named)
    first = [int(match[1]) for match in named]
    assert first == sorted(first) and set(first) == {1, 2, 3}


def test_default_tolerance_is_within_the_weight_error_of_the_optimum():
    points, triangles = sheet(110, 60)
    handles = handles_of(
        points, [disc(points, [3.0, 3.0, 0], 0.3), disc(points, [7.0, 2.5, 0], 0.3)], cage=4.5, pins=np.arange(60)
    )
    exact = bound(points, triangles, handles).weights
    usual = bound(points, triangles, handles, BbwOptions()).weights
    assert np.abs(exact - usual).max() < WEIGHT_ERROR


def test_many_levels_and_a_cold_start_have_the_same_optimum():
    points, triangles = sheet(80, 50)
    handles = handles_of(points, [disc(points, [3.0, 2.5, 0], 0.3)], 2.4, pins=disc(points, [4.0, 2.5, 0], 0.3))
    L, M = operators(points, triangles)
    problem = bbw_problem(points, L, M, handles, options=EXACT)
    one_level = type(problem)(**{**vars(problem), "levels": problem.levels[:1], "energies": problem.energies[:1]})
    assert len(problem.levels) > 1
    warm, cold = handle_weight(problem, 0), handle_weight(one_level, 0)
    assert warm.qp.n_factorisations < cold.qp.n_factorisations
    dense = np.zeros((2, len(points)))
    dense[0, warm.nodes], dense[1, cold.nodes] = warm.values, cold.values
    # The optimum is flat where weights vanish: active sets may differ there by what roundoff decides.
    np.testing.assert_allclose(dense[0], dense[1], atol=1e-7)


def test_weights_agree_with_libigl_on_a_mesh():
    points, triangles, handles = three_handles()
    values = np.zeros((len(handles.indices), 4))
    values[np.arange(len(values)), handles.labels] = 1.0  # label -1 is the last column: the pins' own weight
    expected = igl.bbw(points, triangles, handles.indices, values, max_iter=500)
    L, M = operators(points, triangles)
    problem = bbw_problem(points, L, M, handles, options=EXACT)
    for h in range(3):
        solved = handle_weight(problem, h)
        weight = np.zeros(len(points))
        weight[solved.nodes] = solved.values
        # libigl's active set stops on its own terms, and it does not floor the masses.
        assert np.abs(weight - expected[:, h]).max() < 5e-3


@pytest.mark.parametrize("cage", [np.inf, 0.9])
@pytest.mark.parametrize("options", [EXACT, BbwOptions()])
def test_weights_are_a_partition_of_unity_within_bounds(cage, options):
    points, triangles, handles = three_handles(cage)
    weights = bound(points, triangles, handles, options).weights
    assert weights.min() >= -1e-9
    assert weights.max() <= 1 + 1e-9
    rest = 1 - weights.sum(axis=1)
    assert rest.min() >= -1e-12


def test_weights_are_one_and_zero_where_fixed():
    points, triangles, handles = three_handles(0.5)
    weights = bound(points, triangles, handles).weights
    fixed = weights[handles.indices]
    np.testing.assert_array_equal(fixed, np.eye(4)[handles.labels][:, :3])
    for h in range(3):
        own = points[handles.indices[handles.labels == h]]
        far = np.linalg.norm(points[:, None] - own, axis=2).min(axis=1) > 0.5
        assert not weights[far, h].any()


def test_overlapping_cages_keep_the_resting_complement_positive_and_handles_exact():
    points, triangles = sheet(30, 9)
    regions = [disc(points, [x, 0.4, 0], 0.1) for x in (0.8, 1.2, 1.6, 2.0)]
    handles = handles_of(points, regions, cage=0.8)
    deformer = bound(points, triangles, handles)
    assert deformer.weights.sum(axis=1).max() <= 1 + 1e-12
    np.testing.assert_array_equal(deformer.weights[handles.indices], np.eye(4)[handles.labels])


def test_handles_that_share_the_whole_object_leave_nothing_at_rest():
    points, triangles = sheet(23, 13)
    regions = [disc(points, c, 0.12) for c in ([0.4, 0.6, 0], [1.3, 0.3, 0], [1.8, 1.0, 0])]
    weights = bound(points, triangles, handles_of(points, regions)).weights
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-12)


def test_a_lone_handle_of_the_whole_object_carries_all_of_it():
    points, triangles = sheet(15, 10)
    deformer = bound(points, triangles, handles_of(points, [[7]]))
    np.testing.assert_array_equal(deformer.weights, 1.0)
    assert deformer.report.unreachable == ()


def test_weights_do_not_depend_on_rotation_and_scale():
    points, triangles, handles = three_handles(0.7)
    T = rigid([1, 2, 3], 0.8, [5, -3, 1])
    moved = 40.0 * (points @ T[:3, :3].T + T[:3, 3])
    turned = Handles(handles.indices, handles.labels, handles.centers, 40.0 * handles.cage_radii)
    # Roundoff of the cotangents is amplified by the condition number of the biharmonic energy.
    np.testing.assert_allclose(
        bound(points, triangles, handles).weights, bound(moved, triangles, turned).weights, atol=1e-7
    )


def test_weights_do_not_depend_on_the_order_of_nodes():
    points, triangles, handles = three_handles(0.7)
    new_of_old = np.random.default_rng(5).permutation(len(points))
    old_of_new = np.argsort(new_of_old)
    indices = new_of_old[handles.indices]
    order = np.argsort(indices)
    shuffled = Handles(indices[order], handles.labels[order], handles.centers, handles.cage_radii)
    expected = bound(points, triangles, handles).weights[old_of_new]
    weights = bound(points[old_of_new], new_of_old[triangles], shuffled).weights
    np.testing.assert_allclose(weights, expected, atol=1e-7)  # as above


def test_weight_falls_monotonically_along_a_bar_between_two_handles():
    points, triangles = sheet(60, 5, jitter=0.0)
    ends = [np.flatnonzero(points[:, 0] < 0.05), np.flatnonzero(points[:, 0] > 5.85)]
    weights = bound(points, triangles, handles_of(points, ends)).weights
    along = weights[:, 0].reshape(60, 5)
    assert np.diff(along, axis=0).max() <= 1e-9
    np.testing.assert_allclose(along[30:][::-1], 1 - along[:30], atol=1e-7)  # mirror-symmetric up to conditioning


@pytest.mark.parametrize("cage", [0.8, 4.0, np.inf])
@pytest.mark.parametrize("pinned", [True, False])
def test_an_unconnected_sheet_close_by_has_weight_zero(cage, pinned):
    lower, triangles = sheet(70, 45)
    upper = lower + np.array([0.0, 0.0, 0.01])
    points = np.vstack([lower, upper])
    both = np.vstack([triangles, triangles + len(lower)])
    region = disc(lower, [3.0, 2.0, 0.0], 0.3)
    pins = np.array([0, len(lower)]) if pinned else []
    deformer = bound(points, both, handles_of(points, [region], cage, pins))
    assert not deformer.weights[len(lower) :].any()
    assert deformer.weights[: len(lower)].max() == 1.0
    assert deformer.report.n_resting == (0 if pinned else len(lower))


def test_specks_follow_their_nearest_neighbour_as_one():
    points, triangles = sheet(20, 10)
    handles = handles_of(points, [disc(points, [0.4, 0.4, 0], 0.15)], 0.8)
    alone = bound(points, triangles, handles)
    node = int(np.argmin(np.abs(alone.weights[:, 0] - 0.5)))
    speck = points[node] + np.array([[0.0, 0.0, 0.001], [0.01, 0.0, 0.2], [0.0, 0.01, 0.2]])
    n = len(points)
    with_speck = bound(np.vstack([points, speck]), np.vstack([triangles, [[n, n + 1, n + 2]]]), handles)
    np.testing.assert_allclose(with_speck.weights[n:, 0], alone.weights[node, 0], atol=1e-9)
    assert with_speck.report.n_specks == 3


def test_a_speck_prefers_a_neighbour_over_the_graph():
    points, triangles = sheet(20, 10)
    handles = handles_of(points, [disc(points, [0.4, 0.4, 0], 0.15)], 0.8)
    all_points = np.vstack([points, points[:1] + np.array([0, 0, 0.5])])
    L, M = operators(points, triangles)
    L = sp.block_diag([L, sp.csr_array((1, 1))], format="csr")
    linked = sp.csr_array(([0.5, 0.5], ([88, 200], [200, 88])), shape=(201, 201))
    graph = mesh_graph(all_points, L + linked)
    deformer = BbwDeformer(all_points, L, np.append(M, 0.0), handles, scene_scale=1.0, graph=graph)
    assert deformer.weights[88, 0] != deformer.weights[0, 0]
    assert deformer.weights[200, 0] == deformer.weights[88, 0]


def test_a_handle_that_reaches_no_free_node_is_reported():
    left, triangles = sheet(12, 8)
    right = left[:4] + np.array([5.0, 0, 0])
    points = np.vstack([left, right])
    all_triangles = np.vstack([triangles, [[96, 97, 98], [97, 99, 98]]])
    handles = handles_of(points, [disc(points, [0.4, 0.4, 0], 0.15), np.arange(96, 100), []], 0.5)
    deformer = bound(points, all_triangles, handles)
    assert deformer.report.unreachable == (1, 2)
    np.testing.assert_array_equal(deformer.weights[96:, 1], 1.0)


def test_the_fallback_gives_the_same_weights_and_is_reported():
    points, triangles, handles = three_handles(0.7)
    fallback = bound(points, triangles, handles, BbwOptions(max_factorisations=0))
    assert all(qp.fallback for qp in fallback.report.handles)
    difference = np.abs(fallback.weights - bound(points, triangles, handles).weights)
    assert difference.max() < 1e-5  # the interior point stops short of the bounds


def test_handles_solved_side_by_side_give_the_same_deformer():
    points, triangles, handles = three_handles(0.7)
    L, M = operators(points, triangles)
    problem = bbw_problem(points, L, M, handles, options=EXACT)
    solved = [handle_weight(problem, h) for h in (2, 0, 1)]
    weights, report = bbw_weights(problem, [solved[1], solved[2], solved[0]], mesh_graph(points, L))
    whole = bound(points, triangles, handles)
    np.testing.assert_array_equal(weights.toarray(), whole.weights)
    assert report.handles == whole.report.handles


def test_precomputed_weights_move_nodes_as_solved_ones():
    points, triangles, handles = three_handles(0.7)
    solved = bound(points, triangles, handles)
    transforms = np.stack([rigid([0, 0, 1], 0.5), rigid([1, 0, 0], 0.2), rigid([0, 1, 0], -0.4)])
    for weights in (solved.sparse_weights, solved.weights):
        again = BbwDeformer.from_weights(points, handles, weights)
        np.testing.assert_array_equal(again.solve(transforms).positions, solved.solve(transforms).positions)


@pytest.mark.parametrize("blending", ["linear", "dual-quaternion"])
def test_one_rigid_transform_for_all_handles_comes_through_exactly(blending):
    points, triangles = sheet(23, 13)
    regions = [disc(points, c, 0.12) for c in ([0.4, 0.6, 0], [1.3, 0.3, 0], [1.8, 1.0, 0])]
    deformer = bound(points, triangles, handles_of(points, regions), BbwOptions(blending=blending))
    T = rigid([1, -2, 0.5], 2.2, [3, 1, -2])
    deformation = deformer.solve(np.tile(T, (3, 1, 1)))
    np.testing.assert_allclose(deformation.positions, points @ T[:3, :3].T + T[:3, 3], atol=1e-12)
    np.testing.assert_allclose(deformation.rotations, np.broadcast_to(T[:3, :3], (len(points), 3, 3)), atol=1e-12)


@pytest.mark.parametrize("blending", ["linear", "dual-quaternion"])
def test_resting_handles_give_the_rest_pose_back_bit_for_bit(blending):
    points, triangles, handles = three_handles(0.7)
    deformer = bound(points, triangles, handles, BbwOptions(blending=blending))
    deformation = deformer.drag(np.tile(np.eye(4), (3, 1, 1)))
    np.testing.assert_array_equal(deformation.positions, points)
    np.testing.assert_array_equal(deformation.rotations, np.broadcast_to(np.eye(3), (len(points), 3, 3)))


def test_a_drag_frame_is_the_settled_result():
    points, triangles, handles = three_handles(0.7)
    deformer = bound(points, triangles, handles)
    transforms = np.stack([rigid([0, 0, 1], 0.5), rigid([1, 0, 0], 0.2), rigid([0, 1, 0], -0.4)])
    np.testing.assert_array_equal(deformer.drag(transforms).positions, deformer.solve(transforms).positions)


def chain_on_a_tube(blending, twist=0.0, bend=0.0):
    """A tube with rings of handles at both ends and in the middle; the far half is turned. Its smallest girth left."""
    points, triangles = tube(91, 16)
    rings = [np.flatnonzero(np.abs(points[:, 0] - x) < 0.02) for x in (0.0, 0.75, 2.25, 3.0)]
    deformer = bound(points, triangles, handles_of(points, rings), BbwOptions(blending=blending))
    turned = rigid([1, 0, 0], twist) @ rigid([0, 0, 1], bend, about=[1.5, 0, 0])
    positions = deformer.solve(np.stack([np.eye(4), np.eye(4), turned, turned])).positions
    sections = positions.reshape(91, 16, 3)
    radii = np.linalg.norm(sections - sections.mean(axis=1, keepdims=True), axis=2)
    return sections, radii.min() / 0.3


def test_a_twisted_chain_keeps_its_girth_with_dual_quaternions_where_linear_blending_collapses():
    _, linear = chain_on_a_tube("linear", twist=0.95 * np.pi)
    _, screw = chain_on_a_tube("dual-quaternion", twist=0.95 * np.pi)
    assert linear < 0.15
    assert screw > 0.9


def test_a_chain_of_handles_bends_smoothly_at_its_joint():
    sections, girth = chain_on_a_tube("dual-quaternion", bend=np.pi / 2)
    assert girth > 0.85
    axis = np.diff(sections.mean(axis=1), axis=0)
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    turns = np.arccos(np.clip(np.sum(axis[1:] * axis[:-1], axis=1), -1, 1))
    # A quarter turn spread over half the tube's 90 rings; a kink would take most of it in one.
    assert turns.max() < np.radians(8)


def test_progress_rises_to_one_and_can_cancel():
    points, triangles, handles = three_handles(0.7)
    shares = []
    bound(points, triangles, handles, progress=shares.append)
    assert all(b >= a for a, b in pairwise(shares))
    assert 0 <= shares[0] <= shares[-1] <= 1

    def cancel(share):
        if share > 0.4:
            raise Cancelled

    with pytest.raises(Cancelled):
        bound(points, triangles, handles, progress=cancel)


def test_no_handles_leave_everything_at_rest():
    points, triangles = sheet(8, 8)
    deformer = bound(points, triangles, handles_of(points, [], pins=[3]))
    np.testing.assert_array_equal(deformer.drag(np.zeros((0, 4, 4))).positions, points)


def test_rejects_wrong_shapes_cages_options_and_weights():
    points, triangles, handles = three_handles()
    L, M = operators(points, triangles)
    with pytest.raises(ValueError, match="L and M must have shapes"):
        bbw_problem(points, L, M[:-1], handles)
    with pytest.raises(ValueError, match="cage_radii must be 3 positive"):
        bbw_problem(points, L, M, Handles(handles.indices, handles.labels, handles.centers, np.zeros(3)))
    with pytest.raises(ValueError, match="handle nodes must be 0 to"):
        bbw_problem(points, L, M, Handles(handles.indices + 5000, handles.labels, handles.centers, np.ones(3)))
    with pytest.raises(ValueError, match="blending must be"):
        BbwOptions(blending="cubic")
    with pytest.raises(ValueError, match="weights must have shape"):
        BbwDeformer.from_weights(points, handles, np.zeros((4, 3)))
    with pytest.raises(ValueError, match="row sums of at most 1"):
        BbwDeformer.from_weights(points, handles, np.ones((len(points), 3)))
    deformer = BbwDeformer.from_weights(points, handles, np.zeros((len(points), 3)))
    with pytest.raises(ValueError, match="transforms must be finite"):
        deformer.drag(np.zeros((2, 4, 4)))
    with pytest.raises(ValueError, match="transforms must be finite"):
        deformer.drag(np.full((3, 4, 4), np.nan))
