"""A session as the window drives it, without the window."""

import errno
import shutil
import threading
from dataclasses import replace

import numpy as np
import pytest

from splap_editor.cli import main as command_line
from splap_editor.core.bbw.options import BbwOptions
from splap_editor.core.reach_options import ReachOptions
from splap_editor.engine import scripting, surface_stages
from splap_editor.engine.cache import StageCache
from splap_editor.engine.edit import PIN_COLOR, Pose, binds_like
from splap_editor.engine.recipe_edit import recipe_of
from splap_editor.engine.removal import Removal
from splap_editor.io.ply import read_ply
from splap_editor.io.recipe import recipe_from_json, recipe_to_json
from splap_editor.resources import resource
from splap_editor.session import work
from splap_editor.session.documents import Documents
from splap_editor.session.edit_file import write_edit
from splap_editor.session.placement import disc_rows, held_pose, rows_region
from splap_editor.session.session import Session

TUBE = resource("samples", "tube.ply")


@pytest.fixture
def session(main, tmp_path):
    session = Session(main.post, cache=StageCache(tmp_path / "cache"))
    session.failures = []
    session.failed.connect(lambda title, error: session.failures.append(str(error)))
    yield session
    session.close()


@pytest.fixture
def opened(main, session):
    session.open(TUBE)
    main.run_until(lambda: session.state == "ready")
    return session


def end_rows(scene, sign):
    means = np.asarray(scene.splats.means, np.float64)
    axis = int(np.argmax(np.ptp(means, axis=0)))
    return disc_rows(scene, int(np.argmax(sign * means[:, axis])), 0.1 * float(np.ptp(means[:, axis])))


def bent(main, session, lift=0.3):
    """Pin one end, put a handle on the other and move it; settled."""
    scene = session.scene
    session.steps.add_pin(rows_region(scene, end_rows(scene, -1)))
    handle = session.steps.add_handle(rows_region(scene, end_rows(scene, 1)))
    session.drag.preview({handle.handle_id: Pose((lift, lift, 0.0))})
    session.drag.commit("Move handle")
    main.run_until(lambda: session.state == "settled")
    return handle


def test_opening_prepares_in_the_background(main, session):
    states = []
    session.state_changed.connect(lambda: states.append(session.state))
    session.open(TUBE)
    main.run_until(lambda: session.state == "ready")
    assert states == ["opening", "preparing", "ready"]
    assert session.scene.surface.graph.n_edges > 0 and session.failures == []


def test_the_second_opening_skips_the_stages(main, opened):
    assert "graph" in opened.scene.surface.timings_s
    first = opened.scene
    opened.open(TUBE)
    main.run_until(lambda: opened.scene is not first and opened.state == "ready")
    assert "graph" not in opened.scene.surface.timings_s


def test_a_drag_shows_poses_and_settles(main, opened):
    shown = []
    scene = opened.scene
    scene.pose_changed.connect(lambda: shown.append(scene.kernels))
    handle = opened.steps.add_handle(rows_region(scene, end_rows(scene, 1)))
    main.run_until(lambda: opened.state == "settled")
    steps = []
    opened.history.changed.connect(lambda: steps.append(opened.history.undo_label))
    for step in range(1, 6):
        opened.drag.preview({handle.handle_id: Pose((0.05 * step, 0.0, 0.0))})
        before = len(shown)
        main.run_until(lambda before=before: len(shown) > before)
    assert opened.state == "dragging" and steps == []
    opened.drag.commit("Move handle")
    main.run_until(lambda: opened.state == "settled")
    assert steps == ["Move handle"]
    held = np.mean(scene.kernels.means[handle.region.rows] - scene.splats.means[handle.region.rows], axis=0)
    # Ellipses follow their corners, so the held splats' own centres are off by a small share of their size.
    np.testing.assert_allclose(held, [0.25, 0.0, 0.0], atol=0.02)


def test_the_newest_request_wins(main, opened):
    scene = opened.scene
    handle = opened.steps.add_handle(rows_region(scene, end_rows(scene, 1)))
    main.run_until(lambda: opened.state == "settled")
    shown = []
    scene.pose_changed.connect(lambda: shown.append(scene.kernels))
    for step in range(1, 101):
        opened.drag.preview({handle.handle_id: Pose((0.002 * step, 0.0, 0.0))})
    main.run_until(lambda: not opened.drag.awaits_frame)
    assert len(shown) < 50, "requests that came too late are skipped"


