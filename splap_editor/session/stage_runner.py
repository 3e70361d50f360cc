"""Walks the table of stages: starts what is missing next, and cancels what is of no use any more."""

from functools import partial
from typing import Any

from splap_editor.session.jobs import Starter, Worker
from splap_editor.session.latest_job import LatestJob
from splap_editor.session.signals import Signal
from splap_editor.session.stages import STAGES, Ledger, Stage


class StageRunner:
    """Makes, one job at a time, what the ledger asks for.

    `made` tells stage and value once the ledger has them, `failed` a title
    and the error, `state_changed` that the ledger's state is another.

    Parameters
    ----------
    ledger : Ledger
    worker : Worker
    starter : Starter
        Runs what waits for nothing.
    stages : tuple of Stage
    """

    def __init__(self, ledger: Ledger, worker: Worker, starter: Starter, stages: tuple[Stage, ...] = STAGES) -> None:
        self.made = Signal()
        self.failed = Signal()
        self.state_changed = Signal()
        self._ledger = ledger
        self._worker = worker
        self._starter = starter
        self._stages = stages
        self._loops = {stage.name: self._loop(stage) for stage in stages if stage.make is not None}

    def loop(self, name: str) -> LatestJob:
        """What runs the jobs of a stage."""
        return self._loops[name]

    def advance(self) -> None:
        """Start the first stage that is called for and not up to date, unless that is under way already.

        What runs beside the others is started as well.
        """
        ledger = self._ledger
        for stage in self._stages:
            if not stage.is_at_once and self._is_left:
                return
            if not stage.needs(ledger) or stage.is_current(ledger):
                continue
            if stage.make is None:
                self._cancel(stage)
                stage.take(ledger, None, None)
                continue
            self._set_state(stage.state(ledger))
            if stage.is_at_once or not ledger.is_held:
                self._start_unless_it_runs(stage)
            if not stage.is_beside:
                return
        self._set_state(ledger.state_at_rest)

    def halt(self) -> None:
        """Cancel everything, files to be opened or written included, and leave it until the ledger says otherwise."""
        self._ledger.is_halted = True
        self._ledger.opening, self._ledger.exports = None, ()
        for loop in self._loops.values():
            loop.drop()
        self._worker.cancel()
        self._starter.cancel()
        self._set_state("halted")

    def stop_opening(self) -> None:
        """Give up the file that is being read, if one is."""
        if self._ledger.opening is not None:
            self._ledger.opening = None
            self._loops["open"].drop()
            self._set_state("empty" if self._ledger.scene is None else self._ledger.state)
            self.advance()

    @property
    def _is_left(self) -> bool:
        """Whether nothing more is to be made for the scene on screen."""
        ledger = self._ledger
        return ledger.scene is None or ledger.is_halted or ledger.scene.shown_edit is ledger.given_up

    def _loop(self, stage: Stage) -> LatestJob:
        # A stage that awaits itself lets each of its jobs come to an end.
        cancels = stage.name not in stage.awaits
        threads = self._starter if stage.is_at_once else self._worker
        abandons = stage.is_at_once and cancels
        return LatestJob(threads, stage.name, cancels=cancels, abandons=abandons, freed=self.advance)

    def _start_unless_it_runs(self, stage: Stage) -> None:
        if any(self._loops[name].is_busy for name in stage.awaits):
            return
        request = stage.request(self._ledger)
        under_way = self._loops[stage.name].wanted
        if under_way is None or not stage.serves(under_way, request):
            self._start(stage, request)

    def _start(self, stage: Stage, request: Any) -> None:
        self._cancel(stage)
        make = stage.make
        assert make is not None  # else it has no loop
        self._loops[stage.name].ask(
            lambda job: make(job, request),
            partial(self._take, stage, request),
            failed=partial(self._fail, stage, request),
            title=stage.title(request) if stage.is_told else "",
            wanted=request,
        )

    def _cancel(self, stage: Stage) -> None:
        for name in stage.cancels:
            self._loops[name].drop()

    def _take(self, stage: Stage, request: Any, made: Any) -> None:
        stage.take(self._ledger, request, made)
        self.made.emit(stage.name, made)

    def _fail(self, stage: Stage, request: Any, error: Exception) -> None:
        ledger = self._ledger
        stage.fail(ledger, request)
        if ledger.scene is None:
            self._set_state("empty")
        elif ledger.scene.shown_edit is ledger.given_up:
            self._set_state("failed")
        self.failed.emit(stage.title(request), error)

    def _set_state(self, state: str) -> None:
        if state != self._ledger.state:
            self._ledger.state = state
            self.state_changed.emit()
