"""Parts on several threads: results in order, failures raised, and an end that everyone hears of."""

import threading

import pytest

from splap_editor.core.progress import Cancelled
from splap_editor.session.side_by_side import side_by_side


def silent(shares):
    pass


@pytest.mark.parametrize("n_threads", [1, 3, 9])
def test_parts_give_their_results_in_order(n_threads):
    gates = [threading.Event() for _ in range(5)]

    def part(number):
        def run(progress):
            # With several threads the later parts end first.
            if n_threads > len(gates) and number + 1 < len(gates):
                assert gates[number + 1].wait(60.0)
            gates[number].set()
            progress(0.5)
            return number

        return run

    assert side_by_side(n_threads)([part(number) for number in range(5)], silent) == [0, 1, 2, 3, 4]


def test_no_part_has_no_result():
    assert side_by_side()([], silent) == []


def endless(running, ended):
    def run(progress):
        running.set()
        try:
            while True:
                progress(1.0)
        except Cancelled:
            ended.set()
            raise

    return run


@pytest.mark.parametrize("ending", [Cancelled, KeyboardInterrupt])
def test_whoever_is_told_stops_all_parts(ending):
    running, ended, begun = threading.Event(), threading.Event(), []

    def told(shares):
        assert running.wait(60.0)
        assert max(shares) < 1.0
        raise ending

    with pytest.raises(ending):
        side_by_side(1)([endless(running, ended), begun.append], told)
    assert ended.wait(60.0)
    assert begun == []


def test_a_part_that_fails_ends_the_others():
    running, ended = threading.Event(), threading.Event()

    def failing(progress):
        assert running.wait(60.0)
        raise ValueError("no weights")

    with pytest.raises(ValueError, match="no weights"):
        side_by_side(2)([endless(running, ended), failing], silent)
    assert ended.wait(60.0)