def test_undo_and_redo_swap_the_pose(main, opened):
    bent(main, opened)
    posed = opened.scene.kernels.means.copy()
    opened.history.undo()
    main.run_until(lambda: opened.state == "settled")
    assert not opened.scene.kernels.changed.any()
    opened.history.redo()
    main.run_until(lambda: opened.state == "settled")
    np.testing.assert_array_equal(opened.scene.kernels.means, posed)
    while opened.history.undo():
        pass
    main.run_until(lambda: opened.state == "ready")
    assert opened.scene.kernels is None and opened.scene.edit.handles == ()


def test_a_cancelled_drag_leaves_no_trace(main, opened):
    scene = opened.scene
    handle = opened.steps.add_handle(rows_region(scene, end_rows(scene, 1)))
    opened.drag.preview({handle.handle_id: Pose((0.3, 0.0, 0.0))})
    opened.drag.cancel()
    main.run_until(lambda: opened.state == "settled")
    assert opened.scene.edit.is_identity and not opened.scene.kernels.changed.any()
    assert opened.history.undo_label == "Place handle"


def test_what_is_exported_is_what_is_shown_and_what_the_command_line_makes(main, opened, tmp_path):
    documents = Documents(opened, main.post)
    bent(main, opened)
    reports = []
    opened.exported.connect(reports.append)
    assert opened.has_unexported_edit
    write_edit(tmp_path / "edit.json", opened.scene)
    opened.export(tmp_path / "window.ply")
    main.run_until(lambda: reports)
    assert not opened.has_unexported_edit
    assert documents.would_lose, "the file has no handle"
    documents.close()
    written = read_ply(tmp_path / "window.ply").splats
    np.testing.assert_array_equal(written.means, opened.scene.kernels.means.astype(np.float32))
    assert reports[0].n_changed == np.count_nonzero(opened.scene.kernels.changed)
    arguments = ["deform", str(TUBE), "--recipe", str(tmp_path / "edit.json"), "-o", str(tmp_path / "cli.ply")]
    assert command_line([*arguments, "--quiet"]) == 0
    assert (tmp_path / "cli.ply").read_bytes() == (tmp_path / "window.ply").read_bytes()


def test_the_path_of_the_drag_does_not_matter(main, opened):
    handle = bent(main, opened)
    direct = opened.scene.kernels.means.copy()
    for pose in (Pose((-0.4, 0.1, 0.5)), Pose((0.0, -0.5, 0.2)), Pose((0.3, 0.3, 0.0))):
        opened.drag.preview({handle.handle_id: pose})
        main.run_until(lambda: not opened.drag.awaits_frame)
    opened.drag.commit("Move handle")
    main.run_until(lambda: opened.state == "settled")
    np.testing.assert_array_equal(opened.scene.kernels.means, direct)


def test_export_waits_for_the_pose_to_settle(main, opened, tmp_path):
    handle = bent(main, opened)
    reports = []
    opened.exported.connect(reports.append)
    opened.drag.preview({handle.handle_id: Pose((-0.2, 0.0, 0.1))})
    opened.drag.commit("Move handle")
    opened.export(tmp_path / "out.ply")
    main.run_until(lambda: reports)
    assert opened.state == "settled"
    written = read_ply(tmp_path / "out.ply").splats
    np.testing.assert_array_equal(written.means, opened.scene.kernels.means.astype(np.float32))


def test_an_unedited_scene_exports_byte_for_byte(main, opened, tmp_path):
    reports = []
    opened.exported.connect(reports.append)
    opened.export(tmp_path / "copy.ply")
    main.run_until(lambda: reports)
    assert (tmp_path / "copy.ply").read_bytes() == TUBE.read_bytes()
    assert str(reports[0]).endswith("unchanged")


def test_a_bad_file_leaves_the_open_scene_alone(main, opened, tmp_path):
    bent(main, opened)
    before, edit = opened.scene, opened.scene.edit
    bad = tmp_path / "bad.ply"
    bad.write_bytes(b"not a ply")
    opened.open(bad)
    main.run_until(lambda: opened.failures)
    main.run_until(lambda: opened.state == "settled")
    assert opened.scene is before and opened.scene.edit is edit
    opened.open(tmp_path / "gone.ply")
    main.run_until(lambda: len(opened.failures) == 2)
    assert opened.scene is before


def test_an_export_that_fails_says_so_and_loses_nothing(main, opened, tmp_path):
    bent(main, opened)
    opened.export(tmp_path / "no such folder" / "out.ply")
    main.run_until(lambda: opened.failures)
    assert opened.has_unexported_edit and opened.state == "settled"


