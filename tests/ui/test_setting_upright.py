"""Setting the object upright in the window: gestures, the panel, what is saved and exported."""

import json

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt

from splap_editor.cli import main
from splap_editor.core.place import Place, placed_points
from splap_editor.io.ply import read_ply
from splap_editor.io.recipe import read_recipe
from splap_editor.session.edit_file import write_edit
from tests.ui.conftest import WAIT_MS


def keys(driver, *names):
    for name in names:
        driver.key(name)


def test_the_object_is_moved_by_key_and_number_and_the_panel_shows_where_it_is(driver):
    panel, middle = driver.window.place_panel, driver.scene.ellipses.subject.center
    driver.key(Qt.Key.Key_T)
    assert driver.window.tools.chosen.name == "place"
    driver.move(QPoint(300, 300))
    keys(driver, Qt.Key.Key_G, Qt.Key.Key_X, Qt.Key.Key_2, Qt.Key.Key_Return)
    assert driver.scene.edit.place.translate == pytest.approx((2.0, 0.0, 0.0))
    assert panel.form.translate[0].value() == pytest.approx(middle[0] + 2.0, abs=1e-4)
    panel.form.translate[2].setValue(0.5)
    assert placed_points(middle[None], driver.scene.edit.place)[0, 2] == pytest.approx(0.5)
    panel.form.scales[0].setValue(0.25)
    assert driver.scene.edit.place.scale == pytest.approx(0.25)
    panel.form.rotate[0].setValue(90.0)
    np.testing.assert_allclose(driver.scene.edit.place.rotation[1], [0.0, 0.0, -1.0], atol=1e-9)
    driver.window.actions_["place.recentre"].trigger()
    np.testing.assert_allclose(placed_points(middle[None], driver.scene.edit.place), 0.0, atol=1e-9)
    driver.window.actions_["place.reset"].trigger()
    assert driver.scene.edit.place == Place()
    assert not driver.window.actions_["place.reset"].isEnabled()
    for _ in range(6):
        driver.key(Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert driver.scene.edit.place == Place()


def test_a_gizmo_drag_of_the_whole_object_is_one_step(driver):
    driver.key(Qt.Key.Key_T)
    at = driver.pixel_of(driver.scene.ellipses.subject.center)
    driver.drag(at, at + QPoint(10, 4), at + QPoint(40, 20))
    assert driver.session.history.undo_label == "Move object"
    now = driver.pixel_of(driver.scene.ellipses.subject.center)
    assert abs(now.x() - at.x() - 40) <= 1 and abs(now.y() - at.y() - 20) <= 1


def test_another_up_axis_is_a_step_that_undo_takes_back_with_the_view(driver):
    panel, before = driver.window.place_panel, driver.scene.up
    panel.up.activated.emit(panel.up.findText("Y"))
    assert driver.scene.up == (0.0, 1.0, 0.0)
    np.testing.assert_allclose(driver.scene.edit.place.rotation @ np.array(before), [0.0, 1.0, 0.0], atol=1e-9)
    assert driver.window.actions_["view.up_y"].isChecked()
    driver.key(Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert driver.scene.up == before and driver.scene.edit.place.is_identity
    assert panel.up.currentText() == "Z"


def test_level_and_true_size_by_hand(driver, qtbot):
    driver.key(Qt.Key.Key_T, Qt.KeyboardModifier.ShiftModifier)
    driver.click(driver.surface_pixel())
    qtbot.waitUntil(lambda: driver.scene.preview is not None, timeout=WAIT_MS)
    driver.key(Qt.Key.Key_Return)
    assert driver.session.history.undo_label == "Level object" and driver.scene.preview is None
    driver.key(Qt.Key.Key_M)
    tool, rows = driver.window.tools.chosen, driver.scene.ellipses.rows
    driver.click(driver.surface_pixel())
    assert len(tool.rows) == 1
    tool.put(1, int(rows[np.argmax(driver.scene.ellipses.centers[:, 2])]))
    qtbot.waitUntil(lambda: tool.found is not None, timeout=WAIT_MS)
    keys(driver, Qt.Key.Key_3, Qt.Key.Key_Return)
    assert tool.straight == pytest.approx(3.0) and driver.session.history.undo_label == "Set true size"
    driver.key(Qt.Key.Key_Escape)
    assert not tool.rows


def test_handles_numbers_are_along_the_axes_of_the_placed_object(driver):
    quat = (np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5))
    driver.session.steps.change_place(Place(rotate=quat, scale=2.0), "Turn")
    driver.click(driver.surface_pixel())
    driver.wait_idle()
    form = driver.window.handles_panel.pose_form
    form.translate[0].setValue(0.5)
    driver.wait_idle()
    pose = driver.scene.edit.handles[0].pose
    np.testing.assert_allclose(pose.translate, (0.0, -0.25, 0.0), atol=1e-6)
    assert form.translate[0].value() == pytest.approx(0.5)
    assert form.translate[1].value() == pytest.approx(0.0, abs=1e-6)


def test_window_and_command_line_write_the_same_and_a_session_brings_the_place_back(driver, qtbot, tmp_path):
    quat = tuple((np.array([0.9, 0.1, -0.3, 0.2]) / np.linalg.norm([0.9, 0.1, -0.3, 0.2])).tolist())
    place = Place((0.1, 0.2, 0.3), (1.0, -2.0, 0.5), quat, 1.5)
    driver.session.steps.change_place(place, "Place object")
    source = driver.scene.file.path
    recipe, saved, by_window, by_terminal = (tmp_path / name for name in ("e.json", "e.splap", "w.ply", "t.ply"))
    write_edit(recipe, driver.scene)
    assert read_recipe(recipe).place == place and "place" in json.loads(recipe.read_text())
    driver.session.export(by_window)
    qtbot.waitUntil(lambda: by_window.exists() and not driver.session.is_busy("export"), timeout=WAIT_MS)
    assert main(["deform", str(source), "--recipe", str(recipe), "-o", str(by_terminal), "--quiet"]) == 0
    assert by_window.read_bytes() == by_terminal.read_bytes()
    means = read_ply(by_window).splats.means
    np.testing.assert_allclose(means, placed_points(driver.scene.splats.means, place), atol=1e-5)
    driver.window.document_actions.save_to(saved)
    qtbot.waitUntil(saved.exists, timeout=WAIT_MS)
    view = driver.window.view.viewport.camera.view
    driver.open(saved)
    qtbot.waitUntil(lambda: driver.scene.edit.place == place, timeout=WAIT_MS)
    camera = driver.window.view.viewport.camera
    qtbot.waitUntil(lambda: camera.view.is_near(view), timeout=WAIT_MS)
    assert camera.place == place
    driver.wait_idle()
