import numpy as np
import pytest

from splap_editor.core.arap.coarse import CoarseModel
from splap_editor.core.arap.options import ArapOptions
from splap_editor.core.arap.scene import ArapScene
from splap_editor.core.deformer import UnconstrainedComponentError
from splap_editor.core.kept_arrays import CacheEntryError
from splap_editor.core.progress import Cancelled
from tests.core.arap.arap_scenes import Scene, edge_graph, holding, joined, moved, rigid, strip
from tests.reference.arap import local_global, spokes_energy

STRIP = strip()
TIP = STRIP.rest[:, 0] > 0.93
ROOT = STRIP.rest[:, 0] < 0.07
BEND = rigid(50.0, [0.0, 1.0, 0.0], [1.0, 0.12, 0.0], [-0.1, 0.05, 0.1])[None]
KINDS = ("converged", "local-global", "libigl")


def _distance(a, b):
    return np.linalg.norm(a.positions - b.positions, axis=1).max()


def _coarse(scene, n_samples):
    """What deformers of a scene share, with a coarse model however small it is."""
    return ArapScene(scene.rest, scene.L, scene.graph, small=0, n_samples=n_samples)


def _dense_weights(scene):
    weights = -scene.L.toarray()
    np.fill_diagonal(weights, 0.0)
    return weights


def _assert_moved_by(T, scene, deformation, nodes=slice(None)):
    np.testing.assert_allclose(deformation.positions[nodes], moved(T, scene.rest)[nodes], atol=1e-9)
    expected = np.tile(T[:3, :3], (len(scene.rest), 1, 1))
    np.testing.assert_allclose(deformation.rotations[nodes], expected[nodes], atol=1e-9)


HELD = {
    "one patch": [TIP],
    "two patches": [TIP, ROOT],
    "one splat": [np.arange(len(STRIP.rest)) == 80],
    "two splats": [np.isin(np.arange(len(STRIP.rest)), [80, 90])],
}


@pytest.mark.parametrize("held", HELD)
def test_rigid_motion_of_all_handles_moves_every_node_exactly(held):
    handles = holding(STRIP.rest, HELD[held])
    T = rigid(140.0, [1.0, 2.0, -0.5], [0.3, 0.2, 0.1], [0.4, -1.0, 2.0])
    deformer = STRIP.deformer(handles)
    transforms = np.tile(T, (handles.n_handles, 1, 1))
    _assert_moved_by(T, STRIP, deformer.solve(transforms))
    _assert_moved_by(T, STRIP, deformer.drag(transforms))


def test_one_splat_turned_about_itself_turns_everything_with_it():
    node = np.arange(len(STRIP.rest)) == 80
    T = rigid(40.0, [0.3, 1.0, 0.2], STRIP.rest[80])
    _assert_moved_by(T, STRIP, STRIP.deformer(holding(STRIP.rest, [node])).solve(T[None]))


def test_solver_alone_finds_the_rigid_motion():
    # Scaling one of the handles by a hair keeps the exact short cut for rigid motions out of the way.
    handles = holding(STRIP.rest, [TIP, ROOT])
    T = rigid(100.0, [1.0, 2.0, -0.5], [0.3, 0.2, 0.1], [0.4, -1.0, 2.0])
    nearly = T.copy()
    nearly[:3, 3] += 1e-8
    result = STRIP.deformer(handles, tolerance=1e-9).solve(np.stack([T, nearly]))
    # The handles disagree by 1e-8.
    np.testing.assert_allclose(result.positions, moved(T, STRIP.rest), atol=1e-7)


def test_no_motion_gives_exactly_the_rest_pose():
    deformer = STRIP.deformer(holding(STRIP.rest, [TIP], ROOT))
    for result in (deformer.solve(np.eye(4)[None]), deformer.drag(np.eye(4)[None])):
        assert (result.positions == STRIP.rest).all()
        assert (result.rotations == np.eye(3)).all()


@pytest.mark.parametrize("kind", KINDS)
def test_constrained_nodes_are_exactly_in_place(kind):
    handles = holding(STRIP.rest, [TIP], ROOT)
    result = STRIP.deformer(handles, kind=kind).solve(BEND)
    np.testing.assert_allclose(result.positions[handles.indices], handles.targets(STRIP.rest, BEND), atol=1e-14)


