"""The axes in the corner: a click on an end looks from there."""

from collections.abc import Callable

from splap_editor.tools.tool import KeyEvent, PointerEvent, ToolContext
from splap_editor.viewport.camera import View


class AxesTool:
    """Stands before the chosen tool, and takes what happens on the corner axes.

    `fly_to` brings the camera to a view; a host that can animate replaces it.
    """

    name = "axes"
    hint = "Click an end to look from there."

    def __init__(self, context: ToolContext) -> None:
        self._context = context
        self.fly_to: Callable[[View], None] = self._jump

    def pointer(self, event: PointerEvent) -> bool:
        """Light up the end under the cursor; a click looks from it."""
        viewport = self._context.viewport
        if event.kind == "move" and not event.buttons:
            return viewport.hover_axes(*event.xy) is not None
        if event.kind == "press" and event.button == "left":
            axis = viewport.hover_axes(*event.xy)
            if axis is not None:
                self.fly_to(viewport.camera.look_from(axis))
                return True
        return False

    def key(self, event: KeyEvent) -> bool:
        """Take no key; the axis views are actions of the window."""
        return False

    def cancel(self) -> None:
        """There is nothing under way."""

    def _jump(self, view: View) -> None:
        self._context.viewport.camera.view = view
        self._context.viewport.camera_moved()
