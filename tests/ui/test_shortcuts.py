"""No key is claimed twice, and keys reach what they are for wherever the focus is."""

from collections import Counter
from time import sleep

import numpy as np
import pytest
from PySide6.QtCore import QCoreApplication, QPoint, QPointF, Qt
from PySide6.QtGui import QKeySequence, QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractItemView,
    QAbstractSpinBox,
    QApplication,
    QComboBox,
    QLabel,
    QMenu,
    QSlider,
)

from splap_editor.core.reach_options import ReachOptions
from splap_editor.tools.crop_tool import CropNumbers
from splap_editor.ui.actions.action_table import ACTIONS, MENUS
from splap_editor.ui.widgets.tool_options import ToolOptionsBar

ALT = Qt.KeyboardModifier.AltModifier


def test_no_mnemonic_of_the_menu_bar_is_a_shortcut_too(empty_window):
    claimed = Counter(keys.toString() for spec in ACTIONS for keys in empty_window.actions_[spec.action_id].shortcuts())
    claimed.update(QKeySequence.mnemonic(title).toString() for title in MENUS)
    assert all(claimed), "every menu has a mnemonic, every shortcut is one that Qt reads"
    claimed.update(button.shortcut().toString() for button in empty_window.findChildren(QAbstractButton))
    claimed.pop("", None)
    assert [keys for keys, n in claimed.items() if n > 1] == []


def test_no_two_entries_of_a_menu_share_a_mnemonic(empty_window):
    menus = empty_window.findChildren(QMenu)
    assert {menu.title() for menu in menus} >= set(MENUS)
    for menu in menus:
        found = Counter(QKeySequence.mnemonic(action.text()).toString() for action in menu.actions())
        found.pop("", None)
        assert [keys for keys, n in found.items() if n > 1] == [], menu.title()


def test_show_all_and_reset_pose_answer_their_keys(driver):
    scene = driver.scene
    driver.session.steps.change_mask("hidden", np.arange(scene.splats.n_splats) < 50, "Hide")
    driver.key(Qt.Key.Key_H, ALT)
    assert not scene.hidden.any()
    driver.click(driver.surface_pixel())
    driver.wait_idle()
    for key in (Qt.Key.Key_G, Qt.Key.Key_X, Qt.Key.Key_1, Qt.Key.Key_Return):
        driver.key(key)
    assert not scene.edit.is_identity
    driver.key(Qt.Key.Key_G, ALT)
    assert scene.edit.is_identity
    driver.wait_idle()


def focused(driver, widget):
    driver.window.activateWindow()
    driver.qtbot.waitUntil(driver.window.isActiveWindow)
    widget.setFocus()
    assert widget.hasFocus()
    return widget


def test_the_keyboard_starts_with_the_picture(empty_window, qtbot):
    empty_window.activateWindow()
    qtbot.waitUntil(empty_window.isActiveWindow)
    assert QApplication.focusWidget() is empty_window.viewport


def test_the_tools_are_told_every_position_of_the_pointer(empty_window):
    # Qt would leave out all but the last of those that come during a frame.
    assert not QCoreApplication.testAttribute(Qt.ApplicationAttribute.AA_CompressHighFrequencyEvents)


@pytest.mark.parametrize("key", [Qt.Key.Key_Return, Qt.Key.Key_Escape])
def test_return_and_escape_give_the_keyboard_back(driver, key):
    field = focused(driver, driver.window.deformer_panel.free_radius)
    QTest.keyClick(field, key)
    assert driver.window.viewport.hasFocus()


def test_return_in_a_number_of_a_tool_takes_the_number_and_not_what_the_tool_does(driver):
    window, scene = driver.window, driver.scene
    window.tools.choose("crop")
    held = window.tools.context.held(CropNumbers)
    bar = window.findChild(ToolOptionsBar)
    field = focused(driver, bar.forms[CropNumbers].editors["width"])
    field.selectAll()
    QTest.keyClicks(field, "0.25")
    QTest.keyClick(field, Qt.Key.Key_Return)
    assert held.value.width == 0.25 and scene.edit.removed is None
    assert window.viewport.hasFocus() and window.tools.chosen.shape is not None
    QTest.keyClick(window.viewport, Qt.Key.Key_Return)
    assert scene.edit.removed.any()
    driver.session.history.undo()
    driver.wait_idle()


