"""Keys on the strip under the picture, with a real mouse and real keys."""

import threading

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QImage
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from splap_editor.core.handle_nodes import Region
from splap_editor.engine.edit import Pose
from splap_editor.io.ply import read_ply
from splap_editor.ui.dialogs.frames_dialog import FramesDialog
from splap_editor.ui.timeline.frame_export import FrameOrder
from splap_editor.ui.timeline.strip import TimelineStrip

from .conftest import WAIT_MS

CONTROL, SHIFT = Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.ShiftModifier
LIFTED = Pose((0.0, 0.0, 0.2))


def strip_of(driver) -> TimelineStrip:
    """The strip with a handle at rest in frame 1, nothing else set."""
    driver.session.steps.add_handle(Region(driver.scene.ellipses.centers[0], 0.1))
    driver.wait_idle()
    return driver.window.findChild(TimelineStrip)


def keyed_strip(driver) -> TimelineStrip:
    """Ten frames; at rest in the first, lifted in the last, the line at the last."""
    strip = strip_of(driver)
    commands = driver.window.timeline_actions
    commands.set_key()
    commands.change("Change length", n_frames=10)
    commands.go_to(10)
    pose(driver, LIFTED)
    return strip


def pose(driver, to):
    driver.session.drag.preview({driver.scene.edit.handles[0].handle_id: to})
    driver.session.drag.commit("Move handle")
    driver.wait_idle()


def place(strip, frame, *, key=True) -> QPoint:
    """A pixel of the ruler: on the diamond of a frame, or above it."""
    return QPoint(round(strip.ruler.x_of(frame)), round(strip.ruler.height() * (0.75 if key else 0.25)))


def drag(strip, start, end):
    QTest.mousePress(strip.ruler, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, start)
    QTest.mouseMove(strip.ruler, (start + end) / 2)
    QTest.mouseMove(strip.ruler, end)
    QTest.mouseRelease(strip.ruler, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, end)


def height_of(driver) -> float:
    return driver.scene.edit.handles[0].pose.translate[2]


def test_the_strip_shows_with_the_first_key_and_by_the_menu(driver):
    strip = strip_of(driver)
    assert strip.isHidden()
    driver.key(Qt.Key.Key_T, CONTROL)
    assert strip.isVisible() and driver.window.actions_["timeline.show"].isChecked()
    driver.key(Qt.Key.Key_T, CONTROL)
    assert strip.isHidden()
    driver.key(Qt.Key.Key_K, CONTROL)
    assert strip.isVisible() and driver.window.actions_["timeline.show"].isChecked()
    assert driver.scene.edit.timeline.key_frames == (1,)
    assert driver.session.history.undo_label == "Set key"


def test_posing_at_another_frame_sets_a_key_in_the_same_step(driver):
    keyed_strip(driver)
    assert driver.scene.edit.timeline.key_frames == (1, 10)
    driver.window.actions_["edit.undo"].trigger()
    assert driver.scene.edit.timeline.key_frames == (1,) and height_of(driver) == 0.0
    driver.window.actions_["edit.redo"].trigger()
    assert driver.scene.edit.timeline.key_frames == (1, 10)


def test_dragging_the_line_shows_frames_and_stays_where_it_is_let_go(driver, qtbot):
    keyed = keyed_strip(driver)
    shown = []
    driver.scene.preview_changed.connect(lambda: shown.append(driver.scene.shown_edit.timeline.frame))
    n_steps = driver.session.history.undo_label
    drag(keyed, place(keyed, 2, key=False), place(keyed, 6, key=False))
    assert driver.scene.preview is None and driver.scene.edit.timeline.frame == 6
    assert shown[0] == 2 and 6 in shown
    assert 0.0 < height_of(driver) < 0.2
    assert driver.session.history.undo_label == n_steps, "looking at a frame is no step"
    driver.wait_idle()
    assert keyed.frame_field.value() == 6


def test_keys_are_dragged_and_taken_back(driver):
    keyed = keyed_strip(driver)
    drag(keyed, place(keyed, 10), place(keyed, 4))
    assert driver.scene.edit.timeline.key_frames == (1, 4)
    assert driver.session.history.undo_label == "Move key"
    driver.window.actions_["edit.undo"].trigger()
    assert driver.scene.edit.timeline.key_frames == (1, 10)


