"""Floaters in the window: groups in a list, looked at, kept, removed."""

import threading

import numpy as np
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QStyle, QStyleOptionViewItem

from splap_editor.core.removal import PickedFloaters
from splap_editor.session.floater_search import floater_search
from splap_editor.tools.floaters_tool import FloaterOptions
from tests.ui.conftest import WAIT_MS


def taken_up(driver):
    """The panel, groups in it."""
    tool = driver.window.tools.tools["floaters"]
    tool.context.held(FloaterOptions).set(FloaterOptions(0.99))
    driver.key(Qt.Key.Key_F, Qt.KeyboardModifier.ShiftModifier)
    driver.qtbot.waitUntil(lambda: tool.found is not None, timeout=WAIT_MS)
    return driver.window.floaters_panel


def spot(panel, row: int, *, tick: bool = False) -> QPoint:
    """The middle of a row of the list, or of its tick."""
    view = panel.list
    option = QStyleOptionViewItem()
    view.initViewItemOption(option)
    option.rect = view.visualRect(panel.model.index(row))
    option.features |= QStyleOptionViewItem.ViewItemFeature.HasCheckIndicator
    part = QStyle.SubElement.SE_ItemViewItemCheckIndicator
    return view.style().subElementRect(part, option, view).center() if tick else option.rect.center()


def click(panel, row: int, *, tick: bool = False) -> None:
    QTest.mouseClick(panel.list.viewport(), Qt.MouseButton.LeftButton, pos=spot(panel, row, tick=tick))


def test_the_panel_is_there_with_its_tool_and_lists_the_groups(driver):
    panel = taken_up(driver)
    found = driver.window.tools.chosen.found
    assert panel.isVisible() and panel.model.rowCount() == found.n_groups > 1
    text = panel.model.index(0).data()
    assert text.startswith(f"{found.sizes[0]:,} splat") and text.endswith(found.reason(0))
    assert f"{len(found.rows):,} splats float" in panel.status.text()
    driver.key(Qt.Key.Key_W)
    assert not panel.isVisible() and panel.model.rowCount() == 0


def test_the_panel_says_what_it_does_while_it_looks(driver, monkeypatch):
    go_on, panel, tool = threading.Event(), driver.window.floaters_panel, driver.window.tools.tools["floaters"]

    def awaited(splats, removal, ellipses, *, stages, run):
        stages("contributions")(0.25)
        go_on.wait(60.0)
        return floater_search(splats, removal, ellipses)

    monkeypatch.setattr("splap_editor.session.floater_preview.floater_search", awaited)
    driver.key(Qt.Key.Key_F, Qt.KeyboardModifier.ShiftModifier)
    assert panel.status.text() == "Looking for floaters …"
    driver.qtbot.waitUntil(lambda: panel.status.text().endswith("seeing which splats make the picture, 25%"))
    assert not panel.take.isEnabled()
    go_on.set()
    driver.qtbot.waitUntil(lambda: tool.found is not None, timeout=WAIT_MS)
    assert "float" in panel.status.text() and "Looking" not in panel.status.text()


def test_a_row_frames_its_group_and_its_tick_keeps_it(driver):
    panel = taken_up(driver)
    tool, flown = driver.window.tools.chosen, []
    tool.context.fly_to = flown.append
    click(panel, 1)
    assert tool.looked_at == 1 and len(flown) == 1
    click(panel, 0, tick=True)
    assert tool.preview.keeps(0) and tool.looked_at == 1 and len(flown) == 1
    assert panel.model.index(0).data(Qt.ItemDataRole.CheckStateRole) == Qt.CheckState.Unchecked
    kept, goes = tool.found.rows_of(0), tool.preview.goes
    panel.take.click()
    np.testing.assert_array_equal(driver.scene.removed, goes)
    assert not goes[kept].any() and driver.session.history.undo_label == "Remove floaters"
    driver.window.actions_["edit.undo"].trigger()
    assert driver.scene.edit.removed is None


def test_the_slider_is_the_strength_and_the_step_keeps_it(driver):
    panel = taken_up(driver)
    tool = driver.window.tools.chosen
    n = len(tool.found.rows)
    panel.strength.setValue(0)
    driver.qtbot.waitUntil(lambda: tool.found.strength == 0.0, timeout=WAIT_MS)
    assert not tool.found.n_groups and not panel.take.isEnabled() and panel.status.text() == "Nothing floats."
    panel.strength.setValue(99)
    driver.qtbot.waitUntil(lambda: tool.found.strength == 0.99, timeout=WAIT_MS)
    driver.key(Qt.Key.Key_Return)
    assert driver.scene.removed.sum() == n
    assert driver.scene.edit.removal.steps[0].picked == PickedFloaters(0.99)


def test_escape_and_leave_change_nothing(driver):
    panel = taken_up(driver)
    edit, tool = driver.scene.edit, driver.window.tools.chosen
    driver.key(Qt.Key.Key_Escape)
    assert tool.found is None and not panel.take.isEnabled() and "Click the picture" in panel.status.text()
    driver.click(QPoint(5, 5))
    driver.qtbot.waitUntil(lambda: tool.found is not None, timeout=WAIT_MS)
    panel.leave.click()
    assert tool.found is None and driver.scene.edit is edit and not driver.session.history.can_undo
