"""A window that is told to end does so from its idle loop, and leaves the edit for the next start."""

import os
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

def idle():
    window = next(w for w in QApplication.topLevelWidgets() if hasattr(w, "recovery_bar"))
    session = window.session
    if session.state not in ("ready", "settled"):
        QTimer.singleShot(20, idle)
    elif not session.scene.edit.handles:
        # Written only when the process is told to end.
        window.autosave._delay_s = 3600.0
        session.add_handle(Region(session.scene.ellipses.centers[0], 0.1), pose=Pose((0.25, 0.0, 0.0)))
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
    arguments = [sys.executable, "-c", WINDOW, resource("samples", "tube.ply")]
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
