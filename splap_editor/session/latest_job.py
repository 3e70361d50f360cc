"""Background work of which only the newest request matters."""

from collections.abc import Callable
from typing import Any

from splap_editor.session.jobs import Job, Worker


class LatestJob:
    """Runs one request at a time; of those made meanwhile only the newest is run after it.

    Unlike cancelling what runs with each request, this shows something while
    requests keep coming, as in a drag. Only for the main thread.

    Parameters
    ----------
    worker : Worker
    kind : str
        Kind of its jobs.
    cancels : bool
        A new request cancels the one that runs, for work that takes long.
    failed : callable, optional
        Given the error of a request that failed.
    """

    def __init__(
        self, worker: Worker, kind: str, *, cancels: bool = False, failed: Callable[[Exception], None] | None = None
    ) -> None:
        self._worker = worker
        self._kind = kind
        self._cancels = cancels
        self._failed = failed
        self._running: Job | None = None
        self._waiting: tuple[Callable[[Job], Any], Callable[[Any], None]] | None = None

    @property
    def is_busy(self) -> bool:
        """Whether a request runs or waits."""
        return self._running is not None

    def ask(self, function: Callable[[Job], Any], done: Callable[[Any], None]) -> None:
        """Run ``function(job)`` on the worker and give its value to ``done``, unless a newer request comes first."""
        if self._running is not None:
            self._waiting = (function, done)
            if self._cancels:
                self._running.cancel()
            return

        def finished(value: Any) -> None:
            # A newer request that has waited is on its way: what it asked for replaces this, soon.
            self._running = None
            done(value)
            self._go_on()

        def failed(error: Exception) -> None:
            self._running = None
            if self._failed is not None:
                self._failed(error)
            self._go_on()

        self._running = self._worker.submit(Job(self._kind, "", function, finished, failed, self._stopped))

    def drop(self) -> None:
        """Forget what waits and cancel what runs."""
        self._waiting = None
        if self._running is not None:
            self._running.cancel()

    def _stopped(self) -> None:
        self._running = None
        self._go_on()

    def _go_on(self) -> None:
        if self._waiting is not None:
            waiting, self._waiting = self._waiting, None
            self.ask(*waiting)
