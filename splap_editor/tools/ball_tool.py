"""Selecting splats in a ball about a picked one."""

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.index_spaces import FileMask
from splap_editor.core.removal import PickedBall, picked_splats
from splap_editor.session.selection import SelectionMode
from splap_editor.tools.select_tool import CLICKS, SelectTool, picking
from splap_editor.tools.tool import PointerEvent
from splap_editor.viewport.overlays import circle

_RING = "ball"
_COLOR = (1.0, 0.8, 0.3)


class BallStroke:
    """Blows a ball up about the splat under the press, as far as the pointer goes from it."""

    def __init__(self, tool: "BallTool", press: PointerEvent, mode: SelectionMode, center: NDArray[np.float64]) -> None:
        self.tool = tool
        self.mode = mode
        self.center = center
        self.radius = 0.0
        self._from = np.asarray(press.xy)

    def move(self, event: PointerEvent) -> None:
        """Change the radius."""
        viewport = self.tool.context.viewport
        pixels = float(np.linalg.norm(np.asarray(event.xy) - self._from))
        self.radius = pixels * viewport.projection.world_per_pixel(self.center)
        if self.radius > 0.0:
            around = [circle(self.center, axis, self.radius) for axis in (viewport.projection.direction, *np.eye(3))]
            viewport.rings.show(_RING, around, _COLOR)
            self.tool.context.hud.show(text=f"Radius {self.radius:.4g}")
            viewport.request_render()

    def end(self, event: PointerEvent) -> None:
        """Select."""
        self.move(event)
        self.cancel()
        self.tool.select(self.inside(), self.mode)

    def cancel(self) -> None:
        """Show no ball."""
        self.tool.context.viewport.rings.hide(_RING)
        self.tool.context.hud.clear()
        self.tool.context.viewport.request_render()

    def inside(self) -> FileMask:
        """(N,) which splats on screen have their centre in the ball."""
        scene = self.tool.context.session.shown_scene
        x, y, z = (float(value) for value in self.center)
        return picked_splats(PickedBall((x, y, z), self.radius), scene.positions) & ~scene.unseen


class BallTool(SelectTool):
    """A drag from a splat selects what lies in the ball about it, whatever is in front."""

    name = "ball"
    option_kinds = ()

    def blow(self, press: PointerEvent, mode: SelectionMode) -> BallStroke | None:
        """Begin a ball on the splat under the pointer; without one the drag looks around."""
        hit = self.context.viewport.pick(*press.xy)
        if hit is None:
            return None
        center = np.asarray(self.context.session.shown_scene.positions[hit.row], np.float64)
        return BallStroke(self, press, mode, center)

    bindings = (*picking(blow, "The splats in a ball, from its middle outwards", "a ball"), *CLICKS)
