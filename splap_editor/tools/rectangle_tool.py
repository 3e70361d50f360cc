"""Selecting splats in a rectangle."""

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.index_spaces import FileMask
from splap_editor.session.selection import SelectionMode
from splap_editor.tools.select_tool import CLICKS, DrawnStroke, SelectTool, picking
from splap_editor.tools.tool import PointerEvent


class RectangleStroke(DrawnStroke):
    """From a corner to the one across."""

    def move(self, event: PointerEvent) -> None:
        """Show the frame."""
        self.path = [self.path[0], event.xy]
        (x0, y0), (x1, y1) = self.path
        self.context.hud.show(outline=((x0, y0), (x1, y0), (x1, y1), (x0, y1)))

    def inside(self, screen: NDArray[np.float32]) -> FileMask:
        """(N,) which `screen_points` are in the frame."""
        return self.context.viewport.in_rectangle(screen, *self.path[0], *self.path[-1])


class RectangleTool(SelectTool):
    """A drag selects what is between its ends."""

    name = "rectangle"
    yields_to_orbit = True

    def draw(self, press: PointerEvent, mode: SelectionMode) -> RectangleStroke:
        """Begin a frame."""
        return RectangleStroke(self, press, mode)

    bindings = (*picking(draw, "The splats in a frame", "a frame"), *CLICKS)
