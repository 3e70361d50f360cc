"""Many inputs to processes with a memory limit and a clock, so that a crash or a hang is seen and made small."""

import ast
import os
import re
import selectors
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic

from tests.campaign.kinds import KINDS, in_turn, input_of
from tests.campaign.worker import CRASH_NAME

SECONDS = 5.0
"""Of processor time, after which an input is taken to hang: what other programs do beside it counts for nothing."""

WINDOW_SECONDS = 30.0
"""For opening a window, preparing, binding, a drag and closing, on a display without hardware."""

IDLE_SECONDS = 120.0
"""Of waiting, after which a process is taken to be stuck though it computes nothing."""

START_SECONDS = 600.0
"""For importing and compiling."""

SHARED_MEMORY = Path("/dev/shm")
"""A folder whose files are never written to a disk, on Linux."""

FINE = ("accepted", "refused", "shown", "nothing to drag")
WINDOWS_LIKE_ANYWHERE = {"QT_API": "pyside6", "QT_QPA_PLATFORM": "xcb", "LIBGL_ALWAYS_SOFTWARE": "1"}


class Worker:
    """One process, started again when it dies.

    Parameters
    ----------
    seed : int
    module : str
        What it runs.
    display : str, optional
        The X display of its windows.
    """

    def __init__(self, seed: int, module: str = "tests.campaign.worker", display: str | None = None) -> None:
        # What dies leaves its files, so that they are not its own.
        self._folder = tempfile.TemporaryDirectory(dir=SHARED_MEMORY if os.access(SHARED_MEMORY, os.W_OK) else None)
        self._arguments = [sys.executable, "-m", module, str(seed), self._folder.name]
        self._environment = {**os.environ, **({} if display is None else WINDOWS_LIKE_ANYWHERE | {"DISPLAY": display})}
        self._seconds = SECONDS if display is None else WINDOW_SECONDS
        self._is_windowed = display is not None
        self._start()

    def _start(self) -> None:
        self._process = subprocess.Popen(
            self._arguments,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            env=self._environment,
        )
        # The first window of a process waits for its loops.
        self._is_fresh = self._is_windowed
        assert self._answer(START_SECONDS) == "ready"

    def ask(self, kind: str, number: int, left_out: tuple[int, ...] = ()) -> str:
        """What became of an input: accepted, refused, ``crash …``, ``hang``, or a traceback."""
        self._process.stdin.write(",".join(map(str, (kind, number, *left_out))) + "\n")
        self._process.stdin.flush()
        answer = self._answer(START_SECONDS if self._is_fresh else self._seconds)
        self._is_fresh = False
        if answer is not None and answer:
            return ast.literal_eval(answer)
        found = "hang" if answer is None else f"crash {self._process.wait()}\n{self._crash()}"
        self._end()
        self._start()
        return found

    def _crash(self) -> str:
        """Where the process crashed, as far as it could say."""
        path = Path(self._folder.name) / CRASH_NAME
        # Addresses are others each time, and the same crash is looked for again when it is made small.
        return re.sub(r"0x[0-9a-f]+", "0x…", path.read_text(errors="replace")) if path.exists() else ""

    def _answer(self, seconds: float) -> str | None:
        """The next line; None if the process computed for that long without one, or waited for much longer."""
        start, used = monotonic(), self._processor_time()
        with selectors.DefaultSelector() as selector:
            selector.register(self._process.stdout, selectors.EVENT_READ)
            while not selector.select(seconds):
                waited = monotonic() - start
                if waited > max(IDLE_SECONDS, seconds) or self._processor_time(waited) - used > seconds:
                    return None
        return self._process.stdout.readline().strip()

    def _processor_time(self, otherwise: float = 0.0) -> float:
        """Seconds that the process and those it waited for have computed; where no file says so, another number."""
        try:
            words = Path(f"/proc/{self._process.pid}/stat").read_text().rpartition(")")[2].split()
        except OSError:
            return otherwise
        return sum(map(int, words[11:15])) / os.sysconf("SC_CLK_TCK")

    def _end(self) -> None:
        self._process.kill()
        self._process.communicate()

    def close(self) -> None:
        """End the process, and take its files away."""
        self._end()
        self._folder.cleanup()


@dataclass
class Found:
    """What a run has come upon."""

    counts: Counter = field(default_factory=Counter)
    failures: list[str] = field(default_factory=list)


def try_inputs(
    seed: int,
    numbers: range,
    until: float,
    found: Found,
    *,
    kinds: Iterable[str] = KINDS,
    display: str | None = None,
    shown_share: int = 100,
) -> Found:
    """Try numbers one after another, the kinds in turn, until a time of the monotonic clock.

    Of the splat files that are accepted one in ``shown_share`` is opened in a
    window and dragged as well, where there is a display.
    """
    names = in_turn(kinds)
    workers = [Worker(seed)]
    n_to_show = 0
    try:
        for number in numbers:
            if monotonic() >= until:
                break
            kind = names[number % len(names)]
            answer = _tried(workers[0], seed, kind, number, found)
            found.counts["inputs"] += 1
            if display is None or answer != "accepted" or not KINDS[kind].is_shown:
                continue
            n_to_show += 1
            if n_to_show % shown_share == 0:
                if len(workers) == 1:
                    workers.append(Worker(seed, "tests.campaign.window", display))
                _tried(workers[1], seed, kind, number, found)
                found.counts["windows"] += 1
    finally:
        for worker in workers:
            worker.close()
    return found


def _tried(worker: Worker, seed: int, kind: str, number: int, found: Found) -> str:
    """What became of an input; what broke is made small and kept."""
    answer = worker.ask(kind, number)
    if answer in FINE:
        found.counts[f"{kind} {answer}"] += 1
    else:
        what = "hangs" if answer == "hang" else "crashes" if answer[:5] == "crash" else "tracebacks"
        found.counts[what] += 1
        found.failures.append(_smallest(worker, seed, kind, number, answer))
        print(found.failures[-1], end="\n\n", flush=True)
    return answer


def _smallest(worker: Worker, seed: int, kind: str, number: int, answer: str) -> str:
    """Leave out what does not matter, and say what is left."""
    _, names = input_of(seed, kind, number)
    left_out: tuple[int, ...] = ()
    for i in range(len(names)):
        if worker.ask(kind, number, (*left_out, i)) == answer:
            left_out = (*left_out, i)
    _, kept = input_of(seed, kind, number, left_out)
    return f"{kind} {number} of seed {seed}, left out {left_out}, {kept}: {answer.strip()[-1500:]}"
