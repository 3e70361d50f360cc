"""Session files as the window opens and saves them, without the window."""

import json
import os
import shutil
import threading
from dataclasses import replace

import numpy as np
import pytest

from splap_editor.core.graph.options import GraphOptions
from splap_editor.core.handle_nodes import Region
from splap_editor.core.pose import Pose
from splap_editor.core.progress import Cancelled
from splap_editor.engine.edit import Edit
from splap_editor.engine.keyframes import edit_at_frame, keyed_edit
from splap_editor.io.session_file import SessionFileError, read_session_file
from splap_editor.io.session_specs import ViewSpec
from splap_editor.io.splat_files import read_splats
from splap_editor.resources import resource
from splap_editor.session import documents, jobs, work
from splap_editor.session.commands import ChangeSelectionSets
from splap_editor.session.documents import Documents, MissingPlyError
from splap_editor.session.placement import rows_region
from splap_editor.session.saved_state import Look
from splap_editor.session.session import Session

from .main_thread import MainThread

LOOK = Look(ViewSpec((1.0, 2.0, 3.0), (0.0, 0.0, 0.1), (0.0, 0.0, 1.0)), {"mode": "points", "size_factor": 0.4})


class Desk:
    """A session and its documents with a capture in a folder of their own; nothing is computed."""

    def __init__(self, folder):
        self.folder = folder
        self.ply = folder / "captures" / "tube.ply"
        self.ply.parent.mkdir(exist_ok=True)
        shutil.copy(resource("samples", "tube.ply"), self.ply)
        self.main = MainThread()
        self.session = Session(self.main.post)
        self.documents = Documents(self.session, self.main.post)
        self.documents.look = lambda: LOOK
        self.failures, self.opened, self.saved = [], [], []
        self.session.scene_changed.connect(self.session.halt)
        self.session.failed.connect(lambda title, error: self.failures.append(error))
        self.documents.failed.connect(lambda title, error: self.failures.append(error))
        self.documents.opened.connect(lambda session, notes: self.opened.append((session, notes)))
        self.documents.saved.connect(self.saved.append)

    @property
    def scene(self):
        return self.session.scene

    def open_ply(self):
        before = self.scene
        self.session.open(self.ply)
        self.main.run_until(lambda: self.scene is not before)

    def open(self, path):
        n = len(self.opened) + len(self.failures)
        self.documents.open(path)
        self.main.run_until(lambda: len(self.opened) + len(self.failures) > n)

    def save(self, path=None):
        n = len(self.saved) + len(self.failures)
        self.documents.save(path)
        self.main.run_until(lambda: len(self.saved) + len(self.failures) > n)

    def edit(self):
        """Two handles, one disabled and deleted ones before it, a pin, keys, a selection, hidden splats and a set."""
        session, scene = self.session, self.scene
        gone = session.steps.add_handle(Region(np.array([9.0, 9.0, 9.0]), 1.0))
        session.steps.change_edit(scene.edit.without_handles([gone.handle_id]), "Delete handle")
        session.steps.add_handle(
            rows_region(scene, np.arange(50, 90)), pose=Pose((0.1, 1 / 3, 0.0), (0.8, 0.6, 0.0, 0.0))
        )
        second = session.steps.add_handle(Region(np.array([0.1, 0.2, 1 / 3]), 0.07), name="tip")
        session.steps.add_pin(Region(np.array([0.0, 0.0, -0.5]), 0.2))
        session.steps.change_edit(
            scene.edit.with_handle(replace(second, enabled=False, color="#123456")), "Change handle"
        )
        session.steps.change_edit(keyed_edit(scene.edit), "Set key")
        session.steps.change_edit(edit_at_frame(scene.edit, 24), "Go to frame 24")
        handle = scene.edit.handles[0]
        session.steps.change_edit(scene.edit.with_poses({handle.handle_id: Pose((0.0, 0.0, 0.2))}), "Move handle")
        mask = np.zeros(scene.splats.n_splats, bool)
        mask[3:30] = True
        session.steps.change_mask("selection", mask, "Select")
        session.steps.change_mask("hidden", ~mask, "Hide")
        session.history.push(ChangeSelectionSets(scene, {"end": mask}, "Keep selection"))

    def close(self):
        self.documents.close()
        self.session.close()


@pytest.fixture
def desk(tmp_path):
    desk = Desk(tmp_path)
    yield desk
    desk.close()


def assert_same_edit(a, b):
    assert [(h.handle_id, h.name, h.color, h.pose, h.enabled) for h in a.handles] == [
        (h.handle_id, h.name, h.color, h.pose, h.enabled) for h in b.handles
    ]
    assert [(p.pin_id, p.name, p.reach) for p in a.pins] == [(p.pin_id, p.name, p.reach) for p in b.pins]
    for held, again in zip((*a.handles, *a.pins), (*b.handles, *b.pins), strict=True):
        left, right = held.region, again.region
        np.testing.assert_array_equal(left.center, right.center)
        np.testing.assert_array_equal(left.rows, right.rows)
        assert left.rows is not None or left.radius == right.radius
    assert (a.timeline, a.options, a.method) == (b.timeline, b.options, b.method)


