"""The very first start: a picture that waits for no compiler, and a true account of what is compiled meanwhile."""

import json
import os
import subprocess
import sys

from splap_editor.app import open_first
from splap_editor.core.twofold_loop import TwofoldLoop
from splap_editor.resources import resource
from splap_editor.warm_up import Compilation, is_warm, loops

FIRST_PICTURE = """
import json, sys
from numba.core import event
compiled = []
class Listener(event.Listener):
    def on_start(self, happening):
        compiled.append(happening.data["dispatcher"].py_func.__qualname__)
    def on_end(self, happening):
        pass
event.register("numba:compile", Listener())
from PySide6.QtCore import QPoint, Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from splap_editor import first_start
from splap_editor.app import make_window, open_first
from splap_editor.ui.actions.file_actions import sample_path
from splap_editor.ui.viewport_widget import ask_of_qt
# Nothing is compiled elsewhere either: the picture owes nothing to it.
first_start.Compilation.start = lambda self, n=None: None
ask_of_qt()
app = QApplication(["first"])
window = make_window()
window.resize(900, 600)
window.show()
states = [window.session.state]
window.session.state_changed.connect(lambda: states.append(window.session.state))
open_first(window, sample_path())
def work():
    viewport, picture = window.viewport, window.view.viewport
    x, y = picture.projection.width / 2, picture.projection.height / 2
    hit = picture.pick(x, y)
    QTest.mouseClick(viewport, Qt.MouseButton.LeftButton, pos=QPoint(int(x), int(y)))
    window.actions_["tool.lasso"].trigger()
    for action in ("display.ellipses", "display.splats", "select.all", "view.front"):
        window.actions_[action].trigger()
    viewport.repaint()
    picture.in_lasso(picture.screen_points(), [(0, 0), (x, 0), (x, y)])
    scene = window.session.scene
    print(json.dumps({"hit": hit is not None, "handles": len(scene.edit.handles), "states": states,
        "selected": int(scene.selection.sum()), "compiled": compiled, "words": window.deformer_panel.state.text()}))
    window._may_close = True
    window.close()
    app.quit()
def drawn(milliseconds):
    if window.view.viewport.splats.deformed is not None:
        window.viewport.frame_drawn.disconnect(drawn)
        QTimer.singleShot(0, work)
window.viewport.frame_drawn.connect(drawn)
app.exec()
"""


def test_the_first_picture_and_what_is_done_with_it_enter_no_compiled_loop(tmp_path):
    environ = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path), "XDG_CONFIG_HOME": str(tmp_path)}
    run = subprocess.run(
        [sys.executable, "-c", FIRST_PICTURE], env=environ, capture_output=True, text=True, timeout=300
    )
    assert run.returncode == 0 and run.stderr == "", run.stderr
    found = json.loads(run.stdout)
    assert found["compiled"] == []
    assert found["hit"] and found["handles"] == 1 and found["selected"] > 0
    assert found["states"] == ["empty", "opening", "preparing"]
    assert "Nothing is open" not in found["words"]


def test_what_is_asked_for_meanwhile_is_made_once_everything_is_compiled(empty_window, qtbot, monkeypatch):
    # Each loop is answered at once: those of this process are compiled.
    obedient = (sys.executable, "-c", "import sys\nfor line in sys.stdin: print('done', flush=True)")
    monkeypatch.setattr("splap_editor.first_start.Compilation", lambda told: Compilation(told, command=obedient))
    shares, jobs = [], []
    session = empty_window.session
    session.told_job.changed.connect(lambda job: jobs.append(job and (job.kind, job.title)))
    try:
        open_first(empty_window, resource("samples", "tube.ply"), shares.append)
        assert not TwofoldLoop.uses_compiled and session.state == "opening"
        assert empty_window.deformer_panel.state.text() == "Opening the file."
        qtbot.waitUntil(lambda: session.state == "ready", timeout=60_000)
        qtbot.waitUntil(lambda: TwofoldLoop.uses_compiled, timeout=60_000)
    finally:
        TwofoldLoop.use_compiled(True)
    assert shares == sorted(shares) and shares[0] == 0.0 and shares[-1] == 1.0
    assert ("compile", "Getting ready for tube.ply, once on this computer") in jobs


def test_a_drag_waits_for_no_loop_that_it_does_not_call(empty_window, qtbot, monkeypatch):
    later = tuple(i for i, loop in enumerate(loops()) if not loop.first)
    assert later
    # Loops that a drag does not call are never done.
    answers = f"import sys, time\nfor line in sys.stdin: time.sleep(600 * (int(line) in {later})); print(1, flush=True)"
    command = (sys.executable, "-c", answers)
    monkeypatch.setattr("splap_editor.first_start.Compilation", lambda told: Compilation(told, command=command))
    shares, jobs, session = [], [], empty_window.session
    session.told_job.changed.connect(lambda job: jobs.append(job and job.kind))
    try:
        first = open_first(empty_window, resource("samples", "tube.ply"), shares.append)
        qtbot.waitUntil(lambda: session.state == "ready", timeout=60_000)
        qtbot.waitUntil(lambda: jobs[-1] is None, timeout=60_000)
        assert first.compilation.can_drag and not first.compilation.is_done
        assert shares[-1] == 1.0
        # Pictures owe nothing to what is still being compiled.
        assert not TwofoldLoop.uses_compiled
        empty_window.close_for_good()
    finally:
        TwofoldLoop.use_compiled(True)
    assert not is_warm()


def test_a_window_closed_meanwhile_ends_the_processes(empty_window, qtbot, monkeypatch):
    idle = (sys.executable, "-c", "import time\ntime.sleep(600)")
    monkeypatch.setattr("splap_editor.first_start.Compilation", lambda told: Compilation(told, command=idle))
    try:
        first = open_first(empty_window, resource("samples", "tube.ply"))
        qtbot.waitUntil(lambda: empty_window.session.state == "preparing", timeout=60_000)
        assert first.compilation.share == 0.0 and first.compilation.is_running
        empty_window.close_for_good()
    finally:
        TwofoldLoop.use_compiled(True)
    assert not first.compilation.is_running
