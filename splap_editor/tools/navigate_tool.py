"""Orbit, pan and zoom, as in Blender."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from splap_editor.tools.bindings import Binding
from splap_editor.tools.tool import PointerEvent, Tool, ToolContext
from splap_editor.viewport.camera import Camera

ZOOM_PER_NOTCH = 1.15

Motion = Callable[[Camera, float, float, NDArray[np.float64] | None], None]


class CameraStroke:
    """A drag that moves the camera, by a motion told in pixels; about the surface point under the press if any."""

    def __init__(self, context: ToolContext, press: PointerEvent, motion: Motion) -> None:
        self._viewport = context.viewport
        self._motion = motion
        self._last = press.xy
        hit = self._viewport.pick(*press.xy)
        self._pivot = None if hit is None else hit.point
        self._viewport.begin_motion()

    def move(self, event: PointerEvent) -> None:
        """Move the camera on."""
        dx, dy = event.xy[0] - self._last[0], event.xy[1] - self._last[1]
        self._last = event.xy
        self._motion(self._viewport.camera, dx, dy, self._pivot)
        self._viewport.camera_moved()

    def end(self, event: PointerEvent) -> None:
        """Leave the camera where it is."""
        self._viewport.end_motion()

    def cancel(self) -> None:
        """Leave the camera where it is."""
        self._viewport.end_motion()


def _zoom(camera: Camera, dx: float, dy: float, pivot: NDArray[np.float64] | None) -> None:
    camera.zoom(ZOOM_PER_NOTCH ** (-dy / 30.0), pivot)


class NavigateTool(Tool):
    """Moves the camera; asked last, and for the middle button first.

    The gesture stays what it was when the button went down. Orbiting goes
    round the surface point under the pointer where there is one, so what the
    artist looks at does not swing out of sight.
    """

    name = "navigate"
    needs_scene = False

    def orbit(self, press: PointerEvent) -> CameraStroke:
        """Turn about what is under the pointer."""
        return CameraStroke(self.context, press, Camera.orbit)

    def pan(self, press: PointerEvent) -> CameraStroke:
        """Shift, so that what is under the pointer follows it."""
        return CameraStroke(self.context, press, Camera.pan)

    def zoom(self, press: PointerEvent) -> CameraStroke:
        """Go nearer to what is under the pointer, or away from it."""
        return CameraStroke(self.context, press, _zoom)

    def zoom_at(self, event: PointerEvent) -> None:
        """Go nearer to the pointer by wheel or pinch."""
        viewport = self.context.viewport
        hit = viewport.pick(*event.xy)
        viewport.camera.zoom_at(ZOOM_PER_NOTCH**event.steps, *event.xy, None if hit is None else hit.point)
        viewport.camera_moved()

    def glide_orbit(self, event: PointerEvent) -> None:
        """Turn as two fingers go."""
        self.context.viewport.camera.orbit(*event.pan_px)
        self.context.viewport.camera_moved()

    def glide_pan(self, event: PointerEvent) -> None:
        """Shift as two fingers go."""
        self.context.viewport.camera.pan(*event.pan_px)
        self.context.viewport.camera_moved()

    bindings = (
        Binding(("Middle drag",), orbit, "Orbit", "orbit", at_once=True),
        Binding(
            ("Drag",),
            orbit,
            "Orbit, in a tool that does not draw; by preference in all",
            on="empty space",
            at_once=True,
        ),
        Binding(("Shift+Middle drag", "Shift+Drag"), pan, "Pan", "pan", at_once=True),
        Binding(("Ctrl+Middle drag", "Ctrl+Drag"), zoom, "Zoom", at_once=True),
        Binding(("Shift+Two fingers",), glide_pan, "Pan"),
        Binding(("Ctrl+Two fingers",), zoom_at),
        Binding(("Any+Two fingers",), glide_orbit, "Orbit"),
        Binding(("Any+Wheel", "Any+Pinch"), zoom_at, "Zoom to the pointer", "zoom"),
    )
