"""Actions found by some letters of their name."""

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest

from splap_editor.ui.actions.action_table import ACTIONS
from splap_editor.ui.dialogs.action_palette import ENABLED, KEYS, ActionPalette, ranked, recent_actions
from splap_editor.ui.dialogs.fuzzy import fuzzy_score

CTRL_SHIFT = Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier


@pytest.mark.parametrize(
    ("query", "better", "worse"),
    [
        ("sw", "Show weights", "Lasso two"),
        ("fram", "Frame all", "Far from a mark"),
        ("wei", "Show weights", "When it is"),
        ("ALL", "Frame all", "Handle local"),
    ],
)
def test_letters_that_start_words_or_run_on_count_more(query, better, worse):
    assert fuzzy_score(query, better) > fuzzy_score(query, worse)


def test_letters_must_come_in_order():
    assert fuzzy_score("", "anything") == 0
    assert fuzzy_score("ba", "ab") is None
    assert fuzzy_score("a b", "a big") is not None


def test_recent_actions_come_first_among_equals():
    texts = [("a", "Frame all"), ("b", "Frame all"), ("c", "Undo")]
    assert ranked("", texts, ["c", "b"]) == ["c", "b", "a"]
    assert ranked("frame", texts, ["b"]) == ["b", "a"]
    assert ranked("xyz", texts, []) == []


def palette(driver):
    driver.key(Qt.Key.Key_P, CTRL_SHIFT)
    found = driver.window.findChildren(ActionPalette)
    assert len(found) == 1 and found[0].isVisible()
    return found[0]


def test_typing_and_enter_run_an_action_which_is_recent_from_then_on(driver):
    shown = palette(driver)
    assert len(shown.found) == len(ACTIONS) - 1
    QTest.keyClicks(shown.field, "sel all")
    assert shown.found[0] == "select.all"
    QTest.keyClick(shown.field, Qt.Key.Key_Return)
    assert driver.scene.selection.all()
    assert recent_actions() == ["select.all"]
    driver.qtbot.waitUntil(lambda: not driver.window.findChildren(ActionPalette))
    again = palette(driver)
    assert again.found[0] == "select.all"
    QTest.keyClick(again.field, Qt.Key.Key_Escape)
    driver.qtbot.waitUntil(lambda: not driver.window.findChildren(ActionPalette))


def test_what_cannot_be_done_is_grey_and_does_nothing(driver):
    shown = palette(driver)
    QTest.keyClicks(shown.field, "handle from selection")
    item = shown.list.item(0)
    assert shown.found[0] == "handle.from_selection"
    assert item.data(ENABLED) is False and item.data(KEYS) == "H"
    QTest.keyClick(shown.field, Qt.Key.Key_Return)
    assert shown.isVisible() and driver.scene.edit.handles == ()
    shown.close()


def test_arrow_keys_move_the_mark(driver):
    shown = palette(driver)
    QTest.keyClick(shown.field, Qt.Key.Key_Up)
    assert shown.list.currentRow() == len(shown.found) - 1, "from the first to the last"
    QTest.keyClick(shown.field, Qt.Key.Key_Down)
    QTest.keyClick(shown.field, Qt.Key.Key_Down)
    assert shown.list.currentRow() == 1
    shown.close()
