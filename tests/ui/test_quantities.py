"""Quantities in the real window: colours, histogram, value under the cursor, columns of an export."""

import numpy as np
import plyfile
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from splap_editor.tools.tool import PointerEvent
from splap_editor.ui.dialogs.export_dialog import ExportDialog

WAIT_MS = 60_000


@pytest.fixture
def size_shown(driver, qtbot) -> None:
    """The tube coloured by size."""
    panel = driver.window.inspection.quantity_panel
    panel.choice.setCurrentIndex(panel.choice.findData("size"))
    qtbot.waitUntil(lambda: driver.window.inspection.quantities.shown is not None, timeout=WAIT_MS)


def painted(driver) -> np.ndarray:
    return driver.window.view.viewport.splats.deformed.tints


def test_choosing_a_quantity_paints_the_splats_and_own_colours_bring_them_back(driver, size_shown):
    inspection = driver.window.inspection
    shown = inspection.quantities.shown
    np.testing.assert_array_equal(painted(driver), shown.tints)
    assert len(np.unique(shown.tints[:, :3], axis=0)) > 20
    assert inspection.legend.title == "Size" and not inspection.legend.isHidden()
    inspection.quantity_panel.choice.setCurrentIndex(0)
    assert painted(driver) is None and inspection.legend.isHidden()


def test_the_value_under_the_cursor_is_in_the_status_line(driver, size_shown, qtbot):
    inspection = driver.window.inspection
    at = driver.surface_pixel()

    def hovers_until(has_text: bool, at: QPoint) -> None:
        # Straight to the tools: a button that an earlier test's window was closed with counts as held in Qt's events.
        ratio = driver.window.viewport.devicePixelRatioF()
        driver.window.tools.pointer(PointerEvent("move", (at.x() * ratio, at.y() * ratio)))
        qtbot.waitUntil(lambda: bool(inspection.read_out.text()) is has_text, timeout=WAIT_MS)

    hovers_until(True, at)
    row = inspection.probe.row
    expected = inspection.quantities.shown.values[row]
    assert inspection.read_out.text() == f"Size: {expected:.4g} · row {row:,}"
    hovers_until(False, QPoint(2, 2))


def test_a_drag_over_the_histogram_selects_by_value_as_one_undoable_step(driver, size_shown):
    session, scene = driver.session, driver.scene
    panel = driver.window.inspection.quantity_panel
    histogram = panel.histogram
    start, end = QPoint(histogram.width() // 4, 20), QPoint(histogram.width() // 2, 30)
    QTest.mousePress(histogram, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, start)
    QTest.mouseMove(histogram, (start + end) / 2)
    QTest.mouseMove(histogram, end)
    assert scene.selection.any() and session.history.undo_label == "", "the selection follows the drag"
    QTest.mouseRelease(histogram, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, end)
    values = driver.window.inspection.quantities.shown.values
    low, high = histogram.value_at(start.x()), histogram.value_at(end.x())
    np.testing.assert_array_equal(scene.selection, (values >= low) & (values <= high))
    assert session.history.undo_label == "Select by value"
    session.history.undo()
    assert not scene.selection.any()


def test_the_handles_below_move_the_ends_of_the_colours(driver, size_shown, qtbot):
    quantities = driver.window.inspection.quantities
    histogram = driver.window.inspection.quantity_panel.histogram
    before = quantities.shown
    x, y = round(histogram.x_of(before.high)), histogram.height() - 6
    QTest.mousePress(histogram, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, QPoint(x, y))
    QTest.mouseMove(histogram, QPoint(x - 20, y))
    QTest.mouseRelease(histogram, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, QPoint(x - 20, y))
    qtbot.waitUntil(lambda: quantities.shown.high < before.high, timeout=WAIT_MS)
    assert quantities.shown.low == before.low
    QTest.mouseDClick(histogram, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, QPoint(x, y))
    qtbot.waitUntil(lambda: quantities.shown.high == before.high, timeout=WAIT_MS)


def test_displacement_follows_the_pose(driver, qtbot):
    quantities = driver.window.inspection.quantities
    quantities.set(name="displacement")
    qtbot.waitUntil(lambda: quantities.shown is not None, timeout=WAIT_MS)
    assert not quantities.shown.values.any()
    driver.click(driver.surface_pixel())
    for key in (Qt.Key.Key_G, Qt.Key.Key_X, Qt.Key.Key_Period, Qt.Key.Key_2, Qt.Key.Key_Return):
        driver.key(key)
    driver.wait_idle()
    means = np.asarray(driver.scene.splats.means, np.float64)
    expected = np.linalg.norm(driver.scene.kernels.means - means, axis=1)
    qtbot.waitUntil(lambda: np.allclose(quantities.shown.values, expected), timeout=WAIT_MS)
    assert expected.max() > 0.15


def test_what_a_quantity_waits_for_is_said(driver):
    panel = driver.window.inspection.quantity_panel
    panel.choice.setCurrentIndex(panel.choice.findData("weight"))
    assert "bounded biharmonic" in panel.lack.text() and not panel.lack.isHidden()
    assert panel.histogram.isHidden()


def test_ticked_quantities_are_in_the_exported_file(driver, qtbot, tmp_path):
    driver.key(Qt.Key.Key_E, Qt.KeyboardModifier.ControlModifier)
    dialog = next(widget for widget in QApplication.topLevelWidgets() if isinstance(widget, ExportDialog))
    target = tmp_path / "with_columns.ply"
    dialog.path_field.setText(str(target))
    dialog.columns.tick("degree", "size")
    dialog.accept_button.click()
    qtbot.waitUntil(target.exists, timeout=WAIT_MS)
    vertex = plyfile.PlyData.read(target)["vertex"].data
    graph, rows = driver.scene.surface.graph, driver.scene.ellipses.rows
    np.testing.assert_array_equal(vertex["degree"][rows], graph.degrees)
    np.testing.assert_allclose(vertex["size"][rows], driver.scene.ellipses.reaches, rtol=1e-6)
