"""Camera keys on the timeline: set, seen, moved, deleted, played, kept, and drawn alike by window and terminal."""

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest

from splap_editor.cli import main
from splap_editor.engine.recipe_edit import recipe_of
from splap_editor.io.recipe import read_recipe, write_recipe
from splap_editor.io.session_file import read_session_file, write_session_file
from splap_editor.ui.timeline.frame_export import FrameOrder
from splap_editor.ui.timeline.strip import TimelineStrip
from splap_editor.viewport.camera import camera_pose, view_of

from .conftest import WAIT_MS
from .test_timeline import drag, pose, strip_of

CONTROL = Qt.KeyboardModifier.ControlModifier
LAST = 5


def eye(driver):
    return np.array(driver.window.view.viewport.camera.view.position)


def go_round(driver, yaw_px: float) -> None:
    viewport = driver.window.view.viewport
    viewport.camera.orbit(yaw_px, 0.0)
    viewport.camera_moved()


def with_camera(driver) -> TimelineStrip:
    """A camera key at the first and last frame of five, a quarter of a turn apart; the last is shown."""
    strip = strip_of(driver)
    commands = driver.window.timeline_actions
    commands.change("Change length", n_frames=LAST)
    driver.key(Qt.Key.Key_J, CONTROL)
    commands.go_to(LAST)
    go_round(driver, 200.0)
    driver.key(Qt.Key.Key_J, CONTROL)
    driver.wait_idle()
    return strip


def camera_mark(strip, frame):
    return QPoint(round(strip.ruler.x_of(frame)), round(strip.ruler.y_of(is_camera=True)))


def test_camera_keys_are_set_shown_and_looked_through(driver):
    strip = with_camera(driver)
    assert strip.isVisible() and driver.session.history.undo_label == "Key camera"
    # In the least window that is supported the ruler has a line of its own, as wide as the picture.
    driver.qtbot.waitUntil(lambda: strip.ruler.width() > 0.9 * strip.width(), timeout=WAIT_MS)
    assert strip.ruler.y() >= strip.frame_field.geometry().bottom()
    assert driver.scene.edit.timeline.camera_key_frames == (1, LAST)
    last = eye(driver)
    driver.window.timeline_actions.go_to(1)
    assert np.linalg.norm(eye(driver) - last) > 0.1
    path = driver.scene.edit.timeline.camera_at(3)
    driver.window.timeline_actions.scrub(3)
    np.testing.assert_allclose(eye(driver), path.position, atol=1e-9)
    driver.window.actions_["timeline.look_through"].trigger()
    driver.window.timeline_actions.go_to(LAST)
    np.testing.assert_allclose(eye(driver), path.position, atol=1e-9, err_msg="the view is left to the hand")
    driver.window.actions_["timeline.look_through"].trigger()
    np.testing.assert_allclose(eye(driver), last, atol=1e-9)
    driver.wait_idle()


def test_camera_keys_are_moved_deleted_and_taken_back(driver):
    strip = with_camera(driver)
    drag(strip, camera_mark(strip, LAST), camera_mark(strip, 3))
    assert driver.scene.edit.timeline.camera_key_frames == (1, 3)
    driver.window.actions_["edit.undo"].trigger()
    assert driver.scene.edit.timeline.camera_key_frames == (1, LAST)
    n_removed = driver.scene.edit.removal
    QTest.mouseClick(strip.ruler, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, camera_mark(strip, 1))
    assert driver.scene.edit.timeline.frame == 1
    QTest.keyClick(strip.ruler, Qt.Key.Key_Delete)
    assert driver.scene.edit.timeline.camera_key_frames == (LAST,)
    assert driver.scene.edit.removal is n_removed and driver.scene.edit.handles, "nothing else is deleted by it"
    driver.window.actions_["edit.undo"].trigger()
    driver.window.timeline_actions.go_to(1)
    driver.key(Qt.Key.Key_J, CONTROL | Qt.KeyboardModifier.AltModifier)
    assert driver.scene.edit.timeline.camera_key_frames == (LAST,)
    driver.wait_idle()


def test_playing_moves_the_camera_along_its_keys(driver, qtbot):
    with_camera(driver)
    stood = set()
    driver.scene.preview_changed.connect(lambda: stood.add(tuple(np.round(eye(driver), 6))))
    driver.key(Qt.Key.Key_Space)
    qtbot.waitUntil(lambda: len(stood) >= 3, timeout=WAIT_MS)
    driver.key(Qt.Key.Key_Space)
    driver.wait_idle()


@pytest.mark.parametrize("source", ["session", "recipe"])
def test_window_and_terminal_draw_the_same_frames_from_the_same_places(driver, qtbot, tmp_path, source):
    with_camera(driver)
    driver.window.timeline_actions.set_key()
    driver.window.timeline_actions.go_to(1)
    if source == "session":
        pose(driver, replace(driver.scene.edit.handles[0].pose, translate=(0.0, 0.0, 0.2)))
    driver.window.display.set(mode="ellipses", background="black")
    order = FrameOrder("pictures", range(1, LAST + 1), tmp_path / "w.png", (96, 64), is_transparent=True)
    driver.window.timeline_actions.export_frames(order)
    qtbot.waitUntil(lambda: driver.window.toast.text.startswith(f"Exported {LAST} frames"), timeout=WAIT_MS)
    driver.wait_idle()
    edit, held = driver.scene.edit, tmp_path / f"held.{source}"
    arguments = [
        "render",
        str(driver.scene.file.path),
        "-o",
        str(tmp_path / "c.png"),
        "--size",
        "96x64",
        "--transparent",
        "--quiet",
    ]
    if source == "session":
        documents = driver.window.documents
        write_session_file(held, documents.file_of(documents.state(), tmp_path))
        assert read_session_file(held).recipe.camera == edit.timeline.camera_keys
    else:
        write_recipe(held, recipe_of(edit))
        assert read_recipe(held).camera == edit.timeline.camera_keys
        arguments += ["--mode", "ellipses"]
    assert main([*arguments, f"--{source}", str(held), "--frames", f"1-{LAST}"]) == 0
    for number in range(1, LAST + 1):
        mine, other = (np.asarray(Image.open(tmp_path / f"{name}_000{number}.png").convert("RGBA")) for name in "wc")
        np.testing.assert_array_equal(mine, other)
        assert mine[..., 3].any()


def test_a_key_keeps_a_view_whole(driver):
    view = driver.window.view.viewport.camera.view
    again = view_of(camera_pose(view))
    for name in ("position", "focal_point", "view_up"):
        np.testing.assert_allclose(getattr(again, name), getattr(view, name), atol=1e-12)
    assert (again.angle, again.is_parallel) == (view.angle, view.is_parallel)
