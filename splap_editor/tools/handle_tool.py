"""Placing handles and pins on the surface."""

import numpy as np

from splap_editor.session.placement import disc_rows, held_pose, rows_region
from splap_editor.session.signals import Signal
from splap_editor.tools.tool import CLICK_SLACK_PX, KeyEvent, PointerEvent, ToolContext

RADIUS_STEP = 1.15
RADIUS_RANGE = (0.002, 0.5)


class HandleTool:
    """A click places a handle (or pin) on the disc of surface that lights up under the cursor.

    [ and ] or Ctrl+wheel change the disc's radius. A drag, wherever it starts, orbits.

    Parameters
    ----------
    context : ToolContext
    places : str
        ``"handle"`` or ``"pin"``.
    """

    def __init__(self, context: ToolContext, places: str) -> None:
        self._context = context
        self.name = places
        self.radius = 0.03
        self.radius_changed = Signal()
        self._pressed: tuple[float, float] | None = None
        self._navigating = False
        self._hovered = (-1, 0.0)

    @property
    def hint(self) -> str:
        """What to do, for the status line."""
        if self.name == "pin":
            return "Click the surface to pin it where it is. [ ] or Ctrl+wheel change the size."
        return "Click the surface to place a handle. Drag the arrows. [ ] or Ctrl+wheel change the size."

    @property
    def radius_world(self) -> float:
        """Radius of the disc in world units; ``radius`` is in units of the scene scale."""
        return self.radius * self._context.session.scene.ellipses.scene_scale

    def set_radius(self, radius: float) -> None:
        """Change the disc's radius, in units of the scene scale."""
        self.radius = float(np.clip(radius, *RADIUS_RANGE))
        self.radius_changed.emit()

    def pointer(self, event: PointerEvent) -> bool:
        """Show the disc, place on click, orbit on drag."""
        if self._context.session.scene is None:
            return False
        if event.kind == "wheel" and (event.ctrl or "left" in event.buttons):
            self._resize(event.steps, event.xy)
            return True
        if event.kind == "press" and event.button == "left":
            self._pressed = event.xy
            return True
        if event.kind == "move":
            return self._move(event)
        if event.kind == "release" and event.button == "left":
            return self._release(event)
        if event.kind == "leave":
            self._context.viewport.show_disc(None)
            self._hovered = (-1, 0.0)
        return False

    def key(self, event: KeyEvent) -> bool:
        """Take [ and ] for the radius."""
        if event.pressed and event.key in ("BracketLeft", "BracketRight"):
            self._resize(1 if event.key == "BracketRight" else -1, None)
            return True
        return False

    def cancel(self) -> None:
        """Place nothing."""
        if self._navigating:
            self._context.navigate.cancel()
        self._pressed = None
        self._navigating = False
        self._hovered = (-1, 0.0)
        self._context.viewport.show_disc(None)

    def _move(self, event: PointerEvent) -> bool:
        if self._navigating:
            return self._context.navigate.pointer(event)
        if self._pressed is None:
            if not event.buttons:
                self._hover(event.xy)
            return False
        if np.hypot(event.xy[0] - self._pressed[0], event.xy[1] - self._pressed[1]) > CLICK_SLACK_PX:
            self._navigating = True
            self._context.viewport.show_disc(None)
            start = PointerEvent("press", self._pressed, "left", event.buttons, event.shift, event.ctrl, event.alt)
            self._context.navigate.pointer(start)
            self._context.navigate.pointer(event)
        return True

    def _release(self, event: PointerEvent) -> bool:
        if self._navigating:
            self._context.navigate.pointer(event)
        elif self._pressed is not None:
            hit = self._context.viewport.pick(*self._pressed)
            if hit is not None:
                self._place(hit.row)
        used = self._pressed is not None
        self._pressed = None
        self._navigating = False
        return used

    def _place(self, row: int) -> None:
        session = self._context.session
        region = rows_region(session.scene, disc_rows(session.scene, row, self.radius_world))
        pose = held_pose(session.scene, region)
        self._context.viewport.show_disc(None)
        if self.name == "handle":
            session.add_handle(region, pose=pose)
        elif pose.is_identity:
            session.add_pin(region)
        else:
            # A pin holds splats at rest; what has moved is held by a handle that keeps its pose.
            session.add_handle(region, pose=pose, name="Pin")

    def _hover(self, xy: tuple[float, float]) -> None:
        hit = self._context.viewport.pick(*xy)
        hovered = (-1, 0.0) if hit is None else (hit.row, self.radius)
        if hovered != self._hovered:
            self._hovered = hovered
            scene = self._context.session.scene
            rows = None if hit is None else disc_rows(scene, hit.row, self.radius_world)
            self._context.viewport.show_disc(rows)

    def _resize(self, steps: float, xy: tuple[float, float] | None) -> None:
        self.set_radius(self.radius * RADIUS_STEP**steps)
        if xy is not None:
            self._hover(xy)
        elif self._hovered[0] >= 0:
            self._hovered = (self._hovered[0], self.radius)
            rows = disc_rows(self._context.session.scene, self._hovered[0], self.radius_world)
            self._context.viewport.show_disc(rows)
