"""Laws of undo and redo."""

from dataclasses import dataclass

import pytest

from splap_editor.session.history import History


@dataclass
class Add:
    """Adds a number to a list's only entry; a negative one refuses."""

    box: list
    amount: int
    nbytes: int = 10
    label: str = "Add"

    def do(self):
        if self.amount < 0:
            raise ValueError("negative")
        self.box[0] += self.amount

    def undo(self):
        self.box[0] -= self.amount


def test_undo_takes_back_and_redo_repeats():
    box, history = [0], History()
    for amount in (1, 2, 4):
        history.push(Add(box, amount))
    assert box == [7]
    assert history.undo() and history.undo()
    assert box == [1] and history.redo_label == "Add"
    assert history.redo()
    assert box == [3]
    history.push(Add(box, 8))
    assert box == [11] and not history.can_redo


def test_nothing_to_undo_is_no_step():
    history = History()
    assert not history.undo() and not history.redo()
    assert history.undo_label == history.redo_label == ""


def test_a_step_that_raises_leaves_the_history_as_it_was():
    box, history = [0], History()
    history.push(Add(box, 1))
    with pytest.raises(ValueError, match="negative"):
        history.push(Add(box, -1))
    assert box == [1] and not history.can_redo
    history.undo()
    assert box == [0] and not history.can_undo


def test_kept_bytes_stay_under_the_bound_and_the_newest_step_stays():
    box, history = [0], History(max_bytes=35)
    for _ in range(10):
        history.push(Add(box, 1))
        assert history.nbytes <= 35
    while history.undo():
        pass
    assert box == [7]
    history.push(Add(box, 1, nbytes=1000))
    assert history.can_undo


def test_dirty_means_away_from_the_saved_state():
    box, history = [0], History()
    assert not history.is_dirty
    history.push(Add(box, 1))
    assert history.is_dirty
    history.mark_saved()
    assert not history.is_dirty
    history.undo()
    assert history.is_dirty
    history.push(Add(box, 2))
    history.undo()
    assert history.is_dirty, "the saved state was on a branch that is gone"


def test_dirty_survives_forgetting_the_oldest_steps():
    box, history = [0], History(max_bytes=25)
    history.mark_saved()
    for _ in range(5):
        history.push(Add(box, 1))
    while history.undo():
        pass
    assert history.is_dirty


def test_every_change_is_told():
    told, history, box = [], History(), [0]
    history.changed.connect(lambda: told.append(1))
    history.push(Add(box, 1))
    history.undo()
    history.redo()
    history.mark_saved()
    history.clear()
    assert len(told) == 5


def test_a_tighter_bound_forgets_the_oldest_steps_at_once():
    box, history, told = [0], History(), []
    for amount in (1, 2, 4):
        history.push(Add(box, amount))
    history.changed.connect(lambda: told.append(history.nbytes))
    history.set_max_bytes(20)
    assert history.nbytes == 20 and told == [20]
    assert history.undo() and history.undo() and not history.undo()
    assert box == [1]
