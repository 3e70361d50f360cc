"""Cancel, failure, and leaving: nothing is lost and nothing is left running."""

import subprocess
import sys
import textwrap
import zipfile
from pathlib import Path

import pytest
from PySide6.QtCore import QMimeData, QPoint, QPointF, Qt, QUrl
from PySide6.QtGui import QDragEnterEvent, QDropEvent
from PySide6.QtWidgets import QApplication, QFileDialog, QMessageBox, QPushButton

from splap_editor.core.handle_nodes import Region
from splap_editor.engine.edit import Pose
from splap_editor.io.splat_files import read_splats, write_splats
from splap_editor.resources import resource

from .conftest import WAIT_MS, Driver

TUBE = resource("samples", "tube.ply")


def bend(driver: Driver) -> None:
    """Place a handle and move it, as one who has work to lose."""
    handle = driver.session.steps.add_handle(Region(driver.scene.ellipses.centers[0], 0.1))
    driver.session.drag.preview({handle.handle_id: Pose((0.0, 0.0, 0.1))})
    driver.session.drag.commit("Move handle")
    driver.wait_idle()


def question() -> QMessageBox:
    return next(w for w in QApplication.topLevelWidgets() if isinstance(w, QMessageBox) and w.isVisible())


def answer(text: str) -> None:
    box = question()
    next(button for button in box.findChildren(QPushButton) if button.text() == text).click()


def drop(window, path: Path) -> None:
    data = QMimeData()
    data.setUrls([QUrl.fromLocalFile(str(path))])
    held = (Qt.DropAction.CopyAction, data, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier)
    window.dragEnterEvent(QDragEnterEvent(QPoint(400, 300), *held))
    window.dropEvent(QDropEvent(QPointF(400, 300), *held))


def test_a_dropped_file_opens(driver, qtbot):
    before = driver.scene
    drop(driver.window, resource("samples", "coil.ply"))
    qtbot.waitUntil(lambda: driver.scene is not before, timeout=WAIT_MS)
    assert driver.window.windowTitle().startswith("coil.ply")
    assert driver.session.history.can_undo is False


@pytest.mark.parametrize("name", ["", "meta.json"])
def test_a_dropped_folder_of_splats_opens_and_so_does_the_file_that_names_the_others(driver, qtbot, tmp_path, name):
    file = read_splats(resource("samples", "coil.ply"))
    write_splats(tmp_path / "coil.sog", file, file.splats)
    with zipfile.ZipFile(tmp_path / "coil.sog") as held:
        held.extractall(tmp_path / "coil")
    before = driver.scene
    drop(driver.window, tmp_path / "coil" / name)
    qtbot.waitUntil(lambda: driver.scene is not before, timeout=WAIT_MS)
    assert driver.scene.splats.n_splats == file.splats.n_splats and driver.scene.file.format_name == "sog-folder"


def test_a_broken_file_is_refused_in_a_sentence_and_the_scene_stays(driver, qtbot, tmp_path):
    broken = tmp_path / "broken.ply"
    broken.write_bytes(b"ply\nformat binary_little_endian 1.0\nelement vertex 9\n")
    before = driver.scene
    driver.window.files.open_path(broken)
    qtbot.waitUntil(lambda: "broken.ply failed" in driver.window.toast.text, timeout=WAIT_MS)
    assert driver.scene is before
    driver.wait_idle()


def test_a_file_that_vanished_is_said(driver, qtbot, tmp_path):
    driver.window.files.open_path(tmp_path / "gone.ply")
    qtbot.waitUntil(lambda: "gone.ply failed" in driver.window.toast.text, timeout=WAIT_MS)


@pytest.mark.parametrize("choice", ["Discard", "Cancel"])
def test_opening_asks_before_an_edit_is_lost(driver, qtbot, choice):
    bend(driver)
    before = driver.scene
    driver.window.files.open_path(TUBE)
    answer(choice)
    if choice == "Discard":
        qtbot.waitUntil(lambda: driver.scene is not before, timeout=WAIT_MS)
        driver.wait_idle()
    else:
        assert driver.scene is before
        assert not driver.session.is_busy("open")


def test_closing_asks_before_an_edit_is_lost(driver, qtbot):
    bend(driver)
    driver.window.close()
    assert driver.window.isVisible()
    answer("Cancel")
    assert driver.window.isVisible()
    driver.window.close()
    answer("Discard")
    assert not driver.window.isVisible()


def test_quitting_asks_before_handles_and_pins_are_lost(driver):
    quit_key = (Qt.Key.Key_Q, Qt.KeyboardModifier.ControlModifier)
    region = Region(driver.scene.ellipses.centers[0], 0.1)
    for place in (driver.session.steps.add_pin, driver.session.steps.add_handle):
        place(region)
        driver.wait_idle()
        assert driver.scene.edit.is_identity
        driver.key(*quit_key)
        answer("Cancel")
        assert driver.window.isVisible()
        driver.session.history.undo()
        driver.wait_idle()
    driver.key(*quit_key)
    assert not driver.window.isVisible(), "nothing is left to be lost"


