"""Laws of the walk: stages in order, newest wins, what is of no use is cancelled, what failed is left alone."""

import threading
from dataclasses import replace
from types import SimpleNamespace

import pytest

from splap_editor.session.jobs import Job, Starter
from splap_editor.session.stage_runner import StageRunner
from splap_editor.session.stages import STAGES, Ledger, Stage


class Edit:
    """What is asked for: a number; handles there are none."""

    active_handles = ()

    def __init__(self, number):
        self.number = number


@pytest.fixture
def starter(main):
    starter = Starter(main.post, name="splap-open")
    yield starter
    starter.close()


@pytest.fixture
def ledger():
    return Ledger(scene=SimpleNamespace(shown_edit=Edit(1), preview=None))


class Shop:
    """Stages that write down for which number they made something, one building on the other."""

    def __init__(self):
        self.made, self.told = {}, []
        self.wait_for = {}
        self.begun = threading.Event()

    def stage(self, name, *, cancels=(), **more):
        def make(job, number):
            self.told.append(f"{name} {number}")
            if name in self.wait_for:
                self.begun.set()
                while not self.wait_for[name].is_set():
                    job.report(0.0)
            return number

        def take(ledger, request, made):
            self.made[name] = made

        more.setdefault("make", make)
        more.setdefault("take", take)
        return Stage(
            name,
            needs=lambda ledger: True,
            is_current=lambda ledger: self.made.get(name) == ledger.scene.shown_edit.number,
            state=lambda ledger: f"{name} under way",
            cancels=cancels,
            request=lambda ledger: ledger.scene.shown_edit.number,
            serves=lambda a, b: a == b,
            fail=lambda ledger, request: setattr(ledger, "given_up", ledger.scene.shown_edit),
            title=lambda request: f"{name.title()} {request}",
            **more,
        )


def test_the_stages_of_a_session_know_each_other():
    names = [stage.name for stage in STAGES]
    assert len(set(names)) == len(names)
    made = {stage.name for stage in STAGES if stage.make is not None}
    assert all({*stage.cancels, *stage.awaits} <= made for stage in STAGES)


def test_stages_are_made_in_the_order_of_the_table(main, worker, starter, ledger):
    shop, states = Shop(), []
    runner = StageRunner(ledger, worker, starter, (shop.stage("first"), shop.stage("second"), shop.stage("third")))
    runner.state_changed.connect(lambda: states.append(ledger.state))
    runner.advance()
    main.run_until(lambda: ledger.state == "ready")
    assert shop.told == ["first 1", "second 1", "third 1"]
    assert states == ["first under way", "second under way", "third under way", "ready"]
    runner.advance()
    assert not worker.is_busy(), "what is up to date is not made again"


def test_what_is_under_way_and_serves_is_not_started_twice(main, worker, starter, ledger):
    shop = Shop()
    shop.wait_for["first"] = go = threading.Event()
    runner = StageRunner(ledger, worker, starter, (shop.stage("first"), shop.stage("second")))
    for _ in range(5):
        runner.advance()
    go.set()
    main.run_until(lambda: ledger.state == "ready")
    assert shop.told == ["first 1", "second 1"]


def test_a_newer_request_cancels_the_stage_and_what_builds_on_it(main, worker, starter, ledger):
    shop = Shop()
    shop.wait_for["second"] = go = threading.Event()
    runner = StageRunner(ledger, worker, starter, (shop.stage("first", cancels=("second",)), shop.stage("second")))
    runner.advance()
    main.run_until(shop.begun.is_set)
    ledger.scene.shown_edit = Edit(2)
    runner.advance()
    main.run_until(lambda: shop.made.get("first") == 2)
    assert "second" not in shop.made
    go.set()
    main.run_until(lambda: ledger.state == "ready")
    assert shop.made == {"first": 2, "second": 2} and shop.told[-2:] == ["first 2", "second 2"]


def test_a_stage_that_awaits_itself_comes_to_an_end_and_then_the_newest_is_made(main, worker, starter, ledger):
    shop = Shop()
    shop.wait_for["drag"] = go = threading.Event()
    runner = StageRunner(ledger, worker, starter, (shop.stage("drag", awaits=("drag",)),))
    taken = []
    runner.made.connect(lambda name, made: taken.append(made))
    for number in range(1, 9):
        ledger.scene.shown_edit = Edit(number)
        runner.advance()
    go.set()
    main.run_until(lambda: ledger.state == "ready")
    assert taken == [1, 8]


