"""Autosave and recovery: whatever moment a process dies at, the edit is found whole."""

import os
import random
import select
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from splap_editor.core.handle_nodes import Region
from splap_editor.core.progress import Cancelled
from splap_editor.engine.edit import Pose
from splap_editor.io.file_lock import FileLock
from splap_editor.io.session_file import read_session_file, write_session_file
from splap_editor.io.session_specs import PlySpec, SessionFile
from splap_editor.resources import resource
from splap_editor.session.autosave import DELAY_S, Autosave
from splap_editor.session.documents import Documents
from splap_editor.session.recovery import left_behind as found_in
from splap_editor.session.recovery import new_slot, recovery_folder
from splap_editor.session.session import Session

from .main_thread import MainThread

TUBE = resource("samples", "tube.ply")
N_KILLS = 40


class Desk:
    """A session with autosave; nothing is computed."""

    def __init__(self, folder, *, delay_s=0.01):
        self.folder = folder
        self.main = MainThread()
        self.session = Session(self.main.post)
        self.documents = Documents(self.session, self.main.post)
        self.autosave = Autosave(self.documents, self.main.post, folder=folder, delay_s=delay_s)
        self.failures, self.written = [], []
        self.autosave.failed.connect(self.failures.append)
        self.autosave.written.connect(self.written.append)
        self.session.scene_changed.connect(self.session.halt)
        self.documents.failed.connect(lambda title, error: self.failures.append(error))

    @property
    def scene(self):
        return self.session.scene

    @property
    def files(self):
        return sorted(self.folder.glob("*.splap"))

    def open(self, path=TUBE):
        before = self.scene
        self.session.open(path)
        self.main.run_until(lambda: self.scene is not before)

    def move(self, x):
        """Move the handle, and wait until that is written."""
        edit = self.scene.edit
        if not edit.handles:
            self.session.steps.add_handle(Region(np.zeros(3), 0.1), pose=Pose((x, 0.0, 0.0)))
        else:
            self.session.steps.change_edit(edit.with_poses({edit.handles[0].handle_id: Pose((x, 0.0, 0.0))}), "Move")
        self.wait_written()

    def wait_written(self):
        edit = self.scene.edit
        self.main.run_until(lambda: self.failures or any(s is not None and s.edit is edit for s in self.written))

    def close(self, *, keep=False):
        self.autosave.close(keep=keep)
        self.documents.close()
        self.session.close()


@pytest.fixture
def desk(tmp_path):
    desk = Desk(tmp_path / "recovery")
    yield desk
    desk.close()


def left_behind(folder, x=0.5, *, document=None) -> Path:
    """A recovery file as a process leaves it that dies."""
    desk = Desk(folder)
    desk.open()
    desk.documents.path = document
    desk.move(x)
    desk.close(keep=True)
    return max(folder.glob("*.splap"), key=lambda path: path.stat().st_mtime_ns)


def test_a_change_is_on_disk_soon_and_gone_after_a_clean_exit(tmp_path):
    desk = Desk(tmp_path / "recovery")
    desk.open()
    assert desk.files == []
    desk.move(0.25)
    (path,) = desk.files
    held = read_session_file(path)
    assert held.recipe.handles[0].translate == (0.25, 0.0, 0.0)
    assert Path(held.ply.path) == TUBE.absolute() and held.document == ""
    desk.close()
    assert list((tmp_path / "recovery").iterdir()) == []


def test_saving_leaves_nothing_to_recover_until_the_next_change(desk, tmp_path):
    desk.open()
    desk.move(0.25)
    desk.documents.save(tmp_path / "a.splap")
    desk.main.run_until(lambda: desk.written[-1] is None)
    assert desk.files == []
    desk.move(0.5)
    assert read_session_file(desk.files[0]).document == str(tmp_path / "a.splap")


def test_undoing_back_to_the_saved_state_leaves_nothing_to_recover(desk):
    desk.open()
    desk.move(0.25)
    desk.session.history.undo()
    desk.main.run_until(lambda: desk.written[-1] is None)
    assert desk.files == []


def sought(desk):
    found = []
    desk.autosave.seek(found.append)
    desk.main.run_until(lambda: found)
    return found[0]