def test_converged_result_is_within_a_few_tolerances_of_the_minimiser():
    for pins, degrees in ((ROOT, 50.0), (ROOT, 120.0), (np.arange(len(STRIP.rest)) == 0, 50.0)):
        handles = holding(STRIP.rest, [TIP], pins)
        bend = rigid(degrees, [0.0, 1.0, 0.0], [1.0, 0.12, 0.0], [-0.1, 0.05, 0.1])[None]
        exact = STRIP.deformer(handles, tolerance=1e-11).solve(bend)
        for tolerance in (1e-3, 1e-4, 1e-6):
            result = STRIP.deformer(handles, tolerance=tolerance).solve(bend)
            assert result.residual <= tolerance
            # The estimate is an extrapolation: four times the tolerance is the worst seen on many shapes.
            assert _distance(result, exact) <= 4.0 * tolerance


@pytest.mark.parametrize("smoothness", [0.001, 0.0])
def test_converged_result_is_that_of_the_plain_dense_twin(smoothness):
    scene = strip(9, 4)
    tip, root = scene.rest[:, 0] > 0.8, scene.rest[:, 0] < 0.2
    handles = holding(scene.rest, [tip], root)
    beta = 2.0 * smoothness * scene.M.sum()
    given = {}
    if smoothness:
        given = {i: BEND[0, :3, :3] for i in np.flatnonzero(tip)} | {i: np.eye(3) for i in np.flatnonzero(root)}
    targets = handles.targets(scene.rest, BEND)
    expected, rotations = local_global(_dense_weights(scene), scene.rest, handles.indices, targets, 400, beta, given)
    result = scene.deformer(handles, tolerance=1e-10, smoothness=smoothness).solve(BEND)
    # The twin's 400 plain iterations come this close.
    np.testing.assert_allclose(result.positions, expected, atol=5e-6)
    free = ~(tip | root)
    np.testing.assert_allclose(result.rotations[free], rotations[free], atol=1e-4)


def test_local_global_is_the_plain_dense_twin_iteration_for_iteration():
    scene = strip(9, 4)
    handles = holding(scene.rest, [scene.rest[:, 0] > 0.8], scene.rest[:, 0] < 0.2)
    targets = handles.targets(scene.rest, BEND)
    for iterations in (1, 7):
        expected, _ = local_global(_dense_weights(scene), scene.rest, handles.indices, targets, iterations)
        result = scene.deformer(handles, kind="local-global", iterations=iterations).solve(BEND)
        np.testing.assert_allclose(result.positions, expected, atol=1e-9)


def test_local_global_agrees_with_libigl_on_a_mesh():
    handles = holding(STRIP.rest, [TIP], ROOT)
    ours = STRIP.deformer(handles, kind="local-global").solve(BEND)
    peer = STRIP.deformer(handles, kind="libigl").solve(BEND)
    # libigl fits rotations in single precision.
    np.testing.assert_allclose(ours.positions, peer.positions, atol=2e-5)
    np.testing.assert_allclose(ours.rotations, peer.rotations, atol=1e-3)


def test_stars_that_hold_each_triangle_three_times_change_nothing():
    handles = holding(STRIP.rest, [TIP], ROOT)
    single = STRIP.deformer(handles, kind="libigl").solve(BEND)
    stars = Scene(STRIP.rest, STRIP.triangles)
    stars.triangles = np.concatenate([np.roll(STRIP.triangles, k, axis=1) for k in range(3)])
    np.testing.assert_allclose(
        stars.deformer(handles, kind="libigl").solve(BEND).positions, single.positions, atol=2e-5
    )


def test_rotating_scaling_and_permuting_the_scene_commute_with_solving():
    handles = holding(STRIP.rest, [TIP], ROOT)
    expected = STRIP.deformer(handles, tolerance=1e-10).solve(BEND)
    A = rigid(70.0, [1.0, -1.0, 0.3], [0.0, 0.0, 0.0], [3.0, 2.0, -1.0], scale=50.0)
    order = np.random.default_rng(0).permutation(len(STRIP.rest))
    place = np.argsort(order)
    scene = Scene(moved(A, STRIP.rest)[order], place[STRIP.triangles])
    scene.scene_scale = 50.0 * STRIP.scene_scale
    handles = holding(scene.rest, [TIP[order]], ROOT[order])
    result = scene.deformer(handles, tolerance=1e-10).solve(A @ BEND @ np.linalg.inv(A))
    # Both runs stop within their tolerance of the same minimiser.
    np.testing.assert_allclose(result.positions[place], moved(A, expected.positions), atol=50.0 * 1e-8)
    turn = A[:3, :3] / 50.0
    np.testing.assert_allclose(result.rotations[place], turn @ expected.rotations @ turn.T, atol=1e-7)