def test_a_saved_session_opens_as_it_was(desk, tmp_path):
    desk.open_ply()
    desk.edit()
    before, path = desk.scene, tmp_path / "work.splap"
    desk.save(path)
    assert json.loads(path.read_text())["ply"]["path"] == "captures/tube.ply"
    desk.open_ply()
    assert desk.scene.edit.handles == () and desk.documents.path is None
    desk.open(path)
    assert desk.failures == [] and desk.scene is not before
    (session, notes), scene = desk.opened[-1], desk.scene
    assert notes == [] and (session.view, session.display) == (LOOK.view, LOOK.display)
    assert_same_edit(scene.edit, before.edit)
    for name in ("selection", "hidden"):
        np.testing.assert_array_equal(getattr(scene, name), getattr(before, name))
    np.testing.assert_array_equal(scene.selection_sets["end"], before.selection_sets["end"])
    assert scene.active_handles == before.active_handles
    assert desk.documents.path == path and not desk.documents.is_dirty
    assert not desk.session.history.can_undo
    data = path.read_bytes()
    desk.save()
    assert path.read_bytes() == data


def test_an_edit_is_dirty_until_it_is_saved_and_clean_again_when_undone(desk, tmp_path):
    desk.open_ply()
    documents, session = desk.documents, desk.session
    assert not documents.is_dirty
    session.steps.add_handle(Region(np.zeros(3), 0.1), pose=Pose((0.1, 0.0, 0.0)))
    assert documents.is_dirty and documents.would_lose
    desk.save(tmp_path / "a.splap")
    assert not documents.is_dirty and not documents.would_lose
    session.history.undo()
    assert documents.is_dirty
    session.history.redo()
    assert not documents.is_dirty


def test_undo_chooses_again_what_was_chosen(desk):
    desk.open_ply()
    session, scene = desk.session, desk.scene
    first = session.steps.add_handle(Region(np.zeros(3), 0.1))
    session.steps.add_handle(Region(np.array([0.0, 0.0, 0.5]), 0.1))
    session.history.undo()
    assert scene.active_handles == (first.handle_id,)
    session.steps.change_edit(scene.edit.without_handles([first.handle_id]), "Delete handle")
    assert not scene.active_handles
    session.history.undo()
    assert scene.active_handles == (first.handle_id,)


def test_what_a_session_still_has_is_lost_when_it_is_deleted_only_in_the_window(desk, tmp_path):
    desk.open_ply()
    desk.session.steps.add_pin(Region(np.zeros(3), 0.1))
    desk.save(tmp_path / "a.splap")
    assert not desk.documents.would_lose
    desk.session.steps.change_edit(desk.scene.edit.without_pins([1]), "Delete pin")
    assert desk.documents.would_lose


@pytest.mark.parametrize("mend", [{"cut": ((0, 1),)}, {"add": ((0, 1),)}])
def test_a_mend_is_work(mend):
    edit = Edit().with_options(GraphOptions(**mend))
    assert edit.has_work and not Edit().has_work


def test_saving_without_a_name_is_refused(desk):
    desk.open_ply()
    with pytest.raises(ValueError, match="no session file yet"):
        desk.documents.save()


def test_a_save_under_way_is_finished_on_closing(desk, tmp_path):
    desk.open_ply()
    desk.edit()
    desk.documents.save(tmp_path / "a.splap")
    desk.documents.close()
    assert read_session_file(tmp_path / "a.splap").recipe.handles


def test_a_save_that_fails_is_said_and_leaves_the_edit_dirty(desk, tmp_path):
    desk.open_ply()
    desk.edit()
    desk.save(tmp_path / "no" / "a.splap")
    assert isinstance(desk.failures[0], SessionFileError)
    assert desk.documents.is_dirty and desk.documents.path is None


def test_a_missing_ply_is_said_and_can_be_located(desk, tmp_path):
    desk.open_ply()
    desk.edit()
    edit, path = desk.scene.edit, tmp_path / "work.splap"
    desk.save(path)
    desk.open_ply()
    moved = tmp_path / "elsewhere.ply"
    desk.ply.rename(moved)
    before = desk.scene
    desk.open(path)
    (error,) = desk.failures
    assert isinstance(error, MissingPlyError) and error.document == path and "tube.ply" in str(error)
    assert desk.scene is before
    error.open_with(moved)
    desk.main.run_until(lambda: len(desk.opened) == 1)
    assert_same_edit(desk.scene.edit, edit)
    assert desk.opened[-1][1] == []
    desk.save()
    assert read_session_file(path).ply.path == "elsewhere.ply"


def test_session_and_ply_may_move_together(desk, tmp_path):
    desk.open_ply()
    desk.edit()
    desk.save(tmp_path / "work.splap")
    os.rename(desk.ply.parent, tmp_path / "moved")
    (tmp_path / "work.splap").rename(tmp_path / "moved" / "work.splap")
    desk.open(tmp_path / "moved" / "work.splap")
    assert desk.failures == [] and desk.scene.file.path == tmp_path / "moved" / "tube.ply"


