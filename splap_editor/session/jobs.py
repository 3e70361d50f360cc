"""Background threads: jobs with progress and cancel, results delivered on the main thread."""

import threading
import traceback
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import partial
from time import monotonic
from typing import Any

from splap_editor.core.progress import Cancelled, Progress
from splap_editor.session.background_thread import LEAVE_SECONDS, BackgroundThread, joined

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
    _worker: "Threads | None" = None

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


class Threads(ABC):
    """What runs jobs in the background.

    Compiled loops of the engine are serial and let go of Python's lock, so
    several threads may run side by side. Results, failures and progress reach
    the main thread through ``post``, in order. A job that is cancelled ends at
    its next report.

    Parameters
    ----------
    post : callable
        Runs a callable on the main thread.
    name : str
        Name of the threads.
    """

    def __init__(self, post: Post, *, name: str) -> None:
        self._post = post
        self._is_heard = True
        self.on_progress: Callable[[Job], None] = lambda job: None
        self.on_busy: Callable[[Job | None], None] = lambda job: None
        self._name = name
        self._wake = threading.Condition()

    @abstractmethod
    def submit(self, job: Job) -> Job:
        """Take a job; where only the newest of its kind matters, a `LatestJob` does that."""

    def close(self) -> None:
        """Cancel everything and join what comes to an end in time; the rest ends with the process, unheard."""
        close_all((self,))

    def stop(self) -> None:
        """Cancel everything, and begin no more; waits for nothing."""
        self.cancel()

    @abstractmethod
    def threads(self) -> tuple[threading.Thread, ...]:
        """Threads that run."""

    @abstractmethod
    def _jobs(self) -> tuple[Job, ...]:
        """Jobs that wait or run, the newest last."""

    def cancel(self, *kinds: str) -> None:
        """Cancel waiting and running jobs of these kinds, or all when none is named."""
        with self._wake:
            for job in self._jobs():
                if not kinds or job.kind in kinds:
                    job.cancel()

    def is_busy(self, *kinds: str) -> bool:
        """Whether a job of these kinds (or any) waits or runs and is not cancelled."""
        with self._wake:
            return any(not job.is_cancelled and (not kinds or job.kind in kinds) for job in self._jobs())

    def post(self, call: Callable[[], None]) -> None:
        """Run a callable on the main thread, soon, if anybody is left there to hear of it."""
        if self._is_heard:
            self._post(call)

    def fall_silent(self) -> None:
        """Tell the main thread nothing any more."""
        self._is_heard = False

    def tell_progress(self, job: Job) -> None:
        """Pass a job's progress to the main thread."""
        self.post(lambda: None if job.is_cancelled else self.on_progress(job))

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
            self.post(partial(self._tell_failure, job, error))
        else:
            self.post(lambda: self._finish(job, value))

    @staticmethod
    def _tell_failure(job: Job, error: Exception) -> None:
        """Tell of a failure, unless nobody wants to know any more what would have come of it."""
        told = job.stopped if job.is_cancelled else job.failed and partial(job.failed, error)
        if told is not None:
            told()

    @staticmethod
    def _finish(job: Job, value: Any) -> None:
        if job.is_cancelled:
            if job.stopped is not None:
                job.stopped()
        elif job.done is not None:
            job.done(value)


class Worker(Threads):
    """A single background thread that runs jobs one after another."""

    def __init__(self, post: Post, *, name: str = "splap-worker") -> None:
        super().__init__(post, name=name)
        self._queue: deque[Job] = deque()
        self._running: Job | None = None
        self._closing = False
        self._thread = BackgroundThread(self._run, name=name, stop=self.stop)
        self._thread.start()

    def submit(self, job: Job) -> Job:
        """Queue a job."""
        job._worker = self
        with self._wake:
            self._queue.append(job)
            self._wake.notify()
        return job

    def stop(self) -> None:
        """Cancel everything, and begin no more; waits for nothing."""
        with self._wake:
            self._closing = True
            for job in self._jobs():
                job.cancel()
            self._wake.notify()

    def threads(self) -> tuple[threading.Thread, ...]:
        """The one thread."""
        return (self._thread,)

    def _jobs(self) -> tuple[Job, ...]:
        return (*(() if self._running is None else (self._running,)), *self._queue)

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

    def _tell_busy(self, job: Job | None) -> None:
        self.on_busy(job)


class Starter(Threads):
    """A thread of its own for each job, begun at once: no file that is opened waits for one that is slow or blocked.

    Until a job that is cancelled ends it holds on to what it works on, but
    nobody hears of it any more.
    """

    def __init__(self, post: Post, *, name: str) -> None:
        super().__init__(post, name=name)
        self._running: dict[Job, threading.Thread] = {}

    def submit(self, job: Job) -> Job:
        """Start a job."""
        job._worker = self
        thread = BackgroundThread(partial(self._run, job), name=self._name, stop=job.cancel)
        with self._wake:
            self._running[job] = thread
        self._tell_busy()
        thread.start()
        return job

    def threads(self) -> tuple[threading.Thread, ...]:
        """Threads of the jobs that run."""
        with self._wake:
            return tuple(self._running.values())

    def _jobs(self) -> tuple[Job, ...]:
        return tuple(self._running)

    def _run(self, job: Job) -> None:
        self._run_one(job)
        with self._wake:
            del self._running[job]
        self._tell_busy()

    def _tell_busy(self) -> None:
        """Tell of the newest job that runs and is wanted, as it is by then."""

        def tell() -> None:
            with self._wake:
                wanted = [job for job in self._jobs() if not job.is_cancelled]
            self.on_busy(wanted[-1] if wanted else None)

        self.post(tell)


def close_all(several: Iterable[Threads]) -> None:
    """Close all of them at once: none waits for another, and all together take no longer than one."""
    several = tuple(several)
    for threads in several:
        threads.stop()
    joined((thread for threads in several for thread in threads.threads()), LEAVE_SECONDS)
    for threads in several:
        threads.fall_silent()
