"""A start that cannot succeed ends in one sentence with the line that mends it, before Qt or VTK is imported."""

import json
import os
import subprocess
import sys

import pytest

from splap_editor.cli import main
from splap_editor.installation import system_packages
from splap_editor.installation.readiness import check_picture, platform

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="libraries and displays are Linux's")
DISPLAY_VARIABLES = ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM")
START = """
import sys
from splap_editor.installation import system_packages
lacking = set(sys.argv[1].split())
loads = system_packages.loads
system_packages.loads = lambda name: name not in lacking and loads(name)
from splap_editor.cli import main
code = main(sys.argv[2:])
assert not {"PySide6", "vtkmodules", "numba"} & set(sys.modules), "refused too late"
sys.exit(code)
"""


def start(*arguments: str, lacking: str = "", **environ: str) -> subprocess.CompletedProcess:
    """Start the program in a process of its own, as if some libraries were missing."""
    kept = {name: value for name, value in os.environ.items() if name not in DISPLAY_VARIABLES}
    command = [sys.executable, "-c", START, lacking, *arguments]
    return subprocess.run(command, env=kept | environ, capture_output=True, text=True, timeout=60)


def sentence(run: subprocess.CompletedProcess) -> str:
    assert run.returncode == 2, run.stderr
    assert run.stdout == "" and run.stderr.count("\n") == 1 and run.stderr.startswith("splap-editor: ")
    return run.stderr


def test_missing_libraries_are_named_with_their_packages():
    said = sentence(start(lacking="libEGL.so.1 libxcb-cursor.so.0", DISPLAY=":4093"))
    assert "libEGL.so.1, libxcb-cursor.so.0" in said


def test_a_long_list_of_missing_libraries_stays_one_sentence():
    said = sentence(start(lacking="libGL.so.1 libEGL.so.1 libxcb.so.1 libglib-2.0.so.0 libfontconfig.so.1"))
    assert "and 2 more" in said


def test_pictures_need_less_than_the_window(monkeypatch):
    assert "libEGL.so.1" in sentence(start("render", "absent.ply", "-o", "out.png", lacking="libEGL.so.1"))
    monkeypatch.setattr(system_packages, "loads", lambda name: name != "libglib-2.0.so.0")
    check_picture()


def test_no_display_is_said():
    assert "neither DISPLAY nor WAYLAND_DISPLAY is set" in sentence(start())
    assert "neither DISPLAY nor WAYLAND_DISPLAY is set" in sentence(start(QT_QPA_PLATFORM="xcb"))


@pytest.mark.parametrize(
    ("environ", "expected"),
    [
        ({}, None),
        ({"DISPLAY": ":0"}, "x11"),
        ({"QT_QPA_PLATFORM": "xcb"}, None),
        ({"QT_QPA_PLATFORM": "xcb:force", "DISPLAY": ":0", "WAYLAND_DISPLAY": "w"}, "x11"),
        ({"DISPLAY": ":0", "WAYLAND_DISPLAY": "w"}, "x11"),
        ({"DISPLAY": ":0", "WAYLAND_DISPLAY": "w", "XDG_SESSION_TYPE": "wayland"}, "wayland"),
        ({"WAYLAND_DISPLAY": "w"}, "wayland"),
        ({"QT_QPA_PLATFORM": "wayland-egl"}, "wayland"),
        ({"QT_QPA_PLATFORM": "offscreen"}, "offscreen"),
    ],
)
def test_the_display_is_the_one_that_qt_will_take(environ, expected):
    assert platform(environ) == expected


def test_doctor_reports_and_ends_with_the_same_sentence(monkeypatch, capsys):
    for name in DISPLAY_VARIABLES:
        monkeypatch.delenv(name, raising=False)
    assert main(["doctor", "--json"]) == 2
    found = json.loads(capsys.readouterr().out)
    assert {"program", "python", "packages", "opengl", "missing_libraries", "folders", "problem"} <= found.keys()
    assert found["missing_libraries"] == [] and None not in found["packages"].values()
    assert found["folders"]["cache"]["free_gb"] > 0
    assert main(["doctor"]) == 2
    said = capsys.readouterr()
    assert said.err == f"splap-editor: {found['problem']}\n"
    assert "free_gb" in said.out and "numba" in said.out


def test_doctor_says_when_a_folder_cannot_be_written(monkeypatch, tmp_path, capsys):
    blocked = tmp_path / "file"
    blocked.write_text("")
    monkeypatch.setenv("SPLAP_CACHE_DIR", str(blocked / "cache"))
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    monkeypatch.setenv("QT_QPA_PLATFORM", "offscreen")
    assert main(["doctor", "--json"]) == 2
    assert "export SPLAP_CACHE_DIR=" in json.loads(capsys.readouterr().out)["problem"]