def test_a_stage_without_a_job_is_taken_on_the_way(main, worker, starter, ledger):
    shop = Shop()
    rest = shop.stage("rest", make=None, take=lambda ledger, request, made: shop.told.append("rest"))
    StageRunner(ledger, worker, starter, (rest, shop.stage("after"))).advance()
    main.run_until(lambda: ledger.state == "ready")
    assert shop.told[:2] == ["rest", "after 1"]


def test_what_failed_is_told_and_left_until_something_else_is_asked_for(main, worker, starter, ledger):
    def fail(job, number):
        if number == 1:
            raise ValueError("no such luck")
        return number

    shop, told = Shop(), []
    runner = StageRunner(ledger, worker, starter, (shop.stage("first", make=fail), shop.stage("second")))
    runner.failed.connect(lambda title, error: told.append((title, str(error))))
    runner.advance()
    main.run_until(lambda: ledger.state == "failed")
    assert told == [("First 1", "no such luck")]
    runner.advance()
    assert not worker.is_busy() and ledger.state == "failed"
    ledger.scene.shown_edit = Edit(2)
    runner.advance()
    main.run_until(lambda: ledger.state == "ready")
    assert shop.made == {"first": 2, "second": 2}


def test_halting_cancels_and_leaves_everything_until_it_is_taken_back(main, worker, starter, ledger):
    shop = Shop()
    shop.wait_for["first"] = go = threading.Event()
    runner = StageRunner(ledger, worker, starter, (shop.stage("first"), shop.stage("second")))
    runner.advance()
    main.run_until(shop.begun.is_set)
    runner.halt()
    main.run_until(lambda: not runner.loop("first").is_busy)
    assert ledger.state == "halted" and shop.made == {} and not worker.is_busy()
    go.set()
    ledger.is_halted = False
    runner.advance()
    main.run_until(lambda: ledger.state == "ready")
    assert shop.made == {"first": 1, "second": 1}


def test_what_is_made_at_once_waits_for_nothing_not_even_for_its_like_that_is_blocked(main, worker, starter, ledger):
    doors = {number: threading.Event() for number in (0, 1, 2)}
    worker.submit(Job("export", "", lambda job: doors[0].wait(60.0)))
    begun, taken = [], []

    def make(job, number):
        begun.append(number)
        assert doors[number].wait(60.0)  # it does not report: nothing reaches it
        return number

    stage = Shop().stage(
        "open",
        make=make,
        take=lambda ledger, request, made: taken.append(made),
        is_at_once=True,
    )
    stage = replace(stage, is_current=lambda ledger: taken == [ledger.scene.shown_edit.number])
    runner = StageRunner(ledger, worker, starter, (stage,))
    runner.advance()
    ledger.scene.shown_edit = Edit(2)
    runner.advance()
    doors[2].set()
    main.run_until(lambda: taken)
    assert sorted(begun) == [1, 2] and taken == [2] and ledger.state == "ready"
    doors[1].set()
    main.run_to_the_end_of("splap-open")
    doors[0].set()
    assert taken == [2], "what was given up is not heard of"


def test_what_runs_beside_the_others_neither_waits_nor_is_waited_for(main, worker, starter, ledger):
    shop = Shop()
    shop.wait_for = {name: threading.Event() for name in ("beside", "first")}
    beside = shop.stage("beside", is_at_once=True, is_beside=True, awaits=("beside",))
    runner = StageRunner(ledger, worker, starter, (beside, shop.stage("first"), shop.stage("second")))
    runner.advance()
    main.run_until(lambda: len(shop.told) == 2)
    assert sorted(shop.told) == ["beside 1", "first 1"] and ledger.state == "first under way"
    ledger.scene.shown_edit = Edit(2)
    shop.wait_for["first"].set()
    main.run_until(lambda: shop.made.get("second") == 2)
    assert shop.made.keys() == {"first", "second"}, "it goes on, and what it awaits is itself"
    shop.wait_for["beside"].set()
    main.run_until(lambda: shop.made.get("beside") == 2)
    assert shop.told.count("beside 1") == shop.told.count("beside 2") == 1
