"""The axes in the corner: a click on an end looks from there."""

from splap_editor.tools.bindings import Binding
from splap_editor.tools.tool import PointerEvent, Tool


class AxesTool(Tool):
    """Stands before the chosen tool, and takes what happens on the corner axes."""

    name = "axes"
    needs_scene = False

    def hover(self, event: PointerEvent) -> bool:
        """Light up the end under the cursor."""
        return self.context.viewport.hover_axes(event.xy) is not None

    def left(self) -> None:
        """Light up none."""
        self.context.viewport.hover_axes(None)

    def look(self, event: PointerEvent) -> bool:
        """Look from the end under the cursor."""
        viewport = self.context.viewport
        axis = viewport.hover_axes(event.xy)
        if axis is not None:
            self.context.fly_to(viewport.camera.look_from(axis))
        return axis is not None

    bindings = (Binding(("Click",), look, "Look from there", on="an end of the corner axes", at_once=True),)
