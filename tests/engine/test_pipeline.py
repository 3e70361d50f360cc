"""Laws of the whole way from a file to a pose."""

from dataclasses import replace

import numpy as np
import pytest

from splap_editor.core.adaptation.kernel_adaptation import adapted_splats
from splap_editor.core.adaptation.options import AdaptationOptions
from splap_editor.core.arap.binding import arap_scene
from splap_editor.core.arap.coarse import CoarseModel
from splap_editor.core.arap.options import ArapOptions
from splap_editor.core.graph.splat_graph import GraphOptions
from splap_editor.core.handle_nodes import Region
from splap_editor.core.options import OptionSet
from splap_editor.core.pose import Pose
from splap_editor.core.progress import Cancelled
from splap_editor.core.reach_options import ReachOptions
from splap_editor.core.splats.rotations import quats_to_matrices
from splap_editor.core.splats.splats import Splats
from splap_editor.engine.bound_edit import bind, ready_for_drags
from splap_editor.engine.bound_edit import posed as posed_file
from splap_editor.engine.cache import StageCache
from splap_editor.engine.edit import Edit, Handle, Pin
from splap_editor.engine.recipe_edit import edit_of, recipe_of
from splap_editor.engine.scripting import write_posed
from splap_editor.engine.surface import surface_of
from splap_editor.engine.surface_stages import packed_stages
from splap_editor.io import plain_edit as plain
from splap_editor.io.ply import read_ply
from splap_editor.io.recipe import RecipeError, recipe_from_json, recipe_to_json
from splap_editor.io.sample_maker import shape_sample
from splap_editor.resources import resource

FREED = OptionSet(ReachOptions(None))


@pytest.fixture(scope="module")
def splats() -> Splats:
    """A bent-free tube of a few thousand splats, many of them in layers."""
    return read_ply(resource("samples", "tube.ply")).splats


@pytest.fixture(scope="module")
def surface(splats):
    return surface_of(splats, GraphOptions())


def posed(surface, splats, edit):
    return bind(surface, edit).pose().kernels


def covariances(frames, log_scales):
    """World covariances of flat splats."""
    axes = frames[:, :, :2] * np.exp(np.asarray(log_scales, np.float64))[:, None, :]
    return axes @ axes.swapaxes(1, 2)


def end_edit(splats, **changes) -> Edit:
    """Lift one end of the tube, hold the other."""
    means = np.asarray(splats.means, np.float64)
    axis = int(np.argmax(np.ptp(means, axis=0)))
    reach = 0.1 * float(np.ptp(means[:, axis]))
    lift = np.roll([0.0, 3.0 * reach, 0.0], axis)
    handle = Handle(1, "end", "#ffffff", Region(means[means[:, axis].argmax()], reach), Pose(tuple(lift.tolist())))
    pins = (Pin(1, "rest", Region(means[means[:, axis].argmin()], reach)),)
    return replace(Edit(handles=(handle,), pins=pins, options=FREED), **changes)


def rotated(splats: Splats, rotation: np.ndarray, shift: np.ndarray) -> Splats:
    """The same scene elsewhere, in double precision."""
    turned = rotation @ quats_to_matrices(np.asarray(splats.quats, np.float64))
    from splap_editor.core.splats.rotations import matrices_to_quats

    means = np.asarray(splats.means, np.float64) @ rotation.T + shift
    return replace(splats, means=means, quats=matrices_to_quats(turned))


