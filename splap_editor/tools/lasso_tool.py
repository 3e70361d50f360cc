"""Selecting splats in an outline drawn by hand."""

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.index_spaces import FileMask
from splap_editor.session.selection import SelectionMode
from splap_editor.tools.select_tool import CLICKS, DrawnStroke, SelectTool, picking
from splap_editor.tools.tool import PointerEvent


class LassoStroke(DrawnStroke):
    """Wherever the pointer went, closed from the end to the start."""

    def move(self, event: PointerEvent) -> None:
        """Draw on; every position is kept, or a quick hand would lose its corners."""
        if event.xy != self.path[-1]:
            self.path.append(event.xy)
            self.context.hud.show(outline=tuple(self.path))

    def inside(self, screen: NDArray[np.float32]) -> FileMask:
        """(N,) which `screen_points` are in the outline."""
        return self.context.viewport.in_lasso(screen, self.path)


class LassoTool(SelectTool):
    """A drag draws round what it selects."""

    name = "lasso"

    def draw(self, press: PointerEvent, mode: SelectionMode) -> LassoStroke:
        """Begin an outline."""
        return LassoStroke(self, press, mode)

    bindings = (*picking(draw, "The splats inside a lasso", "a lasso"), *CLICKS)