def test_escape_drops_a_key_where_it_was(driver):
    keyed = keyed_strip(driver)
    QTest.mousePress(keyed.ruler, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, place(keyed, 10))
    QTest.mouseMove(keyed.ruler, place(keyed, 5))
    QTest.keyClick(keyed.ruler, Qt.Key.Key_Escape)
    QTest.mouseRelease(keyed.ruler, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, place(keyed, 5))
    assert driver.scene.edit.timeline.key_frames == (1, 10)


def test_clicking_a_key_goes_to_it_and_keys_walk_along(driver):
    keyed = keyed_strip(driver)
    QTest.mouseClick(keyed.ruler, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, place(keyed, 1))
    assert driver.scene.edit.timeline.frame == 1 and height_of(driver) == 0.0
    driver.key(Qt.Key.Key_Right, CONTROL)
    assert driver.scene.edit.timeline.frame == 2
    driver.key(Qt.Key.Key_Right, CONTROL | SHIFT)
    assert driver.scene.edit.timeline.frame == 10 and height_of(driver) == 0.2
    driver.key(Qt.Key.Key_Left, CONTROL | SHIFT)
    assert driver.scene.edit.timeline.frame == 1
    driver.key(Qt.Key.Key_Left, CONTROL)
    assert driver.scene.edit.timeline.frame == 1


def test_a_key_is_deleted_by_key_and_by_its_menu(driver, qtbot):
    keyed = keyed_strip(driver)
    driver.key(Qt.Key.Key_K, CONTROL | Qt.KeyboardModifier.AltModifier)
    assert driver.scene.edit.timeline.key_frames == (1,)
    assert not driver.window.actions_["timeline.delete_key"].isEnabled()
    driver.window.actions_["edit.undo"].trigger()
    at = place(keyed, 1)
    QTest.mousePress(keyed.ruler, Qt.MouseButton.RightButton, Qt.KeyboardModifier.NoModifier, at)
    keyed.ruler.contextMenuEvent(_menu_event(keyed.ruler, at))
    menu = QApplication.activePopupWidget()
    menu.actions()[0].trigger()
    menu.close()
    assert driver.scene.edit.timeline.key_frames == (10,)


def _menu_event(widget, at):
    from PySide6.QtGui import QContextMenuEvent

    return QContextMenuEvent(QContextMenuEvent.Reason.Mouse, at, widget.mapToGlobal(at))


def test_playing_shows_poses_and_stops_by_key(driver, qtbot):
    keyed_strip(driver)
    frames, posed = set(), []
    driver.scene.preview_changed.connect(lambda: frames.add(driver.scene.shown_edit.timeline.frame))
    driver.scene.pose_changed.connect(lambda: posed.append(driver.scene.kernels))
    driver.key(Qt.Key.Key_Space)
    player = driver.window.timeline_actions.player
    assert player.is_playing and driver.window.actions_["timeline.play"].isChecked()
    qtbot.waitUntil(lambda: len(frames) >= 5 and len(posed) >= 3, timeout=WAIT_MS)
    driver.key(Qt.Key.Key_Space)
    assert not player.is_playing and driver.scene.preview is None
    assert not driver.window.actions_["timeline.play"].isChecked()
    driver.wait_idle()
    assert not driver.window.view.viewport.is_moving


def test_dragging_a_handle_stops_playing(driver, qtbot):
    keyed_strip(driver)
    driver.key(Qt.Key.Key_Space)
    player = driver.window.timeline_actions.player
    qtbot.waitUntil(lambda: driver.scene.preview is not None, timeout=WAIT_MS)
    driver.session.drag.preview({driver.scene.edit.handles[0].handle_id: Pose((0.3, 0.0, 0.0))})
    qtbot.waitUntil(lambda: not player.is_playing, timeout=WAIT_MS)
    assert driver.scene.preview.handles[0].pose.translate == (0.3, 0.0, 0.0)
    driver.session.drag.cancel()
    driver.wait_idle()


