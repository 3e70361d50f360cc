"""The table of loops is that of the program, and its compilation says truly how far it is."""

import importlib
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from numba.core.registry import CPUDispatcher

from splap_editor.warm_up import Compilation, Loop, is_warm, loops
from tests.benchmark.loops import loop_name, notation, reached
from tests.every_loop import call_every_loop, call_first_loops

ROOT = Path(__file__).resolve().parent.parent

ANSWERS = "import sys\nfor line in sys.stdin: print({!r}, flush=True)"


def made(*seconds: float, later: tuple[float, ...] = ()) -> list[Loop]:
    first = [Loop(f"loop{i}", "()", cost, i // 2, True) for i, cost in enumerate(seconds)]
    return first + [Loop(f"later{i}", "()", cost, i // 2, False) for i, cost in enumerate(later)]


def compilation(wanted, answer="done", program=ANSWERS) -> tuple[Compilation, list[float]]:
    shares: list[float] = []
    told = threading.Event()

    def tell() -> None:
        shares.append(work.share)
        if work.is_done:
            told.set()

    work = Compilation(tell, wanted, (sys.executable, "-c", program.format(answer)))
    assert work.share == 0.0 and not work.is_done
    work.start(1)
    work.start(2)
    assert told.wait(60)
    work.close()
    return work, shares


def test_the_share_rises_by_what_each_loop_costs():
    work, shares = compilation(made(1.0, 1.0, 6.0, 2.0))
    assert shares == sorted(shares) and shares[-1] == 1.0
    assert {round(share, 3) for share in shares} <= {0.1, 0.2, 0.6, 0.7, 0.8, 0.9, 1.0}
    assert work.n_done == work.n_loops == 4


def test_what_a_drag_waits_for_comes_before_longer_loops_of_its_group_and_is_all_of_the_share():
    can_drag: list[tuple[int, bool, float]] = []
    told = threading.Event()

    def tell() -> None:
        can_drag.append((work.n_done, work.can_drag, work.share))
        if work.is_done:
            told.set()

    work = Compilation(tell, made(1.0, 1.0, later=(9.0, 9.0, 9.0)), (sys.executable, "-c", ANSWERS.format("done")))
    work.start(1)
    assert told.wait(60)
    work.close()
    assert can_drag == [(1, False, 0.5), (2, True, 1.0), (3, True, 1.0), (4, True, 1.0), (5, True, 1.0)]


@pytest.mark.parametrize(("answer", "kept"), [("done", True), ("failed: no such type", False)])
def test_only_a_whole_compilation_is_kept(answer, kept):
    work, _ = compilation(made(1.0, 2.0), answer)
    assert not is_warm()
    work.keep()
    assert is_warm() is kept


def test_a_process_that_ends_is_not_waited_for():
    work, _ = compilation(made(1.0, 2.0), program="pass")
    assert work.is_done and not work.is_running
    work.keep()
    assert not is_warm()


def tell_first_loops() -> None:
    """Print those loops that a first handle and its drag call."""
    call_first_loops()
    modules = [module for name, module in list(sys.modules.items()) if name.startswith("splap_editor.")]
    there = {loop for module in modules for loop in vars(module).values() if isinstance(loop, CPUDispatcher)}
    print(*(loop_name(loop) for loop in there if loop.signatures), sep="\n")


def told_by(function: str) -> list[str]:
    # In a process of its own: other tests call loops in ways that the program does not.
    command = [sys.executable, "-c", f"from tests.test_warm_up import {function}; {function}()"]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.split()


def test_the_first_loops_of_the_table_are_those_that_a_first_drag_calls():
    in_table = {row.loop for row in loops()}
    called = in_table.intersection(told_by("tell_first_loops"))
    assert {row.loop for row in loops() if row.first} == called


def tell_loops() -> None:
    """Print the loops that Python may call, in any module, a line each; "+" before those that are called."""
    for path in sorted((ROOT / "splap_editor").rglob("*.py")):
        if "njit" in path.read_text(encoding="utf-8"):
            importlib.import_module(".".join(path.relative_to(ROOT).with_suffix("").parts))
    call_every_loop()
    modules = [module for name, module in list(sys.modules.items()) if name.startswith("splap_editor.")]
    there = {loop for module in modules for loop in vars(module).values() if isinstance(loop, CPUDispatcher)}
    # A loop that only loops call is compiled into these.
    inner = {called for loop in there for called in reached(loop) if called is not loop}
    print(*("+"[: len(loop.signatures)] + loop_name(loop) for loop in there - inner), sep="\n")


def test_the_table_holds_every_loop_that_python_may_call():
    told = told_by("tell_loops")
    assert len(told) > 30
    assert [loop for loop in told if loop[0] != "+"] == [], "tests/every_loop.py does not call them"
    missing = {loop[1:] for loop in told} - {row.loop for row in loops()}
    assert missing == set(), "python -m tests.benchmark.loops > resources/loops.json makes the table again"


def test_every_row_of_the_table_is_loaded_as_it_is_called():
    call_every_loop()
    for row in loops():
        module, _, name = row.loop.rpartition(".")
        loop = getattr(sys.modules[f"splap_editor.{module}"], name)
        before = list(loop.signatures)
        row.compile()
        assert list(loop.signatures) == before, f"{row.loop} is called with other types"
        assert row.types in [notation(kinds) for kinds in before]
