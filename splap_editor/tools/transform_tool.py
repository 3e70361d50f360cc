"""Moving handles, or what the tool in use moves: the gizmo, and G / R / S with axis locks and typed numbers."""

from functools import partial

import numpy as np
from numpy.typing import NDArray

from splap_editor.engine.edit import Handle, Pin
from splap_editor.session.pivot import Pivot
from splap_editor.tools.bindings import Binding
from splap_editor.tools.mover import HandleMover, Mover
from splap_editor.tools.pin_stroke import PinStroke
from splap_editor.tools.tool import KeyEvent, PointerEvent, Tool, ToolContext
from splap_editor.viewport.gizmo_parts import DOT, SCALE_BOX, VIEW_RING, Act, Lock, Part

MARKER_REACH_PX = 11.0

_KEY_PARTS = {"G": DOT, "R": VIEW_RING, "S": SCALE_BOX}
_AXES = {"X": 0, "Y": 1, "Z": 2}


class TransformTool(Tool):
    """Stands before the chosen tool: a press on the gizmo, on a handle's marker, or a transform under way by key.

    It moves the chosen handles, or what the tool in use says. All is worked out
    from the state at the start of the drag, never from the
    frame before. Moves are previews; the release is one step of the history,
    Escape and the right button bring the old state back.
    """

    name = "transform"

    def __init__(self, context: ToolContext) -> None:
        super().__init__(context)
        self._handles = HandleMover(context.session)
        self._moving: Mover | None = None
        self._by_key = False
        self._typed = ""
        self._xy = (0.0, 0.0)
        self._has_moved = False

    @property
    def is_active(self) -> bool:
        """Whether a drag or a transform by key is under way."""
        return self._moving is not None

    def pointer(self, event: PointerEvent) -> bool:
        """Drag the gizmo, choose handles by their markers, finish what a key began."""
        if event.kind != "leave":
            self._xy = event.xy
        if not self.is_active:
            return super().pointer(event)
        super().pointer(event)
        # The camera can be moved meanwhile.
        return event.button != "middle" and event.kind not in ("wheel", "pinch", "leave")

    def hover(self, event: PointerEvent) -> bool:
        """Light up the part of the gizmo under the cursor."""
        return self.context.viewport.hover_gizmo(event.xy) is not None

    def left(self) -> None:
        """Light up none."""
        self.context.viewport.hover_gizmo(None)

    def key(self, event: KeyEvent) -> bool:
        """Take keys; while something is under way, all that could mean something else."""
        if self.is_active and event.pressed:
            self.context.session.drag.catch_up()
        used = super().key(event)
        return used or (self.is_active and event.pressed and not (event.ctrl or event.alt))

    def cancel(self) -> None:
        """Bring the state from before the drag back."""
        super().cancel()
        moving = self._moving
        if moving is not None:
            self.context.viewport.gizmo.cancel()
            self._finish()
            moving.drop()

    # At rest ------------------------------------------------------------------------------------------------------

    def grab(self, event: PointerEvent) -> bool:
        """Begin to drag the part of the gizmo under the cursor."""
        part = self.context.viewport.gizmo_part(*event.xy)
        return part is not None and self._begin(part, event.xy, by_key=False)

    def start(self, event: KeyEvent) -> bool:
        """Begin to move, turn or scale with the pointer; of what is under way by key, another of them."""
        if self.is_active:
            if not self._by_key:
                return False
            self.cancel()
        part = _KEY_PARTS[event.key]
        gizmo = self.context.viewport.gizmo
        return gizmo.is_shown and part.act in gizmo.acts and self._begin(part, self._xy, by_key=True)

    # Under way ----------------------------------------------------------------------------------------------------

    def follow(self, event: PointerEvent, *, fine: bool = False, snap: bool = False) -> None:
        """Go with the pointer; while a pose is on its way only the newest position matters."""

        def go() -> None:
            if self.is_active:
                self._show(self.context.viewport.gizmo.move(*event.xy, fine=fine, snap=snap))

        self.context.session.drag.take(go)

    def take(self, event: PointerEvent | KeyEvent) -> None:
        """Make it a step: by Return, by the release of a drag, by the click after a key."""
        kind = getattr(event, "kind", "")
        if not kind or (kind == "press") == self._by_key:
            self._commit()

    def drop(self, event: PointerEvent | KeyEvent) -> None:
        """Bring the poses from before back."""
        self.cancel()

    def lock(self, event: KeyEvent) -> None:
        """Bind to an axis, or let go of it."""
        self._lock(Lock.AXIS, _AXES[event.key])

    def lock_plane(self, event: KeyEvent) -> None:
        """Bind to the plane across an axis, or let go of it."""
        self._lock(Lock.PLANE, _AXES[event.key])

    def enter(self, event: KeyEvent) -> None:
        """Take one more character of a number, or one less."""
        self._typed = self._typed[:-1] if event.key == "Backspace" else self._typed + event.text
        self._show(self.context.viewport.gizmo.type(_number(self._typed)))

    def _lock(self, lock: Lock, axis: int) -> None:
        gizmo = self.context.viewport.gizmo
        part = gizmo.dragged
        if part is None or part.act is Act.SCALE:
            return  # handles scale alike along all axes
        if part.act is Act.ROTATE:
            lock = Lock.AXIS
        if (part.lock, part.axis) == (lock, axis):
            lock, axis = Lock.VIEW, 2
        self._show(gizmo.bind(lock, axis))

    def _begin(self, part: Part, xy: tuple[float, float], *, by_key: bool) -> bool:
        viewport, mover = self.context.viewport, self.context.mover or self._handles
        if not mover.begin():
            return False
        self._moving = mover
        self._by_key = by_key
        self._typed = ""
        self._has_moved = False
        viewport.gizmo.begin(part, viewport.projection, *xy)
        viewport.begin_motion()
        return True

    def _show(self, delta: NDArray[np.float64]) -> None:
        """Preview what is moved."""
        assert self._moving is not None
        self._has_moved = True
        self._moving.show(delta)
        self.context.hud.show(text=self._read_out())
        self.context.viewport.gizmo_changed()

    def _read_out(self) -> str:
        gizmo = self.context.viewport.gizmo
        part = gizmo.dragged
        assert part is not None
        bound = {Lock.AXIS: f" along {'XYZ'[part.axis]}", Lock.PLANE: f" across {'XYZ'[part.axis]}", Lock.VIEW: ""}
        typed = f"  [{self._typed}]" if self._typed else ""
        if part.act is Act.ROTATE:
            where = bound[part.lock].replace("along", "about")
            return f"Turn{where}: {np.degrees(gizmo.amount):.1f}°{typed}"
        if part.act is Act.SCALE:
            return f"Scale: {gizmo.amount:.3f} ×{typed}"
        return f"Move{bound[part.lock]}: {gizmo.amount:.4g}{typed}"

    def _commit(self) -> None:
        viewport = self.context.viewport
        self.context.session.drag.catch_up()
        part, moving = viewport.gizmo.dragged, self._moving
        assert part is not None and moving is not None
        has_moved = self._has_moved
        viewport.gizmo.end()
        self._finish()
        if has_moved:
            moving.take(part.act)
        viewport.gizmo_changed()

    def _finish(self) -> None:
        self._moving = None
        self._typed = ""
        self.context.hud.clear()
        self.context.viewport.end_motion()
        self.context.viewport.gizmo_changed()

    def choose(self, event: PointerEvent) -> bool | PinStroke:
        """Choose the handle or pin whose mark is under the cursor; a pin goes along with the pointer."""
        found, scene = self._marked(event.xy), self.context.session.shown_scene
        if isinstance(found, Pin):
            scene.set_active_handles((), (found.pin_id,))
            return PinStroke(self.context, found, event)
        if found is not None:
            scene.set_active_handles((found.handle_id,))
        return found is not None

    def choose_more(self, event: PointerEvent) -> bool:
        """Choose one more handle or pin, or one less."""
        found, scene = self._marked(event.xy), self.context.session.shown_scene
        handles, pins = scene.active_handles, scene.active_pins
        if isinstance(found, Pin):
            scene.set_active_handles(handles, toggled(pins, found.pin_id))
        elif found is not None:
            scene.set_active_handles(toggled(handles, found.handle_id), pins)
        return found is not None

    def place_pivot(self, event: PointerEvent) -> bool:
        """Put the point that handles turn about where the pointer is on the surface."""
        hit = self.context.viewport.pick(*event.xy)
        if hit is not None:
            self.context.session.shown_scene.set_pivot(Pivot.POINT, hit.point)
        return hit is not None

    def _marked(self, xy: tuple[float, float]) -> Handle | Pin | None:
        """The handle or pin whose mark is near a pixel; of two as near the one drawn on top."""
        viewport, edit = self.context.viewport, self.context.session.shown_scene.edit
        marked: tuple[Handle | Pin, ...] = (*edit.active_handles, *edit.pins)
        if not marked:
            return None
        centers = np.array([each.moved_center if isinstance(each, Handle) else each.region.center for each in marked])
        distances = np.linalg.norm(viewport.projection.pixels(centers) - np.array(xy), axis=1)
        nearest = int(np.argmin(distances))
        is_near = distances[nearest] <= MARKER_REACH_PX * viewport.gizmo.scale
        return marked[nearest] if is_near else None

    bindings = (
        Binding(
            ("Any+Drag",),
            grab,
            "Arrow: along an axis; square: in a plane; dot: on the screen; ring: turn; box: scale",
            "move, turn, scale",
            on="the gizmo",
            at_once=True,
        ),
        Binding(("Click", "Ctrl+Click", "Alt+Click"), choose, "Choose the handle or pin", on="its mark", at_once=True),
        Binding(("Shift+Click",), choose_more, "Choose one more, or one less", on="its mark", at_once=True),
        Binding(("Drag",), choose, "Put the pin elsewhere", on="a pin's mark", at_once=True),
        Binding(("Shift+Right click",), place_pivot, "Turn handles about this point", on="the surface", at_once=True),
        Binding(("G", "R", "S"), start, "Move, turn, scale with the pointer", "by key"),
    )
    active_bindings = (
        Binding(("Any+Press",), take, "… take it"),
        Binding(("Any+Release",), take),
        Binding(("Return", "Enter"), take, "… take it", "take it"),
        Binding(("Esc", "Any+Right press"), drop, "… drop it", "drop it"),
        Binding(("X", "Y", "Z"), lock, "… along an axis, or no more", "axis"),
        Binding(("Shift+X", "Shift+Y", "Shift+Z"), lock_plane, "… across an axis, or no more", "plane"),
        Binding(("Any+Number", "Backspace"), enter, "… by exactly so much", "exactly"),
        Binding(("Ctrl+Move",), partial(follow, snap=True), "… in steps", "steps"),
        Binding(("Shift+Move",), partial(follow, fine=True), "… finely", "finely"),
        Binding(("Shift+Ctrl+Move",), partial(follow, fine=True, snap=True)),
        Binding(("Any+Move",), follow),
        Binding(("G", "R", "S"), start),
    )


def toggled(chosen: tuple[int, ...], one: int) -> tuple[int, ...]:
    """Choice with one more, in the last place, or without it."""
    return tuple(each for each in chosen if each != one) if one in chosen else (*chosen, one)


def _number(text: str) -> float | None:
    """Read what was typed so far; None until it is a number."""
    try:
        return float(text)
    except ValueError:
        return None
