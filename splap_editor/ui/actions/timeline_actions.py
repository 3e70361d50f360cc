"""What the Animation menu and the timeline strip do."""

from bisect import bisect_left, bisect_right
from dataclasses import replace
from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QWidget

from splap_editor.core.timeline import Timeline
from splap_editor.engine.edit import Edit
from splap_editor.engine.keyframes import edit_at_frame, keyed_edit
from splap_editor.session.scene import Scene
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.session.session import Session
from splap_editor.ui.actions.file_actions import sentence
from splap_editor.ui.dialogs.frames_dialog import FramesDialog
from splap_editor.ui.timeline.frame_export import FrameOrder, submit_frames
from splap_editor.ui.timeline.player import Player
from splap_editor.ui.widgets.toast import Toast
from splap_editor.viewport.camera import camera_pose, view_of
from splap_editor.viewport.viewport import Viewport


class TimelineActions(QObject):
    """Keys are undoable steps; going from frame to frame is none, as looking from elsewhere is none.

    Parameters
    ----------
    window : QWidget
        Parent of the dialog.
    session : Session
    viewport : Viewport
    toast : Toast
        Where results are said.
    """

    shown_changed = Signal(bool)

    def __init__(self, window: QWidget, session: Session, viewport: Viewport, toast: Toast) -> None:
        super().__init__(window)
        self._window = window
        self._session = session
        self._viewport = viewport
        self._toast = toast
        self._is_shown = False
        self._looks_through = True
        self._looked: tuple[Scene, int] | None = None
        self.player = Player(session, viewport, self)
        SceneFollower(session, self._on_edit, edit_changed=self._on_edit, preview_changed=self._follow_camera)

    @property
    def _edit(self) -> Edit:
        return self._session.shown_scene.edit

    def show(self, on: bool) -> None:
        """Show or hide the strip."""
        if on != self._is_shown:
            self._is_shown = on
            self.shown_changed.emit(on)
        if not on:
            self.player.stop()

    # ---------------------------------------------------------------- frames

    def scrub(self, frame: int) -> None:
        """Show a frame while the line is dragged."""
        self.player.stop()
        self._session.shown_scene.set_preview(edit_at_frame(self._edit, frame))

    def go_to(self, frame: int) -> None:
        """Show a frame, and stay there."""
        self.player.stop()
        scene = self._session.shown_scene
        if frame != scene.edit.timeline.frame or scene.preview is not None:
            scene.set_edit(edit_at_frame(scene.edit, frame))

    def next_frame(self) -> None:
        """Go one frame on."""
        timeline = self._edit.timeline
        self.go_to(min(timeline.frame + 1, max(timeline.n_frames, timeline.frame)))

    def previous_frame(self) -> None:
        """Go one frame back."""
        self.go_to(max(self._edit.timeline.frame - 1, 1))

    def next_key(self) -> None:
        """Go to the next key."""
        timeline = self._edit.timeline
        keyed = _keyed_frames(timeline)
        later = keyed[bisect_right(keyed, timeline.frame) :]
        self.go_to(later[0] if later else timeline.frame)

    def previous_key(self) -> None:
        """Go to the key before."""
        timeline = self._edit.timeline
        keyed = _keyed_frames(timeline)
        earlier = keyed[: bisect_left(keyed, timeline.frame)]
        self.go_to(earlier[-1] if earlier else timeline.frame)

    def play(self, on: bool) -> None:
        """Play, or stop."""
        if on:
            self.player.play()
        else:
            self.player.stop()

    # ---------------------------------------------------------------- keys

    def set_key(self) -> None:
        """Keep the poses of all handles at the frame shown."""
        self.player.stop()
        self._session.steps.change_edit(keyed_edit(self._edit), "Set key")

    def delete_key(self) -> None:
        """Delete the key at the frame shown."""
        self.delete_key_at(self._edit.timeline.frame)

    def delete_key_at(self, frame: int) -> None:
        """Delete the key of a frame."""
        self._change(self._edit.timeline.without_key(frame), "Delete key")

    def move_key(self, frame: int, to: int) -> None:
        """Move a key to another frame."""
        self._change(self._edit.timeline.with_key_moved(frame, to), "Move key")

    # ---------------------------------------------------------------- camera

    def set_camera_key(self) -> None:
        """Keep where the camera stands at the frame shown."""
        timeline, pose = self._edit.timeline, camera_pose(self._viewport.camera.view)
        self._change(timeline.with_camera_key(timeline.frame, pose), "Key camera")

    def delete_camera_key(self) -> None:
        """Delete the camera key at the frame shown."""
        self.delete_camera_key_at(self._edit.timeline.frame)

    def delete_camera_key_at(self, frame: int) -> None:
        """Delete the camera key of a frame."""
        self._change(self._edit.timeline.without_camera_key(frame), "Delete camera key")
        self._look()

    def move_camera_key(self, frame: int, to: int) -> None:
        """Move a camera key to another frame."""
        self._change(self._edit.timeline.with_camera_key_moved(frame, to), "Move camera key")
        self._look()

    def look_through(self, on: bool) -> None:
        """Let the picture follow the camera keys from frame to frame, or leave it to the hand."""
        self._looks_through = on
        if on:
            self._look()

    @property
    def looks_through(self) -> bool:
        """Whether the picture follows the camera keys."""
        return self._looks_through

    def change(self, label: str, **values: Any) -> None:
        """Change length, speed or interpolation."""
        timeline = replace(self._edit.timeline, **values)
        if timeline != self._edit.timeline:
            self._change(timeline, label)

    def smooth(self, on: bool) -> None:
        """Move smoothly through the keys, or straight from one to the next."""
        self.change("Change interpolation", is_smooth=on)

    def auto_key(self, on: bool) -> None:
        """Set a key whenever a handle is posed."""
        self.change("Change automatic keys", is_auto=on)

    def export(self) -> None:
        """Ask for a range, and write frames or pictures."""
        self.player.stop()
        scene, projection = self._session.shown_scene, self._viewport.projection
        size = projection.width, projection.height
        threads = self._session.detail_worker
        FramesDialog(self._window, scene.file, scene.edit.timeline, size, self.export_frames, threads).open()

    def export_frames(self, order: FrameOrder) -> None:
        """Write frames in the background."""

        def done(written: list[Path], note: str) -> None:
            n = len(order.frames)
            if len(written) < n:
                text = f"Exported {n} frames in {written[0].name}."
            else:
                text = f"Exported {n} frames, {written[0].name} and so on." if n > 1 else "Exported 1 frame."
            self._toast.say(f"{text} {note}".rstrip())

        def failed(error: Exception) -> None:
            self._toast.fail(f"The frames were not exported: {sentence(error)}")

        submit_frames(self._session, self._viewport, order, done, failed)

    def _change(self, timeline: Timeline, label: str) -> None:
        """Take a changed timeline, and show the frame as it is now."""
        self.player.stop()
        edit = replace(self._edit, timeline=timeline)
        self._session.steps.change_edit(edit_at_frame(edit, timeline.frame) if timeline.keys else edit, label)

    def _on_edit(self) -> None:
        if not self._edit.timeline.is_empty and not self._is_shown:
            self.show(True)
        self._follow_camera()

    def _follow_camera(self) -> None:
        """Look through the keyed camera where another frame is shown; a scene just opened keeps its view."""
        scene = self._session.shown_scene
        shown = scene, scene.shown_edit.timeline.frame
        if self._looked is not None and self._looked[0] is scene and self._looked[1] != shown[1]:
            self._look()
        self._looked = shown

    def _look(self) -> None:
        timeline = self._session.shown_scene.shown_edit.timeline
        pose = timeline.camera_at(timeline.frame)
        if pose is not None and self._looks_through:
            self._viewport.camera.view = view_of(pose)
            self._viewport.camera_moved()


def _keyed_frames(timeline: Timeline) -> list[int]:
    """Frames with a key of any kind, ascending."""
    return sorted({*timeline.key_frames, *timeline.camera_key_frames})
