"""Worker threads: jobs with progress and cancel, results delivered on the main thread."""

import threading
import traceback
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from time import monotonic
from typing import Any

from splap_editor.core.progress import Cancelled, Progress

Post = Callable[[Callable[[], None]], None]
"""Runs a callable on the main thread, soon; called from the worker."""

REPORT_SECONDS = 0.05


@dataclass(eq=False)
class Job:
    """One piece of background work: a snapshot in, a value out.

    Parameters
    ----------
    kind : str
        What it does, by which it is asked for and cancelled.
    title : str
        As shown beside the progress bar: "Preparing bench.ply".
    function : callable
        ``function(job)`` on the worker thread; returns the value. It reports by `Job.report` and so is cancelled.
    """

    kind: str
    title: str
    function: Callable[["Job"], Any]
    done: Callable[[Any], None] | None = None
    failed: Callable[[Exception], None] | None = None
    stopped: Callable[[], None] | None = None
    stage: str = ""
    share: float = 0.0
    _cancelled: threading.Event = field(default_factory=threading.Event)
    _reported: float = 0.0
    _worker: "Worker | None" = None

    def cancel(self) -> None:
        """Ask the work to stop at its next report."""
        self._cancelled.set()

    @property
    def is_cancelled(self) -> bool:
        """Whether `cancel` was called."""
        return self._cancelled.is_set()

    def report(self, share: float, stage: str | None = None) -> None:
        """Tell how far the work is; raises `Cancelled` when it shall stop."""
        if self._cancelled.is_set():
            raise Cancelled
        changed = stage is not None and stage != self.stage
        if stage is not None:
            self.stage = stage
        self.share = share
        now = monotonic()
        if self._worker is not None and (changed or now - self._reported >= REPORT_SECONDS):
            self._reported = now
            self._worker.tell_progress(self)

    def progress(self, stage: str) -> Progress:
        """Progress callback of one named stage."""
        return lambda share: self.report(share, stage)

    def deliver(self, call: Callable[[], None]) -> None:
        """Run ``call`` on the main thread unless the job is cancelled by then."""
        if self._worker is not None:
            self._worker.post(lambda: None if self.is_cancelled else call())


class Worker:
    """A single background thread that runs jobs one after another.

    Compiled loops of the engine are serial and let go of Python's lock, so
    two workers may run side by side. Results, failures and progress reach
    the main thread through ``post``, in order.

    Parameters
    ----------
    post : callable
        Runs a callable on the main thread.
    name : str
        Name of the thread.
    """

    def __init__(self, post: Post, *, name: str = "splap-worker") -> None:
        self.post = post
        self.on_progress: Callable[[Job], None] = lambda job: None
        self.on_busy: Callable[[Job | None], None] = lambda job: None
        self._queue: deque[Job] = deque()
        self._running: Job | None = None
        self._closing = False
        self._wake = threading.Condition()
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def submit(self, job: Job) -> Job:
        """Queue a job; where only the newest of its kind matters, a `LatestJob` does that."""
        job._worker = self
        with self._wake:
            self._queue.append(job)
            self._wake.notify()
        return job

    def cancel(self, *kinds: str) -> None:
        """Cancel waiting and running jobs of these kinds, or all when none is named."""
        with self._wake:
            for job in (*self._queue, self._running):
                if job is not None and (not kinds or job.kind in kinds):
                    job.cancel()

    def is_busy(self, *kinds: str) -> bool:
        """Whether a job of these kinds (or any) waits or runs and is not cancelled."""
        with self._wake:
            return any(
                job is not None and not job.is_cancelled and (not kinds or job.kind in kinds)
                for job in (*self._queue, self._running)
            )

    def tell_progress(self, job: Job) -> None:
        """Pass a job's progress to the main thread."""
        self.post(lambda: None if job.is_cancelled else self.on_progress(job))

    def close(self, timeout: float = 30.0) -> None:
        """Cancel everything and join the thread."""
        with self._wake:
            self._closing = True
            for job in (*self._queue, self._running):
                if job is not None:
                    job.cancel()
            self._wake.notify()
        self._thread.join(timeout)

    def _run(self) -> None:
        while True:
            with self._wake:
                while not self._queue and not self._closing:
                    self._wake.wait()
                if self._closing:
                    return
                job = self._running = self._queue.popleft()
            self.post(partial(self._tell_busy, job))
            self._run_one(job)
            with self._wake:
                self._running = None
                idle = not self._queue
            if idle:
                self.post(partial(self._tell_busy, None))

    def _run_one(self, job: Job) -> None:
        try:
            if job.is_cancelled:
                raise Cancelled
            value = job.function(job)
        except Cancelled:
            if job.stopped is not None:
                self.post(job.stopped)
        except Exception as error:  # a job's failure is shown to the user, whatever it is
            if not isinstance(error, (ValueError, OSError, MemoryError)):
                traceback.print_exc()
            if job.failed is not None:
                self.post(partial(job.failed, error))
        else:
            self.post(lambda: self._finish(job, value))

    def _tell_busy(self, job: Job | None) -> None:
        self.on_busy(job)

    @staticmethod
    def _finish(job: Job, value: Any) -> None:
        if job.is_cancelled:
            if job.stopped is not None:
                job.stopped()
        elif job.done is not None:
            job.done(value)
