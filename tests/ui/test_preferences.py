"""Preferences are in force at once and kept between runs."""

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QSettings, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QComboBox

from splap_editor.resources import resource
from splap_editor.ui.dialogs.preferences_dialog import PreferencesDialog
from splap_editor.ui.preferences import GB, MB, Preferences, kept_preferences
from splap_editor.ui.widgets.number_field import NumberField


def opened_page(driver):
    driver.key(Qt.Key.Key_Comma, Qt.KeyboardModifier.ControlModifier)
    return driver.window.findChild(PreferencesDialog)


def test_numbers_reach_what_they_are_about_and_are_kept(driver):
    page, session = opened_page(driver), driver.session
    page.form.findChild(NumberField, "undo_mb").setValue(32)
    page.form.findChild(NumberField, "n_threads").setValue(2)
    page.form.findChild(NumberField, "cache_gb").setValue(0.5)
    assert session.history.max_bytes == 32 * MB
    assert session.n_threads == 2
    assert session.cache.max_bytes == round(0.5 * GB)
    assert kept_preferences() == Preferences(undo_mb=32, n_threads=2, cache_gb=0.5)
    driver.window.program.store.reset()
    assert session.history.max_bytes == 256 * MB and kept_preferences() == Preferences()
    page.close()


def test_the_cache_can_be_cleared(driver):
    page = opened_page(driver)
    assert driver.session.cache.nbytes > 0 and "MB now" in page.cache.text()
    QTest.mouseClick(page.clear, Qt.MouseButton.LeftButton)
    assert driver.session.cache.nbytes == 0
    assert not page.clear.isEnabled() and page.cache.text() == "No prepared scenes are kept."
    page.close()


@pytest.mark.parametrize(("name", "value"), [("undo_mb", "much"), ("navigation", "teleport"), ("n_threads", 0)])
def test_kept_nonsense_is_passed_over(own_settings, name, value):
    QSettings().setValue(f"preferences/{name}", value)
    assert kept_preferences() == Preferences()


def test_up_of_new_scenes_can_be_chosen(driver):
    page = opened_page(driver)
    box = page.form.findChild(QComboBox, "up")
    box.setCurrentIndex(box.findData("y"))
    page.close()
    driver.open(resource("samples", "coil.ply"))
    np.testing.assert_array_equal(driver.window.view.viewport.camera.world_up, [0.0, 1.0, 0.0])
    driver.wait_idle()


def test_a_left_drag_orbits_where_that_is_liked(driver):
    page = opened_page(driver)
    box = page.form.findChild(QComboBox, "navigation")
    box.setCurrentIndex(box.findData("left"))
    page.close()
    driver.key(Qt.Key.Key_Q)
    camera, at = driver.window.view.viewport.camera, driver.surface_pixel()
    before = camera.view
    driver.drag(at, at + QPoint(30, 0), at + QPoint(60, 10))
    assert not np.allclose(camera.view.position, before.position)
    assert not driver.scene.selection.any()
    before = camera.view
    corner = QPoint(5, 5)
    end = QPoint(driver.window.viewport.width() - 6, driver.window.viewport.height() - 6)
    driver.drag(corner, at, end, modifiers=Qt.KeyboardModifier.ShiftModifier)
    np.testing.assert_allclose(camera.view.position, before.position)
    assert driver.scene.selection.any(), "with Shift it selects"
    driver.click(driver.surface_pixel())
    assert driver.scene.selection.sum() == 1, "a click still picks"
