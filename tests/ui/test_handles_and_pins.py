"""Handles and pins in the list: several chosen, named, resized and deleted one by one."""

from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtCore import QCoreApplication, QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from splap_editor.core.handle_nodes import Region
from splap_editor.core.pose import Pose
from splap_editor.engine.edit import PIN_COLOR
from splap_editor.session.pivot import Pivot
from splap_editor.session.placement import disc_rows, rows_region

SHIFT = Qt.KeyboardModifier.ShiftModifier


def pinned(driver):
    """A pin on the disc in the middle of the picture."""
    driver.key(Qt.Key.Key_E)
    driver.click(driver.surface_pixel())
    driver.wait_idle()
    return driver.scene.edit.pins[-1]


def at_ends(driver):
    """Handles at both ends of the tube."""
    centers = driver.scene.ellipses.centers
    for node in (np.argmin(centers[:, 0]), np.argmax(centers[:, 0])):
        driver.session.steps.add_handle(Region(centers[node], 0.1))
    driver.wait_idle()
    return driver.scene.edit.handles


def test_a_pin_is_listed_named_chosen_and_deleted(driver):
    panel = driver.window.handles_panel
    first, second = pinned(driver), driver.session.steps.add_pin(Region(driver.scene.ellipses.centers[0], 0.1))
    assert list(panel.pin_rows) == [first.pin_id, second.pin_id]
    row = panel.pin_rows[first.pin_id]
    assert row.held.text() == f"{len(first.region.rows):,}"
    QTest.mouseClick(row, Qt.MouseButton.LeftButton, pos=QPoint(2, 2))
    assert driver.scene.active_pins == (first.pin_id,)
    row.name.setText("Foot")
    row.name.editingFinished.emit()
    assert driver.scene.edit.pin(first.pin_id).name == "Foot"
    driver.key(Qt.Key.Key_Delete)
    assert [pin.pin_id for pin in driver.scene.edit.pins] == [second.pin_id]
    panel.pin_rows[second.pin_id].delete.click()
    assert not driver.scene.edit.pins and not panel.pin_rows
    for _ in range(2):
        driver.session.history.undo()
    assert [pin.name for pin in driver.scene.edit.pins] == ["Foot", "Pin 2"]
    driver.wait_idle()


def test_a_click_on_a_name_leaves_the_keys_with_the_picture_and_a_double_click_edits_it(driver):
    panel, (first, _) = driver.window.handles_panel, at_ends(driver)
    name, window = panel.handle_rows[first.handle_id].name, driver.window
    driver.move(driver.surface_pixel())
    driver.key(Qt.Key.Key_E)
    QTest.mouseClick(name, Qt.MouseButton.LeftButton)
    assert driver.scene.active_handles == (first.handle_id,)
    QTest.keyClick(QApplication.focusWidget(), Qt.Key.Key_W)
    assert name.text() == first.name and window.tools.chosen.name == "handle"
    for end, kept in ((Qt.Key.Key_Escape, first.name), (Qt.Key.Key_Return, "W")):
        QTest.mouseDClick(name, Qt.MouseButton.LeftButton)
        QTest.keyClicks(name, "W")
        assert window.tools.chosen.name == "handle" and name.text() == "W"
        QTest.keyClick(name, end)
        assert driver.scene.edit.handle(first.handle_id).name == kept == name.text()
        assert window.viewport.hasFocus() and name.isReadOnly()


def test_the_reach_of_a_pin_is_a_number(driver):
    panel, pin = driver.window.handles_panel, pinned(driver)
    assert not panel.pin_reach.isEnabled()
    driver.scene.set_active_handles((), (pin.pin_id,))
    assert panel.pin_reach.isEnabled()
    panel.pin_reach.setValue(2.0 * pin.reach)
    larger = driver.scene.edit.pin(pin.pin_id)
    assert set(pin.region.rows) < set(larger.region.rows)
    panel.pin_reach.setValue(pin.reach / 2.0)
    assert set(driver.scene.edit.pin(pin.pin_id).region.rows) < set(pin.region.rows)
    for _ in range(2):
        driver.session.history.undo()
    assert driver.scene.edit.pin(pin.pin_id) is pin


def test_a_pin_goes_along_with_its_mark(driver):
    pin = pinned(driver)
    driver.key(Qt.Key.Key_W)
    start = driver.pixel_of(pin.region.center)
    viewport = driver.window.view.viewport
    ratio = driver.window.viewport.devicePixelRatioF()
    ways = [QPoint(dx, dy) for dx in (-60, -40, 40, 60) for dy in (-20, 0, 20)]
    end = next(start + way for way in ways if viewport.pick((start + way).x() * ratio, (start + way).y() * ratio))
    row = viewport.pick(end.x() * ratio, end.y() * ratio).row
    driver.drag(start, start + (end - start) / 2, end)
    moved = driver.scene.edit.pin(pin.pin_id)
    np.testing.assert_array_equal(moved.region.rows, disc_rows(driver.scene, row, pin.reach))
    assert driver.scene.active_pins == (pin.pin_id,) and not driver.scene.edit.handles
    driver.session.history.undo()
    assert driver.scene.edit.pin(pin.pin_id) is pin
    driver.wait_idle()


