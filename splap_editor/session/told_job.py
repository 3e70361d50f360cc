"""Which background job a person is told of."""

from functools import partial

from splap_editor.session.jobs import Job, Threads
from splap_editor.session.signals import Signal


class ToldJob:
    """The running job of the first of several threads that has one to tell, else work that is done elsewhere.

    `changed` tells the job, or None, when it is another and whenever it reports.

    Parameters
    ----------
    *threads : Threads
        The first come first.
    """

    def __init__(self, *threads: Threads) -> None:
        self.changed = Signal()
        self._running: dict[Threads, Job | None] = dict.fromkeys(threads)
        self._told: Job | None = None
        self._elsewhere: Job | None = None
        for each in threads:
            each.on_progress = partial(self._on_progress, each)
            each.on_busy = partial(self._on_busy, each)

    def set_elsewhere(self, job: Job | None) -> None:
        """Tell of work that is done elsewhere whenever there is none here; None: it is over."""
        self._elsewhere = job
        if self._told is None:
            self.changed.emit(job)

    def _on_progress(self, threads: Threads, job: Job) -> None:
        """Tell how far the job is that is told; of one that goes on beside it nothing is heard."""
        is_beside = self._told is not None and self._running[threads] is not self._told
        if job is self._told or not (job.title or is_beside):
            self.changed.emit(job)

    def _on_busy(self, threads: Threads, job: Job | None) -> None:
        """Tell which job runs; frames of a drag, which have no title, come and go too fast to be told."""
        if job is None or job.title:
            self._running[threads] = job
        told = next((each for each in self._running.values() if each is not None), None)
        if told is not self._told:
            self._told = told
            self.changed.emit(told or self._elsewhere)
