"""Crash reports: written by a crash, found once by the next start, and by nothing else."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

import splap_editor
from splap_editor.session.crash_report import MOST_REPORTS, new_crash_reports

ENDS = """
import faulthandler, os, signal, sys
from pathlib import Path
from splap_editor.session.crash_report import CrashReport
def where_it_happened():
    os.kill(os.getpid(), getattr(signal, sys.argv[2]))
report = CrashReport(Path(sys.argv[1]))
if sys.argv[2] == "clean":
    report.close()
elif sys.argv[2] == "live":
    print("up", flush=True)
    sys.stdin.read()
else:
    where_it_happened()
"""


def process(folder, how, **streams):
    env = {**os.environ, "PYTHONPATH": str(Path(splap_editor.__file__).parents[1])}
    return subprocess.Popen([sys.executable, "-c", ENDS, str(folder), how], env=env, **streams)


@pytest.mark.parametrize("how", ["SIGSEGV", "SIGABRT", "SIGFPE"])
def test_a_crash_leaves_a_report_that_says_where_and_is_told_once(tmp_path, how):
    with process(tmp_path, how, stderr=subprocess.PIPE) as dead:
        dead.communicate(timeout=60)
    assert dead.returncode == -getattr(signal, how)
    (report,) = new_crash_reports(tmp_path)
    text = report.read_text()
    assert text.startswith(f"SpLap Editor {splap_editor.__version__}, Python 3.")
    assert "Fatal Python error" in text and "where_it_happened" in text
    assert new_crash_reports(tmp_path) == [] and report.exists()


@pytest.mark.parametrize("how", ["clean", "SIGKILL", "SIGTERM"])
def test_any_other_end_leaves_none(tmp_path, how):
    with process(tmp_path, how) as dead:
        dead.wait(60)
    assert new_crash_reports(tmp_path) == []
    assert list(tmp_path.iterdir()) == []


def test_reports_of_living_processes_are_left_alone(tmp_path):
    with process(tmp_path, "live", stdin=subprocess.PIPE, stdout=subprocess.PIPE) as live:
        assert live.stdout.readline() == b"up\n"
        assert new_crash_reports(tmp_path) == [] and len(list(tmp_path.iterdir())) == 1
        live.stdin.close()
        live.wait(60)


def test_old_reports_go_in_time(tmp_path):
    for day in range(MOST_REPORTS + 3):
        (tmp_path / f"crash-2026-01-{day + 1:02}-120000-1-aa.txt").touch()
    assert new_crash_reports(tmp_path) == []
    assert len(list(tmp_path.iterdir())) == MOST_REPORTS
    assert not (tmp_path / "crash-2026-01-01-120000-1-aa.txt").exists()


def test_a_folder_that_cannot_be_made_means_no_report(tmp_path):
    (tmp_path / "file").touch()
    with process(tmp_path / "file" / "crashes", "clean") as done:
        assert done.wait(60) == 0
    assert new_crash_reports(tmp_path / "file" / "crashes") == []
