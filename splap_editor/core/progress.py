"""How a long function tells how far it is, and how it is cancelled."""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from itertools import pairwise
from typing import Protocol, TypeVar

Result = TypeVar("Result")

Progress = Callable[[float], None]
"""Called with the share done, 0 to 1, at most about ten times a second; raises `Cancelled` to stop the caller."""


class Cancelled(Exception):  # noqa: N818 - not an error: the user asked for it
    """Raised by a progress callback when the user has cancelled the work."""


def no_progress(share: float) -> None:
    """Ignore the report and never cancel."""


def part_of(progress: Progress, start: float, end: float) -> Progress:
    """Map a sub-step's own share 0..1 to the slice ``start``..``end`` of its caller's progress."""
    return lambda share: progress(start + (end - start) * share)


FrameProgress = Callable[[int], Progress]
"""Gives the progress callback of a frame by its place, from 0 on, and at their number that of what follows the last."""


def no_frame_progress(place: int) -> Progress:
    """Ignore the report of every frame."""
    return no_progress


StageProgress = Callable[[str], Progress]
"""Gives the progress callback of a stage, by its name or by words for it."""


def silent(stage: str) -> Progress:
    """Report no stage."""
    return no_progress


Guard = Callable[[Progress], AbstractContextManager]
"""Entered around loops that run on several cores: who has several threads lets one at a time in."""


def unguarded(progress: Progress) -> AbstractContextManager:
    """For who has one thread."""
    return nullcontext()


class Runner(Protocol):
    """Runs parts that do not depend on each other, as it likes: one after the other, or side by side."""

    def __call__(
        self, parts: Sequence[Callable[[Progress], Result]], told: Callable[[Sequence[float]], None]
    ) -> list[Result]:
        """Give the results in order; ``told`` hears the shares done of all parts, and cancels all by raising."""
        ...


def in_turn(parts: Sequence[Callable[[Progress], Result]], told: Callable[[Sequence[float]], None]) -> list[Result]:
    """Run parts one after the other."""
    shares = [0.0] * len(parts)

    def progress_of(number: int) -> Progress:
        """Progress of one part."""

        def progress(share: float) -> None:
            """Note the part's share, and tell those of all."""
            shares[number] = share
            told(shares)

        return progress

    results = []
    for number, part in enumerate(parts):
        results.append(part(progress_of(number)))
        shares[number] = 1.0
    return results


_PARTS = 4


def in_parts(function: Callable[[int, int, Progress], None], n: int, progress: Progress, run: Runner) -> None:
    """Call a function with the bounds, first and end, of each of four parts of n things."""
    bounds = [number * n // _PARTS for number in range(_PARTS + 1)]
    parts = [partial(function, first, end) for first, end in pairwise(bounds)]
    run(parts, lambda shares: progress(sum(shares) / len(parts)))
    progress(1.0)
