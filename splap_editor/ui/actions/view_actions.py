"""What the View menu does: the camera and the window."""

import numpy as np
from PySide6.QtCore import QObject, QVariantAnimation
from PySide6.QtWidgets import QWidget

from splap_editor.core.index_spaces import FileRows
from splap_editor.session.session import Session
from splap_editor.viewport.camera import View, blended, scene_axes
from splap_editor.viewport.scene_view import SceneView

FLIGHT_MS = 220


class ViewActions(QObject):
    """Flies the camera, shows and hides parts of the window.

    Parameters
    ----------
    window : QWidget
        Goes full screen.
    dock : QWidget
        The panels.
    """

    def __init__(self, session: Session, view: SceneView, window: QWidget, dock: QWidget) -> None:
        super().__init__(window)
        self._session = session
        self._view = view
        self._viewport = view.viewport
        self._window = window
        self._dock = dock
        self._flight = QVariantAnimation(self, duration=FLIGHT_MS, startValue=0.0, endValue=1.0)
        self._flight.valueChanged.connect(self._on_flown)
        self._flight.finished.connect(view.viewport.end_motion)
        self._ends: tuple[View, View] | None = None
        self._frame_again: View | None = None
        session.state_changed.connect(self._on_state_changed)

    @property
    def is_flying(self) -> bool:
        """Whether the camera is on its way."""
        return self._flight.state() == QVariantAnimation.State.Running

    def fly_to(self, end: View) -> None:
        """Move the camera there, quickly enough not to wait for."""
        if self.is_flying:
            self._flight.stop()
            self._viewport.end_motion()
        self._ends = (self._viewport.camera.view, end)
        self._viewport.begin_motion()
        self._flight.start()

    def _on_flown(self, share: float) -> None:
        if self._ends is None:
            return
        start, end = self._ends
        # Slow at the end: the eye finds its place again.
        self._viewport.camera.view = blended(start, end, 1.0 - (1.0 - share) ** 3)
        self._viewport.camera_moved()

    def frame_selection(self) -> None:
        """Fly to the selection, else to the chosen handles and pins, else to the main subject."""
        scene = self._session.shown_scene
        rows: FileRows = np.flatnonzero(scene.selection & ~scene.unseen)
        if not len(rows):
            held = (self._view.rows_of_handles(scene.active_handles), self._view.rows_of_pins(scene.active_pins))
            rows = np.concatenate(held)
        if len(rows):
            self.fly_to(self._viewport.frame(rows))
        else:
            self.home()

    def frame_everything(self) -> None:
        """Fly to where all splats are in view, far floaters too."""
        self.fly_to(self._viewport.frame_everything())

    def home(self) -> None:
        """Fly to where the main subject fills the picture; after the pose that is on its way, if one is, once more."""
        end = self._viewport.frame()
        self.fly_to(end)
        if self._session.state not in ("ready", "settled"):
            self._frame_again = end

    def _on_state_changed(self) -> None:
        if self._frame_again is None or self._session.state not in ("ready", "settled"):
            return
        asked, self._frame_again = self._frame_again, None
        flown_to = self._ends[1] if self._ends is not None and self.is_flying else None
        # Who has moved the camera since is not carried off.
        if flown_to is asked or self._viewport.camera.view.is_near(asked):
            self.fly_to(self._viewport.frame())

    def look_from(self, *, axis: int, sign: float) -> None:
        """Fly to an end of right (0), away (1) or up (2), and look back."""
        camera = self._viewport.camera
        self.fly_to(camera.look_from(sign * scene_axes(camera.world_up)[axis]))

    def orthographic(self, on: bool) -> None:
        """Drop perspective, or bring it back."""
        self._viewport.camera.set_parallel(on)
        self._viewport.camera_moved()

    def turntable(self, on: bool) -> None:
        """Keep the horizon level."""
        self._viewport.camera.is_turntable = on

    def up_z(self) -> None:
        """Look at the scene as standing on its XY plane."""
        self._stand((0.0, 0.0, 1.0))

    def up_y(self) -> None:
        """Look at the scene as standing on its XZ plane."""
        self._stand((0.0, 1.0, 0.0))

    def down_y(self) -> None:
        """Look at the scene as standing on its XZ plane, upside down, as most captures want it."""
        self._stand((0.0, -1.0, 0.0))

    def _stand(self, up: tuple[float, float, float]) -> None:
        self._session.shown_scene.set_up(up)
        self._viewport.reset_camera()
        self._viewport.camera_moved()

    def panels(self, on: bool) -> None:
        """Show or hide the panels."""
        self._dock.setVisible(on)

    def full_screen(self, on: bool) -> None:
        """Fill the screen."""
        if on:
            self._window.showFullScreen()
        else:
            self._window.showNormal()