def test_solving_depends_on_the_transforms_alone():
    handles = holding(STRIP.rest, [TIP], ROOT)
    fresh = STRIP.deformer(handles).solve(BEND)
    used = STRIP.deformer(handles)
    used.solve(rigid(-80.0, [1.0, 0.0, 0.0], [1.0, 0.1, 0.0])[None])
    used.drag(rigid(30.0, [0.0, 0.0, 1.0], [1.0, 0.1, 0.0])[None])
    again = used.solve(BEND)
    assert (again.positions == fresh.positions).all()
    assert (again.rotations == fresh.rotations).all()


def test_scaled_handle_turns_its_nodes_by_the_polar_factor():
    handles = holding(STRIP.rest, [TIP], ROOT)
    T = rigid(30.0, [0.0, 1.0, 0.0], [1.0, 0.12, 0.0], scale=1.5)
    result = STRIP.deformer(handles).solve(T[None])
    np.testing.assert_allclose(result.positions[TIP], moved(T, STRIP.rest)[TIP], atol=1e-14)
    np.testing.assert_allclose(result.rotations[TIP], np.tile(T[:3, :3] / 1.5, (TIP.sum(), 1, 1)), atol=1e-12)


def test_energy_of_the_converged_result_is_below_every_plain_iterate():
    handles = holding(STRIP.rest, [TIP], ROOT)
    weights = _dense_weights(STRIP)
    best = STRIP.deformer(handles, smoothness=0.0, tolerance=1e-8).solve(BEND)
    least = spokes_energy(weights, STRIP.rest, best.positions, best.rotations)
    last = np.inf
    for iterations in (1, 2, 5, 20, 80):
        plain = STRIP.deformer(handles, kind="local-global", iterations=iterations).solve(BEND)
        energy = spokes_energy(weights, STRIP.rest, plain.positions, plain.rotations)
        assert least <= energy <= last
        last = energy


def test_a_part_that_nothing_holds_follows_its_neighbours_rigidly():
    other = strip(6, 4, 0.2, 0.2)
    other.rest += [0.95, 0.0, 0.03]
    scene = joined(STRIP, other)
    n, both = len(STRIP.rest), len(scene.rest)
    tip = np.r_[TIP, np.zeros(both - n, bool)]
    root = np.r_[ROOT, np.zeros(both - n, bool)]
    for result in (
        scene.deformer(holding(scene.rest, [tip], root)).solve(BEND),
        scene.deformer(holding(scene.rest, [tip], root), kind="local-global").solve(BEND),
        scene.deformer(holding(scene.rest, [tip], root), kind="libigl").solve(BEND),
    ):
        R = result.rotations[n]
        assert (result.rotations[n:] == R).all()
        rest, after = other.rest - other.rest[0], result.positions[n:] - result.positions[n]
        np.testing.assert_allclose(after, rest @ R.T, atol=1e-12)
        # It hovers over the edge of the handle and of what bends beside it.
        assert np.abs(result.positions[n:] - moved(BEND[0], other.rest)).max() < 0.06


def test_isolated_nodes_follow_and_rigid_motions_reach_them_exactly():
    loose = np.array([[0.5, 0.1, 0.2], [2.0, 2.0, 2.0], [0.0, 0.0, 0.0]])
    rest = np.concatenate([STRIP.rest, loose])
    scene = Scene(rest, STRIP.triangles)
    grow = len(rest) - len(STRIP.rest)
    handles = holding(rest, [np.r_[TIP, np.zeros(grow, bool)]])
    T = rigid(75.0, [1.0, 2.0, -0.5], [0.3, 0.2, 0.1], [0.4, -1.0, 2.0])
    for result in (scene.deformer(handles).solve(T[None]), scene.deformer(handles).drag(T[None])):
        _assert_moved_by(T, scene, result)


