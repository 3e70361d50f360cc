"""A window that is told to end does so from its idle loop, and leaves the edit for the next start."""

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

import splap_editor
from splap_editor.resources import resource
from splap_editor.session.recovery import left_behind

WINDOW = """
import sys
from pathlib import Path
import numpy as np
from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QApplication
from splap_editor import app
from splap_editor.core.handle_nodes import Region
from splap_editor.engine.edit import Pose
from splap_editor.session.crash_report import crash_folder

is_told = sys.argv[2] == "told"

def idle():
    window = next(w for w in QApplication.topLevelWidgets() if hasattr(w, "recovery_bar"))
    session = window.session
    if session.state not in ("ready", "settled"):
        QTimer.singleShot(20, idle)
    elif not session.scene.edit.handles:
        if is_told:
            # Written only when the process is told to end.
            window.autosave._delay_s = 3600.0
        else:
            window.autosave.written.connect(lambda state: print("kept", flush=True))
        session.steps.add_handle(Region(session.scene.ellipses.centers[0], 0.1), pose=Pose((0.25, 0.0, 0.0)))
        QTimer.singleShot(20, idle)
    else:
        print("idle", len(list(crash_folder().iterdir())), flush=True)

QTimer.singleShot(0, idle)
sys.exit(app.run(Path(sys.argv[1])))
"""


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
def test_a_window_told_to_end_leaves_its_edit(name, own_cache):
    environment = {**os.environ, "PYTHONPATH": str(Path(splap_editor.__file__).parents[1])}
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    arguments = [sys.executable, "-c", WINDOW, resource("samples", "tube.ply"), "told"]
    with subprocess.Popen(arguments, env=environment, **streams) as process:
        assert process.stdout.readline() == b"idle 1\n", process.stderr.read().decode()
        process.send_signal(getattr(signal, name))
        _, complaints = process.communicate(timeout=60)
    assert complaints == b""
    assert process.returncode == 128 + getattr(signal, name)
    (orphan,) = left_behind(own_cache / "state" / "recovery").orphans
    assert orphan.session.recipe.handles[0].translate == (0.25, 0.0, 0.0)
    assert list((own_cache / "state" / "crashes").iterdir()) == []
    orphan.slot.remove()


@pytest.mark.skipif(shutil.which("Xvfb") is None, reason="a display to be lost is needed")
def test_an_edit_outlives_the_display(own_cache):
    reader, writer = os.pipe()
    command = ["Xvfb", "-displayfd", str(writer), "-screen", "0", "1280x800x24"]
    with subprocess.Popen(command, pass_fds=(writer,), stderr=subprocess.DEVNULL) as display:
        os.close(writer)
        with os.fdopen(reader) as numbers:
            number = numbers.readline().strip()
        environment = {**os.environ, "PYTHONPATH": str(Path(splap_editor.__file__).parents[1]), "DISPLAY": f":{number}"}
        arguments = [sys.executable, "-c", WINDOW, resource("samples", "tube.ply"), "left"]
        with subprocess.Popen(arguments, env=environment, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as process:
            assert b"kept\n" in iter(process.stdout.readline, b"")
            display.kill()
            process.communicate(timeout=60)
    (orphan,) = left_behind(own_cache / "state" / "recovery").orphans
    assert orphan.session.recipe.handles[0].translate == (0.25, 0.0, 0.0)
    orphan.slot.remove()
