"""Painting a selection."""

from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.index_spaces import FileMask
from splap_editor.core.options import option
from splap_editor.session.selection import SelectionMode, combined_selection
from splap_editor.tools.bindings import Binding
from splap_editor.tools.select_tool import DrawnStroke, SelectOptions, SelectTool, picking
from splap_editor.tools.tool import KeyEvent, PointerEvent, ToolContext

BRUSH_STEP = 1.15
BRUSH_RANGE_PX = (3.0, 400.0)


@dataclass(frozen=True)
class BrushOptions:
    """Size of the brush.

    Parameters
    ----------
    radius_px : float
        In device pixels.
    """

    radius_px: float = option(
        24.0,
        "Radius of the brush; [ and ] change it too.",
        label="Brush",
        least=BRUSH_RANGE_PX[0],
        most=BRUSH_RANGE_PX[1],
        unit="px",
        step=2.0,
        decimals=0,
    )


class BrushStroke(DrawnStroke):
    """Everything within the radius of where the pointer went, seen as it is painted."""

    tool: "BrushTool"

    def __init__(self, tool: "BrushTool", press: PointerEvent, mode: SelectionMode) -> None:
        super().__init__(tool, press, mode)
        self._screen = self.context.viewport.screen_points()
        self._busy_until = 0.0
        self._preview()
        tool.show_circle(press.xy)

    def move(self, event: PointerEvent) -> None:
        """Paint on; with more positions than can be shown in time, some are shown together."""
        self.tool.show_circle(event.xy)
        if event.xy != self.path[-1]:
            self.path.append(event.xy)
            if perf_counter() >= self._busy_until:
                self._preview()

    def inside(self, screen: NDArray[np.float32]) -> FileMask:
        """(N,) which `screen_points` the brush went over."""
        return self.context.viewport.in_brush(screen, self.path, self.tool.radius_px)

    def end(self, event: PointerEvent) -> None:
        """Select what was painted."""
        self.context.session.shown_scene.set_selection(self.before)
        super().end(event)

    def cancel(self) -> None:
        """Put the selection from before back."""
        scene = self.context.session.scene
        if scene is not None and len(self.before) == len(scene.selection):
            scene.set_selection(self.before)
        super().cancel()

    def _preview(self) -> None:
        start = perf_counter()
        picked = self.inside(self._screen)
        if not self.tool.is_through:
            picked = self.context.viewport.visible_only(self._screen, picked)
        self.context.session.shown_scene.set_selection(combined_selection(self.before, picked, self.mode))
        end = perf_counter()
        self._busy_until = end + (end - start)


class BrushTool(SelectTool):
    """A press paints at once, and a drag on."""

    name = "brush"
    option_kinds = (BrushOptions, SelectOptions)

    def __init__(self, context: ToolContext) -> None:
        super().__init__(context)
        self._brush = context.held(BrushOptions)

    @property
    def radius_px(self) -> float:
        """Radius in device pixels."""
        return self._brush.value.radius_px

    def show_circle(self, xy: tuple[float, float]) -> None:
        """Show the brush."""
        self.context.hud.show(circle=(*xy, self.radius_px))

    def hover(self, event: PointerEvent) -> bool:
        """Show the brush."""
        self.show_circle(event.xy)
        return False

    def left(self) -> None:
        """Show no brush."""
        self.context.hud.clear()

    def paint(self, press: PointerEvent, mode: SelectionMode) -> BrushStroke:
        """Begin to paint."""
        return BrushStroke(self, press, mode)

    def resize(self, event: PointerEvent | KeyEvent) -> None:
        """Change the size by a wheel notch or a key."""
        if isinstance(event, KeyEvent):
            steps = 1.0 if event.key == "BracketRight" else -1.0
        else:
            steps = event.steps
        radius = float(np.clip(self.radius_px * BRUSH_STEP**steps, *BRUSH_RANGE_PX))
        self._brush.set(replace(self._brush.value, radius_px=radius))
        circle = self.context.hud.circle
        if circle is not None:
            self.show_circle(circle[:2])

    bindings = (
        *picking(paint, "The splats under a brush", "paint", at_once=True),
        Binding(("Ctrl+Wheel", "[", "]"), resize, "Size of the brush", "size"),
    )
