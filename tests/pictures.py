"""Makes the pictures of the README by driving the real window, as a person would.

::

    xvfb-run -s "-screen 0 1600x1000x24" python tests/pictures.py
"""

import os
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("QT_API", "pyside6")
REPOSITORY = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(REPOSITORY))

import numpy as np
from PySide6.QtCore import QCoreApplication, QEventLoop, QPoint, QPointF, QSettings, Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from splap_editor.app import make_window
from splap_editor.core.removal import PickedFloaters, RemovalStep
from splap_editor.io.ply import read_ply
from splap_editor.io.sample_maker import write_sample
from splap_editor.resources import resource
from splap_editor.session.edit_file import read_edit
from splap_editor.ui.panels.section import bring_into_view
from splap_editor.ui.theme import apply_theme
from splap_editor.ui.viewport_widget import ask_of_qt
from tests.benchmark.floaters import with_floaters

PICTURES = REPOSITORY / "resources" / "pictures"
SIZE = (1280, 800)
SAIL_TIP = np.array([-0.45, -0.40, 1.16])


def run_for(milliseconds: int) -> None:
    """Let the window live for a while."""
    loop = QEventLoop()
    QTimer.singleShot(milliseconds, loop.quit)
    loop.exec()


def run_until(condition) -> None:
    """Let the window live until something holds."""
    for _ in range(3000):
        if condition():
            return
        run_for(40)
    raise TimeoutError("the window did not get there")


class Person:
    """Points, clicks and drags in one window."""

    def __init__(self, window) -> None:
        self.window = window
        self.session = window.session

    def pixel(self, point: np.ndarray) -> QPoint:
        """Where a world point is in the viewport."""
        x, y = self.window.view.viewport.projection.pixel(point) / self.window.viewport.devicePixelRatioF()
        return QPoint(round(x), round(y))

    def click(self, at: QPoint) -> None:
        """Move there, pause, click."""
        QTest.mouseMove(self.window.viewport, at)
        run_for(300)
        QTest.mouseClick(self.window.viewport, Qt.MouseButton.LeftButton, pos=at)
        run_for(300)

    def drag(self, start: QPoint, end: QPoint, *, let_go: bool = True, steps: int = 24) -> None:
        """Press, move in steps, and let go or hold."""
        QTest.mouseMove(self.window.viewport, start)
        run_for(200)
        QTest.mousePress(self.window.viewport, Qt.MouseButton.LeftButton, pos=start)
        for step in range(1, steps + 1):
            at = QPointF(start) + (QPointF(end) - QPointF(start)) * (step / steps)
            QTest.mouseMove(self.window.viewport, at.toPoint())
            run_for(60)
        if let_go:
            QTest.mouseRelease(self.window.viewport, Qt.MouseButton.LeftButton, pos=end)

    def settle(self) -> None:
        """Wait until nothing moves any more."""
        run_until(lambda: self.session.state in ("ready", "settled"))
        run_for(1200)

    def picture(self, name: str, *, only_view: bool = False) -> None:
        """Write what is on the screen."""
        run_for(800)
        shot = QApplication.primaryScreen().grabWindow(self.window.winId())
        if only_view:
            corner = self.window.viewport.mapTo(self.window, QPoint(0, 0))
            shot = shot.copy(corner.x(), corner.y(), self.window.viewport.width(), self.window.viewport.height())
        PICTURES.mkdir(parents=True, exist_ok=True)
        shot.save(str(PICTURES / f"{name}.png"))


def graph_pictures(person: Person) -> None:
    """Show the graph over a bench, and two answers to who the neighbours of a splat are."""
    window, session = person.window, person.session
    session.open(resource("samples", "bench_2dgs.ply"))
    run_until(lambda: session.scene is not None and session.scene.file.path.name == "bench_2dgs.ply")
    person.settle()
    means = np.asarray(session.scene.splats.means)
    slats = (np.abs(means[:, 0] - 0.75) < 0.35) & (means[:, 2] > 0.45) & (means[:, 1] > 0.35)
    camera = window.view.viewport.camera
    camera.view = camera.look_from((-0.25, -1.0, 0.25))
    camera.view = window.view.viewport.frame(np.flatnonzero(slats))
    window.display.set(mode="ellipses")
    window.inspection.graph_view.set(shown="all")
    person.settle()
    person.picture("graph", only_view=True)
    window.inspection.graph_view.set(shown="off")
    window.tools.choose("inspect")
    window.inspection.inspected.set(kind="geodesic", other="euclidean", k=30)
    near_gap = slats & (np.abs(means[:, 2] - 0.72) < 0.02)
    person.click(person.pixel(np.median(means[near_gap], axis=0)))
    person.settle()
    person.picture("neighbors", only_view=True)


