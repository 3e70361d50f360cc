"""How the window keeps up with the hand: start, updates, drags, blocking and picking, as JSON lines.

Needs a display; software OpenGL will do::

    xvfb-run -s "-screen 0 1280x1000x24" python tests/benchmark/window.py --splats 100000
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("QT_API", "pyside6")
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
from PySide6.QtCore import QEventLoop, QPoint, QPointF, Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from splap_editor.app import make_window
from splap_editor.core.handle_nodes import Region
from splap_editor.engine.cache import StageCache
from splap_editor.engine.edit import Pose
from splap_editor.io.sample_maker import big_scene, write_sample
from splap_editor.ui.theme import apply_theme
from splap_editor.ui.viewport_widget import ask_of_qt
from tests.benchmark.peers import machine, note, report, timed

REPOSITORY = Path(__file__).resolve().parents[2]
SIZE = (900, 700)
N_MOVES = 60

FIRST_PICTURE = """
import os, sys, time
start = float(sys.argv[1])
from PySide6.QtGui import QSurfaceFormat
from PySide6.QtWidgets import QApplication
from splap_editor.app import make_window
from splap_editor.ui.actions.file_actions import sample_path
from splap_editor.ui.theme import apply_theme
from splap_editor.ui.viewport_widget import ask_of_qt
ask_of_qt()
app = QApplication(sys.argv[:1])
apply_theme(app)
window = make_window()
window.show()
def drawn(milliseconds):
    if window.view.viewport.splats.deformed is not None:
        print(time.time() - start, flush=True)
        os._exit(0)  # the picture is there; tearing down is not what is measured
window.viewport.frame_drawn.connect(drawn)
window.session.open(sample_path())
sys.exit(app.exec())
"""


class Heart:
    """Beats on the GUI thread; a long time between beats, less what drawing took, is a block."""

    def __init__(self, window) -> None:
        self.blocks: list[float] = []
        self._drawing = 0.0
        self._last = time.perf_counter()
        self._timer = QTimer(window, interval=2)
        self._timer.timeout.connect(self._beat)
        window.viewport.frame_drawn.connect(self._note_draw)
        self._timer.start()

    def worst_ms(self) -> float:
        """Longest block since the last call, in milliseconds; the time before that call does not count."""
        worst = 1000.0 * max(self.blocks, default=0.0)
        self.blocks.clear()
        self._last, self._drawing = time.perf_counter(), 0.0
        return worst

    def _note_draw(self, milliseconds: float) -> None:
        self._drawing += milliseconds / 1000.0

    def _beat(self) -> None:
        now = time.perf_counter()
        self.blocks.append(max(now - self._last - self._drawing, 0.0))
        self._last, self._drawing = now, 0.0


class DrawClock:
    """Processor time that the GUI thread spends inside the GL draw of a window's frames."""

    def __init__(self, window) -> None:
        self.seconds = 0.0
        kind = type(window.viewport)
        draw = kind.paintGL

        def timed_draw(widget) -> None:
            start = time.thread_time()
            draw(widget)
            self.seconds += time.thread_time() - start

        kind.paintGL = timed_draw


def run_until(condition, seconds: float = 600.0) -> None:
    """Run the event loop until something holds."""
    loop, end = QEventLoop(), time.monotonic() + seconds
    poll = QTimer(interval=5)
    poll.timeout.connect(lambda: loop.quit() if condition() or time.monotonic() > end else None)
    poll.start()
    loop.exec()
    if not condition():
        raise TimeoutError("the window did not get there")


def bench_start() -> None:
    """Process start to the first picture with splats in it, warm."""
    seconds = []
    for _ in range(4):
        arguments = [sys.executable, "-c", FIRST_PICTURE, repr(time.time())]
        seconds.append(float(subprocess.run(arguments, cwd=REPOSITORY, capture_output=True, check=True).stdout))
    report(benchmark="first picture", seconds=median(seconds[1:]), target=3.0)


