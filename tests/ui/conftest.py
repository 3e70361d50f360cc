"""Real windows under Xvfb: one per test, with settings of its own, closed at its end."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QCoreApplication, QEvent, QPoint, QPointF, QSettings, Qt
from PySide6.QtGui import QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from splap_editor.app import make_window
from splap_editor.resources import resource
from splap_editor.ui.main_window import MainWindow
from splap_editor.ui.theme import apply_theme
from splap_editor.ui.viewport_widget import ask_of_qt

WAIT_MS = 60_000
IDLE = ("ready", "settled")


@pytest.fixture(scope="session")
def qapp_args() -> list[str]:
    """Set the surface format before the application is made, as the program does."""
    ask_of_qt()
    return ["splap-editor"]


@pytest.fixture(autouse=True)
def own_settings(tmp_path: Path, qapp: QApplication) -> None:
    """Give each test settings nobody else sees."""
    QCoreApplication.setOrganizationName("splap-editor-tests")
    QCoreApplication.setApplicationName("splap-editor-tests")
    QSettings.setDefaultFormat(QSettings.Format.IniFormat)
    QSettings.setPath(QSettings.Format.IniFormat, QSettings.Scope.UserScope, str(tmp_path / "settings"))


@pytest.fixture(autouse=True)
def quiet(capfd: pytest.CaptureFixture[str]) -> Iterator[None]:
    """Fail a test during which anything was written to stderr, by Python or below it."""
    capfd.readouterr()
    yield
    assert capfd.readouterr().err == ""


class Driver:
    """A person in front of the window: points in logical pixels of the viewport."""

    def __init__(self, window: MainWindow, qtbot) -> None:
        self.window = window
        self.qtbot = qtbot

    @property
    def session(self):
        return self.window.session

    @property
    def scene(self):
        return self.window.session.scene

    def open(self, path: Path) -> None:
        before = self.scene
        self.window.files.open_path(path)
        self.qtbot.waitUntil(lambda: self.scene is not before, timeout=WAIT_MS)

    def wait_idle(self) -> None:
        self.qtbot.waitUntil(lambda: self.session.state in IDLE, timeout=WAIT_MS)

    def wait_frame(self) -> None:
        with self.qtbot.waitSignal(self.window.viewport.frame_drawn, timeout=WAIT_MS):
            self.window.viewport.update()

    def pixel_of(self, point: np.ndarray) -> QPoint:
        """Where a world point is on the screen."""
        x, y = self.window.view.viewport.projection.pixel(point) / self.window.viewport.devicePixelRatioF()
        return QPoint(round(x), round(y))

    def surface_pixel(self) -> QPoint:
        """A pixel with splats under it: the one nearest to the middle of the picture."""
        viewport = self.window.view.viewport
        width, height = viewport.projection.width, viewport.projection.height
        screen = viewport.screen_points()
        order = np.argsort(np.hypot(screen[:, 0] - width / 2, screen[:, 1] - height / 2))
        ratio = self.window.viewport.devicePixelRatioF()
        for x, y in screen[order[:200], :2]:
            at = QPoint(round(x / ratio), round(y / ratio))
            # The mouse comes to whole pixels only, and a hand is not sure of one.
            around = [(at.x() + dx, at.y() + dy) for dx in (-1, 0, 1) for dy in (-1, 0, 1)]
            if all(viewport.pick(float(px * ratio), float(py * ratio)) is not None for px, py in around):
                return at
        raise AssertionError("no splat is in the picture")

    def move(self, to: QPoint) -> None:
        QTest.mouseMove(self.window.viewport, to)
        QCoreApplication.processEvents()

    def click(self, at: QPoint, modifiers=Qt.KeyboardModifier.NoModifier) -> None:
        self.move(at)
        QTest.mouseClick(self.window.viewport, Qt.MouseButton.LeftButton, modifiers, at)

    def press(self, at: QPoint, button=Qt.MouseButton.LeftButton, modifiers=Qt.KeyboardModifier.NoModifier) -> None:
        self.move(at)
        QTest.mousePress(self.window.viewport, button, modifiers, at)

    def release(self, at: QPoint, button=Qt.MouseButton.LeftButton, modifiers=Qt.KeyboardModifier.NoModifier) -> None:
        QTest.mouseRelease(self.window.viewport, button, modifiers, at)

    def drag(self, *points: QPoint, button=Qt.MouseButton.LeftButton, modifiers=Qt.KeyboardModifier.NoModifier) -> None:
        self.press(points[0], button, modifiers)
        for point in points[1:]:
            self.move(point)
        self.release(points[-1], button, modifiers)

    def wheel(self, at: QPoint, notches: int, modifiers=Qt.KeyboardModifier.NoModifier) -> None:
        """Turn the wheel, away from the person for positive notches."""
        viewport = self.window.viewport
        turn = QPoint(0, 120 * notches)
        position, on_screen = QPointF(at), QPointF(viewport.mapToGlobal(at))
        none, phase = Qt.MouseButton.NoButton, Qt.ScrollPhase.NoScrollPhase
        QApplication.sendEvent(
            viewport, QWheelEvent(position, on_screen, QPoint(), turn, none, modifiers, phase, False)
        )

    def key(self, key: Qt.Key, modifiers=Qt.KeyboardModifier.NoModifier) -> None:
        # Shortcuts are those of the active window.
        self.window.activateWindow()
        self.qtbot.waitUntil(self.window.isActiveWindow, timeout=WAIT_MS)
        self.window.viewport.setFocus()
        QTest.keyClick(self.window.viewport, key, modifiers)

    def close(self) -> None:
        self.window.close_for_good()


@pytest.fixture
def empty_window(qapp: QApplication, qtbot, no_leaked_vtk, request) -> Iterator[MainWindow]:
    """The window with nothing open."""
    apply_theme(qapp)
    window = make_window()
    window.resize(900, 600)
    window.show()
    qtbot.waitExposed(window)
    yield window
    window.close_for_good()
    window.deleteLater()
    qapp.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    del window
    # pytest holds on to a test's arguments until after the check for what was leaked.
    for name in ("empty_window", "driver"):
        request.node.funcargs.pop(name, None)


@pytest.fixture(scope="session")
def prepared(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder for what the first window makes of the tube; the others find it in their own."""
    return tmp_path_factory.mktemp("prepared")


@pytest.fixture
def driver(empty_window: MainWindow, qtbot, own_cache: Path, prepared: Path) -> Driver:
    """A person, the tube open and prepared."""
    scenes = own_cache / "scenes"
    shutil.copytree(prepared, scenes, dirs_exist_ok=True)
    person = Driver(empty_window, qtbot)
    person.open(resource("samples", "tube.ply"))
    person.wait_idle()
    person.wait_frame()
    if not any(prepared.iterdir()):
        shutil.copytree(scenes, prepared, dirs_exist_ok=True)
    return person
