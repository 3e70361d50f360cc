"""One thread at a time in loops that run on several cores."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from splap_editor.core.progress import Progress

_LOCK = threading.Lock()
_WAIT_S = 0.1


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