def test_a_changed_ply_is_said_and_opens(desk, tmp_path):
    desk.open_ply()
    desk.edit()
    desk.save(tmp_path / "work.splap")
    data = bytearray(desk.ply.read_bytes())
    data[-1] ^= 1
    desk.ply.write_bytes(data)
    desk.open(tmp_path / "work.splap")
    assert desk.failures == []
    (note,) = desk.opened[-1][1]
    assert "has changed since" in note


def test_a_ply_with_too_few_splats_is_refused_and_the_open_scene_stays(desk, tmp_path):
    desk.open_ply()
    desk.session.steps.add_handle(rows_region(desk.scene, np.array([desk.scene.splats.n_splats - 1])))
    desk.save(tmp_path / "work.splap")
    held = json.loads((tmp_path / "work.splap").read_text())
    held["recipe"]["handles"][0]["rows"] = [10**9]
    (tmp_path / "work.splap").write_text(json.dumps(held))
    before = desk.scene
    desk.open(tmp_path / "work.splap")
    assert "does not fit tube.ply" in str(desk.failures[0])
    assert desk.scene is before


def test_a_corrupt_session_is_refused_and_the_open_scene_stays(desk, tmp_path):
    desk.open_ply()
    before, path = desk.scene, tmp_path / "bad.splap"
    path.write_bytes(b"{}")
    desk.open(path)
    assert str(desk.failures[0]) == "bad.splap: it is not a SpLap session."
    assert desk.scene is before and desk.documents.path is None


def test_kept_selections_are_undone(desk):
    desk.open_ply()
    mask = np.ones(desk.scene.splats.n_splats, bool)
    desk.session.history.push(ChangeSelectionSets(desk.scene, {"all": mask}, "Keep selection"))
    assert desk.documents.is_dirty
    desk.session.history.undo()
    assert desk.scene.selection_sets == {} and not desk.documents.is_dirty


@pytest.fixture
def door(monkeypatch):
    """Files whose name begins with "slow" are read once it is opened, and reading them hears nothing till then."""
    door = Door()
    monkeypatch.setattr(work, "read_splats", door.guarded(read_splats))
    monkeypatch.setattr(documents, "read_session_file", door.guarded(read_session_file))
    yield door
    door.opened.set()


class Door:
    def __init__(self):
        self.opened, self.reached = threading.Event(), threading.Event()

    def guarded(self, read):
        def guarded(path, progress, **options):
            if path.name.startswith("slow"):
                self.reached.set()
                assert self.opened.wait(120.0)
            return read(path, **options)

        return guarded


@pytest.mark.parametrize("second", ["ply", "session"])
@pytest.mark.parametrize("first", ["ply", "session", "damaged ply", "damaged session"])
def test_a_file_opens_while_another_is_blocked_and_what_comes_of_that_is_dropped(desk, tmp_path, door, first, second):
    desk.open_ply()
    desk.edit()
    desk.save(tmp_path / "work.splap")
    source = desk.ply if "ply" in first else tmp_path / "work.splap"
    slow = source.with_name(f"slow{source.suffix}")
    slow.write_bytes(b"ply" if "damaged" in first else source.read_bytes())
    before = desk.scene
    (desk.session if "ply" in first else desk.documents).open(slow)
    assert door.reached.wait(120.0)
    if second == "ply":
        desk.open_ply()
    else:
        desk.open(tmp_path / "work.splap")
    shown, path = desk.scene, desk.documents.path
    assert shown is not before and shown.file.path == desk.ply and (path is None) == (second == "ply")
    door.opened.set()
    for name in ("splap-open", "splap-sessions", "splap-open"):
        desk.main.run_to_the_end_of(name)
    assert desk.scene is shown and desk.documents.path == path and desk.failures == []


def test_closing_does_not_wait_for_a_reader_that_is_blocked(desk, door, monkeypatch):
    monkeypatch.setattr(jobs, "LEAVE_SECONDS", 0.0)
    slow = desk.ply.with_name("slow.ply")
    shutil.copy(desk.ply, slow)
    desk.session.open(slow)
    assert door.reached.wait(120.0)
    while not desk.main.calls.empty():
        desk.main.calls.get()()
    desk.close()
    door.opened.set()
    desk.main.run_to_the_end_of("splap-open")
    assert desk.scene is None, "what it read comes to nobody any more"


def test_the_hash_made_during_a_save_asks_whether_it_shall_stop(desk, tmp_path, monkeypatch):
    reports = []

    def unreadable(path, progress):
        reports.append(progress)
        raise OSError("no such luck")

    monkeypatch.setattr(documents, "content_hash", unreadable)
    desk.open_ply()
    desk.save(tmp_path / "work.splap")
    job = reports[-1].__self__
    assert job.kind == "save"
    job.cancel()
    with pytest.raises(Cancelled):
        reports[-1](0.5)
