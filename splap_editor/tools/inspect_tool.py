"""Looking at one splat or one edge."""

import numpy as np

from splap_editor.session.signals import Signal
from splap_editor.tools.bindings import Binding
from splap_editor.tools.tool import KeyEvent, PointerEvent, Tool, ToolContext
from splap_editor.viewport.edge_picking import edge_under

LINE_REACH_PX = 5.0
EDGE_REACH_PX = 3.0


class InspectTool(Tool):
    """A click inspects the splat under it, or the edge; beside the object, nothing. A drag orbits.

    `cut_asked` tells that a key wants the inspected edge cut.
    """

    name = "inspect"

    def __init__(self, context: ToolContext) -> None:
        super().__init__(context)
        self.inspected = context.inspected
        self.cut_asked = Signal()

    def inspect(self, event: PointerEvent) -> None:
        """Look at what is under the pointer."""
        viewport, positions = self.context.viewport, self.context.session.shown_scene.positions
        projection, hit = viewport.projection, viewport.pick(*event.xy)
        # The lines to neighbours are drawn over everything, other edges may be hidden by the surface.
        lines = self.inspected.neighbor_edges()
        found = edge_under(projection, positions, lines, event.xy, LINE_REACH_PX)
        if found is None:
            lines = self.inspected.more_edges()
            depth = float(projection.depths(hit.point)[0]) if hit is not None else np.inf
            shown = viewport.splats.shown
            extent = shown.extent if shown is not None else 0.0
            found = edge_under(projection, positions, lines, event.xy, EDGE_REACH_PX, depth=depth, extent=extent)
        if found is not None:
            a, b = lines[found].tolist()
            self.inspected.pick_edge((a, b))
        else:
            self.inspected.pick(hit.row if hit is not None else None)

    def cut(self, event: KeyEvent) -> bool:
        """Ask for the inspected edge to be cut."""
        if self.inspected.edge is None:
            return False
        self.cut_asked.emit()
        return True

    def let_go(self, event: KeyEvent) -> bool:
        """Let go of the edge, then of the splat."""
        scene = self.context.session.scene
        if scene is None or (self.inspected.edge is None and scene.picked is None):
            return False
        if self.inspected.edge is not None:
            self.inspected.pick_edge(None)
        else:
            self.inspected.pick(None)
        return True

    bindings = (
        Binding(("Click",), inspect, "Its card and its neighbours, or the edge's", "look", on="a splat or a line"),
        Binding(("X", "Delete", "Backspace"), cut, "Cut the edge", "cut the edge"),
        Binding(("Esc",), let_go, "Let go of the edge, then of the splat"),
    )