def test_cancel_stops_preparing_and_resume_goes_on(empty_window, qtbot):
    driver = Driver(empty_window, qtbot)
    driver.open(TUBE)
    assert driver.session.state == "preparing"
    empty_window.actions_["edit.stop"].trigger()
    assert driver.session.state == "halted"
    assert empty_window.job_bar.text == "Background work stopped."
    qtbot.waitUntil(lambda: not driver.session.worker.is_busy(), timeout=WAIT_MS)
    assert driver.scene.surface is None
    empty_window.actions_["edit.resume"].trigger()
    driver.wait_idle()
    assert driver.scene.surface is not None


def test_a_second_file_cancels_the_first(empty_window, qtbot):
    driver = Driver(empty_window, qtbot)
    empty_window.files.open_path(TUBE)
    empty_window.files.open_path(resource("samples", "coil.ply"))
    qtbot.waitUntil(lambda: driver.scene is not None, timeout=WAIT_MS)
    assert driver.scene.file.path.name == "coil.ply"


def test_saved_edits_open_again(driver, qtbot, tmp_path):
    bend(driver)
    edit = driver.scene.edit
    path = tmp_path / "edit.json"
    driver.window.actions_["file.export_edit"].trigger()
    driver.window.findChild(QFileDialog).fileSelected.emit(str(path))
    driver.window.actions_["handle.reset_all"].trigger()
    driver.window.files.open_path(path)
    qtbot.waitUntil(lambda: driver.window.toast.text == "Opened the edit edit.json.", timeout=WAIT_MS)
    assert [handle.pose for handle in driver.scene.edit.handles] == [handle.pose for handle in edit.handles]
    driver.wait_idle()


@pytest.mark.parametrize("moment", ["compiling", "opening", "preparing", "settling"])
def test_closing_while_a_job_runs_exits_with_0(tmp_path, moment):
    program = textwrap.dedent(
        f"""
        import sys
        from pathlib import Path
        from PySide6.QtCore import QSettings, QTimer
        from PySide6.QtGui import QSurfaceFormat
        from PySide6.QtWidgets import QApplication
        from splap_editor.app import make_window, open_first
        from splap_editor.core.handle_nodes import Region
        from splap_editor.engine.edit import Pose
        from splap_editor.ui.viewport_widget import ask_of_qt
        QSettings.setPath(QSettings.Format.NativeFormat, QSettings.Scope.UserScope, {str(tmp_path)!r})
        ask_of_qt()
        app = QApplication(["splap-editor"])
        window = make_window()
        window._may_close = True
        window.show()
        session = window.session
        def bend():
            if session.state == "ready":
                handle = session.steps.add_handle(Region(session.scene.ellipses.centers[0], 0.2))
                session.drag.preview({{handle.handle_id: Pose((0.0, 0.0, 0.5))}})
                session.drag.commit("Move")
            elif session.state == "settling":
                window.close()
        if {moment!r} == "opening":
            QTimer.singleShot(0, window.close)
        elif {moment!r} == "preparing":
            session.scene_changed.connect(window.close)
        else:
            session.state_changed.connect(lambda: QTimer.singleShot(0, bend))
        if {moment!r} == "compiling":
            first = open_first(window, Path({str(TUBE)!r}))
            assert first is not None and not first.compilation.is_done
            QTimer.singleShot(0, window.close)
        else:
            session.open(Path({str(TUBE)!r}))
        sys.exit(app.exec())
        """
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr


def test_a_thread_that_hears_nothing_and_never_falls_silent_ends_with_the_window(own_cache):
    # Emitting a signal lets go of Python's lock: taking it again once Python is gone aborts the process.
    program = textwrap.dedent(
        f"""
        import sys
        from pathlib import Path
        from PySide6.QtCore import QTimer
        from PySide6.QtWidgets import QApplication
        from splap_editor import app
        from splap_editor.session import background_thread, jobs
        background_thread.LEAVE_SECONDS = jobs.LEAVE_SECONDS = 0.1
        def talk(job):
            while True:
                window.autosave._post(lambda: None)
        def begin():
            global window
            window = next(w for w in QApplication.topLevelWidgets() if hasattr(w, "autosave"))
            for worker in (window.session.view_worker, window.session.detail_worker):
                worker.submit(jobs.Job("talk", "", talk))
            QTimer.singleShot(50, window.close)
        QTimer.singleShot(0, begin)
        sys.exit(app.run(Path({str(TUBE)!r})))
        """
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120, check=False)
    assert (done.returncode, done.stderr) == (0, "")
