"""A process that opens inputs in the real window: ``python -m tests.campaign.window SEED FOLDER``, on a display."""

import gc
import os
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from time import monotonic

import numpy as np
from PySide6.QtCore import QCoreApplication, QEvent, QPoint, QSettings, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from splap_editor.app import make_window
from splap_editor.core.handle_nodes import Region
from splap_editor.core.pose import Pose
from splap_editor.ui.main_window import MainWindow
from splap_editor.ui.theme import apply_theme
from splap_editor.ui.viewport_widget import ask_of_qt
from tests.campaign.kinds import written_input
from tests.campaign.worker import answer_lines

WAIT_SECONDS = 60.0
"""After which a window is taken to hang; the first of a process waits for compiled loops."""

AT_REST = ("ready", "settled", "failed")
SIZE = 900, 600


def wait(condition: Callable[[], bool], what: str) -> None:
    """Let the window work until something has happened."""
    until = monotonic() + WAIT_SECONDS
    while not condition():
        assert monotonic() < until, f"{what} did not happen"
        QTest.qWait(5)


def use(window: MainWindow, path: Path) -> str:
    """Open a file, place a handle and drag it a step; "nothing to drag" where no splat can be seen."""
    session = window.session
    window.files.open_path(path)
    wait(lambda: session.scene is not None or "failed" in window.toast.text, "opening")
    assert session.scene is not None, window.toast.text
    wait(lambda: session.state in AT_REST, "preparing")
    viewport = window.view.viewport
    points = viewport.screen_points()
    points = points[np.isfinite(points).all(axis=1)]
    if len(points):
        middle = np.array(SIZE) / 2
        x, y = np.clip(points[np.argmin(np.abs(points[:, :2] - middle).sum(axis=1)), :2], 0, SIZE)
        QTest.mouseMove(window.viewport, QPoint(round(x), round(y)))
        QTest.mouseClick(window.viewport, Qt.MouseButton.LeftButton, pos=QPoint(round(x), round(y)))
    scene = session.scene
    if not scene.edit.handles:
        if not scene.ellipses.n_nodes:
            return "nothing to drag"
        # It is too small or too far off for a click.
        session.steps.add_handle(Region(scene.ellipses.centers[0], 0.0, scene.ellipses.rows[:1]))
    wait(lambda: session.state in AT_REST, "binding")
    drag(window)
    wait(lambda: session.state in AT_REST, "settling")
    window.viewport.update()
    QTest.qWait(0)
    return "shown"


def drag(window: MainWindow) -> None:
    """Drag an arrow of the gizmo; where it cannot be taken hold of, the handle's own way."""
    session, viewport = window.session, window.view.viewport
    gizmo = viewport.gizmo
    tip = gizmo.frame[:3, 3] + 0.7 * gizmo.arm_length(viewport.projection) * np.array([0.0, 0.0, 1.0])
    x, y = np.nan_to_num(viewport.projection.pixel(tip), nan=0.0, posinf=0.0, neginf=0.0)
    at = QPoint(*(round(float(np.clip(value, 0, side))) for value, side in zip((x, y), SIZE, strict=True)))
    left, none = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier
    QTest.mouseMove(window.viewport, at)
    QTest.mousePress(window.viewport, left, none, at)
    for step in (1, 2):
        QTest.mouseMove(window.viewport, at + QPoint(3 * step, -8 * step))
        QTest.qWait(1)
    QTest.mouseRelease(window.viewport, left, none, at + QPoint(6, -16))
    scene = session.scene
    if scene is not None and scene.edit.is_identity:
        session.drag.preview({scene.edit.handles[0].handle_id: Pose((0.0, 0.0, 0.1))})
        session.drag.commit("Move handle")


def tried(folder: Path, seed: int, kind: str, number: int, left_out: tuple[int, ...] = ()) -> str:
    """``"shown"``, ``"nothing to drag"``, or a traceback; what is written to standard error counts as one."""
    path = written_input(folder, seed, kind, number, left_out)
    complaints = folder / "stderr"
    held = os.dup(2)
    with complaints.open("wb") as file:
        os.dup2(file.fileno(), 2)
        try:
            found = shown(path)
        except Exception:
            found = traceback.format_exc()
        finally:
            os.dup2(held, 2)
            os.close(held)
    said = complaints.read_text(errors="replace")
    return found if not said else f"{found}\non standard error:\n{said}"


def shown(path: Path) -> str:
    """Open a window, use it, and close it."""
    window = make_window()
    try:
        window.resize(*SIZE)
        window.show()
        assert QTest.qWaitForWindowExposed(window, int(1000 * WAIT_SECONDS))
        return use(window, path)
    finally:
        window.leave_at_once()
        window.deleteLater()
        QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
        del window
        gc.collect()


def main() -> None:
    """Answer numbers, as `tests.campaign.worker`."""
    folder = sys.argv[2]
    os.environ["SPLAP_STATE_DIR"] = os.path.join(folder, "state")
    ask_of_qt()
    app = QApplication(["splap-editor"])
    QCoreApplication.setOrganizationName("splap-editor-campaign")
    QSettings.setDefaultFormat(QSettings.Format.IniFormat)
    QSettings.setPath(QSettings.Format.IniFormat, QSettings.Scope.UserScope, os.path.join(folder, "settings"))
    apply_theme(app)
    # As in the program, windows are freed on their own thread alone: a worker that happens to collect would crash Qt.
    gc.disable()
    answer_lines(tried, Path(folder), int(sys.argv[1]))


if __name__ == "__main__":
    main()
