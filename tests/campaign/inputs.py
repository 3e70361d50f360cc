"""Many inputs to processes with a memory limit and a clock, so that a crash or a hang is seen and made small."""

import ast
import os
import selectors
import subprocess
import sys
from collections import Counter
from dataclasses import dataclass, field
from time import monotonic

from tests.campaign.checks import OTHER_FORMATS, is_deformed
from tests.campaign.worker import input_of, kind_of

SECONDS = 5.0
START_SECONDS = 120.0
WINDOW_SECONDS = 30.0
"""For opening a window, preparing, binding, a drag and closing, on a display without hardware."""

FINE = ("accepted", "refused", "shown", "nothing to drag")
WINDOWS_LIKE_ANYWHERE = {"QT_API": "pyside6", "QT_QPA_PLATFORM": "xcb", "LIBGL_ALWAYS_SOFTWARE": "1"}

SHOWN = ("ply", *OTHER_FORMATS)
"""Kinds that a window opens."""


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
        self._arguments = [sys.executable, "-m", module, str(seed)]
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
        # The first window, and the first deformation, of a process wait for their loops.
        self._is_fresh = True
        assert self._answer(START_SECONDS) == "ready"

    def ask(self, number: int, left_out: tuple[int, ...] = ()) -> str:
        """What became of an input: accepted, refused, ``crash …``, ``hang``, or a traceback."""
        self._process.stdin.write(",".join(map(str, (number, *left_out))) + "\n")
        self._process.stdin.flush()
        is_slow = self._is_fresh if self._is_windowed else is_deformed(number)
        self._is_fresh = False
        answer = self._answer(START_SECONDS if is_slow else self._seconds)
        if answer is not None and answer:
            return ast.literal_eval(answer)
        found = "hang" if answer is None else f"crash {self._process.wait()}"
        self.close()
        self._start()
        return found

    def _answer(self, seconds: float) -> str | None:
        with selectors.DefaultSelector() as selector:
            selector.register(self._process.stdout, selectors.EVENT_READ)
            if not selector.select(seconds):
                return None
        return self._process.stdout.readline().strip()

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.communicate()


@dataclass
class Found:
    """What a run has come upon."""

    counts: Counter = field(default_factory=Counter)
    failures: list[str] = field(default_factory=list)


def try_inputs(
    seed: int, numbers: range, until: float, found: Found, *, display: str | None = None, shown_share: int = 100
) -> Found:
    """Try numbers one after another until a time of the monotonic clock.

    Of the splat files that are accepted one in ``shown_share`` is opened in a
    window and dragged as well, where there is a display.
    """
    workers = [Worker(seed)]
    n_to_show = 0
    try:
        for number in numbers:
            if monotonic() >= until:
                break
            answer = _tried(workers[0], seed, number, found)
            found.counts["inputs"] += 1
            if display is None or answer != "accepted" or kind_of(number) not in SHOWN:
                continue
            n_to_show += 1
            if n_to_show % shown_share == 0:
                workers += [Worker(seed, "tests.campaign.window", display)] * (len(workers) == 1)
                _tried(workers[1], seed, number, found)
                found.counts["windows"] += 1
    finally:
        for worker in workers:
            worker.close()
    return found


def _tried(worker: Worker, seed: int, number: int, found: Found) -> str:
    """What became of an input; what broke is made small and kept."""
    answer = worker.ask(number)
    if answer in FINE:
        found.counts[f"{kind_of(number)} {answer}"] += 1
    else:
        found.counts["hangs" if answer == "hang" else "crashes" if answer[:5] == "crash" else "tracebacks"] += 1
        found.failures.append(_smallest(worker, seed, number, answer))
    return answer


def _smallest(worker: Worker, seed: int, number: int, answer: str) -> str:
    """Leave out what does not matter, and say what is left."""
    _, names = input_of(seed, number)
    left_out: tuple[int, ...] = ()
    for i in range(len(names)):
        if worker.ask(number, (*left_out, i)) == answer:
            left_out = (*left_out, i)
    _, kept = input_of(seed, number, left_out)
    return f"{kind_of(number)} {number} of seed {seed}, left out {left_out}, {kept}: {answer.strip()[-1500:]}"
