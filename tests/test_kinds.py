"""A test is marked by what it needs, and needs no more than that."""

import ast
from pathlib import Path

import pytest

from tests.kinds import FIXTURES, KINDS, LIBRARIES, TESTS, kind_of, needed_kind, rank

FILES = sorted(TESTS.rglob("test_*.py"))


def _imported(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(TESTS)))
def test_a_file_imports_no_more_than_its_kind_allows(path):
    kind = kind_of(path)
    assert kind is not None, "give it, or its folder, a kind in tests/kinds.py"
    for name in _imported(path):
        for library, allowed in LIBRARIES.items():
            if name == library or name.startswith(f"{library}."):
                assert rank(kind) >= rank(allowed), f"{name} is for tests of kind {allowed!r}"


def test_every_test_carries_one_mark_of_its_kind(request):
    for item in request.session.items:
        kinds = [mark.name for mark in item.iter_markers() if mark.name in KINDS]
        assert kinds == [kind_of(item.path)], item.nodeid
        for fixture, allowed in FIXTURES.items():
            assert fixture not in item.fixturenames or rank(kinds[0]) >= rank(allowed), f"{item.nodeid}: {fixture}"


@pytest.mark.parametrize(
    ("arguments", "kind"),
    [
        ([], "window"),
        (["-x", "-k", "graph"], "window"),
        (["tests"], "window"),
        (["tests/core", "-q"], "pure"),
        (["tests/installation"], "window"),
        (["tests/core/graph/test_splat_graph.py::test_x"], "pure"),
        (["tests/core", "tests/viewport"], "offscreen"),
        (["tests/io", "tests/ui"], "window"),
        (["-m", "pure"], "pure"),
        (["-m", "pure", "tests"], "pure"),
        (["-m", "not window"], "window"),
    ],
)
def test_arguments_ask_for_no_more_than_their_tests_need(arguments, kind, monkeypatch):
    monkeypatch.chdir(Path(TESTS).parent)
    assert needed_kind(arguments) == kind