def slow_graph(monkeypatch, started):
    """Make the graph stage wait until it is cancelled."""
    real = surface_stages.splat_graph

    def graph(ellipses, options, *, progress):
        started.set()
        while not getattr(graph, "go", False):
            progress(0.1)
        return real(ellipses, options, progress=progress)

    monkeypatch.setattr(surface_stages, "splat_graph", graph)
    return graph


def test_preparing_can_be_cancelled_and_resumed(main, session, monkeypatch):
    started = threading.Event()
    graph = slow_graph(monkeypatch, started)
    session.open(TUBE)
    main.run_until(started.is_set)
    session.halt()
    main.run_until(lambda: not session.worker.is_busy())
    assert session.state == "halted" and session.scene.surface is None and session.failures == []
    assert not list((session.cache.folder).glob("*"))
    graph.go = True
    session.resume()
    main.run_until(lambda: session.state == "ready")


def test_a_file_that_nothing_poses_is_written_while_the_scene_is_prepared(main, session, monkeypatch, tmp_path):
    started = threading.Event()
    graph = slow_graph(monkeypatch, started)
    told, reports = [], []
    session.exported.connect(reports.append)
    session.told_job.changed.connect(lambda job: told.append(job.title if job is not None else ""))
    session.hold()
    session.open(TUBE)
    main.run_until(lambda: session.scene is not None)
    session.export(tmp_path / "held.ply")
    main.run_until(lambda: len(reports) == 1)
    session.release()
    main.run_until(started.is_set)
    for name in ("copy.ply", "copy.spz"):
        session.export(tmp_path / name)
    main.run_until(lambda: len(reports) == 3)
    assert session.state == "preparing" and session.scene.surface is None
    assert (tmp_path / "held.ply").read_bytes() == (tmp_path / "copy.ply").read_bytes() == TUBE.read_bytes()
    assert [str(report).partition(", ")[2] for report in reports[1:]] == [
        "unchanged",
        "none of them moved, as .spz holds them",
    ]
    begun, last = told.index("Exporting copy.ply"), len(told) - told[::-1].index("Exporting copy.ply")
    assert "Preparing tube.ply" not in told[begun:last], "of two jobs the bar shows one"
    session.halt()
    session.export(tmp_path / "halted.ply")
    main.run_until(lambda: len(reports) == 4)
    assert session.state == "halted", "it needs nothing of what was stopped"
    graph.go = True
    session.resume()
    main.run_until(lambda: session.state == "ready")
    assert session.failures == []


def test_a_crop_is_written_while_the_scene_is_prepared_and_a_pose_waits_for_it(main, session, monkeypatch, tmp_path):
    started = threading.Event()
    graph = slow_graph(monkeypatch, started)
    session.open(TUBE)
    main.run_until(started.is_set)
    scene = session.scene
    scene.set_edit(replace(scene.edit, removal=Removal(mask=np.arange(scene.splats.n_splats) < 9)))
    reports = []
    session.exported.connect(reports.append)
    session.export(tmp_path / "crop.ply")
    main.run_until(lambda: reports)
    assert read_ply(tmp_path / "crop.ply").splats.n_splats == scene.splats.n_splats - 9
    session.steps.add_handle(rows_region(scene, end_rows(scene, 1)))
    session.export(tmp_path / "posed.ply")
    session.export(tmp_path / "again.ply")
    assert session.state == "preparing" and not (tmp_path / "posed.ply").exists()
    graph.go = True
    main.run_until(lambda: len(reports) == 3)
    assert (tmp_path / "again.ply").read_bytes() == (tmp_path / "posed.ply").read_bytes()


def waits_until_cancelled(started, progress):
    started.set()
    while True:
        progress(0.1)


