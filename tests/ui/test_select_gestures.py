"""Selecting in the window, by each shape, with the modifiers, and what H and P make of it."""

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt

SHIFT, CTRL = Qt.KeyboardModifier.ShiftModifier, Qt.KeyboardModifier.ControlModifier


def corners(driver, size: int) -> tuple[QPoint, QPoint]:
    """Opposite corners of a square about a pixel of the surface."""
    middle = driver.surface_pixel()
    return middle - QPoint(size, size), middle + QPoint(size, size)


def around(start: QPoint, end: QPoint) -> list[QPoint]:
    """The outline of a rectangle, as a hand draws it."""
    x0, y0, x1, y1 = start.x(), start.y(), end.x(), end.y()
    ends = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    pairs = zip(ends, [*ends[1:], ends[0]], strict=True)
    return [
        QPoint(round(x + (u - x) * t), round(y + (v - y) * t)) for (x, y), (u, v) in pairs for t in np.linspace(0, 1, 8)
    ]


def test_rectangle_and_lasso_of_one_outline_select_the_same(driver):
    start, end = corners(driver, 30)
    driver.window.actions_["select.through"].trigger()
    driver.key(Qt.Key.Key_Q)
    driver.drag(start, QPoint(start.x() + 10, start.y() + 10), end)
    by_rectangle = driver.scene.selection.copy()
    assert 0 < by_rectangle.sum() < len(by_rectangle)
    driver.key(Qt.Key.Key_K)
    driver.drag(*around(start, end))
    by_lasso = driver.scene.selection
    # The lasso is filled on the pixel grid, so splats on its very edge may fall either way.
    assert (by_lasso != by_rectangle).sum() <= 0.1 * by_rectangle.sum()


def test_modifiers_add_remove_and_intersect(driver):
    driver.window.actions_["select.through"].trigger()
    driver.key(Qt.Key.Key_Q)
    outer, inner = corners(driver, 40), corners(driver, 15)
    driver.drag(*inner)
    small = driver.scene.selection.copy()
    driver.drag(*outer)
    large = driver.scene.selection.copy()
    assert (large & small).sum() == small.sum() < large.sum()
    driver.drag(*inner, modifiers=CTRL)
    assert (driver.scene.selection == (large & ~small)).all()
    driver.drag(*inner, modifiers=SHIFT)
    assert (driver.scene.selection == large).all()
    driver.drag(*inner, modifiers=SHIFT | CTRL)
    assert (driver.scene.selection == small).all()


def test_visible_only_selects_fewer_than_through(driver):
    driver.key(Qt.Key.Key_Q)
    outline = corners(driver, 30)
    driver.drag(*outline)
    n_visible = driver.scene.selection.sum()
    driver.window.actions_["select.through"].trigger()
    driver.drag(*outline)
    assert 0 < n_visible < driver.scene.selection.sum()


def test_the_brush_paints_one_undoable_step(driver):
    driver.key(Qt.Key.Key_C)
    middle = driver.surface_pixel()
    driver.drag(middle, middle + QPoint(10, 0), middle + QPoint(20, 0))
    assert driver.scene.selection.any()
    driver.key(Qt.Key.Key_Z, CTRL)
    assert not driver.scene.selection.any()
    assert not driver.session.history.can_undo


@pytest.mark.parametrize(("key", "n_handles", "n_pins"), [(Qt.Key.Key_H, 1, 0), (Qt.Key.Key_P, 0, 1)])
def test_a_selection_becomes_a_handle_or_a_pin(driver, key, n_handles, n_pins):
    driver.key(Qt.Key.Key_Q)
    driver.drag(*corners(driver, 20))
    rows = np.flatnonzero(driver.scene.selection)
    driver.key(key)
    edit = driver.scene.edit
    assert (len(edit.handles), len(edit.pins)) == (n_handles, n_pins)
    region = [*(handle.region for handle in edit.handles), *(pin.region for pin in edit.pins)][0]
    np.testing.assert_array_equal(region.rows, rows)
    driver.wait_idle()


def test_everything_else_is_pinned_in_one_action(driver):
    driver.key(Qt.Key.Key_Q)
    driver.drag(*corners(driver, 20))
    others = np.flatnonzero(~driver.scene.selection)
    driver.key(Qt.Key.Key_P, Qt.KeyboardModifier.ShiftModifier)
    (pin,) = driver.scene.edit.pins
    np.testing.assert_array_equal(pin.region.rows, others)
    driver.session.history.undo()
    assert not driver.scene.edit.pins
    driver.wait_idle()


def test_escape_during_a_lasso_keeps_the_selection(driver):
    driver.key(Qt.Key.Key_K)
    outline = around(*corners(driver, 30))
    driver.press(outline[0])
    for point in outline[1:12]:
        driver.move(point)
    driver.key(Qt.Key.Key_Escape)
    driver.release(outline[12])
    assert not driver.scene.selection.any()
    assert driver.window.overlay._hud.outline == ()