def test_length_speed_and_interpolation_are_steps(driver):
    keyed = keyed_strip(driver)
    keyed.length_field.setValue(30)
    keyed.fps_field.setValue(12)
    driver.window.actions_["timeline.smooth"].trigger()
    timeline = driver.scene.edit.timeline
    assert (timeline.n_frames, timeline.fps, timeline.is_smooth) == (30, 12.0, False)
    for _ in range(3):
        driver.window.actions_["edit.undo"].trigger()
    timeline = driver.scene.edit.timeline
    assert (timeline.n_frames, timeline.fps, timeline.is_smooth) == (10, 24.0, True)
    assert driver.window.actions_["timeline.smooth"].isChecked()


def test_frames_are_exported_from_the_dialog(driver, qtbot, tmp_path):
    keyed_strip(driver)
    driver.key(Qt.Key.Key_E, CONTROL | SHIFT)
    dialog = next(w for w in QApplication.topLevelWidgets() if isinstance(w, FramesDialog))
    assert dialog.kind.currentData() == "splats" and dialog.last.value() == 10
    dialog.first.setValue(9)
    dialog.export_to(tmp_path / "out.ply")
    qtbot.waitUntil(lambda: driver.window.toast.text.startswith("Exported 2 frames"), timeout=WAIT_MS)
    assert sorted(path.name for path in tmp_path.glob("*.ply")) == ["out_0009.ply", "out_0010.ply"]
    driver.wait_idle()
    # The file holds float32.
    np.testing.assert_allclose(read_ply(tmp_path / "out_0010.ply").splats.means, driver.scene.kernels.means, atol=1e-6)


@pytest.mark.parametrize("kind", ["pictures", "turntable"])
def test_pictures_are_drawn_as_the_view_shows_them(driver, qtbot, tmp_path, kind):
    keyed_strip(driver)
    driver.window.display.set(mode="ellipses", background="black")
    order = FrameOrder(kind, range(1, 4), tmp_path / "a.png", (80, 60))
    driver.window.timeline_actions.export_frames(order)
    qtbot.waitUntil(lambda: driver.window.toast.text.startswith("Exported 3 frames"), timeout=WAIT_MS)
    pictures = []
    for number in (1, 2, 3):
        image = QImage(str(tmp_path / f"a_000{number}.png")).convertToFormat(QImage.Format.Format_RGBA8888)
        pictures.append(np.frombuffer(image.constBits(), np.uint8).reshape(60, 80, 4).copy())
    assert (pictures[0][0, 0] == (0, 0, 0, 255)).all()
    assert (pictures[0] != pictures[2]).any()
    driver.wait_idle()


def test_the_export_of_frames_can_be_cancelled(driver, qtbot, tmp_path):
    keyed_strip(driver)
    order = FrameOrder("pictures", range(1, 1000), tmp_path / "a.png", (40, 30))
    driver.window.timeline_actions.export_frames(order)
    qtbot.waitUntil(lambda: any(tmp_path.glob("*.png")), timeout=WAIT_MS)
    assert driver.window.actions_["edit.stop"].isEnabled()
    driver.window.actions_["edit.stop"].trigger()
    qtbot.waitUntil(lambda: not driver.session.worker.is_busy(), timeout=WAIT_MS)
    # A cancelled job no longer counts as busy while it takes away the picture it was writing.
    qtbot.waitUntil(lambda: not any(path.name.endswith(".part") for path in tmp_path.iterdir()), timeout=WAIT_MS)
    assert 1 <= sum(path.suffix == ".png" for path in tmp_path.iterdir()) < 999
    driver.window.actions_["edit.resume"].trigger()
    driver.wait_idle()


def test_closing_while_frames_are_drawn_ends_cleanly(driver, qtbot, tmp_path):
    keyed_strip(driver)
    order = FrameOrder("pictures", range(1, 1000), tmp_path / "a.png", (40, 30))
    driver.window.timeline_actions.export_frames(order)
    qtbot.waitUntil(lambda: any(tmp_path.glob("*.png")), timeout=WAIT_MS)
    driver.close()
    assert not any(thread.name.startswith("splap") for thread in threading.enumerate())
