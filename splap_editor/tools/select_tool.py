"""Selecting splats by click, rectangle, lasso or brush."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from splap_editor.session.selection import SelectionMode, combined_selection
from splap_editor.session.signals import Signal
from splap_editor.tools.tool import CLICK_SLACK_PX, KeyEvent, PointerEvent, ToolContext

BRUSH_STEP = 1.15
LASSO_STEP_PX = 3.0


@dataclass(frozen=True)
class SelectOptions:
    """How the select tool picks.

    Parameters
    ----------
    shape : str
        ``"click"``, ``"rectangle"``, ``"lasso"`` or ``"brush"``.
    through : bool
        Also splats behind others.
    brush_px : float
        Brush radius in device pixels.
    """

    shape: str = "rectangle"
    through: bool = False
    brush_px: float = 24.0


def selection_mode(event: PointerEvent) -> SelectionMode:
    """Read the modifiers: shift adds, ctrl removes, both intersect; the one place where they mean something."""
    if event.shift and event.ctrl:
        return SelectionMode.INTERSECT
    if event.shift:
        return SelectionMode.ADD
    return SelectionMode.REMOVE if event.ctrl else SelectionMode.REPLACE


class SelectTool:
    """A press that does not move picks the splat under it; a drag draws the chosen shape.

    A click beside the object with no modifier clears the selection. The
    selection on screen follows the drag; the history gets one step.
    """

    name = "select"

    def __init__(self, context: ToolContext) -> None:
        self._context = context
        self.options = SelectOptions()
        self.options_changed = Signal()
        self._path: list[tuple[float, float]] = []
        self._before: NDArray[np.bool_] | None = None
        self._screen: NDArray[np.float32] | None = None
        self._orbits = False
        self._navigating = False

    @property
    def hint(self) -> str:
        """What to do, for the status line."""
        shapes = {
            "click": "Click a splat",
            "rectangle": "Drag a rectangle",
            "lasso": "Draw a lasso",
            "brush": "Paint ([ ] or Ctrl+wheel: size)",
        }
        return f"{shapes[self.options.shape]}. Shift adds, Ctrl removes, both intersect. H makes a handle, P a pin."

    def set_options(self, options: SelectOptions) -> None:
        """Change shape, depth or brush size."""
        self.options = options
        self.options_changed.emit()

    def pointer(self, event: PointerEvent) -> bool:
        """Pick."""
        if self._context.session.scene is None:
            return False
        if event.kind == "wheel" and event.ctrl and self.options.shape == "brush":
            self._resize_brush(event.steps, event.xy)
            return True
        if event.kind == "press" and event.button == "left":
            self._begin(event)
            return True
        if event.kind == "move":
            return self._move(event)
        if event.kind == "release" and event.button == "left" and (self._path or self._navigating):
            self._end(event)
            return True
        if event.kind == "leave":
            self._context.hud.clear()
        return False

    def key(self, event: KeyEvent) -> bool:
        """Take [ and ] for the brush size."""
        if event.pressed and event.key in ("BracketLeft", "BracketRight") and self.options.shape == "brush":
            self._resize_brush(1 if event.key == "BracketRight" else -1, None)
            return True
        return False

    def cancel(self) -> None:
        """Put the selection from before the drag back."""
        scene = self._context.session.scene
        if self._before is not None and scene is not None and len(self._before) == len(scene.selection):
            scene.set_selection(self._before)
        if self._navigating:
            self._context.navigate.cancel()
        self._forget()

    def _begin(self, event: PointerEvent) -> None:
        scene, viewport = self._context.session.scene, self._context.viewport
        self._path = [event.xy]
        self._orbits = (
            self._context.left_orbits and self.options.shape == "rectangle" and not (event.shift or event.ctrl)
        )
        self._before = scene.selection
        if self.options.shape == "brush":
            self._screen = viewport.screen_points()
            self._show(event)

    def _move(self, event: PointerEvent) -> bool:
        if self._navigating:
            return self._context.navigate.pointer(event)
        if not self._path:
            if self.options.shape == "brush":
                self._context.hud.show(circle=(*event.xy, self.options.brush_px))
            return False
        last = self._path[-1]
        if self.options.shape == "click" or self._orbits:
            if np.hypot(event.xy[0] - last[0], event.xy[1] - last[1]) > CLICK_SLACK_PX:
                self._forget()
                self._navigating = True
                self._context.navigate.pointer(PointerEvent("press", last, "left", event.buttons))
                self._context.navigate.pointer(event)
            return True
        if self.options.shape == "rectangle":
            self._path = [self._path[0], event.xy]
        elif np.hypot(event.xy[0] - last[0], event.xy[1] - last[1]) >= LASSO_STEP_PX:
            self._path.append(event.xy)
        self._show(event)
        return True

    def _show(self, event: PointerEvent) -> None:
        hud = self._context.hud
        if self.options.shape == "brush":
            hud.show(circle=(*event.xy, self.options.brush_px))
            self._preview(event)
        elif self.options.shape == "rectangle":
            (x0, y0), (x1, y1) = self._path[0], self._path[-1]
            hud.show(outline=((x0, y0), (x1, y0), (x1, y1), (x0, y1)))
        else:
            hud.show(outline=tuple(self._path))

    def _preview(self, event: PointerEvent) -> None:
        picked = self._context.viewport.in_brush(self._screen, self._path, self.options.brush_px)
        if not self.options.through:
            picked = self._context.viewport.visible_only(self._screen, picked)
        scene = self._context.session.scene
        scene.set_selection(combined_selection(self._before, picked, selection_mode(event)))

    def _end(self, event: PointerEvent) -> None:
        if self._navigating:
            self._context.navigate.pointer(event)
            self._forget()
            return
        session, viewport = self._context.session, self._context.viewport
        start, before = self._path[0], self._before
        still = np.hypot(event.xy[0] - start[0], event.xy[1] - start[1]) <= CLICK_SLACK_PX
        if self.options.shape == "brush":
            selection = session.scene.selection
        else:
            if still and len(self._path) <= 2:
                picked = np.zeros_like(before)
                hit = viewport.pick(*event.xy)
                if hit is not None:
                    picked[hit.row] = True
            else:
                picked = self._in_shape(event)
            selection = combined_selection(before, picked, selection_mode(event))
        self._forget()
        session.scene.set_selection(before)
        session.change_mask("selection", selection, "Select")

    def _in_shape(self, event: PointerEvent) -> NDArray[np.bool_]:
        viewport = self._context.viewport
        screen = viewport.screen_points()
        if self.options.shape == "rectangle":
            picked = viewport.in_rectangle(screen, *self._path[0], *event.xy)
        else:
            picked = viewport.in_lasso(screen, self._path)
        return picked if self.options.through else viewport.visible_only(screen, picked)

    def _resize_brush(self, steps: float, xy: tuple[float, float] | None) -> None:
        from dataclasses import replace

        size = float(np.clip(self.options.brush_px * BRUSH_STEP**steps, 3.0, 400.0))
        self.set_options(replace(self.options, brush_px=size))
        if xy is not None:
            self._context.hud.show(circle=(*xy, size))

    def _forget(self) -> None:
        self._path = []
        self._before = self._screen = None
        self._navigating = False
        self._context.hud.clear()
