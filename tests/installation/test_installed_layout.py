"""The program as pip, pipx and uv lay it out: no source tree around it, its data inside the package."""

import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """A folder of installed packages, filled as the wheel says."""
    site = tmp_path_factory.mktemp("site")
    wheel = PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]
    for package in wheel["packages"]:
        shutil.copytree(ROOT / package, site / package, ignore=shutil.ignore_patterns("__pycache__"))
    for source, target in wheel["force-include"].items():
        (site / target).parent.mkdir(parents=True, exist_ok=True)
        (shutil.copytree if (ROOT / source).is_dir() else shutil.copy)(ROOT / source, site / target)
    return site


def run(site, folder, script, *arguments):
    """Run a script of the installed program as the file does that pip makes of an entry point."""
    module, _, function = PROJECT["project"]["scripts"][script].partition(":")
    code = f"import sys; from {module} import {function}; sys.exit({function}())"
    environ = os.environ | {"PYTHONPATH": str(site)}
    command = [sys.executable, "-c", code, *arguments]
    return subprocess.run(command, cwd=folder, env=environ, capture_output=True, text=True, check=False)


def test_the_command_answers_from_anywhere(site, tmp_path):
    done = run(site, tmp_path, "splap-editor", "--version")
    assert done.returncode == 0 and done.stderr == "" and done.stdout.strip()


def test_data_is_found_inside_the_package(site, tmp_path):
    code = (
        "from splap_editor.resources import resource; from splap_editor.warm_up import loops;"
        "assert len(loops()) > 30; print(resource('samples', 'windmill_2dgs.ply'));"
        "print(resource('icons', 'splap-editor.svg')); print(resource('schemas'))"
    )
    environ = os.environ | {"PYTHONPATH": str(site)}
    told = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, env=environ, capture_output=True, text=True, check=True
    ).stdout.split()
    assert len(told) == 3 and all(Path(each).is_relative_to(site) and Path(each).exists() for each in told)


def test_an_installed_program_reads_its_sample(site, tmp_path):
    sample = site / "splap_editor" / "_resources" / "samples" / "tube.ply"
    done = run(site, tmp_path, "splap-editor", "info", str(sample))
    assert done.returncode == 0 and "splats" in done.stdout