@pytest.mark.parametrize("method", ["arap", "bbw"])
def test_one_handle_and_nothing_held_is_exactly_its_rigid_motion(splats, surface, method):
    center = surface.ellipses.centers[0]
    quat = np.array([0.8, 0.3, -0.4, 0.33])
    pose = Pose((0.4, -0.7, 0.2), tuple((quat / np.linalg.norm(quat)).tolist()))
    handle = Handle(1, "all", "#ffffff", Region(center, 0.05), pose, cage_radius=None)
    edit = Edit(handles=(handle,), options=FREED, method=method)
    kernels = posed(surface, splats, edit)
    transform = handle.transform
    s = surface.ellipses.scene_scale
    expected = np.asarray(splats.means, np.float64) @ transform[:3, :3].T + transform[:3, 3]
    np.testing.assert_allclose(kernels.means, expected, atol=1e-6 * s)
    np.testing.assert_allclose(kernels.rotations - transform[:3, :3], 0.0, atol=1e-6)
    result = adapted_splats(splats, kernels)
    np.testing.assert_allclose(result.log_scales, splats.log_scales, atol=2e-6)
    frames = quats_to_matrices(np.asarray(result.quats, np.float64))
    turned = transform[:3, :3] @ quats_to_matrices(np.asarray(splats.quats, np.float64))
    # Single precision of the file, squared by nearly round splats whose axes may turn in their plane.
    got, wanted = covariances(frames, result.log_scales), covariances(turned, splats.log_scales)
    np.testing.assert_allclose(got, wanted, atol=1e-5 * float(np.abs(wanted).max()))


def test_a_handle_at_rest_changes_no_bit(splats, surface):
    edit = end_edit(splats)
    edit = edit.with_poses({1: Pose()})
    kernels = posed(surface, splats, edit)
    assert not kernels.changed.any()
    result = adapted_splats(splats, kernels)
    for name in ("means", "quats", "log_scales", "shN"):
        np.testing.assert_array_equal(getattr(result, name), getattr(splats, name))


def test_pinned_splats_stay_and_held_ones_arrive(splats, surface):
    edit = end_edit(splats)
    bound = bind(surface, edit)
    handles, deformer = bound.handles, bound.deformer
    deformation = deformer.solve(edit.transforms)
    targets = handles.targets(surface.ellipses.centers, edit.transforms)
    np.testing.assert_allclose(deformation.positions[handles.indices], targets, atol=1e-12)
    assert np.isfinite(deformation.positions).all()


@pytest.mark.parametrize("seed", [0, 1])
def test_moving_the_whole_scene_moves_the_result(splats, surface, seed):
    rng = np.random.default_rng(seed)
    quat = rng.normal(size=4)
    rotation = quats_to_matrices(quat[None])[0]
    shift = rng.normal(size=3)
    elsewhere = rotated(splats, rotation, shift)
    other = surface_of(elsewhere, GraphOptions())
    edit = end_edit(splats)
    handle = edit.handles[0]
    moved = Edit(
        handles=(
            replace(
                handle,
                region=Region(rotation @ handle.region.center + shift, handle.region.radius),
                pose=Pose(tuple((rotation @ np.array(handle.pose.translate)).tolist())),
            ),
        ),
        pins=tuple(
            replace(pin, region=Region(rotation @ pin.region.center + shift, pin.region.radius)) for pin in edit.pins
        ),
        options=FREED,
    )
    here, there = posed(surface, splats, edit), posed(other, elsewhere, moved)
    s = surface.ellipses.scene_scale
    # Both are settled to 1e-4 of the scene, from starts that differ by roundoff and by the sample of the coarse model.
    np.testing.assert_allclose(there.means, here.means @ rotation.T + shift, atol=5e-4 * s)


def test_the_order_of_the_rows_does_not_matter(splats, surface):
    order = np.random.default_rng(3).permutation(splats.n_splats)
    fields = {
        name: np.asarray(getattr(splats, name))[order]
        for name in ("means", "log_scales", "quats", "logit_opacities", "sh0", "shN")
    }
    shuffled = replace(splats, **fields)
    other = surface_of(shuffled, GraphOptions())
    edit = end_edit(splats)
    here, there = posed(surface, splats, edit), posed(other, shuffled, edit)
    np.testing.assert_allclose(there.means, here.means[order], atol=1e-9 * surface.ellipses.scene_scale)