def test_two_nodes_follow_a_turn_of_one():
    rest = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    scene = strip(3, 3)
    scene.rest, scene.L, scene.M = rest, scene.L[:2, :2] * 0.0, np.ones(2)
    scene.L[0, 0] = scene.L[1, 1] = 1.0
    scene.L[0, 1] = scene.L[1, 0] = -1.0
    scene.graph = edge_graph(rest, np.array([[0, 1, 0]]))
    handles = holding(rest, [np.array([True, False])])
    T = rigid(40.0, [0.0, 0.0, 1.0], rest[0])
    _assert_moved_by(T, scene, scene.deformer(handles).solve(T[None]))
    stretch = holding(rest, [np.array([True, False]), np.array([False, True])])
    result = scene.deformer(stretch).solve(np.stack([np.eye(4), rigid(0.0, [1, 0, 0], rest[1], [1.0, 1.0, 0.0])]))
    np.testing.assert_allclose(result.positions, [[0, 0, 0], [2, 1, 0]], atol=1e-12)


@pytest.mark.parametrize("kind", ["converged", "local-global"])
def test_a_line_and_a_flat_plane_deform_without_failing(kind):
    flat = strip(bump=0.0)
    handles = holding(flat.rest, [TIP], ROOT)
    result = flat.deformer(handles, kind=kind).solve(BEND)
    assert np.isfinite(result.positions).all()
    assert np.linalg.norm(result.positions - flat.rest, axis=1).max() < 0.5
    line = strip(bump=0.0)
    n = 40
    line.rest = np.stack([np.linspace(0, 1, n), np.zeros(n), np.zeros(n)], axis=1)
    chain = np.stack([np.arange(n - 1), np.arange(1, n)], axis=1)
    line.graph = edge_graph(line.rest, chain[:, [0, 1, 0]])
    adjacency = (line.graph.matrix() > 0).astype(np.float64).toarray()
    line.L = type(flat.L)(np.diag(adjacency.sum(axis=1)) - adjacency)
    line.M = np.full(n, 1.0 / n)
    handles = holding(line.rest, [line.rest[:, 0] > 0.9], line.rest[:, 0] < 0.1)
    result = line.deformer(handles, kind=kind).solve(BEND)
    assert np.isfinite(result.positions).all()
    steps = np.linalg.norm(np.diff(result.positions, axis=0), axis=1) * (n - 1)
    assert steps.max() < 2.0


def test_everything_held_is_placed_without_solving():
    handles = holding(STRIP.rest, [TIP], ~TIP)
    result = STRIP.deformer(handles).solve(BEND)
    np.testing.assert_array_equal(result.positions[~TIP], STRIP.rest[~TIP])
    np.testing.assert_allclose(result.positions[TIP], moved(BEND[0], STRIP.rest)[TIP], atol=1e-14)


def test_dragging_ends_where_solving_settles():
    handles = holding(STRIP.rest, [TIP], ROOT)
    deformer = STRIP.deformer(handles)
    for share in np.linspace(0.1, 1.0, 10):
        frame = deformer.drag(
            rigid(50.0 * share, [0.0, 1.0, 0.0], [1.0, 0.12, 0.0], share * np.array([-0.1, 0.05, 0.1]))[None]
        )
    # A frame of a drag stops short of the minimum.
    assert _distance(frame, deformer.solve(BEND)) < 5e-3


def test_coarse_drag_is_close_to_the_settled_result():
    scene = strip(120, 30)
    shared = _coarse(scene, 500)
    handles = holding(scene.rest, [scene.rest[:, 0] > 0.93], scene.rest[:, 0] < 0.07)
    deformer = scene.deformer(handles, scene=shared)
    for share in np.linspace(0.1, 1.0, 10):
        frame = deformer.drag(
            rigid(50.0 * share, [0.0, 1.0, 0.0], [1.0, 0.12, 0.0], share * np.array([-0.1, 0.05, 0.1]))[None]
        )
    settled = deformer.solve(BEND)
    np.testing.assert_allclose(frame.positions[handles.indices], handles.targets(scene.rest, BEND), atol=1e-14)
    # 500 nodes stand for 3,600: what a person sees jump when the drag ends.
    assert _distance(frame, settled) < 0.03
    assert np.linalg.norm(frame.positions - settled.positions, axis=1).mean() < 0.01
    np.testing.assert_allclose(
        settled.positions, scene.deformer(handles, tolerance=1e-9).solve(BEND).positions, atol=4e-4
    )


