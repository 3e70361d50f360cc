"""Threads for the engine, which has none of its own: parts run side by side, and loops that only one may enter."""

import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import contextmanager

from splap_editor.core.progress import Cancelled, Progress, Result, Runner

N_THREADS = 4
"""Parts at a time unless told otherwise; factorisation and compiled loops let go of Python's lock."""

_LOCK = threading.Lock()
_WAIT_S = 0.1
_REPORT_S = 0.05


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
    """Run parts on so many threads; what they give does not depend on how many."""

    def run(parts: Sequence[Callable[[Progress], Result]], told: Callable[[Sequence[float]], None]) -> list[Result]:
        shares = [0.0] * len(parts)
        is_cancelled = False

        def progress_of(number: int) -> Progress:
            def progress(share: float) -> None:
                shares[number] = share
                if is_cancelled:
                    raise Cancelled

            return progress

        with ThreadPoolExecutor(n_threads, thread_name_prefix="splap-part") as threads:
            futures = [threads.submit(part, progress_of(number)) for number, part in enumerate(parts)]
            try:
                is_under_way = bool(futures)
                while is_under_way:
                    told(
                        [
                            1.0 if future.done() else min(share, 0.999)
                            for future, share in zip(futures, shares, strict=True)
                        ]
                    )
                    is_under_way = bool(wait(futures, timeout=_REPORT_S).not_done)
            except Cancelled:
                is_cancelled = True
                raise
        return [future.result() for future in futures]

    return run
