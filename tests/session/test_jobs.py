"""Laws of the worker: order, progress, cancel, failure, and a clean end."""

import threading

import pytest

from splap_editor.core.progress import Cancelled
from splap_editor.session.jobs import Job, Worker
from tests.session.main_thread import MainThread


def test_a_value_reaches_the_main_thread(main, worker):
    results = []
    worker.submit(Job("add", "Adding", lambda job: (1 + 1, threading.current_thread().name), done=results.append))
    main.run_until(lambda: results)
    assert results == [(2, "splap-worker")]


def test_jobs_run_in_order(main, worker):
    results = []
    for number in range(5):
        worker.submit(Job(str(number), "", lambda job, number=number: number, done=results.append))
    main.run_until(lambda: len(results) == 5)
    assert results == [0, 1, 2, 3, 4]


def test_a_failure_is_told_and_the_next_job_runs(main, worker):
    failures, results = [], []

    def fail(job):
        raise ValueError("no such thing")

    worker.submit(Job("bad", "", fail, failed=failures.append))
    worker.submit(Job("good", "", lambda job: 1, done=results.append))
    main.run_until(lambda: results)
    assert [str(error) for error in failures] == ["no such thing"]


def test_cancel_stops_at_the_next_report(main, worker):
    running, stopped, done = threading.Event(), [], []

    def forever(job):
        while True:
            running.set()
            job.report(0.5, "spinning")

    job = worker.submit(Job("spin", "", forever, done=done.append, stopped=lambda: stopped.append(1)))
    assert running.wait(20)
    job.cancel()
    main.run_until(lambda: stopped)
    assert not done


def test_a_waiting_job_that_is_cancelled_never_runs(main, worker):
    gate, ran, results = threading.Event(), [], []
    worker.submit(Job("gate", "", lambda job: gate.wait(20)))
    worker.submit(Job("old", "", lambda job: ran.append("old")))
    worker.submit(Job("new", "", lambda job: "new", done=results.append))
    worker.cancel("old")
    gate.set()
    main.run_until(lambda: results)
    assert ran == []


def test_a_result_cancelled_on_its_way_is_not_delivered(main, worker):
    done, stopped = [], []
    job = worker.submit(Job("late", "", lambda job: 1, done=done.append, stopped=lambda: stopped.append(1)))
    while worker.is_busy():
        pass
    job.cancel()
    main.run_until(lambda: stopped)
    assert not done


def test_progress_names_stage_and_share(main, worker):
    told, results = [], []
    worker.on_progress = lambda job: told.append((job.stage, job.share))

    def work(job):
        job.progress("first")(0.25)
        job.progress("second")(0.75)

    worker.submit(Job("work", "", work, done=results.append))
    main.run_until(lambda: results)
    assert len(told) == 2, "a new stage is told at once"
    assert told[-1] == ("second", 0.75)


def test_closing_cancels_and_joins():
    main = MainThread()
    worker = Worker(main.post)
    running = threading.Event()

    def forever(job):
        while True:
            running.set()
            job.report(0.0)

    worker.submit(Job("spin", "", forever))
    assert running.wait(20)
    worker.close()
    assert not any(thread.name == "splap-worker" for thread in threading.enumerate())


def test_report_raises_once_cancelled():
    job = Job("any", "", lambda job: None)
    job.report(0.1)
    job.cancel()
    with pytest.raises(Cancelled):
        job.report(0.2)
