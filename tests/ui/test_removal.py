"""Deleting splats by key in the window."""

import numpy as np
from PySide6.QtCore import Qt

from splap_editor.cli import main
from splap_editor.core.removal import PickedBox, PickedFloaters, RemovalStep
from splap_editor.engine.removal import removal_of
from splap_editor.session.edit_file import write_edit
from tests.ui.conftest import WAIT_MS


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


def test_window_recipe_and_clean_write_the_same(driver, qtbot, tmp_path):
    """Crop to a box, then take the floaters of what is left."""
    source, splats = driver.scene.file.path, driver.scene.splats
    low, high = np.quantile(np.asarray(splats.means, np.float64), [0.1, 1.0], axis=0)
    box = PickedBox(tuple((0.5 * (low + high)).tolist()), tuple((high - low).tolist()))
    removal = removal_of((RemovalStep(box, outside=True), RemovalStep(PickedFloaters(0.9))), splats)
    driver.session.steps.change_removal(removal, "Clean")
    recipe, by_window, by_recipe, by_clean = (tmp_path / name for name in ("e.json", "w.ply", "r.ply", "c.ply"))
    write_edit(recipe, driver.scene)
    driver.session.export(by_window)
    qtbot.waitUntil(lambda: by_window.exists() and not driver.session.is_busy("export"), timeout=WAIT_MS)
    assert main(["deform", str(source), "--recipe", str(recipe), "-o", str(by_recipe), "--quiet"]) == 0
    crop = [str(value) for value in (*low, *high)]
    assert main(["clean", str(source), "-o", str(by_clean), "--crop", *crop, "--strength", "0.9", "--quiet"]) == 0
    assert by_window.read_bytes() == by_recipe.read_bytes() == by_clean.read_bytes()
    assert 0 < removal.n_removed < splats.n_splats
    driver.wait_idle()