def test_escape_drops_what_was_typed(driver):
    field = focused(driver, driver.window.deformer_panel.free_radius)
    before = driver.scene.edit
    field.selectAll()
    QTest.keyClicks(field, "0.7")
    QTest.keyClick(field, Qt.Key.Key_Escape)
    assert driver.scene.edit is before


def test_single_keys_work_with_the_focus_on_a_switch_or_a_choice(driver):
    display = driver.window.display
    panel = driver.window.deformer_panel
    for widget in (panel.whole, panel.method):
        if widget is panel.whole:
            # As a hand does it: Qt may give a switch the focus by the click, or not.
            driver.window.activateWindow()
            driver.qtbot.waitUntil(driver.window.isActiveWindow)
            QTest.mouseClick(widget, Qt.MouseButton.LeftButton, pos=QPoint(8, widget.height() // 2))
            assert driver.scene.edit.options[ReachOptions].free_radius is None
            widget = QApplication.focusWidget()
        else:
            focused(driver, widget)
        index = panel.method.currentIndex()
        QTest.keyPress(widget, Qt.Key.Key_O)
        assert display.options.shown == "original"
        QTest.keyRelease(widget, Qt.Key.Key_O)
        assert display.options.shown == "deformed"
        QTest.keyClick(widget, Qt.Key.Key_3)
        assert display.options.mode == "points"
        display.set(mode="splats")
        QTest.keyClick(widget, Qt.Key.Key_Q)
        assert driver.window.tools.chosen.name == "rectangle"
        driver.window.tools.choose("handle")
        assert panel.method.currentIndex() == index


def wheel_taker(widget):
    """Turn the wheel a notch down over a widget, and say who takes it: the event goes up as Qt passes it on."""
    while widget is not None:
        at, turn, none = QPointF(widget.rect().center()), QPoint(0, -120), QPoint()
        held = (Qt.MouseButton.NoButton, Qt.KeyboardModifier.NoModifier, Qt.ScrollPhase.NoScrollPhase)
        event = QWheelEvent(at, QPointF(widget.mapToGlobal(at.toPoint())), none, turn, *held, False)
        # What is switched off leaves the event to its parent, without saying so.
        if QApplication.sendEvent(widget, event) and event.isAccepted():
            return widget
        widget = widget.parentWidget()
    return None


def values(controls):
    return [each.currentIndex() if isinstance(each, QComboBox) else each.value() for each in controls]


@pytest.mark.parametrize("frame_s", [0.0, 0.3])
def test_the_wheel_over_the_panels_changes_nothing_but_the_scroll(driver, frame_s):
    window, scene = driver.window, driver.scene
    window.viewport.frame_drawn.connect(lambda _: sleep(frame_s))
    scroll = window.dock.widget()
    window.viewport.setFocus()
    page, bar = scroll.widget(), scroll.verticalScrollBar()
    controls = [each for kind in (QComboBox, QAbstractSpinBox, QSlider) for each in page.findChildren(kind)]
    edit, options, before = scene.edit, window.display.options, values(controls)
    assert len(controls) > 20 and bar.maximum() > 0
    for widget in [*page.findChildren(QAbstractButton), *page.findChildren(QLabel), *controls]:
        bar.setValue(0)
        taker = wheel_taker(widget)
        assert values(controls) == before, widget.objectName() or widget.toolTip()
        # A list scrolls its own lines.
        if not isinstance(widget.parentWidget(), QAbstractItemView):
            assert taker is scroll.viewport() and bar.value() > 0, widget.objectName() or widget.toolTip()
    assert scene.edit is edit and window.display.options == options
    assert all(each.focusPolicy() is not Qt.FocusPolicy.WheelFocus for each in controls), "the wheel takes no focus"


def test_the_wheel_turns_a_choice_that_has_the_focus(driver):
    method = focused(driver, driver.window.deformer_panel.method)
    assert wheel_taker(method) is method
    assert method.currentIndex() == 1
    driver.wait_idle()


def test_home_after_undo_frames_what_undo_brings_back(driver):
    driver.click(driver.surface_pixel())
    driver.wait_idle()
    for key in (Qt.Key.Key_G, Qt.Key.Key_X, Qt.Key.Key_5, Qt.Key.Key_Return):
        driver.key(key)
    driver.wait_idle()
    driver.key(Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    driver.key(Qt.Key.Key_Home)
    driver.wait_idle()
    viewport = driver.window.view.viewport
    driver.qtbot.waitUntil(lambda: not viewport.is_moving)
    assert viewport.camera.view.is_near(viewport.frame())
