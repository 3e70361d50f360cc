"""Saving, opening and recovering sessions in the window."""

import json
import shutil

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication, QFileDialog, QMessageBox, QPushButton

from splap_editor.core.handle_nodes import Region
from splap_editor.engine.edit import Pose
from splap_editor.io.session_file import read_session_file
from splap_editor.resources import resource
from splap_editor.session.autosave import Autosave
from splap_editor.session.documents import Documents
from splap_editor.session.recovery import recovery_folder
from splap_editor.session.session import Session

from .conftest import WAIT_MS, Driver

TUBE = resource("samples", "tube.ply")
CONTROL, SHIFT = Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.ShiftModifier


@pytest.fixture
def ply(tmp_path):
    return shutil.copy(TUBE, tmp_path / "capture.ply")


@pytest.fixture
def driver(empty_window, qtbot, ply):
    driver = Driver(empty_window, qtbot)
    driver.open(ply)
    driver.wait_idle()
    driver.wait_frame()
    return driver


def bend(driver, x=0.1):
    handle = driver.session.steps.add_handle(Region(driver.scene.ellipses.centers[0], 0.1))
    driver.session.drag.preview({handle.handle_id: Pose((x, 0.0, 0.0))})
    driver.session.drag.commit("Move handle")
    driver.wait_idle()


def answer_save_dialog(path):
    dialog = next(w for w in QApplication.topLevelWidgets() if isinstance(w, QFileDialog) and w.isVisible())
    dialog.selectFile(str(path))
    dialog.accept()


def answer(text):
    box = next(w for w in QApplication.topLevelWidgets() if isinstance(w, QMessageBox) and w.isVisible())
    next(button for button in box.findChildren(QPushButton) if button.text() == text).click()


def test_a_session_saved_by_key_opens_with_its_camera_and_display(driver, qtbot, tmp_path):
    window = driver.window
    bend(driver)
    window.display.set(mode="points", background="light")
    window.display.set(size_factor=0.35)
    camera = window.view.viewport.camera
    camera.orbit(120.0, 30.0)
    view, edit = camera.view, driver.scene.edit
    assert window.isWindowModified()

    driver.key(Qt.Key.Key_S, CONTROL)
    answer_save_dialog(tmp_path / "work.splap")
    qtbot.waitUntil(lambda: window.toast.text == "Saved work.splap.", timeout=WAIT_MS)
    assert not window.isWindowModified() and window.windowTitle().startswith("work.splap")

    window.display.set(mode="ellipses", background="dark")
    camera.orbit(-50.0, 0.0)
    driver.open(TUBE)
    assert window.windowTitle().startswith("tube.ply")
    driver.open(tmp_path / "work.splap")
    driver.wait_idle()
    again = window.view.viewport.camera.view
    for name in ("position", "focal_point", "view_up"):
        np.testing.assert_allclose(getattr(again, name), getattr(view, name), atol=1e-12)
    options = window.display.options
    assert (options.mode, options.background, options.size_factor) == ("points", "light", 0.35)
    assert driver.scene.edit.handles[0].pose == edit.handles[0].pose
    assert driver.scene.kernels is not None and driver.scene.kernels.changed.any()


def test_saving_again_asks_nothing(driver, qtbot, tmp_path):
    bend(driver)
    driver.window.documents.save(tmp_path / "work.splap")
    qtbot.waitUntil(lambda: not driver.window.documents.is_dirty, timeout=WAIT_MS)
    driver.window.actions_["handle.reset_all"].trigger()
    driver.key(Qt.Key.Key_S, CONTROL)
    qtbot.waitUntil(lambda: not driver.window.documents.is_dirty, timeout=WAIT_MS)
    assert read_session_file(tmp_path / "work.splap").recipe.handles[0].translate == (0.0, 0.0, 0.0)


def test_leaving_offers_to_save_and_goes_on_after_it(driver, qtbot, tmp_path):
    bend(driver)
    driver.window.close()
    answer("Save…")
    assert driver.window.isVisible()
    answer_save_dialog(tmp_path / "work.splap")
    qtbot.waitUntil(lambda: not driver.window.isVisible(), timeout=WAIT_MS)
    assert read_session_file(tmp_path / "work.splap").recipe.handles[0].translate == (0.1, 0.0, 0.0)


