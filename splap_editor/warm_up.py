"""Compiles every loop of the program into the cache on disk, in processes of their own, and says how far that is.

Compiling holds Python's lock for half a minute in all; done here, the window of another process stays alive
meanwhile. Two processes may do it at once: entries are written whole or not at all.
"""

import contextlib
import importlib
import json
import math
import os
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import IO, Any

import numba
from numba import types

import splap_editor
from splap_editor.core.adaptation.carried_ellipses import KernelArrays
from splap_editor.core.adaptation.kernel_binding import RestArrays
from splap_editor.core.twofold_loop import TwofoldLoop
from splap_editor.engine.cache import default_cache_folder
from splap_editor.resources import resource
from splap_editor.session.background_thread import BackgroundThread

MOST_PROCESSES = 4


@dataclass(frozen=True)
class Loop:
    """A compiled loop, as it is called.

    Parameters
    ----------
    loop : str
        Module and name within the package.
    types : str
        Of its arguments, in numba's notation.
    seconds : float
        Processor time that compiling it took where the table was made; of interest is its share of the whole.
    group : int
        Loops with the same number share inner loops, and are compiled by one process, in their order.
    first : bool
        A first handle and its drag wait for it; the others are compiled after these, and at a lower priority.
    """

    loop: str
    types: str
    seconds: float
    group: int
    first: bool

    def compile(self) -> None:
        """Compile it for these types, or load it if that has been done."""
        module_name, _, name = self.loop.rpartition(".")
        module = importlib.import_module(f"splap_editor.{module_name}")
        tuples = {named.__name__: _tuple_of(named) for named in (KernelArrays, RestArrays)}
        # The table is the program's own.
        arguments = eval(self.types, {"__builtins__": {}}, {**vars(types), **tuples})
        getattr(module, name).compile(arguments)


def _tuple_of(named: type) -> Callable[..., types.Type]:
    return lambda *fields: types.NamedTuple(fields, named)


@cache
def loops() -> tuple[Loop, ...]:
    """Read the table of loops, made by ``tests/benchmark/loops.py``."""
    return tuple(Loop(**row) for row in json.loads(resource("loops.json").read_text(encoding="utf-8")))


def is_warm() -> bool:
    """Whether the loops, for this state of the program, this Python and compiler, have been compiled."""
    return _stamp().exists()


def load_view_loops() -> None:
    """Load what picks, sorts and colours from the cache, and use it from here on."""
    for loop in loops():
        if loop.loop.startswith(("viewport.", "core.splats.")):
            loop.compile()
    TwofoldLoop.use_compiled(True)


