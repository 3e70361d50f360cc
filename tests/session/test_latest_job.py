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


class Picture:
    """Holds values back until it is drawn."""

    def __init__(self):
        self.held = []

    def gate(self, call):
        self.held.append(call)

    def drawn(self):
        self.held.pop()()


def test_nothing_is_asked_for_before_the_picture_has_taken_the_value_before(worker, posted):
    picture, begun, shown = Picture(), [], []
    latest = LatestJob(worker, "drag")
    latest.gate = picture.gate

    def step(number):
        begun.append(number)
        latest.ask(lambda job: number, shown.append)

    for number in range(4):
        latest.when_free(lambda number=number: step(number))
    run_until(posted, lambda: picture.held)
    assert (begun, shown) == ([0], []) and latest.is_busy
    picture.drawn()
    assert (begun, shown) == ([0, 3], [0]), "the newest step is taken, after the frame before is shown"
    run_until(posted, lambda: picture.held)
    picture.drawn()
    assert shown == [0, 3] and not latest.is_busy


def test_what_waits_is_begun_after_the_value_was_taken_and_not_from_inside(worker, posted):
    order = []
    latest = LatestJob(worker, "drag", freed=lambda: order.append("freed"))

    def done(value):
        order.append("shown")
        latest.when_free(lambda: order.append("asked meanwhile"))
        order.append("end of showing")

    latest.ask(lambda job: None, done)
    latest.when_free(lambda: order.append("step"))
    run_until(posted, lambda: "freed" in order)
    assert order == ["shown", "asked meanwhile", "end of showing", "step", "freed"]


def test_a_value_dropped_at_the_gate_is_not_taken_and_the_loop_is_free_at_once(worker, posted):
    picture, shown = Picture(), []
    latest = LatestJob(worker, "drag")
    latest.gate = picture.gate
    latest.ask(lambda job: "dropped", shown.append)
    run_until(posted, lambda: picture.held)
    latest.drop()
    assert not latest.is_busy
    latest.ask(lambda job: "next", shown.append)
    picture.drawn()
    assert latest.is_busy and shown == [], "the picture that comes late does not end the request after"
    run_until(posted, lambda: picture.held)
    picture.drawn()
    assert shown == ["next"]


def test_catching_up_takes_the_step_that_waits_and_forgetting_does_not(worker, posted):
    go, steps = threading.Event(), []
    latest = LatestJob(worker, "drag")
    latest.ask(lambda job: go.wait(30.0), lambda value: None)
    latest.when_free(lambda: steps.append("caught up"))
    latest.catch_up()
    latest.catch_up()
    latest.when_free(lambda: steps.append("forgotten"))
    latest.forget()
    go.set()
    run_until(posted, lambda: not latest.is_busy)
    assert steps == ["caught up"]


def test_what_is_wanted_is_what_the_newest_request_is_for(worker, posted):
    go = threading.Event()
    latest = LatestJob(worker, "bind")
    assert latest.wanted is None
    latest.ask(lambda job: go.wait(30.0), lambda value: None, wanted="first")
    assert latest.wanted == "first"
    latest.ask(lambda job: None, lambda value: None, wanted="second")
    assert latest.wanted == "second"
    latest.drop()
    assert latest.wanted is None and latest.is_busy
    go.set()
    run_until(posted, lambda: not latest.is_busy)


def test_the_loop_goes_on_though_showing_a_value_goes_wrong(worker, posted):
    shown = []
    latest = LatestJob(worker, "view")

    def broken(value):
        raise RuntimeError("the view is broken")

    latest.ask(lambda job: 1, broken)
    latest.ask(lambda job: 2, shown.append)
    with pytest.raises(RuntimeError, match="the view is broken"):
        run_until(posted, lambda: shown)
    run_until(posted, lambda: shown)
    assert shown == [2]
