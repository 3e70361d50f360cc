"""Many inputs to processes with a memory limit and a clock, so that a crash or a hang is seen and made small."""

import ast
import selectors
import subprocess
import sys
from collections import Counter
from dataclasses import dataclass, field
from time import monotonic

from tests.campaign.checks import is_deformed
from tests.campaign.worker import input_of, kind_of

SECONDS = 5.0
START_SECONDS = 120.0


class Worker:
    """One process, started again when it dies."""

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self._start()

    def _start(self) -> None:
        arguments = [sys.executable, "-m", "tests.campaign.worker", str(self._seed)]
        self._process = subprocess.Popen(
            arguments, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        )
        assert self._answer(START_SECONDS) == "ready"

    def ask(self, number: int, left_out: tuple[int, ...] = ()) -> str:
        """What became of an input: accepted, refused, ``crash …``, ``hang``, or a traceback."""
        self._process.stdin.write(",".join(map(str, (number, *left_out))) + "\n")
        self._process.stdin.flush()
        # The first deformation of a process waits for its loops.
        answer = self._answer(START_SECONDS if is_deformed(number) else SECONDS)
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


def try_inputs(seed: int, numbers: range, until: float, found: Found) -> Found:
    """Try numbers one after another until a time of the monotonic clock."""
    worker = Worker(seed)
    try:
        for number in numbers:
            if monotonic() >= until:
                break
            answer = worker.ask(number)
            found.counts["inputs"] += 1
            if answer in ("accepted", "refused"):
                found.counts[f"{kind_of(number)} {answer}"] += 1
                continue
            found.counts["hangs" if answer == "hang" else "crashes" if answer[:5] == "crash" else "tracebacks"] += 1
            found.failures.append(_smallest(worker, seed, number, answer))
    finally:
        worker.close()
    return found


def _smallest(worker: Worker, seed: int, number: int, answer: str) -> str:
    """Leave out what does not matter, and say what is left."""
    _, names = input_of(seed, number)
    left_out: tuple[int, ...] = ()
    for i in range(len(names)):
        if worker.ask(number, (*left_out, i)) == answer:
            left_out = (*left_out, i)
    _, kept = input_of(seed, number, left_out)
    return f"{kind_of(number)} {number} of seed {seed}, left out {left_out}, {kept}: {answer.strip()[-1500:]}"
