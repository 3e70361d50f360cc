"""Threads for the engine, which has none of its own: parts run side by side, and loops that only one may enter."""

import contextlib
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Generic

from splap_editor.core.progress import Cancelled, Progress, Result, Runner
from splap_editor.session.background_thread import BackgroundThread

N_THREADS = 4
"""Parts at a time unless told otherwise; factorisation and compiled loops let go of Python's lock."""

_LOCK = threading.Lock()
_WAIT_S = 0.1
_REPORT_S = 0.05
_NEARLY_DONE = 0.999


@contextmanager
def alone(progress: Progress) -> Iterator[None]:
    """Wait until no other thread is in the graph search, reporting a share of 0 meanwhile so that it can be cancelled.

    The search uses several cores, and where numba has to use its portable threading layer the process is aborted if
    two Python threads do so at once.
    """
    while not _LOCK.acquire(timeout=_WAIT_S):
        progress(0.0)
    try:
        yield
    finally:
        _LOCK.release()


def side_by_side(n_threads: int = N_THREADS) -> Runner:
    """Run parts on so many threads; what they give does not depend on how many.

    Where one fails, or whoever is told stops the work by an exception, the others end at their next report and are not
    waited for.
    """

    def run(parts: Sequence[Callable[[Progress], Result]], told: Callable[[Sequence[float]], None]) -> list[Result]:
        work = _SharedWork(parts)
        for _ in range(min(n_threads, len(parts))):
            BackgroundThread(work.take_part, name="splap-part", stop=work.stop).start()
        try:
            while not work.is_done(_REPORT_S):
                told(work.shares)
        finally:
            work.stop()
        return work.results

    return run


class _SharedWork(Generic[Result]):
    """Parts that several threads take one after the other, until none is left or one has failed."""

    def __init__(self, parts: Sequence[Callable[[Progress], Result]]) -> None:
        self.shares = [0.0] * len(parts)
        self._results: dict[int, Result] = {}
        self._failure: Exception | None = None
        self._left = deque(enumerate(parts))
        self._is_stopped = False
        self._wake = threading.Condition()

    def stop(self) -> None:
        """End what runs at its next report, and begin nothing more."""
        self._is_stopped = True
        self._left.clear()

    def take_part(self) -> None:
        """Run parts, on a thread of the work."""
        with contextlib.suppress(IndexError, Cancelled):
            while True:
                number, part = self._left.popleft()
                self._run(number, part)

    def is_done(self, seconds: float) -> bool:
        """Wait for the end, no longer than this; raises what a part raised."""
        with self._wake:
            self._wake.wait_for(self._is_at_end, seconds)
            if self._failure is not None:
                raise self._failure
            return self._is_at_end()

    @property
    def results(self) -> list[Result]:
        """What the parts gave, in their order."""
        return [self._results[number] for number in range(len(self.shares))]

    def _is_at_end(self) -> bool:
        return self._failure is not None or len(self._results) == len(self.shares)

    def _run(self, number: int, part: Callable[[Progress], Result]) -> None:
        def progress(share: float) -> None:
            if self._is_stopped:
                raise Cancelled
            self.shares[number] = min(share, _NEARLY_DONE)

        try:
            result = part(progress)
        except Cancelled:
            raise
        except Exception as error:  # it is raised again where the work is waited for
            with self._wake:
                self._failure = self._failure or error
                self._wake.notify()
            self.stop()
        else:
            with self._wake:
                self._results[number] = result
                self.shares[number] = 1.0
                self._wake.notify()
