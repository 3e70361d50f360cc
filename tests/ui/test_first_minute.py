"""What a new user does in the first minute, with a real mouse and real keys."""

from pathlib import Path

import numpy as np
from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import QApplication

from splap_editor.core.adaptation.options import RepairOptions
from splap_editor.engine.scripting import write_posed
from splap_editor.io.ply import read_ply
from splap_editor.ui.dialogs.export_dialog import ExportDialog
from splap_editor.ui.main_window import HINT
from splap_editor.viewport.gizmo_parts import ARROWS
from tests.reference.ply import ply_bytes, splat_columns


def arrow_pixel(driver, axis: int) -> QPoint:
    """A place on an arrow of the gizmo."""
    viewport = driver.window.view.viewport
    gizmo = viewport.gizmo
    length = 0.7 * gizmo.arm_length(viewport.projection)
    return driver.pixel_of(gizmo.frame[:3, 3] + length * np.eye(3)[axis])


def shown_export(driver) -> ExportDialog:
    """Open the export's dialog by its key."""
    driver.key(Qt.Key.Key_E, Qt.KeyboardModifier.ControlModifier)
    found = [widget for widget in QApplication.topLevelWidgets() if isinstance(widget, ExportDialog)]
    return next(dialog for dialog in found if dialog.isVisible())


def export(dialog: ExportDialog, path: Path) -> None:
    """Type a path and press the button."""
    dialog.path_field.setText(str(path))
    dialog.accept_button.click()