def test_a_saved_edit_is_left_without_a_question(driver, qtbot, tmp_path):
    bend(driver)
    driver.window.documents.save(tmp_path / "work.splap")
    qtbot.waitUntil(lambda: not driver.window.documents.is_dirty, timeout=WAIT_MS)
    driver.window.close()
    assert not driver.window.isVisible()


def test_a_missing_capture_is_said_and_found_by_hand(driver, qtbot, tmp_path, ply):
    bend(driver)
    driver.window.documents.save(tmp_path / "work.splap")
    qtbot.waitUntil(lambda: not driver.window.documents.is_dirty, timeout=WAIT_MS)
    shutil.move(ply, tmp_path / "moved.ply")
    driver.window.files.open_path(tmp_path / "work.splap")
    toast = driver.window.toast
    qtbot.waitUntil(lambda: "capture.ply is not where work.splap says" in toast.text, timeout=WAIT_MS)
    before = driver.scene
    next(b for b in toast.findChildren(QPushButton) if b.text() == "Find capture.ply…").click()
    answer_save_dialog(tmp_path / "moved.ply")
    qtbot.waitUntil(lambda: driver.scene is not before, timeout=WAIT_MS)
    assert len(driver.scene.edit.handles) == 1


def test_a_changed_capture_is_said(driver, qtbot, tmp_path, ply):
    driver.window.documents.save(tmp_path / "work.splap")
    qtbot.waitUntil((tmp_path / "work.splap").exists, timeout=WAIT_MS)
    qtbot.waitUntil(lambda: driver.window.documents.path is not None, timeout=WAIT_MS)
    data = bytearray(ply.read_bytes())
    data[-1] ^= 1
    ply.write_bytes(data)
    driver.open(tmp_path / "work.splap")
    assert "capture.ply has changed" in driver.window.toast.text


def test_a_foreign_session_is_refused_in_a_sentence(driver, qtbot, tmp_path):
    path = tmp_path / "other.splap"
    path.write_text(json.dumps({"format": "something else"}))
    before = driver.scene
    driver.window.files.open_path(path)
    qtbot.waitUntil(lambda: "it is not a SpLap session." in driver.window.toast.text, timeout=WAIT_MS)
    assert driver.scene is before


def test_recent_files_open_again(driver, qtbot, tmp_path, ply):
    recent = driver.window.document_actions.recent
    assert recent.paths == [ply]
    driver.open(TUBE)
    assert recent.paths == [ply], "the samples are always at hand"
    before = driver.scene
    recent.actions()[0].trigger()
    qtbot.waitUntil(lambda: driver.scene is not before, timeout=WAIT_MS)
    assert driver.scene.file.path == ply
    recent.actions()[-1].trigger()
    assert recent.paths == [] and not recent.isEnabled()


def leave_behind(driver, qtbot, ply, x):
    """What a process leaves that dies with an edit: everything it has on disk, and no lock."""
    calls = []
    session = Session(calls.append)
    documents = Documents(session, calls.append)
    autosave = Autosave(documents, calls.append, delay_s=0.0)

    def run() -> bool:
        while calls:
            calls.pop(0)()
        return True

    session.open(ply)
    qtbot.waitUntil(lambda: run() and session.scene is not None, timeout=WAIT_MS)
    session.halt()
    session.steps.add_handle(Region(session.scene.ellipses.centers[0], 0.1), pose=Pose((x, 0.0, 0.0)))
    qtbot.waitUntil(lambda: run() and any(recovery_folder().glob("*.splap")), timeout=WAIT_MS)
    autosave.close(keep=True)
    documents.close()
    session.close()


@pytest.mark.parametrize("choice", ["restore", "discard"])
def test_an_edit_left_behind_is_offered_back(driver, qtbot, ply, choice):
    leave_behind(driver, qtbot, ply, 0.3)
    window, bar = driver.window, driver.window.recovery_bar
    bar.look()
    qtbot.waitUntil(lambda: bar.text != "", timeout=WAIT_MS)
    assert "Your edit of capture.ply" in bar.text
    before = driver.scene
    if choice == "restore":
        bar.restore_button.click()
        qtbot.waitUntil(lambda: driver.scene is not before, timeout=WAIT_MS)
        assert driver.scene.edit.handles[0].pose.translate == (0.3, 0.0, 0.0)
        assert window.isWindowModified(), "it is not saved yet"
        driver.wait_idle()
    else:
        bar.discard_button.click()
        assert driver.scene is before
    assert bar.text == ""
    window.close_for_good()
    assert list(recovery_folder().iterdir()) == []
