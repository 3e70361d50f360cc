"""Orbit, pan and zoom, as in Blender."""

from splap_editor.tools.tool import KeyEvent, PointerEvent, ToolContext

ZOOM_PER_NOTCH = 1.15


class NavigateTool:
    """Middle button (or left on empty space) orbits, with shift pans, with ctrl zooms; the wheel zooms to the pointer.

    The gesture stays what it was when the button went down. Orbiting goes
    round the surface point under the pointer where there is one, so what the
    artist looks at does not swing out of sight.
    """

    name = "navigate"
    hint = "Drag to orbit, shift-drag to pan, wheel to zoom."

    def __init__(self, context: ToolContext) -> None:
        self._context = context
        self._gesture = ""
        self._last = (0.0, 0.0)
        self._pivot = None

    def pointer(self, event: PointerEvent) -> bool:
        """Move the camera."""
        if event.kind == "wheel":
            self._wheel(event)
            return True
        if event.kind == "press" and event.button in ("middle", "left"):
            self._gesture = "pan" if event.shift else "zoom" if event.ctrl else "orbit"
            self._last = event.xy
            hit = self._context.viewport.pick(*event.xy)
            self._pivot = None if hit is None else hit.point
            self._context.viewport.begin_motion()
            return True
        if event.kind == "move" and self._gesture:
            self._drag(event)
            return True
        if event.kind == "release" and self._gesture:
            self.cancel()
            return True
        return False

    def key(self, event: KeyEvent) -> bool:
        """Take no key; views by key are actions of the window."""
        return False

    def cancel(self) -> None:
        """Leave the camera where it is."""
        if self._gesture:
            self._gesture = ""
            self._context.viewport.end_motion()

    def _drag(self, event: PointerEvent) -> None:
        camera = self._context.viewport.camera
        dx, dy = event.xy[0] - self._last[0], event.xy[1] - self._last[1]
        self._last = event.xy
        if self._gesture == "orbit":
            camera.orbit(dx, dy, self._pivot)
        elif self._gesture == "pan":
            camera.pan(dx, dy, self._pivot)
        else:
            camera.zoom(ZOOM_PER_NOTCH ** (-dy / 30.0), self._pivot)
        self._context.viewport.camera_moved()

    def _wheel(self, event: PointerEvent) -> None:
        viewport = self._context.viewport
        if event.pan_px != (0.0, 0.0) and not event.ctrl:
            move = viewport.camera.pan if event.shift else viewport.camera.orbit
            move(*event.pan_px)
        else:
            hit = viewport.pick(*event.xy)
            viewport.camera.zoom_at(ZOOM_PER_NOTCH**event.steps, *event.xy, None if hit is None else hit.point)
        viewport.camera_moved()
