"""What the wheel carries, what the layers may import, and what lies at the top of the tree."""

import ast
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import splap_editor
from splap_editor.resources import resource

ROOT = Path(__file__).resolve().parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
LAYERS = ["__main__", "cli", "app", "ui", "tools", "viewport", "session", "engine", "io", "core"]


def _modules():
    return sorted((ROOT / "splap_editor").rglob("*.py"))


def test_the_wheel_carries_the_resources_where_the_program_looks_for_them():
    wheel = PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]
    assert wheel["packages"] == ["splap_editor"]
    # The pictures of the README stay out of the wheel.
    names = ("icons", "loops.json", "samples", "schemas", "shaders", "system-packages.txt")
    assert wheel["force-include"] == {f"resources/{name}": f"splap_editor/_resources/{name}" for name in names}


@pytest.mark.parametrize("name", ["bench_2dgs.ply", "windmill_2dgs.ply", "tube.ply", "coil.ply", "README.txt"])
def test_samples_are_found(name):
    assert resource("samples", name).stat().st_size > 0


def test_every_sample_is_named_with_its_source():
    readme = resource("samples", "README.txt").read_text(encoding="utf-8")
    assert "CC0" in readme
    for sample in resource("samples").glob("*.ply"):
        assert sample.name in readme


def test_a_missing_resource_says_what_to_do():
    with pytest.raises(FileNotFoundError, match="install SpLap Editor again"):
        resource("samples", "nothing.ply")


def test_the_licence_is_the_one_the_metadata_names():
    assert PROJECT["project"]["license"] == "GPL-3.0-or-later"
    assert "GNU GENERAL PUBLIC LICENSE" in (ROOT / "LICENSE").read_text(encoding="utf-8")


def test_every_third_party_import_is_a_declared_dependency():
    def normal(name):
        return re.split(r"[<>=\[; ]", name)[0].lower().replace("-", "_")

    extras = PROJECT["project"]["optional-dependencies"]
    # An extra that users may have is asked for where it is used, and missed in a sentence.
    declared = {normal(name) for name in (*PROJECT["project"]["dependencies"], *extras["usd"], *extras["video"])}
    modules = {
        "igl": "libigl",
        "PIL": "pillow",
        "pxr": "usd_core",
        "PySide6": "pyside6_essentials",
        "vtkmodules": "vtk",
    }
    missing = set()
    for path in _modules():
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and node.level == 0:
                names = [node.module]
            for name in names:
                top = name.split(".")[0]
                known = (
                    top in sys.stdlib_module_names or top == "splap_editor" or modules.get(top, top).lower() in declared
                )
                missing |= set() if known else {f"{path.relative_to(ROOT)}: {top}"}
    assert not missing


def test_the_layer_contract_names_every_layer_from_top_to_bottom():
    contracts = PROJECT["tool"]["importlinter"]["contracts"]
    layers = next(contract for contract in contracts if contract["type"] == "layers")
    named = [name.removeprefix("splap_editor.") for row in layers["layers"] for name in row.split(" | ")]
    assert [name for name in named if name in LAYERS] == LAYERS
    package = ROOT / "splap_editor"
    there = {path.stem for path in package.glob("*.py")} | {path.parent.name for path in package.glob("*/__init__.py")}
    # The resource folder's lookup is for every layer to use.
    assert there - set(named) == {"__init__", "resources"}


def test_the_package_itself_imports_nothing_that_takes_time():
    script = "import sys; before = set(sys.modules); import splap_editor; print(*set(sys.modules) - before)"
    listed = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert set(listed.split()) == {"splap_editor"}


def test_scripts_get_ten_names_and_each_is_called_so():
    recipes = ["read_recipe", "write_recipe"]
    assert len(splap_editor.__all__) == 10
    for name in splap_editor.__all__ + recipes:
        assert getattr(splap_editor, name).__name__.removeprefix("splap_editor.") == name
        assert splap_editor.__dict__[name].__doc__
        assert name in recipes or name in dir(splap_editor)
    named = ast.parse(Path(splap_editor.__file__).read_text(encoding="utf-8"))
    typed = {
        alias.asname or alias.name
        for node in ast.walk(named)
        if isinstance(node, ast.ImportFrom) and node.module.startswith("splap_editor")
        for alias in node.names
    }
    assert sorted(typed) == sorted(splap_editor.__all__ + recipes)
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        splap_editor.nothing  # noqa: B018


def test_nothing_but_the_agreed_names_lies_at_the_top():
    if not (ROOT / ".git").exists():
        pytest.skip("a source archive has no list of tracked files")
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    top = {line.split("/")[0] for line in listed.splitlines()}
    allowed = {"pyproject.toml", "splap_editor", "resources", "tests", "README.md", "LICENSE"}
    assert not {name for name in top - allowed if not name.startswith(".")}


def test_a_commit_is_checked_as_the_test_run_checks():
    run = (ROOT / "tests" / "run").read_text(encoding="utf-8")
    hooks = (ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8")
    checks = re.findall(r"^(.+) \|\| failed=1$", run.partition("failed=0\n")[2].partition("export")[0], re.MULTILINE)
    assert checks == re.findall(r"^ +name: (.+)$", hooks, re.MULTILINE)