@pytest.mark.parametrize("kind", ["bind", "pose", "export"])
def test_every_job_can_be_cancelled_and_leaves_everything_as_it_was(kind, main, opened, monkeypatch, tmp_path):
    handle = bent(main, opened)
    scene, started = opened.scene, threading.Event()
    edit, kernels, kept = scene.edit, scene.kernels, sorted(opened.cache.folder.glob("*"))
    out = tmp_path / "out.ply"
    out.write_bytes(b"what was there")
    if kind == "bind":
        monkeypatch.setattr(work, "bind", lambda *args, progress, **more: waits_until_cancelled(started, progress))
        opened.steps.change_edit(replace(edit, method="bbw"), "Change method")
    elif kind == "pose":
        solve = lambda transforms, *, progress, shown: waits_until_cancelled(started, progress)  # noqa: E731
        monkeypatch.setattr(opened.bound.deformer, "solve", solve)
        opened.steps.change_edit(edit.with_poses({handle.handle_id: Pose((0.1, 0.0, 0.0))}), "Move handle")
    else:
        waits = lambda *args, progress, **more: waits_until_cancelled(started, progress)  # noqa: E731
        monkeypatch.setattr(scripting, "write_splats", waits)
        opened.export(out)
    main.run_until(started.is_set)
    opened.halt()
    main.run_until(lambda: not opened.worker.is_busy())
    assert opened.failures == [] and opened.state == "halted"
    assert scene.kernels is kernels and sorted(opened.cache.folder.glob("*")) == kept
    assert out.read_bytes() == b"what was there" and opened.has_unexported_edit
    monkeypatch.undo()
    opened.resume()
    main.run_until(lambda: opened.state == "settled")


def test_an_export_after_a_cancel_goes_on_with_what_was_halted(main, opened, tmp_path):
    bent(main, opened)
    opened.halt()
    assert opened.state == "halted"
    opened.export(tmp_path / "out.ply")
    main.run_until((tmp_path / "out.ply").exists)
    main.run_until(lambda: opened.state == "settled")
    assert opened.failures == []


def test_a_full_disk_is_said_and_the_old_file_stays(main, opened, monkeypatch, tmp_path):
    bent(main, opened)
    out = tmp_path / "out.ply"
    out.write_bytes(b"what was there")

    def full(*args, **more):
        raise OSError(errno.ENOSPC, "No space left on device", str(out))

    monkeypatch.setattr("splap_editor.io.atomic_file.os.replace", full)
    opened.export(out)
    main.run_until(lambda: opened.failures)
    assert "space" in opened.failures[0].lower()
    assert out.read_bytes() == b"what was there"
    assert [path.name for path in tmp_path.iterdir() if path.is_file()] == ["out.ply"]


def test_a_second_file_cancels_the_preparing_of_the_first(main, session, monkeypatch, tmp_path):
    started = threading.Event()
    graph = slow_graph(monkeypatch, started)
    session.open(TUBE)
    main.run_until(started.is_set)
    other = tmp_path / "other.ply"
    shutil.copy(TUBE, other)
    session.open(other)
    main.run_until(lambda: session.scene is not None and session.scene.file.path == other)
    graph.go = True
    main.run_until(lambda: session.state == "ready")
    assert session.failures == []


def test_a_handle_placed_on_a_moved_part_moves_nothing(main, opened):
    # A second handle frees what lies around it, so all is free from the start.
    opened.steps.change_edit(opened.scene.edit.with_options(ReachOptions(None)), "Free everything")
    bent(main, opened)
    scene = opened.scene
    before = scene.kernels.means.copy()
    middle = np.asarray(scene.splats.means, np.float64)
    row = int(np.argmin(np.linalg.norm(middle - middle.mean(axis=0), axis=1)))
    region = rows_region(scene, disc_rows(scene, row, 0.05))
    pose = held_pose(scene, region)
    opened.steps.add_handle(region, pose=pose)
    main.run_until(lambda: opened.state == "settled")
    moved = np.linalg.norm(scene.kernels.means - before, axis=1)
    # Holding a disc rigidly where it bent a little shifts it by a small share of the bend.
    assert moved.max() < 0.01 * scene.ellipses.scene_scale


