"""Selecting in the window, by each shape, with the modifiers, and what H and P make of it."""

from time import sleep

import numpy as np
import pytest
from PySide6.QtCore import QCoreApplication, QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QMouseEvent

from splap_editor.core.reach_options import ReachOptions

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


def test_a_lasso_drawn_while_frames_are_slow_loses_no_corner(driver):
    driver.window.actions_["select.through"].trigger()
    driver.key(Qt.Key.Key_K)
    middle, turns = driver.surface_pixel(), np.linspace(0.0, 2.0 * np.pi, 13)
    # A star: each corner left out takes a ray away.
    star = [
        middle + QPoint(round(r * np.cos(t)), round(r * np.sin(t)))
        for t, r in zip(turns, [45, 12] * 6 + [45], strict=True)
    ]
    driver.drag(*star)
    at_once = driver.scene.selection.copy()
    assert 0 < at_once.sum() < len(at_once)
    driver.key(Qt.Key.Key_Z, CTRL)
    viewport, hud = driver.window.viewport, driver.window.tools.context.hud
    viewport.frame_drawn.connect(lambda _: sleep(0.3))
    driver.press(star[0])
    driver.wait_frame()
    for point in star[1:]:
        # All of them wait for the frame to be done, as those of a quick hand do.
        viewport.update()
        where = QPointF(point), QPointF(viewport.mapToGlobal(point))
        held = Qt.MouseButton.NoButton, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier
        QCoreApplication.postEvent(viewport, QMouseEvent(QEvent.Type.MouseMove, *where, *held))
    driver.wait_frame()
    ratio = viewport.devicePixelRatioF()
    assert list(hud.outline) == [(point.x() * ratio, point.y() * ratio) for point in star]
    driver.release(star[-1])
    np.testing.assert_array_equal(driver.scene.selection, at_once)


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


@pytest.mark.parametrize("key", [Qt.Key.Key_H, Qt.Key.Key_P])
def test_a_selection_that_has_moved_is_held_where_it_is(driver, key):
    driver.session.steps.change_edit(driver.scene.edit.with_options(ReachOptions(None)), "Free everything")
    driver.click(driver.surface_pixel())
    driver.wait_idle()
    for pressed in (Qt.Key.Key_G, Qt.Key.Key_X, Qt.Key.Key_Period, Qt.Key.Key_5, Qt.Key.Key_Return):
        driver.key(pressed)
    driver.wait_idle()
    before = driver.scene.kernels.means.copy()
    moved = np.linalg.norm(before - driver.scene.splats.means, axis=1)
    driver.session.steps.change_mask("selection", moved > np.quantile(moved, 0.95), "Select")
    driver.key(key)
    driver.wait_idle()
    assert not driver.scene.edit.pins and len(driver.scene.edit.handles) == 2
    assert driver.scene.edit.handles[-1].frees == (key == Qt.Key.Key_H)
    # As a rigid body, which what has bent a little is not.
    shift = np.linalg.norm(driver.scene.kernels.means - before, axis=1)
    assert shift.max() < 0.1 * moved.max()


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
    assert driver.window.tools.context.hud.outline == ()
