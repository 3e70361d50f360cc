"""Removing splats in a session."""

import numpy as np
import pytest

from splap_editor.engine.cache import StageCache
from splap_editor.engine.removal import Removal
from splap_editor.io.ply import read_ply
from splap_editor.resources import resource
from splap_editor.session.saved_state import Look, restore_scene, saved_state, session_file_of
from splap_editor.session.scene import Scene
from splap_editor.session.session import Session

TUBE = resource("samples", "tube.ply")


@pytest.fixture
def session(main, tmp_path):
    session = Session(main.post, cache=StageCache(tmp_path / "cache"))
    session.open(TUBE)
    main.run_until(lambda: session.state == "ready")
    yield session
    session.close()


def half(scene):
    x = np.asarray(scene.splats.means)[:, 0]
    return x > np.median(x)


def remove(session, mask):
    return session.steps.change_removal(session.scene.edit.removal.with_rows(mask), "Delete splats")


def test_removed_splats_are_gone_at_once_and_from_the_surface_soon(main, session):
    scene, mask = session.scene, half(session.scene)
    session.steps.change_mask("selection", mask, "Select")
    size = scene.ellipses.scene_scale
    assert remove(session, mask) == mask.sum()
    np.testing.assert_array_equal(scene.unseen, mask)
    assert not scene.selection.any()
    main.run_until(lambda: session.state == "ready")
    assert not mask[scene.surface.ellipses.rows].any()
    assert scene.ellipses is scene.surface.ellipses
    assert scene.ellipses.scene_scale < size
    session.steps.change_mask("selection", np.ones_like(mask), "Select all")
    np.testing.assert_array_equal(scene.selection, ~mask)


def test_undo_brings_splats_selection_and_file_back(main, session, tmp_path):
    scene, mask = session.scene, half(session.scene)
    session.steps.change_mask("selection", mask, "Select")
    remove(session, mask)
    main.run_until(lambda: session.state == "ready")
    session.history.undo()
    np.testing.assert_array_equal(scene.selection, mask)
    assert not scene.unseen.any()
    session.export(tmp_path / "out.ply")
    main.run_until(lambda: session.state == "ready" and (tmp_path / "out.ply").exists())
    assert (tmp_path / "out.ply").read_bytes() == TUBE.read_bytes()
    assert scene.surface.ellipses.removed is None


def test_an_export_leaves_them_out_and_counts_them(main, session, tmp_path):
    reports = []
    session.exported.connect(reports.append)
    mask = half(session.scene)
    remove(session, mask)
    assert session.has_unexported_edit
    session.export(tmp_path / "out.ply")
    main.run_until(lambda: reports)
    assert not session.has_unexported_edit
    assert (reports[0].n_splats, reports[0].n_removed) == ((~mask).sum(), mask.sum())
    rows = read_ply(tmp_path / "out.ply").table.rows
    assert rows.tobytes() == session.scene.file.table.rows[~mask].tobytes()


def test_removed_splats_that_are_shown_can_be_selected_and_restored(main, session):
    scene, mask = session.scene, half(session.scene)
    remove(session, mask)
    scene.set_shows_removed(True)
    assert not scene.unseen.any()
    session.steps.change_mask("selection", np.ones_like(mask), "Select all")
    assert scene.selection.all()
    few = mask & (np.cumsum(mask) <= 10)
    session.steps.change_removal(scene.edit.removal.with_rows(few, restores=True), "Restore selected")
    np.testing.assert_array_equal(scene.removed, mask & ~few)
    np.testing.assert_array_equal(scene.selection, few)
    scene.set_shows_removed(False)
    np.testing.assert_array_equal(scene.unseen, mask & ~few)


def test_everything_cannot_be_removed(session):
    with pytest.raises(ValueError, match="keep at least one"):
        remove(session, np.ones(session.scene.splats.n_splats, bool))
    assert session.scene.edit.removed is None
    assert session.steps.change_removal(Removal(), "Restore all") == 0
    assert not session.history.can_undo


def test_a_session_file_holds_what_is_removed(session, tmp_path):
    mask = half(session.scene)
    remove(session, mask)
    kept = session_file_of(saved_state(session.scene, Look()), tmp_path, "")
    again = Scene(session.scene.file, session.scene.ellipses)
    restore_scene(again, kept)
    np.testing.assert_array_equal(again.removed, mask)