def bench_update(window, n_splats: int) -> None:
    """Take new positions and axes into the arrays that the graphics card reads; processor time alone."""
    splats = window.view.viewport.splats
    actor = splats.deformed
    means = actor.means + actor.origin
    seconds, _ = timed(lambda: splats.move(means, actor.axes_u.copy(), actor.axes_v.copy()), repeats=15)
    report(benchmark="arrays", n_splats=n_splats, milliseconds=1000 * seconds, target=5.0)


def bench_drag(window, heart: Heart, clock: DrawClock, n_splats: int) -> None:
    """Drag an arrow of the gizmo by mouse moves, against a loop that only draws the same actor again."""
    session, viewport = window.session, window.view.viewport
    means = np.asarray(session.scene.splats.means, np.float64)
    top = means[np.argmax(means[:, 2])]
    heart.worst_ms()
    session.steps.add_handle(Region(top, 0.1))
    run_until(lambda: session.state == "settled")
    report(benchmark="blocked", during="bind", n_splats=n_splats, milliseconds=heart.worst_ms(), target=100.0)
    session.drag.preview({1: Pose((0.0, 0.0, 1e-3))})
    run_until(lambda: session.scene.kernels is not None and session.scene.kernels.changed.any())
    session.drag.cancel()
    run_until(lambda: session.state == "settled")
    heart.worst_ms()

    draws: list[float] = []
    shown = [0]
    connection = window.viewport.frame_drawn.connect(draws.append)
    count = session.scene.pose_changed.connect(lambda: shown.__setitem__(0, shown[0] + 1))
    start_xy = viewport.projection.pixel(top) / window.viewport.devicePixelRatioF()
    press = QPoint(round(start_xy[0]), round(start_xy[1]))
    drawing = clock.seconds
    cpu = time.thread_time()
    began = time.perf_counter()
    QTest.mousePress(window.viewport, Qt.MouseButton.LeftButton, pos=press)
    moves = [0]
    mover = QTimer(interval=8)

    def move() -> None:
        moves[0] += 1
        at = QPointF(press) + QPointF(0.6 * moves[0], -0.4 * moves[0])
        QTest.mouseMove(window.viewport, at.toPoint())

    mover.timeout.connect(move)
    mover.start()
    run_until(lambda: shown[0] >= N_MOVES)
    mover.stop()
    seconds = time.perf_counter() - began
    cpu = time.thread_time() - cpu
    drawing = clock.seconds - drawing
    n_shown, n_draws, drawn = shown[0], len(draws), sum(draws) / 1000.0
    report(benchmark="blocked", during="drag", n_splats=n_splats, milliseconds=heart.worst_ms(), target=100.0)
    QTest.mouseRelease(window.viewport, Qt.MouseButton.LeftButton, pos=press + QPoint(60, -40))
    run_until(lambda: session.state == "settled")
    report(benchmark="blocked", during="settle", n_splats=n_splats, milliseconds=heart.worst_ms(), target=100.0)
    window.viewport.frame_drawn.disconnect(connection)
    session.scene.pose_changed.disconnect(count)
    bare = bare_frames_per_second(window)
    report(
        benchmark="drag",
        n_splats=n_splats,
        shown_per_second=n_shown / seconds,
        bare_frames_per_second=bare,
        ratio=n_shown / seconds / bare,
        target_ratio=0.8,
        gui_milliseconds_per_shown=1000 * (cpu - drawing) / n_shown,
        target_milliseconds=10.0,
        draws=n_draws,
        draw_milliseconds=1000 * drawn / max(n_draws, 1),
    )


def bare_frames_per_second(window, n_frames: int = 30) -> float:
    """Frames a second of a loop that marks the geometry changed and draws it, in the quality of a drag."""
    viewport = window.view.viewport
    splats = viewport.splats
    actor = splats.deformed
    means, u, v = actor.means + actor.origin, actor.axes_u.copy(), actor.axes_v.copy()
    viewport.begin_motion()
    done = [0]
    connection = window.viewport.frame_drawn.connect(lambda milliseconds: done.__setitem__(0, done[0] + 1))
    began = time.perf_counter()
    while done[0] < n_frames:
        splats.move(means, u, v)
        window.viewport.repaint()
        QApplication.processEvents()
    seconds = time.perf_counter() - began
    window.viewport.frame_drawn.disconnect(connection)
    viewport.end_motion()
    return n_frames / seconds