def test_a_cached_scene_gives_the_same_bits(splats, surface, tmp_path):
    cache = StageCache(tmp_path)
    first = surface_of(splats, GraphOptions(), cache=cache)
    second = surface_of(splats, GraphOptions(), cache=cache)
    assert "graph" in first.timings_s and "graph" not in second.timings_s
    edit = end_edit(splats)
    np.testing.assert_array_equal(posed(first, splats, edit).means, posed(second, splats, edit).means)
    other = surface_of(splats, GraphOptions(k=12), cache=cache)
    assert "graph" in other.timings_s


def damaged(arrays, name, change):
    return {**arrays, name: change(arrays[name].copy())}


def set_to(value):
    def change(array):
        array.reshape(-1)[-1] = value
        return array

    return change


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("graph_indices", set_to(-1)),
        ("graph_indptr", set_to(1 << 30)),
        ("near_indices", set_to(1 << 30)),
        ("near_indptr", lambda a: a[::-1].copy()),
        ("L_indices", lambda a: a[:-1]),
        ("L_data", set_to(np.nan)),
        ("triangles", set_to(1 << 20)),
        ("triangles", lambda a: a.reshape(-1)),
        ("M", lambda a: a[:-1]),
        ("M", lambda a: a.astype(np.float32)),
        ("graph_touch", lambda a: a[:-1]),
        ("graph_epsilon", lambda a: np.array([0.0])),
    ],
)
def test_stages_with_an_index_out_of_range_are_made_again(splats, surface, tmp_path, name, change):
    said = []
    cache = StageCache(tmp_path, say=said.append)
    surface_of(splats, GraphOptions(), cache=cache)
    key = next(tmp_path.iterdir()).stem
    cache.store(key, damaged(packed_stages(surface.stages), name, change))
    again = surface_of(splats, GraphOptions(), cache=cache)
    assert "graph" in again.timings_s and len(said) == 1
    np.testing.assert_array_equal(again.triangles, surface.triangles)


@pytest.mark.parametrize(
    ("name", "change"),
    [("weights_indices", set_to(9)), ("weights_data", lambda a: a[1:]), ("qp", set_to(np.nan)), ("counts", set_to)],
)
def test_weights_that_do_not_fit_are_solved_again(splats, surface, tmp_path, name, change):
    said = []
    cache = StageCache(tmp_path, say=said.append)
    edit = end_edit(splats, method="bbw")
    first = bind(surface, edit, cache=cache).deformer
    key = next(tmp_path.iterdir()).stem
    kept = cache.load(key, dict)
    cache.store(key, {n: a for n, a in kept.items() if n != name} if change is set_to else damaged(kept, name, change))
    second = bind(surface, edit, cache=cache).deformer
    assert len(said) == 1
    np.testing.assert_array_equal(first.weights, second.weights)


def test_bbw_weights_are_kept_between_runs(splats, surface, tmp_path):
    cache = StageCache(tmp_path)
    edit = end_edit(splats, method="bbw")
    first = bind(surface, edit, cache=cache).deformer
    second = bind(surface, edit, cache=cache).deformer
    np.testing.assert_array_equal(first.weights, second.weights)
    assert second.report.handles == first.report.handles
    assert len(list(tmp_path.iterdir())) == 1


def test_what_the_first_drag_waits_for_is_kept_between_runs(tmp_path, monkeypatch):
    splats = shape_sample("tube", 6500).splats
    cache = StageCache(tmp_path)
    surface = surface_of(splats, GraphOptions(), cache=cache)
    n_kept = len(list(tmp_path.iterdir()))
    ready_for_drags(surface, cache)
    assert len(list(tmp_path.iterdir())) == n_kept + 1
    again = surface_of(splats, GraphOptions(), cache=cache)
    monkeypatch.setattr(CoarseModel, "__init__", None)
    ready_for_drags(again, cache)
    assert again.shared(arap_scene).coarse.spacing == surface.shared(arap_scene).coarse.spacing


