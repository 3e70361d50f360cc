"""The one loop behind all background work of which only the newest request matters."""

from collections.abc import Callable
from typing import Any

from splap_editor.session.jobs import Job, Threads

Call = Callable[[], None]
Gate = Callable[[Call], None]
"""Makes a call on the main thread once the picture is ready for another value."""


def at_once(call: Call) -> None:
    """Keep nothing waiting: the gate where no picture is drawn."""
    call()


class LatestJob:
    """Runs one request at a time; of those made meanwhile only the newest is run after it.

    Frames of a drag, the stages of a session, colours and order of a view,
    previews: all go through here. Only for the main thread. ::

        ask ─▶ waits (the newest) ─▶ runs on the worker ─▶ held at the gate ─▶ done ─▶ the one that waits
                                     └───────────── busy ────────────┘

    What waits is begun after ``done`` has returned, never from inside it.

    Parameters
    ----------
    worker : Threads
    kind : str
        Kind of its jobs.
    cancels : bool
        A new request cancels the one that runs, for work that takes long. Without, something is shown while requests
        keep coming, as in a drag.
    abandons : bool
        It also begins at once: what runs may be blocked, and its value is not taken. Only for a `Starter`.
    failed : callable, optional
        Given the error of a request that failed.
    freed : callable, optional
        Called when a request has ended, in whatever way, and none waits.
    """

    def __init__(
        self,
        worker: Threads,
        kind: str,
        *,
        cancels: bool = False,
        abandons: bool = False,
        failed: Callable[[Exception], None] | None = None,
        freed: Call | None = None,
    ) -> None:
        self.gate: Gate = at_once
        self._worker = worker
        self._kind = kind
        self._cancels = cancels
        self._abandons = abandons
        self._failed = failed or (lambda error: None)
        self._freed = freed or _nothing
        self._running: Job | None = None
        self._is_held = False
        self._waiting: Call | None = None
        self._wanted: Any = None

    @property
    def is_busy(self) -> bool:
        """Whether a request runs, or its value has not been taken yet."""
        return self._running is not None

    @property
    def wanted(self) -> Any:
        """What the newest request is for that runs or waits, as told to `ask`; None when none is or it is cancelled."""
        is_coming = self._waiting is not None or (self._running is not None and not self._running.is_cancelled)
        return self._wanted if is_coming else None

    def ask(
        self,
        function: Callable[[Job], Any],
        done: Callable[[Any], None],
        *,
        failed: Callable[[Exception], None] | None = None,
        title: str = "",
        wanted: Any = None,
    ) -> None:
        """Run ``function(job)`` on the worker and give its value to ``done``, unless a newer request comes first."""
        self._wanted = wanted
        if self._abandons:
            self.drop()
        if self._running is None:
            self._run(function, done, failed or self._failed, title)
            return
        if self._cancels:
            self._running.cancel()
        self._waiting = lambda: self.ask(function, done, failed=failed, title=title, wanted=wanted)

    def when_free(self, call: Call) -> None:
        """Make a call now, or once what runs has been taken; of calls and requests that wait only the newest is kept.

        For a request that is better put together when its turn comes.
        """
        if self._running is None:
            call()
        else:
            self._waiting = call

    def catch_up(self) -> None:
        """Make the call that waits now, if there is one."""
        call, self._waiting = self._waiting, None
        if call is not None:
            call()

    def forget(self) -> None:
        """Let go of what waits; what runs goes on."""
        self._waiting = None

    def drop(self) -> None:
        """Forget what waits and cancel what runs: its value is not taken."""
        self.forget()
        if self._running is not None:
            self._running.cancel()
            if self._is_held or self._abandons:
                self._running, self._is_held = None, False

    def _run(
        self,
        function: Callable[[Job], Any],
        done: Callable[[Any], None],
        failed: Callable[[Exception], None],
        title: str,
    ) -> None:
        def made(value: Any) -> None:
            if self._running is job:
                self._is_held = True
                self.gate(lambda: end(_nothing if job.is_cancelled else lambda: done(value)))

        def end(tell: Call) -> None:
            # It may have been dropped meanwhile, and another run in its place.
            if self._running is job:
                self._end(tell)

        job = Job(
            self._kind,
            title,
            function,
            made,
            lambda error: end(lambda: failed(error)),
            lambda: end(_nothing),
        )
        self._running = self._worker.submit(job)

    def _end(self, tell: Call) -> None:
        """Tell how a request ended, and go on with what waits even if telling goes wrong."""
        self._running, self._is_held = None, False
        try:
            tell()
        finally:
            if self._running is None:
                self.catch_up()
            if self._running is None:
                self._freed()


def _nothing() -> None:
    pass
