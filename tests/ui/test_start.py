"""What a start says where the display cannot show the window."""

import os
import subprocess
import sys

import pytest

from splap_editor.installation.readiness import WindowCheck, opengl

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="GLX is Linux's")


def test_the_display_of_the_tests_has_opengl_and_is_let_through():
    assert opengl("x11").keys() == {"vendor", "renderer", "version"}
    WindowCheck().finish()


@pytest.mark.parametrize(
    ("environ", "words"),
    [
        ({"MESA_GL_VERSION_OVERRIDE": "2.1"}, "OpenGL 3.2"),
        ({"DISPLAY": ":4093"}, "the display :4093 does not answer"),
    ],
)
def test_a_display_without_opengl_or_that_does_not_answer_is_refused_in_one_sentence(environ, words):
    command = [sys.executable, "-m", "splap_editor"]
    run = subprocess.run(command, env=os.environ | environ, capture_output=True, text=True, timeout=120)
    assert run.returncode == 2, run.stderr
    assert run.stderr.startswith("splap-editor: ") and run.stderr.count("\n") == 1
    assert words in run.stderr and ": " in run.stderr.removeprefix("splap-editor: ")


FIT = """
import sys
from PySide6.QtCore import QSettings
from PySide6.QtWidgets import QApplication
from splap_editor.ui.viewport_widget import ask_of_qt
ask_of_qt()
app = QApplication(sys.argv)
from splap_editor.app import make_window
QSettings.setDefaultFormat(QSettings.Format.IniFormat)
QSettings.setPath(QSettings.Format.IniFormat, QSettings.Scope.UserScope, sys.argv[1])
from splap_editor.ui.main_window import FRAME, MainWindow
moves = []
MainWindow.move = lambda self, *to: moves.append(to)
window = make_window()
window.show()
app.processEvents()
room = window.screen().availableGeometry()
most = room.size() - FRAME
framed = window.isMaximized() or most.expandedTo(window.size()) == most
print(room.contains(window.frameGeometry()), framed, window.isMaximized(), len(moves), flush=True)
window.close()
"""


def test_the_window_and_its_frame_fit_the_screen_and_stay_where_they_were(tmp_path):
    # By itself; as it was kept, and nothing moves it; as large at twice the scale, where it fills the screen.
    for scale, is_full in (("1", False), ("1", False), ("2", True)):
        environment = {**os.environ, "QT_SCALE_FACTOR": scale}
        done = subprocess.run(
            [sys.executable, "-c", FIT, str(tmp_path)], env=environment, capture_output=True, text=True, check=True
        )
        assert done.stdout == f"True True {is_full} 0\n" and done.stderr == ""