def test_a_search_that_is_given_up_leaves_every_edit_for_the_next_start(tmp_path):
    folder = tmp_path / "recovery"
    paths = {left_behind(folder, 1.0), left_behind(folder, 2.0)}
    shares = []

    def stop(share):
        shares.append(share)
        # In the middle of the second file.
        if 1.0 in shares and share < 1.0:
            raise Cancelled

    with pytest.raises(Cancelled):
        found_in(folder, stop)
    found = found_in(folder)
    assert {orphan.slot.path for orphan in found.orphans} == paths and found.set_aside == []
    for orphan in found.orphans:
        orphan.release()


def test_files_of_living_processes_are_left_alone(desk):
    desk.open()
    desk.move(0.25)
    assert sought(desk).orphans == []
    assert len(desk.files) == 1


def test_an_orphan_comes_back_with_its_document_and_stays_recoverable_until_saved(desk, tmp_path):
    document = tmp_path / "work.splap"
    left_behind(desk.folder, 0.75, document=document)
    desk.open()
    (orphan,) = sought(desk).orphans
    assert sought(desk).orphans == [], "one start at a time is offered an edit"
    before = desk.scene
    desk.autosave.restore(orphan)
    desk.main.run_until(lambda: desk.scene is not before)
    assert desk.scene.edit.handles[0].pose.translate == (0.75, 0.0, 0.0)
    assert desk.documents.path == document and desk.documents.is_dirty
    desk.wait_written()
    assert desk.files == [orphan.slot.path]
    desk.documents.save()
    desk.main.run_until(lambda: desk.written[-1] is None)
    assert desk.files == []
    assert read_session_file(document).recipe.handles[0].translate == (0.75, 0.0, 0.0)


def test_an_orphan_whose_capture_is_gone_is_kept(desk, tmp_path):
    path = left_behind(desk.folder)
    held = read_session_file(path)
    write_session_file(
        path, SessionFile(PlySpec(str(tmp_path / "gone.ply"), "", 1), held.recipe, held.handles, document="")
    )
    (orphan,) = sought(desk).orphans
    desk.autosave.restore(orphan)
    desk.main.run_until(lambda: desk.failures)
    assert "gone.ply is not where" in str(desk.failures[0])
    assert path.exists()
    orphan.release()


def test_a_discarded_orphan_is_gone(desk):
    left_behind(desk.folder)
    (orphan,) = sought(desk).orphans
    orphan.slot.remove()
    assert list(desk.folder.iterdir()) == []


def test_the_newest_orphan_comes_first(tmp_path):
    folder = tmp_path / "recovery"
    first, second = left_behind(folder, 1.0), left_behind(folder, 2.0)
    os.utime(first, (1e9, 1e9))
    (folder / "1-aa.lock").touch()
    found = found_in(folder).orphans
    assert [orphan.slot.path for orphan in found] == [second, first]
    assert not (folder / "1-aa.lock").exists()
    for orphan in found:
        orphan.slot.remove()


@pytest.mark.parametrize("content", [b"{", b"", b"\xff", b'{"version": ' + b"9" * 5000 + b"}", b"[" * 100_000, None])
def test_a_file_without_an_edit_is_set_aside_once_and_the_others_are_offered(tmp_path, content):
    folder = tmp_path / "recovery"
    whole = left_behind(folder)
    broken = folder / "broken.splap"
    broken.write_bytes(content) if content is not None else broken.mkdir()
    found = found_in(folder)
    assert [orphan.slot.path for orphan in found.orphans] == [whole]
    assert found.set_aside == [folder / "broken.splap.unreadable"] and found.set_aside[0].exists()
    found.orphans[0].release()
    again = found_in(folder)
    assert len(again.orphans) == 1 and again.set_aside == []
    again.orphans[0].slot.remove()


def test_a_process_told_to_end_writes_what_is_not_written_and_leaves_it(tmp_path):
    desk = Desk(tmp_path / "recovery", delay_s=3600.0)
    desk.open()
    desk.session.steps.add_handle(Region(np.zeros(3), 0.1), pose=Pose((0.25, 0.0, 0.0)))
    desk.autosave.close(keep=True)
    desk.documents.close()
    desk.session.close()
    (orphan,) = found_in(desk.folder).orphans
    assert orphan.session.recipe.handles[0].translate == (0.25, 0.0, 0.0)
    orphan.slot.remove()


def test_a_process_told_to_end_with_nothing_to_lose_leaves_nothing(tmp_path):
    desk = Desk(tmp_path / "recovery")
    desk.open()
    desk.move(0.25)
    desk.session.history.undo()
    desk.autosave.close(keep=True)
    desk.documents.close()
    desk.session.close()
    assert list(desk.folder.iterdir()) == []