def weights_picture(person: Person) -> None:
    """Show an arm bent by a chain of three handles, and how much of it follows the middle one."""
    window, session = person.window, person.session
    session.open(resource("samples", "tube.ply"))
    run_until(lambda: session.scene is not None and session.scene.file.path.name == "tube.ply")
    person.settle()
    session.steps.change_edit(read_edit(resource("samples", "tube_chain.json"), session.shown_scene), "Open edit")
    session.scene.set_active_handles((session.scene.edit.handles[1].handle_id,))
    person.settle()
    window.display.set(mode="splats", weights=True)
    window.view.viewport.gizmo.detach()
    camera = window.view.viewport.camera
    camera.view = camera.look_from((0.1, -1.0, 0.15))
    camera.view = window.view.viewport.frame()
    person.settle()
    person.picture("weights", only_view=True)
    window.display.set(weights=False)


def clean_up_pictures(person: Person) -> None:
    """Show a bench with made haze, clumps and specks about it, and what the floater finder leaves of that."""
    window, session = person.window, person.session
    with TemporaryDirectory() as folder:
        path = Path(folder) / "raw.ply"
        write_sample(path, with_floaters(read_ply(resource("samples", "bench_2dgs.ply")).splats, seed=2)[0])
        session.open(path)
        run_until(lambda: session.scene is not None and session.scene.file.path == path)
        person.settle()
        scene, camera = session.shown_scene, window.view.viewport.camera
        camera.view = camera.look_from((-0.6, -1.0, 0.3))
        camera.view = seen = window.view.viewport.frame()
        window.view.viewport.camera_moved()
        window.overlay.show_hint()
        window.display.set(mode="splats")
        person.settle()
        person.picture("raw", only_view=True)
        step = RemovalStep(PickedFloaters())
        session.steps.change_removal(scene.edit.removal.with_step(step, scene.splats), "Remove floaters")
        person.settle()
        camera.view = seen
        window.view.viewport.camera_moved()
        person.picture("cleaned", only_view=True)


def grade_picture(person: Person) -> None:
    """Show a windmill with one sail graded, fading out along it, and the sliders that do it."""
    window, session = person.window, person.session
    path = resource("samples", "windmill_2dgs.ply")
    session.open(path)
    run_until(lambda: session.scene is not None and session.scene.file.path == path)
    person.settle()
    scene, panel = session.shown_scene, window.grade_panel
    means, size = np.asarray(scene.splats.means, np.float64), scene.ellipses.scene_scale
    scene.set_selection(np.linalg.norm(means - SAIL_TIP, axis=1) < 0.12 * size)
    QTest.mouseClick(panel.add_selection, Qt.MouseButton.LeftButton)
    for name, shown in (("exposure", 0.4), ("saturation", 300.0), ("hue", 160.0), ("falloff", 0.25 * size)):
        panel.rows[name].field.setValue(shown)
    scene.set_selection(np.zeros_like(scene.selection))
    bring_into_view(panel)
    window.overlay.show_hint()
    person.settle()
    person.picture("grade")


def main() -> None:
    """Make every picture."""
    ask_of_qt()
    app = QApplication(sys.argv[:1])
    QCoreApplication.setOrganizationName("splap-editor-pictures")
    QSettings.setDefaultFormat(QSettings.Format.IniFormat)
    QSettings.setPath(QSettings.Format.IniFormat, QSettings.Scope.UserScope, os.devnull)
    apply_theme(app)
    window = make_window()
    window.resize(*SIZE)
    window.show()
    person = Person(window)
    person.session.open(resource("samples", "windmill_2dgs.ply"))
    run_until(lambda: person.session.scene is not None)
    person.settle()

    person.click(person.pixel(SAIL_TIP))
    person.settle()
    handle = person.session.scene.edit.active_handles[0]
    center = np.asarray(handle.region.center)
    gizmo = window.view.viewport.gizmo
    arm = gizmo.arm_length(window.view.viewport.projection)
    grip = person.pixel(center + np.array([0.0, 0.0, 0.8 * arm]))
    person.drag(grip, grip + QPoint(0, 80))
    person.settle()
    arm = gizmo.arm_length(window.view.viewport.projection)
    grip = person.pixel(gizmo.frame[:3, 3] + np.array([0.8 * arm, 0.0, 0.0]))
    person.drag(grip, grip + QPoint(-110, 22), let_go=False)
    person.picture("drag", only_view=True)
    QTest.mouseRelease(window.viewport, Qt.MouseButton.LeftButton, pos=grip + QPoint(-110, 22))
    person.settle()
    person.picture("window")
    graph_pictures(person)
    weights_picture(person)
    clean_up_pictures(person)
    grade_picture(person)
    sys.stdout.flush()
    os._exit(0)  # Qt and VTK tear down in no promised order; the pictures are written


if __name__ == "__main__":
    main()
