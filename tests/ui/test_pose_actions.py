"""Poses copied and mirrored, selections kept, in the window."""

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication, QInputDialog

from splap_editor.core.handle_nodes import Region
from splap_editor.engine.edit import Pose

from .conftest import WAIT_MS

CONTROL = Qt.KeyboardModifier.ControlModifier
BENT = Pose((0.05, 0.0, 0.1), (0.8, 0.6, 0.0, 0.0))


def end_handle(driver, axis=0, sign=1.0):
    """A handle at an end of the tube; the longest way is along X."""
    centers = driver.scene.ellipses.centers
    handle = driver.session.steps.add_handle(Region(centers[np.argmax(sign * centers[:, axis])], 0.1))
    driver.wait_idle()
    return handle


def pose(driver, handle, to):
    driver.session.drag.preview({handle.handle_id: to})
    driver.session.drag.commit("Move handle")
    driver.wait_idle()


def test_a_pose_is_copied_and_pasted_by_key(driver):
    first = end_handle(driver)
    pose(driver, first, BENT)
    driver.key(Qt.Key.Key_C, CONTROL)
    assert driver.window.toast.text == "Copied the pose."
    second = end_handle(driver, sign=-1.0)
    driver.key(Qt.Key.Key_V, CONTROL)
    assert driver.scene.edit.handle(second.handle_id).pose == BENT
    assert driver.session.history.undo_label == "Paste pose"
    driver.wait_idle()


def test_mirroring_makes_the_handle_opposite_and_undo_takes_it_back(driver):
    handle = end_handle(driver)
    pose(driver, handle, BENT)
    driver.window.actions_["pose.mirror_x"].trigger()
    (made,) = driver.scene.active_handles
    assert made != handle.handle_id
    assert driver.scene.edit.handle(made).pose.translate == (-0.05, 0.0, 0.1)
    driver.wait_idle()
    driver.key(Qt.Key.Key_Z, CONTROL)
    assert len(driver.scene.edit.handles) == 1
    driver.wait_idle()


def test_the_symmetry_of_the_object_is_looked_for_once(driver, qtbot):
    handle = end_handle(driver)
    pose(driver, handle, BENT)
    driver.key(Qt.Key.Key_M, CONTROL)
    qtbot.waitUntil(lambda: driver.session.history.undo_label == "Mirror handle", timeout=WAIT_MS)
    driver.wait_idle()
    driver.window.actions_["edit.undo"].trigger()
    driver.scene.set_active_handles((handle.handle_id,))
    driver.key(Qt.Key.Key_M, CONTROL)
    assert driver.session.history.undo_label == "Mirror handle", "this time at once"
    driver.wait_idle()


def test_a_selection_is_kept_by_name_and_selected_again(driver):
    mask = np.zeros(driver.scene.splats.n_splats, bool)
    mask[10:40] = True
    driver.session.steps.change_mask("selection", mask, "Select")
    menu = driver.window.selection_sets
    assert not menu.isEnabled()
    driver.window.actions_["sets.keep"].trigger()
    dialog = next(w for w in QApplication.topLevelWidgets() if isinstance(w, QInputDialog) and w.isVisible())
    dialog.setTextValue("arm")
    dialog.accept()
    driver.window.actions_["select.none"].trigger()
    menu.actions()[0].trigger()
    np.testing.assert_array_equal(driver.scene.selection, mask)
    menu.forget("arm")
    assert not menu.isEnabled() and driver.scene.selection_sets == {}
    driver.window.actions_["edit.undo"].trigger()
    assert menu.isEnabled() and list(driver.scene.selection_sets) == ["arm"]
