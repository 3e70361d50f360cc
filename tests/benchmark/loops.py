"""What compiling each loop costs, as the table that the first start works through::

    python -m tests.benchmark.loops > resources/loops.json

Compiles into an empty cache, so it takes a minute. A row is a loop, the types that the program calls it with, the
seconds of processor time that it took here, the group of loops that call each other, and whether a first handle and its
drag wait for it.
"""

import json
import os
import sys
import tempfile
import time
from typing import Any

from tests.benchmark.peers import note


class Recorder:
    """Listens to numba: the loops that are called from Python, with the time that each took."""

    def __init__(self) -> None:
        self.rows: dict[tuple[str, str], float] = {}
        self.loops: dict[str, Any] = {}
        self._under_way: list[tuple[bool, float]] = []

    def on_start(self, event: Any) -> None:
        """A function is being compiled."""
        is_ours = event.data["dispatcher"].py_func.__module__.startswith("splap_editor.")
        self._under_way.append((is_ours, time.process_time()))

    def on_end(self, event: Any) -> None:
        """It is compiled, with what it calls as far as that was not done before."""
        is_ours, start = self._under_way.pop()
        if is_ours and not any(ours for ours, _ in self._under_way):
            dispatcher = event.data["dispatcher"]
            name = loop_name(dispatcher)
            self.loops[name] = dispatcher
            self.rows[name, notation(event.data["args"])] = time.process_time() - start

    def groups(self) -> dict[str, int]:
        """Number of the group of each loop: those that call the same loop, or each other, have the same."""
        called = {name: reached(loop) for name, loop in self.loops.items()}
        numbers: dict[str, int] = {}
        for number, name in enumerate(called):
            same = {numbers[other] for other in numbers if called[name] & called[other]}
            numbers = {other: number if n in same else n for other, n in numbers.items()} | {name: number}
        order = {number: i for i, number in enumerate(dict.fromkeys(numbers.values()))}
        return {name: order[number] for name, number in numbers.items()}


def loop_name(dispatcher: Any) -> str:
    """Module and name of a loop within the package."""
    function = dispatcher.py_func
    return f"{function.__module__.removeprefix('splap_editor.')}.{function.__name__}"


def notation(kinds: Any) -> str:
    """Types of arguments as the table has them."""
    return f"({', '.join(_notation(kind) for kind in kinds)},)"


def _notation(kind: Any) -> str:
    from numba import types

    if isinstance(kind, types.Array):
        # What is only read, or lies about in memory, would be a loop of its own: the callers see to it.
        assert kind.layout == "C" and kind.mutable and kind.aligned, kind
        return f"{_notation(kind.dtype)}[{':, ' * (kind.ndim - 1)}::1]"
    if isinstance(kind, types.NamedTuple):
        return f"{kind.instance_class.__name__}({', '.join(_notation(field) for field in kind.types)})"
    if isinstance(kind, types.UniTuple):
        return f"UniTuple({_notation(kind.dtype)}, {kind.count})"
    return "boolean" if isinstance(kind, types.Boolean) else str(types.unliteral(kind))


def reached(loop: Any, seen: frozenset[Any] = frozenset()) -> frozenset[Any]:
    """Return a loop and all that it calls, directly or not."""
    from numba.core.registry import CPUDispatcher

    if loop in seen:
        return seen
    seen |= {loop}
    names = loop.py_func.__code__.co_names
    for called in (loop.py_func.__globals__.get(name) for name in names):
        if isinstance(called, CPUDispatcher):
            seen = reached(called, seen)
    return seen


def main() -> None:
    """Compile everything and print the table."""
    # Read when numba is first imported.
    folder = os.environ["NUMBA_CACHE_DIR"] = tempfile.mkdtemp()
    from numba.core import event

    recorder = Recorder()
    listener = type("Listener", (event.Listener,), {"on_start": recorder.on_start, "on_end": recorder.on_end})()
    with event.install_listener("numba:compile", listener):
        from tests.every_loop import call_every_loop, call_first_loops

        call_first_loops()
        first = set(recorder.rows)
        call_every_loop()
    groups = recorder.groups()
    rows = [
        {
            "loop": loop,
            "types": kinds,
            "seconds": round(max(seconds, 0.01), 2),
            "group": groups[loop],
            "first": (loop, kinds) in first,
        }
        for (loop, kinds), seconds in recorder.rows.items()
    ]
    print("[\n" + ",\n".join(json.dumps(row) for row in rows) + "\n]")
    note(f"{len(rows)} loops, {sum(row['seconds'] for row in rows):.1f} s; the cache is in {folder}")


if __name__ == "__main__":
    sys.exit(main())
