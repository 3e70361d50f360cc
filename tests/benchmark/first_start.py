"""The very first start: from an empty cache of compiled loops to a sample that follows the hand, as JSON lines.

    xvfb-run -s "-screen 0 1280x1000x24" python -m tests.benchmark.first_start
    xvfb-run … python -m tests.benchmark.first_start --tree OTHER --repeats 2      # two states of the program, in turn

Copies the program aside, so that its caches are empty, opens the bundled sample, places a handle as soon as there is a
picture, and pulls it by the mouse once it is bound. Told are the seconds from the start of the process to the first
picture, to the bound handle and to the first frame that shows it moved; and the processor time of everything, the
processes that compile included. With ``--warm``: once more from the caches that this left.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from tests.benchmark.peers import machine, report

REPOSITORY = Path(__file__).resolve().parents[2]

DRAG = """
import json, resource, sys, time
start = float(sys.argv[1])
told = {}
from PySide6.QtCore import QPoint, Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from splap_editor.app import make_window, open_first
from splap_editor.ui.actions.file_actions import sample_path
from splap_editor.ui.theme import apply_theme
from splap_editor.ui.viewport_widget import ask_of_qt
ask_of_qt()
app = QApplication(["first"])
apply_theme(app)
window = make_window()
window.show()
session, viewport, picture = window.session, window.viewport, window.view.viewport
sys.setswitchinterval(0.0005)
def tell(name):
    told.setdefault(name, round(time.time() - start, 2))
def at():
    pixel = picture.projection.pixel(session.scene.edit.handles[0].region.center) / viewport.devicePixelRatioF()
    return QPoint(round(pixel[0]), round(pixel[1]))
def place():
    QTest.mouseClick(viewport, Qt.MouseButton.LeftButton, pos=QPoint(viewport.width() // 2, viewport.height() // 2))
    assert len(session.scene.edit.handles) == 1
def drawn(milliseconds):
    if picture.splats.deformed is not None and "picture" not in told:
        tell("picture")
        QTimer.singleShot(0, place)
viewport.frame_drawn.connect(drawn)
def poll():
    if session.state == "settled" and "bound" not in told:
        tell("bound")
        QTest.mousePress(viewport, Qt.MouseButton.LeftButton, pos=at())
        for step in range(1, 6):
            QTest.mouseMove(viewport, at() + QPoint(8 * step, -4 * step))
    if "bound" in told and session.scene.kernels is not None and session.scene.kernels.changed.any():
        tell("dragged")
        QTest.mouseRelease(viewport, Qt.MouseButton.LeftButton, pos=at())
        timer.stop()
        if "--to-the-end" in sys.argv:
            end.start()
            return
        leave()
def ended():
    if first is None or first.compilation.is_done:
        tell("all_compiled")
        leave()
def leave():
    window._may_close = True
    window.close()
    app.quit()
timer = QTimer(interval=10)
timer.timeout.connect(poll)
timer.start()
end = QTimer(interval=50)
end.timeout.connect(ended)
first = open_first(window, sample_path())
app.exec()
cpu = 0.0
for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN):
    used = resource.getrusage(who)
    cpu += used.ru_utime + used.ru_stime
told["cpu"] = round(cpu, 1)
told["peak_mib"] = round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
print(json.dumps(told))
"""


def copied(tree: Path, folder: Path) -> Path:
    """Copy the program without whatever was compiled."""
    to = folder / "tree"
    to.mkdir()
    for part in ("splap_editor", "resources"):
        shutil.copytree(tree / part, to / part, ignore=shutil.ignore_patterns("__pycache__"))
    return to


def started(tree: Path, folder: Path, *, to_the_end: bool) -> dict[str, float]:
    """Start the program, and drag."""
    import time

    environ = {name: value for name, value in os.environ.items() if not name.startswith(("SPLAP_", "NUMBA_", "XDG_"))}
    environ |= {"HOME": str(folder), "PYTHONPATH": str(tree), "QT_API": "pyside6"}
    command = [sys.executable, "-c", DRAG, repr(time.time()), *(["--to-the-end"] if to_the_end else [])]
    run = subprocess.run(command, cwd=tree, env=environ, capture_output=True, text=True, check=True)
    return json.loads(run.stdout.splitlines()[-1])


def main() -> None:
    """Measure the trees in turn."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tree", type=Path, action="append", default=[], help="another state of the program")
    parser.add_argument("--repeats", type=int, default=1)
    parser.add_argument("--warm", action="store_true")
    parser.add_argument("--to-the-end", action="store_true", help="wait for every loop, and count it")
    args = parser.parse_args()
    report(**machine())
    for _ in range(args.repeats):
        for tree in (*args.tree, REPOSITORY):
            with tempfile.TemporaryDirectory() as folder:
                copy = copied(tree, Path(folder))
                for kind in ("cold", "warm")[: 1 + args.warm]:
                    told = started(copy, Path(folder), to_the_end=args.to_the_end)
                    report(
                        benchmark="first start", tree=str(tree), kind=kind, load=round(os.getloadavg()[0], 1), **told
                    )


if __name__ == "__main__":
    main()
