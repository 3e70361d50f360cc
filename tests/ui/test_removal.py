"""Deleting splats by key in the window."""

import numpy as np
from PySide6.QtCore import Qt


def selected(driver, n=300):
    mask = np.zeros(driver.scene.splats.n_splats, bool)
    mask[:n] = True
    driver.session.steps.change_mask("selection", mask, "Select")
    return mask


def shown(driver):
    return np.isfinite(driver.window.view.viewport.screen_points()[:, 0])


def test_delete_removes_the_selected_splats_and_says_so(driver, qtbot):
    window, mask = driver.window, selected(driver)
    before = shown(driver)
    driver.key(Qt.Key.Key_Delete)
    assert "300" in window.toast.text
    assert not shown(driver)[mask].any()
    driver.wait_idle()
    driver.key(Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    np.testing.assert_array_equal(shown(driver), before)
    np.testing.assert_array_equal(driver.scene.selection, mask)
    driver.wait_idle()


def test_delete_takes_chosen_handles_before_splats(driver, qtbot):
    mask = selected(driver)
    driver.window.actions_["handle.from_selection"].trigger()
    driver.wait_idle()
    driver.key(Qt.Key.Key_Delete)
    assert not driver.scene.edit.handles
    assert driver.scene.edit.removed is None
    driver.wait_idle()
    assert mask.any()


def test_keep_only_selected_and_restore_all(driver, qtbot):
    actions, mask = driver.window.actions_, selected(driver, 1000)
    assert not actions["remove.restore_all"].isEnabled()
    actions["remove.others"].trigger()
    np.testing.assert_array_equal(driver.scene.removed, ~mask)
    driver.wait_idle()
    actions["remove.show"].trigger()
    actions["select.invert"].trigger()
    assert actions["remove.restore_selected"].isEnabled()
    actions["remove.restore_selected"].trigger()
    assert driver.scene.edit.removed is None
    driver.wait_idle()
    assert not actions["remove.restore_all"].isEnabled()
