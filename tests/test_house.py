"""Rules of the house that no linter knows, read off the source: of tests, of compiled loops."""

import ast
from pathlib import Path

import splap_editor
from tests.kinds import TESTS

CHECKS = ("raises", "warns", "waitUntil", "waitSignal", "run_until")
"""Calls that fail a test, beside those named assert…"""


def modules(folder):
    return {path: ast.parse(path.read_text(encoding="utf-8")) for path in sorted(folder.rglob("*.py"))}


def functions(tree):
    return [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]


def called(node):
    """Last name of what a call calls."""
    return ast.unparse(node.func).rpartition(".")[2] if isinstance(node, ast.Call) else ""


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


def test_each_compiled_loop_says_what_it_does():
    trees = modules(Path(splap_editor.__file__).parent)
    loops = [
        (path, function)
        for path, tree in trees.items()
        for function in functions(tree)
        if any("njit" in ast.unparse(decorator) for decorator in function.decorator_list)
    ]
    assert len(loops) > 50
    assert [f"{path.name}: {loop.name}" for path, loop in loops if not ast.get_docstring(loop)] == []