def test_a_pin_is_seen_before_there_is_a_handle(driver):
    view = driver.window.view
    pin = pinned(driver)
    color = [int(PIN_COLOR[i : i + 2], 16) for i in (1, 3, 5)]
    tints = view.viewport.splats.deformed.tints
    seen = scene_rows(driver, pin)
    assert (tints[seen, :3] == color).all() and np.count_nonzero(tints[:, 3]) == len(seen)
    view.shows_tints = False
    assert view.viewport.splats.deformed.tints is None


def scene_rows(driver, pin):
    nodes = driver.scene.ellipses.node_of_row[pin.region.rows]
    return driver.scene.ellipses.rows[nodes[nodes >= 0]]


def test_shift_clicks_in_the_list_choose_several(driver):
    panel, (first, second) = driver.window.handles_panel, at_ends(driver)
    QTest.mouseClick(panel.handle_rows[first.handle_id].name, Qt.MouseButton.LeftButton)
    assert driver.scene.active_handles == (first.handle_id,)
    QTest.mouseClick(panel.handle_rows[second.handle_id].name, Qt.MouseButton.LeftButton, SHIFT)
    assert driver.scene.active_handles == (first.handle_id, second.handle_id)
    assert panel.handle_rows[second.handle_id].property("chosen") == "last"
    QTest.mouseClick(panel.handle_rows[first.handle_id], Qt.MouseButton.LeftButton, SHIFT, QPoint(2, 2))
    assert driver.scene.active_handles == (second.handle_id,)
    driver.session.halt()


@pytest.mark.parametrize("pivot", list(Pivot))
def test_several_handles_turn_about_the_pivot(driver, pivot):
    first, second = at_ends(driver)
    scene, panel = driver.scene, driver.window.handles_panel
    scene.set_active_handles((second.handle_id, first.handle_id))
    at = {
        Pivot.MEDIAN: (first.moved_center + second.moved_center) / 2.0,
        Pivot.ACTIVE: first.moved_center,
        Pivot.POINT: np.array((0.1, 0.2, 0.3)),
    }[pivot]
    if pivot is Pivot.POINT:
        scene.set_pivot(pivot, at)
    else:
        driver.window.actions_[f"handle.pivot_{pivot.value}"].trigger()
    assert panel.pivot.currentData() is pivot and driver.window.actions_[f"handle.pivot_{pivot.value}"].isChecked()
    np.testing.assert_allclose(driver.window.view.viewport.gizmo.frame[:3, 3], at)
    before = {handle.handle_id: handle.moved_center for handle in (first, second)}
    for key in (Qt.Key.Key_R, Qt.Key.Key_Z, Qt.Key.Key_9, Qt.Key.Key_0, Qt.Key.Key_Return):
        driver.key(key)
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    for handle in scene.edit.handles:
        np.testing.assert_allclose(handle.moved_center, at + turn @ (before[handle.handle_id] - at), atol=1e-9)
    driver.session.history.undo()
    assert all(handle.pose == Pose() for handle in scene.edit.handles), "one step for both"
    driver.session.halt()


def test_shift_and_the_right_button_place_the_pivot(driver):
    at = driver.surface_pixel()
    driver.move(at)
    QTest.mouseClick(driver.window.viewport, Qt.MouseButton.RightButton, SHIFT, at)
    ratio = driver.window.viewport.devicePixelRatioF()
    hit = driver.window.view.viewport.pick(at.x() * ratio, at.y() * ratio)
    assert driver.scene.pivot is Pivot.POINT
    np.testing.assert_allclose(driver.scene.pivot_at, hit.point)
    driver.key(Qt.Key.Key_Period)
    assert driver.scene.pivot is Pivot.MEDIAN


@pytest.mark.parametrize("method", ["arap", "bbw"])
def test_nothing_below_the_list_jumps_when_handles_and_pins_appear(driver, method):
    window = driver.window
    driver.session.steps.change_edit(replace(driver.scene.edit, method=method), "Change method")
    driver.wait_idle()
    below = [window.handles_panel.pose_form, window.deformer_panel.method, window.display_panel]

    def places():
        # A text, the room it needs and where that is found come in turn.
        for _ in range(5):
            QCoreApplication.processEvents()
        return [part.mapTo(window.dock, QPoint(0, 0)).y() for part in below]

    before = places()
    driver.session.steps.add_handle(Region(driver.scene.ellipses.centers[0], 0.1))
    assert places() == before
    driver.session.steps.add_pin(rows_region(driver.scene, np.arange(50)))
    assert places() == before
    driver.wait_idle()
    assert places() == before
    driver.session.steps.change_edit(driver.scene.edit.without_handles((1,)), "Delete handle")
    driver.wait_idle()
    assert places() == before
