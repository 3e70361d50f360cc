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