def test_a_recipe_and_its_edit_are_the_same(splats, surface):
    edit = end_edit(splats).with_options(AdaptationOptions("affine", 2))
    again = edit_of(recipe_from_json(recipe_to_json(recipe_of(edit))), splats)
    assert recipe_of(again) == recipe_of(edit)
    np.testing.assert_array_equal(posed(surface, splats, again).means, posed(surface, splats, edit).means)


@pytest.mark.parametrize("kind", ["converged", "local-global", "bbw"])
@pytest.mark.parametrize("adaptation", ["surface", "affine", "none"])
def test_what_is_pinned_stays_the_files_own_and_nothing_outruns_its_handle(splats, surface, kind, adaptation):
    center = surface.ellipses.centers[0]
    near = np.linalg.norm(np.asarray(splats.means, np.float64) - center, axis=1) <= 0.1 * surface.ellipses.scene_scale
    shift = 0.3 * surface.ellipses.scene_scale
    handle = Handle(1, "one", "#ffffff", Region(center, 0.0, np.flatnonzero(near)), Pose((0.0, 0.0, shift)))
    edit = Edit(
        handles=(handle,),
        pins=(Pin(1, "rest", Region(center, 0.0, np.flatnonzero(~near))),),
        method="bbw" if kind == "bbw" else "arap",
        options=OptionSet(ArapOptions() if kind == "bbw" else ArapOptions(kind=kind), AdaptationOptions(adaptation)),
    )
    kernels = posed(surface, splats, edit)
    assert near.sum() > 10 and kernels.changed[near].all() and not kernels.changed[~near].any()
    moved = np.linalg.norm(kernels.means - np.asarray(splats.means, np.float64), axis=1)
    assert moved.max() <= shift * (1.0 + 1e-9)


@pytest.mark.parametrize("method", ["arap", "bbw"])
def test_a_cancelled_binding_leaves_the_surface_usable(splats, surface, method):
    edit = end_edit(splats, method=method)

    def cancel(share):
        raise Cancelled

    with pytest.raises(Cancelled):
        bind(surface, edit, progress=cancel)
    assert np.isfinite(posed(surface, splats, edit).means).all()


def test_a_scene_without_a_visible_splat_is_refused(splats):
    faint = replace(splats, logit_opacities=np.full(splats.n_splats, -20.0, np.float32))
    with pytest.raises(ValueError, match="no splat of this file is visible"):
        surface_of(faint, GraphOptions())


@pytest.mark.parametrize("n", [1, 2, 3])
def test_a_handful_of_splats_can_be_moved(splats, n):
    rows = np.arange(n)
    fields = {
        name: np.asarray(getattr(splats, name))[rows]
        for name in ("means", "log_scales", "quats", "logit_opacities", "sh0", "shN")
    }
    few = replace(splats, **fields)
    surface = surface_of(few, GraphOptions())
    handle = Handle(1, "one", "#ffffff", Region(surface.ellipses.centers[0], 1e-6), Pose((1.0, 0.0, 0.0)))
    kernels = posed(surface, few, Edit(handles=(handle,), options=FREED))
    np.testing.assert_allclose(kernels.means, np.asarray(few.means, float) + np.array([1.0, 0.0, 0.0]), atol=1e-6)


@pytest.mark.parametrize("handle", [plain.Handle("head", center=(0.0, 0.0, 0.0)), plain.Handle("head", radius=1.0)])
def test_a_handle_of_no_splats_is_refused(splats, handle):
    with pytest.raises(RecipeError, match=r"handle 'head' needs a center and a radius, or the rows of its splats"):
        edit_of(plain.Edit(handles=(handle,)), splats)


def test_columns_without_a_surface_are_refused(tmp_path):
    file = read_ply(resource("samples", "tube.ply"))
    with pytest.raises(ValueError, match="columns need the snapshot"):
        write_posed(tmp_path / "out.ply", file, None, Edit(), columns=("size",))
    made = posed_file(file, Edit(), with_surface=True)
    write_posed(tmp_path / "out.ply", file, made.kernels, made.edit, columns=("size",), snapshot=made.snapshot)