def test_an_edit_is_written_within_half_a_second():
    assert DELAY_S <= 0.25


def test_a_folder_that_cannot_be_written_is_said_once(tmp_path):
    (tmp_path / "recovery").write_text("a file where the folder should be")
    desk = Desk(tmp_path / "recovery")
    desk.open()
    desk.move(0.1)
    desk.session.steps.add_handle(Region(np.zeros(3), 0.1))
    desk.close()
    assert len(desk.failures) == 1


def test_a_lock_is_held_by_one_and_let_go_by_release(tmp_path):
    lock = FileLock(tmp_path / "a.lock")
    with pytest.raises(BlockingIOError):
        FileLock(tmp_path / "a.lock")
    lock.release()
    FileLock(tmp_path / "a.lock").remove()
    assert not (tmp_path / "a.lock").exists()


def test_each_slot_is_a_file_of_its_own(tmp_path):
    slots = [new_slot(tmp_path) for _ in range(3)]
    assert len({slot.path for slot in slots}) == 3
    for slot in slots:
        slot.remove()


def test_the_folder_can_be_named(monkeypatch, tmp_path):
    monkeypatch.setenv("SPLAP_STATE_DIR", str(tmp_path))
    assert recovery_folder() == tmp_path / "recovery"


class Editor:
    """The program that edits until it is killed, and what it told so far."""

    def __init__(self):
        environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
        self.process = subprocess.Popen(
            [sys.executable, "-m", "tests.session.edit_until_killed"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=environment,
        )
        self._text = b""

    def start(self, *paths) -> int:
        """Pid of an editor on these paths."""
        self.process.stdin.write("\t".join(map(str, paths)).encode() + b"\n")
        self.process.stdin.flush()
        lines = self.read_until(b"child")
        return next(int(line.split()[1]) for line in lines if line.startswith(b"child"))

    def read_until(self, word, seconds=60.0):
        """Lines up to the first that starts with a word, and what came along with it."""
        end = time.monotonic() + seconds
        lines = []
        while not any(line.startswith(word) for line in lines):
            ready, _, _ = select.select([self.process.stdout], [], [], max(end - time.monotonic(), 0.0))
            assert ready, f"no {word!r} in time"
            data = os.read(self.process.stdout.fileno(), 1 << 16)
            assert data, "the program ended"
            self._text += data
            *whole, self._text = self._text.split(b"\n")
            lines += whole
        return lines

    def close(self):
        self.process.stdin.close()
        self.process.wait(30)
        self.process.stdout.close()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="processes are forked to start fast")
def test_a_process_killed_at_any_moment_leaves_the_old_or_the_new_state_whole(tmp_path):
    ply, draw, editor = tmp_path / "tube.ply", random.Random(11), Editor()
    shutil.copy(TUBE, ply)
    n_recovered = n_from_document = 0
    try:
        for trial in range(N_KILLS):
            folder, document = tmp_path / f"recovery{trial}", tmp_path / f"work{trial}.splap"
            pid = editor.start(ply, document, folder)
            lines = editor.read_until(b"does")
            # The moment of death: anywhere in the first states, writes and saves among them.
            select.select([], [], [], draw.uniform(0.0, 0.15))
            os.kill(pid, signal.SIGKILL)
            lines += editor.read_until(b"ended")
            asked = max(int(line.split()[1]) for line in lines if line.startswith(b"does"))
            kept = max((int(line.split()[1]) for line in lines if line.startswith(b"kept")), default=0)
            left = sorted(folder.glob("*.splap"))
            found = found_in(folder).orphans
            assert len(found) == len(left) <= 1, "a recovery file is whole, or it is not there"
            states = [orphan.session for orphan in found]
            if document.exists():
                states.append(read_session_file(document))
            numbers = [round(state.recipe.handles[0].translate[0]) for state in states]
            assert max(numbers, default=0) in range(kept, asked + 1), (trial, numbers, kept, asked)
            n_recovered += bool(found)
            n_from_document += document.exists()
            for orphan in found:
                orphan.slot.remove()
            assert not folder.exists() or list(folder.iterdir()) == []
    finally:
        editor.close()
    assert n_recovered >= N_KILLS // 2 and n_from_document >= 1
