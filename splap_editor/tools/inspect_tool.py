"""Looking at one splat or one edge."""

import numpy as np

from splap_editor.session.signals import Signal
from splap_editor.tools.tool import CLICK_SLACK_PX, KeyEvent, PointerEvent, ToolContext
from splap_editor.viewport.edge_picking import edge_under
from splap_editor.viewport.inspect_view import InspectView

LINE_REACH_PX = 5.0
EDGE_REACH_PX = 3.0
CUT_KEYS = ("X", "Delete", "Backspace")


class InspectTool:
    """A click inspects the splat under it, or the edge; beside the object, nothing. A drag orbits.

    `cut_asked` tells that a key wants the inspected edge cut.

    Parameters
    ----------
    context : ToolContext
    inspected : InspectView
        What is looked at.
    """

    name = "inspect"

    def __init__(self, context: ToolContext, inspected: InspectView) -> None:
        self._context = context
        self.inspected = inspected
        self.cut_asked = Signal()
        self._pressed: tuple[float, float] | None = None
        self._navigating = False

    @property
    def hint(self) -> str:
        """What to do, for the status line."""
        return "Click a splat to see its neighbours, a line between two to see its edge. X cuts the edge."

    def pointer(self, event: PointerEvent) -> bool:
        """Inspect on click, orbit on drag."""
        if self._context.session.scene is None:
            return False
        if event.kind == "press" and event.button == "left":
            self._pressed = event.xy
            return True
        if event.kind == "move" and self._pressed is not None:
            self._move(event)
            return True
        if event.kind == "release" and event.button == "left" and self._pressed is not None:
            if self._navigating:
                self._context.navigate.pointer(event)
            else:
                self._inspect(self._pressed)
            self._pressed, self._navigating = None, False
            return True
        return False

    def key(self, event: KeyEvent) -> bool:
        """Cut the inspected edge, or let go of what is inspected."""
        if not event.pressed or event.ctrl or event.alt or event.shift:
            return False
        if event.key in CUT_KEYS and self.inspected.edge is not None:
            self.cut_asked.emit()
            return True
        if event.key == "Escape" and self._context.session.scene is not None:
            if self.inspected.edge is not None:
                self.inspected.pick_edge(None)
            else:
                self.inspected.pick(None)
            return True
        return False

    def cancel(self) -> None:
        """End an orbit."""
        if self._navigating:
            self._context.navigate.cancel()
        self._pressed, self._navigating = None, False

    def _move(self, event: PointerEvent) -> None:
        if not self._navigating:
            if np.hypot(event.xy[0] - self._pressed[0], event.xy[1] - self._pressed[1]) <= CLICK_SLACK_PX:
                return
            self._navigating = True
            self._context.navigate.pointer(PointerEvent("press", self._pressed, "left", event.buttons))
        self._context.navigate.pointer(event)

    def _inspect(self, xy: tuple[float, float]) -> None:
        viewport, positions = self._context.viewport, self._context.session.scene.positions
        projection, hit = viewport.projection, viewport.pick(*xy)
        # The lines to neighbours are drawn over everything, other edges may be hidden by the surface.
        lines = self.inspected.neighbor_edges()
        found = edge_under(projection, positions, lines, xy, LINE_REACH_PX)
        if found is None:
            lines = self.inspected.more_edges()
            depth = float(projection.depths(hit.point)[0]) if hit is not None else np.inf
            extent = viewport.splats.shown.extent
            found = edge_under(projection, positions, lines, xy, EDGE_REACH_PX, depth=depth, extent=extent)
        if found is not None:
            a, b = lines[found].tolist()
            self.inspected.pick_edge((a, b))
        else:
            self.inspected.pick(hit.row if hit is not None else None)
