"""Of requests made while one runs, only the newest is run."""

import queue
import threading

import pytest

from splap_editor.session.jobs import Worker
from splap_editor.session.latest_job import LatestJob


@pytest.fixture
def posted():
    return queue.Queue()


@pytest.fixture
def worker(posted):
    worker = Worker(posted.put)
    yield worker
    worker.close()


def run_until(posted, condition):
    while not condition():
        posted.get(timeout=30.0)()


def test_the_first_and_the_newest_are_run_and_those_between_are_not(worker, posted):
    go, made, shown = threading.Event(), [], []
    latest = LatestJob(worker, "detail")

    def work(number):
        def function(job):
            go.wait(30.0)
            made.append(number)
            return number

        return function

    for number in range(5):
        latest.ask(work(number), shown.append)
    go.set()
    run_until(posted, lambda: 4 in shown)
    assert made == shown == [0, 4] and not latest.is_busy


def test_a_newer_request_cancels_where_asked_to(worker, posted):
    started, shown = threading.Event(), []
    latest = LatestJob(worker, "preview", cancels=True)

    def endless(job):
        while True:
            started.set()
            job.report(0.0)

    latest.ask(endless, shown.append)
    run_until(posted, started.is_set)
    latest.ask(lambda job: "newest", shown.append)
    run_until(posted, lambda: shown)
    assert shown == ["newest"]


def test_dropping_leaves_nothing_to_show_and_room_for_the_next(worker, posted):
    shown = []
    latest = LatestJob(worker, "preview")
    latest.ask(lambda job: "dropped", shown.append)
    latest.drop()
    run_until(posted, lambda: not latest.is_busy)
    latest.ask(lambda job: "next", shown.append)
    run_until(posted, lambda: shown)
    assert shown == ["next"]


def test_a_failure_is_told_and_the_next_request_runs(worker, posted):
    errors, shown = [], []
    latest = LatestJob(worker, "detail", failed=errors.append)

    def fail(job):
        raise ValueError("no such luck")

    latest.ask(fail, shown.append)
    latest.ask(lambda job: "next", shown.append)
    run_until(posted, lambda: shown)
    assert str(errors[0]) == "no such luck"
