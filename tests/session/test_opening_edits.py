"""Opening edits whose splats have to be looked for: off the main thread, with progress, cancelled by the person."""

import threading

import numpy as np
import pytest

from splap_editor.core.removal import PickedFloaters, RemovalStep
from splap_editor.engine.cache import StageCache
from splap_editor.engine.removal import Finder
from splap_editor.io.ply import read_ply
from splap_editor.io.sample_maker import write_sample
from splap_editor.resources import resource
from splap_editor.session.edit_file import write_edit
from splap_editor.session.saved_state import Look, restore_scene, saved_state, session_file_of
from splap_editor.session.session import Session
from tests.benchmark.floaters import with_floaters
from tests.session.main_thread import MainThread


@pytest.fixture(scope="module")
def raw(tmp_path_factory):
    """File of a capture with floaters."""
    path = tmp_path_factory.mktemp("raw") / "raw.ply"
    splats, _ = with_floaters(read_ply(resource("samples", "tube.ply")).splats, seed=7)
    write_sample(path, splats)
    return path


@pytest.fixture
def main():
    return MainThread()


@pytest.fixture
def session(main, raw, tmp_path):
    session = Session(main.post, cache=StageCache(tmp_path / "cache"))
    session.failures = []
    session.failed.connect(lambda title, error: session.failures.append(f"{title}: {error}"))
    session.open(raw)
    main.run_until(lambda: session.state == "ready")
    yield session
    session.close()


def take(session):
    scene = session.scene
    session.steps.change_removal(
        scene.edit.removal.with_step(RemovalStep(PickedFloaters()), scene.splats), "Remove floaters"
    )


def test_an_edit_with_floaters_is_worked_out_off_the_main_thread(main, session, tmp_path, monkeypatch):
    take(session)
    removed = session.scene.removed
    write_edit(tmp_path / "edit.json", session.scene)
    session.history.undo()
    main.run_until(lambda: session.state == "ready")
    threads, find = [], Finder.__call__

    def watched(self, *arguments):
        threads.append(threading.current_thread().name)
        return find(self, *arguments)

    monkeypatch.setattr(Finder, "__call__", watched)
    opened = []
    session.edit_opened.connect(opened.append)
    session.open_edit(tmp_path / "edit.json")
    assert session.scene.edit.removed is None and session.is_busy("edit")
    main.run_until(lambda: opened)
    np.testing.assert_array_equal(session.scene.removed, removed)
    assert threads == ["splap-open"]
    main.run_until(lambda: session.state == "ready")


def test_an_edit_that_does_not_fit_is_refused_in_a_sentence(main, session, tmp_path):
    (tmp_path / "edit.json").write_text('{"version": 1, "remove": {"quantity": {"name": "charm"}}}')
    session.open_edit(tmp_path / "edit.json")
    main.run_until(lambda: session.failures)
    assert session.failures[0].startswith("Opening edit.json: ")
    assert not session.history.can_undo


def test_halting_gives_up_an_edit_on_its_way(main, session, tmp_path, monkeypatch):
    take(session)
    write_edit(tmp_path / "edit.json", session.scene)
    session.history.undo()
    main.run_until(lambda: session.state == "ready")
    held, begun = threading.Event(), threading.Event()
    find = Finder.__call__

    def slow(self, *arguments):
        begun.set()
        held.wait(60.0)
        return find(self, *arguments)

    monkeypatch.setattr(Finder, "__call__", slow)
    session.open_edit(tmp_path / "edit.json")
    assert begun.wait(60.0)
    session.halt()
    held.set()
    main.run_to_the_end_of("splap-open")
    assert session.scene.edit.removed is None and session.failures == []


def test_a_session_with_floaters_tells_how_far_it_is(session, tmp_path):
    take(session)
    kept = session_file_of(saved_state(session.scene, Look()), tmp_path, "")
    told = []

    def stages(stage):
        return lambda share: told.append((stage, share))

    scene = type(session.scene)(session.scene.file, session.scene.ellipses)
    restore_scene(scene, kept, Finder(scene.splats, stages=stages))
    np.testing.assert_array_equal(scene.removed, session.scene.removed)
    assert {stage for stage, _ in told} == {"contributions", "floaters"}