def test_click_drag_undo_and_export_give_a_file_with_what_was_on_screen(driver, qtbot, tmp_path):
    window, scene = driver.window, driver.scene
    assert window.overlay.hint == HINT
    window.tools.choose("crop")
    assert window.overlay.hint == (), "another tool has other first steps"
    window.tools.choose("handle")
    assert window.overlay.hint == HINT

    driver.click(driver.surface_pixel())
    assert [handle.name for handle in scene.edit.handles] == ["Handle 1"]
    assert scene.active_handles == (1,)
    driver.wait_idle()

    start = arrow_pixel(driver, 2)
    assert window.view.viewport.gizmo_part(start.x(), start.y()) == ARROWS[2]
    driver.press(start)
    for step in range(1, 6):
        driver.move(start + QPoint(0, -8 * step))
    qtbot.waitUntil(lambda: scene.kernels is not None, timeout=60_000)
    assert scene.preview is not None, "the history gets one step, on release"
    driver.release(start + QPoint(0, -40))
    driver.wait_idle()
    assert scene.edit.handles[0].pose.translate[2] > 0
    assert driver.session.history.undo_label == "Move handle"
    assert window.isWindowModified()
    assert window.overlay.hint == ()

    moved = scene.kernels.means.copy()
    driver.key(Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    driver.wait_idle()
    assert scene.edit.is_identity
    driver.key(Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier)
    driver.wait_idle()
    np.testing.assert_allclose(scene.kernels.means, moved, atol=1e-9)

    target = tmp_path / "bent.ply"
    export(shown_export(driver), target)
    qtbot.waitUntil(target.exists, timeout=60_000)
    qtbot.waitUntil(lambda: window.toast.text.startswith("Exported"), timeout=60_000)
    # The file holds float32.
    np.testing.assert_allclose(read_ply(target).splats.means, scene.kernels.means, atol=1e-6)
    assert not driver.session.has_unexported_edit
    # An export keeps no handle.
    assert window.isWindowModified()

    # Split where it is drawn out: ticked in the dialog, a step of the history, and the same file as a script makes.
    driver.session.steps.change_edit(scene.edit.with_options(RepairOptions(1.05)), "Repair")
    driver.session.history.undo()
    assert not scene.edit.repair
    driver.session.history.redo()
    dialog = shown_export(driver)
    assert dialog.repair_box.isVisible() and dialog.repair_box.isChecked() and dialog.repair == 1.05
    repaired = tmp_path / "repaired.ply"
    export(dialog, repaired)
    qtbot.waitUntil(lambda: "split into" in window.toast.text, timeout=60_000)
    write_posed(tmp_path / "script.ply", scene.file, scene.kernels, scene.edit)
    assert repaired.read_bytes() == (tmp_path / "script.ply").read_bytes()
    dialog = shown_export(driver)
    dialog.repair_box.click()
    export(dialog, tmp_path / "whole.ply")
    qtbot.waitUntil((tmp_path / "whole.ply").exists, timeout=60_000)
    assert not scene.edit.repair and (tmp_path / "whole.ply").read_bytes() == target.read_bytes()


def test_escape_during_a_drag_leaves_pose_and_history_as_they_were(driver, qtbot):
    scene = driver.scene
    driver.click(driver.surface_pixel())
    driver.wait_idle()
    start = arrow_pixel(driver, 2)
    driver.press(start)
    driver.move(start + QPoint(0, -30))
    driver.key(Qt.Key.Key_Escape)
    driver.release(start + QPoint(0, -30))
    assert scene.preview is None
    assert scene.edit.is_identity
    assert driver.session.history.undo_label == "Place handle"


def test_grab_by_key_takes_an_axis_and_a_typed_number(driver, qtbot):
    driver.click(driver.surface_pixel())
    driver.wait_idle()
    for key in (Qt.Key.Key_G, Qt.Key.Key_X, Qt.Key.Key_Period, Qt.Key.Key_2, Qt.Key.Key_Return):
        driver.key(key)
    driver.wait_idle()
    np.testing.assert_allclose(driver.scene.edit.handles[0].pose.translate, (0.2, 0.0, 0.0), atol=1e-12)
    assert driver.window.display.options.mode != "splats" or driver.window.actions_["display.splats"].isChecked()


def test_two_turns_by_keys_are_shown_as_they_were_entered(driver):
    driver.click(driver.surface_pixel())
    driver.wait_idle()
    key = Qt.Key
    for turn in ((key.Key_R, key.Key_Y, key.Key_1, key.Key_2, key.Key_0), (key.Key_R, key.Key_Z, key.Key_4, key.Key_0)):
        for each in (*turn, key.Key_Return):
            driver.key(each)
        driver.wait_idle()
    shown = [field.value() for field in driver.window.handles_panel.pose_form.rotate]
    np.testing.assert_allclose(shown, (0.0, 120.0, 40.0), atol=1e-9)


def test_that_up_is_a_guess_is_said_once(driver, tmp_path):
    """Of a file of three scales; one of two says by its making that Z is up."""
    window, told = driver.window, []
    assert "which way is up" not in window.toast.text
    path = tmp_path / "capture.ply"
    path.write_bytes(ply_bytes(splat_columns(300, np.random.default_rng(0))))
    for _ in range(2):
        window.toast.hide()
        driver.open(path)
        driver.wait_idle()
        told.append(window.toast.text)
    assert "View ▸ Up" in told[0] and told[1] == ""
    window.actions_["view.up_z"].trigger()
    assert driver.scene.up == (0.0, 0.0, 1.0)


def test_the_sides_of_a_scene_follow_what_is_up(driver):
    actions, camera = driver.window.actions_, driver.window.view.viewport.camera
    for up, up_axis in {"view.up_z": (0, 0, 1), "view.up_y": (0, 1, 0), "view.down_y": (0, -1, 0)}.items():
        actions[up].trigger()
        for side in ("front", "back", "right", "left", "top", "bottom"):
            actions[f"view.{side}"].trigger()
            driver.qtbot.waitUntil(lambda: not driver.window.view_actions.is_flying)
            forward = np.array(camera.view.focal_point) - np.array(camera.view.position)
            along = float(forward @ np.array(up_axis)) / float(np.linalg.norm(forward))
            np.testing.assert_allclose(along, {"top": -1.0, "bottom": 1.0}.get(side, 0.0), atol=1e-3, err_msg=up + side)
            if side not in ("top", "bottom"):
                np.testing.assert_allclose(camera.up, up_axis, atol=1e-3, err_msg=up + side)


def test_left_drag_on_empty_space_orbits(driver):
    before = driver.window.view.viewport.camera.view.position
    driver.drag(QPoint(5, 5), QPoint(40, 20), QPoint(80, 40))
    after = driver.window.view.viewport.camera.view.position
    assert np.linalg.norm(after - before) > 0
    assert not driver.session.history.can_undo


def test_right_click_offers_a_menu_and_the_wheel_zooms(driver, qtbot):
    camera = driver.window.view.viewport.camera
    with qtbot.waitSignal(driver.window.viewport.menu_wanted):
        driver.press(QPoint(30, 30), Qt.MouseButton.RightButton)
    QApplication.activePopupWidget().close()
    distance = camera.view.distance
    driver.wheel(QPoint(30, 30), 1)
    assert camera.view.distance < distance
    driver.wheel(QPoint(30, 30), -2)
    assert camera.view.distance > distance


def test_a_click_on_an_end_of_the_corner_axes_looks_from_there(driver, qtbot):
    viewport = driver.window.view.viewport
    ends = viewport.triad.ends(viewport.projection)
    ratio = driver.window.viewport.devicePixelRatioF()
    driver.click(QPoint(*(int(number) for number in np.rint(ends[2, :2] / ratio))))
    # The flight ends exactly there; the last direction shows it.
    qtbot.waitUntil(lambda: abs(viewport.camera.view.direction[2] + 1.0) < 1e-6, timeout=60_000)
    assert not driver.scene.edit.handles


def test_a_path_can_be_typed_letter_by_letter(driver):
    driver.window.actions_["file.export"].trigger()
    dialog = next(widget for widget in QApplication.topLevelWidgets() if isinstance(widget, ExportDialog))
    for typed in ("/nowhere/out", "~nobody/out", "../..", "./x", "/" + 300 * "n"):
        for k in range(1, len(typed) + 1):
            dialog.path_field.setText(typed[:k])
            assert dialog.accept_button.isEnabled() or dialog.note.text(), typed[:k]
    dialog.path_field.setText("/")
    assert not dialog.accept_button.isEnabled() and dialog.note.text() == "This is a folder."
    dialog.reject()
