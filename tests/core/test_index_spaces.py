"""What counts rows or nodes says so by its name and its type alike."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[2] / "splap_editor"
KINDS = {
    "row": {"FileRow"},
    "rows": {"FileRow", "FileRows", "FileMask"},
    "node": {"Node"},
    "nodes": {"Node", "Nodes", "NodeMask"},
    "problem_rows": {"ProblemRows"},
    "rows_by_place": {"RowsByPlace"},
    "nodes_by_place": {"NodesByPlace"},
    "removed": {"FileMask"},
    "hidden": {"FileMask"},
    "selection": {"FileMask"},
}
PLAIN = ("int", "ndarray", "NDArray")


def _annotated(tree: ast.AST) -> Iterator[tuple[str, ast.expr]]:
    for node in ast.walk(tree):
        if isinstance(node, ast.arg) and node.annotation is not None:
            yield node.arg, node.annotation
        elif isinstance(node, ast.AnnAssign):
            yield ast.unparse(node.target).rpartition(".")[2], node.annotation
        elif isinstance(node, ast.FunctionDef) and node.returns is not None:
            yield node.name, node.returns


def _breaches(source: str) -> list[str]:
    found = []
    for name, annotation in _annotated(ast.parse(source)):
        kinds = KINDS.get(name.lstrip("_"), set())
        words = {getattr(part, "id", getattr(part, "attr", "")) for part in ast.walk(annotation)}
        # Other things go by these words too: a form has rows, a JSON file nodes, and records are rows themselves, of no
        # one type. What counts has a number for a type.
        if ast.unparse(annotation) != "NDArray" and kinds and not kinds & words and words.intersection(PLAIN):
            found.append(f"{name}: {ast.unparse(annotation)}")
    return found


@pytest.mark.parametrize("path", sorted(PACKAGE.rglob("*.py")), ids=lambda path: str(path.relative_to(PACKAGE)))
def test_a_name_of_an_index_space_has_its_type(path):
    assert _breaches(path.read_text(encoding="utf-8")) == []


@pytest.mark.parametrize(
    "source",
    [
        "def f(rows: NDArray[np.integer]): ...",
        "def f(*, node: int | None = None): ...",
        "nodes: tuple[int, ...]",
        "self.hidden: NDArray[np.bool_] = x",
        "def rows(self) -> list[int]: ...",
    ],
)
def test_a_plain_number_under_such_a_name_is_found(source):
    assert len(_breaches(source)) == 1