def test_a_pin_put_on_a_moved_part_moves_nothing_near_or_far(main, opened):
    handle, scene = bent(main, opened), opened.scene
    far = 0.4 * scene.ellipses.scene_scale
    opened.steps.change_edit(scene.edit.with_options(ReachOptions(far)), "Free less")
    main.run_until(lambda: opened.state == "settled")
    before, n_held = scene.kernels.means.copy(), len(opened.bound.handles.indices)
    moved = np.linalg.norm(before - scene.splats.means, axis=1)
    is_free = np.isin(np.arange(len(moved)), handle.region.rows, invert=True) & (moved > 0.0)
    row = int(np.flatnonzero(is_free)[np.argsort(moved[is_free])[is_free.sum() // 4]])
    region = rows_region(scene, disc_rows(scene, row, 0.03 * scene.ellipses.scene_scale))
    pin = opened.steps.add_held(region, held_pose(scene, region))
    main.run_until(lambda: opened.state == "settled")
    assert n_held < len(opened.bound.handles.indices) <= n_held + len(region.rows)
    assert np.linalg.norm(scene.kernels.means - before, axis=1).max() < 0.01 * scene.ellipses.scene_scale
    assert scene.active_handles == (handle.handle_id,) and (pin.name, pin.color) == ("Pin 2", PIN_COLOR)
    assert opened.steps.add_pin(rows_region(scene, np.array([0]))).name == "Pin 3"
    again = recipe_from_json(recipe_to_json(recipe_of(scene.edit)))
    assert [spec.frees for spec in again.handles] == [True, False]
    assert not binds_like(scene.edit, scene.edit.with_handle(replace(pin, frees=True)))


def test_a_disabled_handle_lets_go(main, opened):
    handle = bent(main, opened)
    edit = opened.scene.edit
    opened.steps.change_edit(edit.with_handle(replace(edit.handle(handle.handle_id), enabled=False)), "Disable handle")
    main.run_until(lambda: opened.state == "ready")
    assert opened.scene.kernels is None


def test_changing_the_graph_prepares_anew(main, opened):
    bent(main, opened)
    edit = opened.scene.edit
    opened.steps.change_edit(edit.with_options(replace(edit.graph, k=12)), "Change graph")
    main.run_until(lambda: opened.state == "settled")
    assert opened.scene.surface.options.k == 12


def test_weights_by_bounded_biharmonics_pose_too(main, opened):
    bent(main, opened)
    opened.steps.change_edit(replace(opened.scene.edit, method="bbw"), "Change method")
    main.run_until(lambda: opened.state == "settled")
    assert opened.bound.deformer.weights.shape[1] == 1
    assert opened.scene.kernels.changed.any()


def test_selection_steps_are_undone_too(opened):
    mask = np.zeros(opened.scene.splats.n_splats, bool)
    mask[5:50] = True
    opened.steps.change_mask("selection", mask, "Select")
    opened.steps.change_mask("selection", mask, "Select")
    assert opened.history.undo() and not opened.history.can_undo
    assert not opened.scene.selection.any()
    opened.history.redo()
    np.testing.assert_array_equal(opened.scene.selection, mask)


def test_closing_while_a_job_runs_ends_cleanly(main, session, monkeypatch):
    started = threading.Event()
    slow_graph(monkeypatch, started)
    session.open(TUBE)
    main.run_until(started.is_set)
    session.close()
    assert not any(thread.name.startswith("splap") for thread in threading.enumerate())


def weighed(main, session):
    """Two handles with bounded biharmonic weights."""
    scene = session.scene
    session.steps.change_edit(replace(scene.edit, method="bbw"), "Change method")
    for sign in (-1, 1):
        session.steps.add_handle(rows_region(scene, end_rows(scene, sign)))
    main.run_until(lambda: session.state == "settled")


def test_weights_found_before_are_not_solved_for_again(main, opened, monkeypatch):
    weighed(main, opened)
    kept = opened.bound.deformer

    def refuse(*_, **__):
        raise AssertionError("solved although the cache has it")

    monkeypatch.setattr("splap_editor.core.bbw.binding.handle_weight", refuse)
    opened.steps.change_edit(opened.scene.edit.with_options(BbwOptions(blending="linear")), "Change blending")
    main.run_until(lambda: opened.state == "settled")
    assert opened.failures == []
    assert opened.bound.deformer is not kept
    np.testing.assert_array_equal(opened.bound.deformer.weights, kept.weights)


def test_cancelling_the_weights_leaves_scene_and_cache_as_they_were(main, opened, monkeypatch):
    weighed(main, opened)
    scene, cache = opened.scene, opened.cache.folder
    entries, bound, kernels = sorted(cache.iterdir()), opened.bound, scene.kernels
    under_way, go_on = threading.Event(), threading.Event()

    def slow(problem, handle, progress):
        under_way.set()
        while not go_on.wait(0.01):
            progress(0.5)
        raise AssertionError("it was to be cancelled")

    with monkeypatch.context() as patched:
        patched.setattr("splap_editor.core.bbw.binding.handle_weight", slow)
        opened.steps.change_edit(
            replace(scene.edit, handles=tuple(replace(h, cage_radius=None) for h in scene.edit.handles)), "Change cage"
        )
        main.run_until(under_way.is_set)
        opened.halt()
        main.run_until(lambda: not opened.worker.is_busy())
        opened.history.undo()
    assert sorted(cache.iterdir()) == entries
    assert opened.bound is bound and scene.kernels is kernels
    opened.resume()
    main.run_until(lambda: opened.state == "settled")
    assert opened.bound is bound, "the weights from before still serve"
    assert sorted(cache.iterdir()) == entries and opened.failures == []