def bench_picking(window, n_splats: int) -> None:
    """Pick under the cursor, and regions of the screen, through the window's own viewport."""
    viewport = window.view.viewport
    width, height = viewport.projection.width, viewport.projection.height
    pick, _ = timed(lambda: viewport.pick(width / 2, height / 2), repeats=15)
    box = (0.25 * width, 0.25 * height, 0.75 * width, 0.75 * height)
    rectangle, _ = timed(lambda: viewport.in_rectangle(viewport.screen_points(), *box))
    angles = np.linspace(0, 2 * np.pi, 90)
    lasso_px = np.stack([width * (0.5 + 0.3 * np.cos(angles)), height * (0.5 + 0.3 * np.sin(angles))], 1)
    lasso, inside = timed(lambda: viewport.in_lasso(viewport.screen_points(), lasso_px))
    visible, _ = timed(lambda: viewport.visible_only(viewport.screen_points(), inside))
    report(
        benchmark="picking",
        n_splats=n_splats,
        pick_milliseconds=1000 * pick,
        pick_target=5.0 if n_splats <= 100_000 else 20.0,
        rectangle_milliseconds=1000 * rectangle,
        lasso_milliseconds=1000 * lasso,
        visible_milliseconds=1000 * visible,
        region_target=50.0,
    )


def bench_window(n_splats: int, folder: Path, *, only_picking: bool) -> None:
    """Open a scene of this size and measure everything that needs it open."""
    path = folder / f"scene_{n_splats}.ply"
    write_sample(path, big_scene(n_splats, sh_degree=0 if only_picking else 3))
    window = make_window(StageCache(folder / "cache"))
    clock = DrawClock(window)
    window.resize(*SIZE)
    window.show()
    heart = Heart(window)
    session = window.session
    run_until(lambda: window.viewport.n_renders > 0)
    heart.worst_ms()
    session.open(path)
    run_until(lambda: session.scene is not None)
    run_until(lambda: session.view_worker.is_busy() is False)
    report(benchmark="blocked", during="open", n_splats=n_splats, milliseconds=heart.worst_ms(), target=100.0)
    bench_picking(window, n_splats)
    bench_update(window, n_splats)
    if only_picking:
        session.halt()
    else:
        heart.worst_ms()
        run_until(lambda: session.state == "ready")
        report(benchmark="blocked", during="precompute", n_splats=n_splats, milliseconds=heart.worst_ms(), target=100.0)
        bench_drag(window, heart, clock, n_splats)
        exported: list[object] = []
        session.exported.connect(exported.append)
        heart.worst_ms()
        session.export(folder / "out.ply")
        run_until(lambda: exported)
        report(benchmark="blocked", during="export", n_splats=n_splats, milliseconds=heart.worst_ms(), target=100.0)
    session.history.clear()
    session.close()
    window.viewport.close()
    window.hide()


def main() -> None:
    """Measure the sizes asked for, and picking at a million."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--splats", type=int, nargs="+", default=[100_000])
    parser.add_argument("--no-million", action="store_true")
    options = parser.parse_args()
    report(**machine())
    bench_start()
    ask_of_qt()
    app = QApplication(sys.argv[:1])
    apply_theme(app)
    sys.setswitchinterval(0.0005)  # as the program does
    with tempfile.TemporaryDirectory() as folder:
        for n_splats in options.splats:
            note(f"window: {n_splats} splats")
            bench_window(n_splats, Path(folder), only_picking=False)
        if not options.no_million:
            note("picking: 1000000 splats")
            bench_window(1_000_000, Path(folder), only_picking=True)
    # Qt and VTK tear down in no promised order; the figures are out.
    sys.stdout.flush()
    os._exit(0)


if __name__ == "__main__":
    main()