class Compilation:
    """Compiles loops in other processes.

    A thread stands before each process: it hands it a loop and waits. What
    cannot be compiled there is left for the process that will call it.

    Parameters
    ----------
    told : callable
        Called from any thread whenever a loop is done.
    wanted : sequence of Loop, optional
        All by default.
    command : sequence of str, optional
        What to run; it reads numbers of loops and answers each with a line.
    """

    def __init__(
        self,
        told: Callable[[], None],
        wanted: Sequence[Loop] | None = None,
        command: Sequence[str] = (sys.executable, "-m", "splap_editor.warm_up"),
    ) -> None:
        self._told = told
        self._wanted = tuple(loops() if wanted is None else wanted)
        self._command = tuple(command)
        self._first = tuple(loop for loop in self._wanted if loop.first)
        # The longest first, so that no process is left alone with it at the end; but what a drag waits for before all.
        groups = sorted(_grouped(self._wanted), key=_seconds, reverse=True)
        self._queue = deque(sorted(groups, key=lambda group: not group[0].first))
        self._left = set(self._wanted)
        self._failed = False
        self._lock = threading.Lock()
        self._processes: list[subprocess.Popen] = []
        self._threads: list[BackgroundThread] = []

    def start(self, n_processes: int | None = None) -> None:
        """Start processes, or more of them; None: as many as there are cores."""
        n_wanted = min(n_processes or os.cpu_count() or 1, MOST_PROCESSES)
        for _ in range(n_wanted - len(self._processes)):
            pipe = subprocess.PIPE
            process = subprocess.Popen(self._command, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL, text=True)
            thread = BackgroundThread(partial(self._serve, process), name="splap-compile", stop=self._stop)
            self._processes.append(process)
            self._threads.append(thread)
            thread.start()

    @property
    def share(self) -> float:
        """How much of what a drag waits for is done, 0 to 1: each loop counts as much as it costs."""
        if self.can_drag:
            return 1.0
        return 1.0 - _seconds(self._left.intersection(self._first)) / max(_seconds(self._first), 1e-9)

    @property
    def n_done(self) -> int:
        """How many loops are compiled."""
        return len(self._wanted) - len(self._left)

    @property
    def n_loops(self) -> int:
        """How many there are."""
        return len(self._wanted)

    @property
    def can_drag(self) -> bool:
        """Whether everything is done that a first handle and its drag wait for."""
        return self._left.isdisjoint(self._first)

    @property
    def is_done(self) -> bool:
        """Whether nothing is left to do."""
        return not self._left

    @property
    def is_running(self) -> bool:
        """Whether one of its processes still lives."""
        return any(process.poll() is None for process in self._processes)

    def keep(self) -> None:
        """Note for later starts that everything is compiled, unless something could not be."""
        if self.is_done and not self._failed:
            _stamp().parent.mkdir(parents=True, exist_ok=True)
            _stamp().touch()

    def close(self) -> None:
        """End the processes, whatever they are doing."""
        self._stop()
        for thread in self._threads:
            thread.join()

    def _stop(self) -> None:
        with self._lock:
            self._queue.clear()
        for process in self._processes:
            process.terminate()

    def _serve(self, process: subprocess.Popen[str]) -> None:
        try:
            while True:
                with self._lock:
                    if not self._queue:
                        return
                    group = self._queue.popleft()
                for loop in group:
                    answer = _answer(process, self._wanted.index(loop))
                    with self._lock:
                        self._failed |= answer != "done"
                        # A set of its own, for those who look at it meanwhile.
                        self._left = self._left - {loop}
                    self._told()
        finally:
            # One that has ended leaves words in the pipe that nobody will read.
            words, answers = _pipes(process)
            with contextlib.suppress(OSError):
                words.close()
            answers.close()
            process.wait()


def _answer(process: subprocess.Popen[str], index: int) -> str:
    """What a process says to a loop; nothing if it has ended."""
    words, answers = _pipes(process)
    try:
        words.write(f"{index}\n")
        words.flush()
        return answers.readline().strip()
    except (OSError, ValueError):
        return ""


def _pipes(process: subprocess.Popen[str]) -> tuple[IO[str], IO[str]]:
    assert process.stdin is not None and process.stdout is not None
    return process.stdin, process.stdout


def _grouped(wanted: Iterable[Loop]) -> list[list[Loop]]:
    groups: dict[tuple[int, bool], list[Loop]] = {}
    for loop in wanted:
        groups.setdefault((loop.group, loop.first), []).append(loop)
    return list(groups.values())


def _seconds(some: Iterable[Loop]) -> float:
    # Loops come from a set: an exact sum does not depend on their order.
    return math.fsum(loop.seconds for loop in some)


def _stamp() -> Path:
    """An empty file named after everything that the compiled loops depend on."""
    python = f"py{sys.version_info.major}.{sys.version_info.minor}"
    newest = max(int(path.stat().st_mtime) for path in Path(splap_editor.__file__).parent.rglob("*.py"))
    return default_cache_folder() / f"compiled-{splap_editor.__version__}-{newest}-{python}-{numba.__version__}"


def _obey(lines: Iterable[str], say: Callable[[str], Any]) -> None:
    """Compile the loops that are asked for by their numbers, one a line."""
    is_polite = not hasattr(os, "nice")
    for line in lines:
        try:
            loop = loops()[int(line)]
            if not loop.first and not is_polite:
                # Somebody may be dragging by now.
                os.nice(10)
                is_polite = True
            loop.compile()
        except Exception as error:  # whatever it is, the program compiles the loop where it is called
            say(f"failed: {error}".replace("\n", " "))
        else:
            say("done")


if __name__ == "__main__":
    _obey(sys.stdin, lambda text: print(text, flush=True))
