"""Rules of the house that no linter knows, read off the source: of tests, of compiled loops."""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

import splap_editor
from tests.kinds import TESTS

WORKFLOWS = TESTS.parent / ".github" / "workflows"

CHECKS = ("raises", "warns", "waitUntil", "waitSignal", "run_until")
"""Calls that fail a test, beside those named assert…"""


@cache
def modules(folder, word=""):
    """Syntax trees of the modules in a folder that hold a word."""
    texts = {path: path.read_text(encoding="utf-8") for path in sorted(folder.rglob("*.py"))}
    return {path: ast.parse(text) for path, text in texts.items() if word in text}


def functions(tree):
    return [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]


def called(node):
    """Last name of what a call calls."""
    match node:
        case ast.Call(func=ast.Name(id=name) | ast.Attribute(attr=name)):
            return name
    return ""


def is_check(call, checkers):
    name = called(call)
    return name in CHECKS or name.startswith("assert") or (isinstance(call.func, ast.Name) and name in checkers)


def is_checked(body, checkers):
    """Whether some check is met on every way through statements, if loops run at all."""
    for statement in body:
        match statement:
            case ast.Assert() | ast.Raise():
                return True
            case ast.Expr(value=ast.Call() as call) | ast.Assign(value=ast.Call() as call):
                if is_check(call, checkers):
                    return True
            case ast.With(items=items, body=inner):
                contexts = [item.context_expr for item in items if isinstance(item.context_expr, ast.Call)]
                if any(is_check(call, checkers) for call in contexts) or is_checked(inner, checkers):
                    return True
            case ast.For(body=inner) | ast.While(body=inner):
                if is_checked(inner, checkers):
                    return True
            case ast.Try(body=inner, finalbody=last):
                if is_checked(inner, checkers) or is_checked(last, checkers):
                    return True
            case ast.If(body=inner, orelse=other):
                if is_checked(inner, checkers) and is_checked(other, checkers):
                    return True
    return False


def checking_functions(trees):
    """Names of those helpers that check something, or call one that does."""
    helpers = [function for tree in trees for function in functions(tree) if not function.name.startswith("test_")]
    names, known = set(), -1
    while len(names) > known:
        known = len(names)
        names |= {function.name for function in helpers if is_checked(function.body, names)}
    # Of one name that stands for several functions all have to.
    return names - {function.name for function in helpers if not is_checked(function.body, names)}


def test_no_test_comes_to_its_end_without_a_check():
    trees = modules(TESTS)
    checkers = checking_functions(trees.values())
    tests = [(path, f) for path, tree in trees.items() for f in functions(tree) if f.name.startswith("test_")]
    unchecked = [f"{path.name}: {test.name}" for path, test in tests if not is_checked(test.body, checkers)]
    assert len(tests) > 1000 and unchecked == []


def test_no_test_leaves_early():
    left = [
        f"{path.name}: {test.name}"
        for path, tree in modules(TESTS).items()
        for test in functions(tree)
        if test.name.startswith("test_")
        for statement in ast.walk(test)
        if isinstance(statement, ast.Return) and statement.value is None
    ]
    assert left == []


def hidden_names(tree):
    """Lines and names, of one underscore, that are neither a module's own nor an object's own."""
    for node in ast.walk(tree):
        names = []
        match node:
            case ast.Attribute(value=ast.Name(id="self" | "cls")):
                pass
            case ast.Attribute(value=ast.Name(id="os"), attr="_exit"):
                pass
            case ast.Attribute(attr="_replace" | "_asdict" | "_fields"):
                pass  # a named tuple's own
            case ast.Attribute(attr=name):
                names = [name]
            case ast.ImportFrom(module=module, names=aliases):
                names = [*(module or "").split("."), *(alias.name for alias in aliases)]
            case ast.Call(args=arguments) if called(node) in ("setattr", "getattr", "hasattr", "delattr"):
                texts = [each.value for each in arguments if isinstance(each, ast.Constant)]
                names = [part for text in texts if isinstance(text, str) for part in text.split(".")]
        yield from ((node.lineno, name) for name in names if name.startswith("_") and not name.startswith("__"))


def test_no_test_reads_what_is_private():
    trees = modules(TESTS).items()
    found = [(path.name, line, name) for path, tree in trees for line, name in hidden_names(tree)]
    assert found == []
    sample = "x._a; self._b; self.x._c; os._exit; from y import _d; m.setattr('z._e', 1); getattr(z, '_f'); x.__g__"
    assert [name for _, name in hidden_names(ast.parse(sample.replace("; ", "\n")))] == ["_d", "_a", "_c", "_e", "_f"]


@pytest.mark.skipif(not WORKFLOWS.is_dir(), reason="a source archive has none")
def test_what_the_workflows_leave_out_is_there():
    named = [word for path in WORKFLOWS.glob("*.yml") for word in re.findall(r"tests/[\w/.:]+", path.read_text())]
    assert len(named) > 5
    for path, _, test in (word.partition("::") for word in named):
        there = TESTS.parent / path
        assert there.exists() and (not test or f"def {test}(" in there.read_text(encoding="utf-8")), path + test


def test_each_compiled_loop_says_what_it_does():
    trees = modules(Path(splap_editor.__file__).parent, "njit")
    loops = [
        (path, function)
        for path, tree in trees.items()
        for function in functions(tree)
        if any("njit" in ast.unparse(decorator) for decorator in function.decorator_list)
    ]
    assert len(loops) > 50
    assert [f"{path.name}: {loop.name}" for path, loop in loops if not ast.get_docstring(loop)] == []