def test_a_kept_coarse_model_drags_to_the_same_bits_and_a_damaged_one_is_refused():
    scene = strip(120, 30)
    handles = holding(scene.rest, [scene.rest[:, 0] > 0.93], scene.rest[:, 0] < 0.07)
    made, kept = _coarse(scene, 300), _coarse(scene, 300)
    arrays = made.coarse.packed()
    kept.ready(lambda name, make, packed, unpacked: unpacked(arrays))
    frames = [scene.deformer(handles, scene=shared).drag(BEND) for shared in (made, kept)]
    np.testing.assert_array_equal(frames[0].positions, frames[1].positions)
    for name, wrong in (("near", -1), ("samples", len(scene.rest)), ("weights_indices", 300), ("shares", np.nan)):
        damaged = {**arrays, name: np.full_like(arrays[name], wrong)}
        with pytest.raises(CacheEntryError):
            CoarseModel.unpacked(damaged, scene.rest)


def test_a_drag_goes_on_from_the_settled_pose_without_a_jump():
    scene = strip(120, 30)
    shared = _coarse(scene, 300)
    deformer = scene.deformer(holding(scene.rest, [scene.rest[:, 0] > 0.93], scene.rest[:, 0] < 0.07), scene=shared)
    first = deformer.drag(BEND)
    settled = deformer.solve(BEND)
    again = deformer.drag(BEND)
    assert _distance(first, settled) > 4e-3
    # One more step of the coarse model is all that lies between.
    assert _distance(again, settled) < 5e-4
    np.testing.assert_allclose(again.rotations, settled.rotations, atol=5e-3)
    assert _distance(deformer.drag(np.eye(4)[None]), deformer.solve(np.eye(4)[None])) == 0.0


def test_coarse_drag_moves_with_a_handle_between_the_samples():
    scene = strip(120, 30)
    shared = _coarse(scene, 300)
    node = np.setdiff1d(np.arange(3000, 3600), shared.coarse.samples)[10]
    handles = holding(scene.rest, [np.arange(3600) == node], scene.rest[:, 0] < 0.07)
    T = rigid(0.0, [0.0, 1.0, 0.0], scene.rest[node], [0.0, 0.0, 0.2])
    deformer = scene.deformer(handles, scene=shared)
    frame = [deformer.drag(T[None]) for _ in range(10)][-1]
    np.testing.assert_allclose(frame.positions[node], moved(T, scene.rest)[node], atol=1e-14)
    assert _distance(frame, deformer.solve(T[None])) < 0.05


def test_intermediate_results_are_shown_while_settling(monkeypatch):
    monkeypatch.setattr("splap_editor.core.arap.arap.REPORT_SECONDS", 0.0)
    handles = holding(STRIP.rest, [TIP], ROOT)
    shown, shares = [], []
    result = STRIP.deformer(handles).solve(BEND, progress=shares.append, shown=shown.append)
    assert len(shown) > 3
    assert shares == sorted(shares)
    assert shares[0] >= 0.0 and shares[-1] <= 1.0
    assert _distance(shown[-1], result) < 1e-3
    np.testing.assert_allclose(shown[0].positions[handles.indices], handles.targets(STRIP.rest, BEND), atol=1e-14)


def test_cancelled_solve_leaves_the_deformer_usable(monkeypatch):
    monkeypatch.setattr("splap_editor.core.arap.arap.REPORT_SECONDS", 0.0)
    deformer = STRIP.deformer(holding(STRIP.rest, [TIP], ROOT))
    expected = STRIP.deformer(holding(STRIP.rest, [TIP], ROOT)).solve(BEND)

    def cancel(share):
        if share > 0.5:
            raise Cancelled

    with pytest.raises(Cancelled):
        deformer.solve(BEND, progress=cancel)
    assert (deformer.solve(BEND).positions == expected.positions).all()


def test_rejects_bad_arguments():
    handles = holding(STRIP.rest, [TIP], ROOT)
    with pytest.raises(UnconstrainedComponentError, match="add a handle or a pin"):
        STRIP.deformer(holding(STRIP.rest, []))
    with pytest.raises(ValueError, match=r"shape \(1, 4, 4\), got \(2, 4, 4\)"):
        STRIP.deformer(handles).solve(np.tile(np.eye(4), (2, 1, 1)))
    with pytest.raises(ValueError, match="finite"):
        STRIP.deformer(handles).drag(np.full((1, 4, 4), np.nan))
    with pytest.raises(ValueError, match="kind must be"):
        ArapOptions(kind="fast")
    with pytest.raises(ValueError, match="tolerance must be a finite number greater than 0"):
        ArapOptions(tolerance=0.0)
    with pytest.raises(ValueError, match="iterations"):
        ArapOptions(iterations=0)
    with pytest.raises(ValueError, match="smoothness"):
        ArapOptions(smoothness=-1.0)
