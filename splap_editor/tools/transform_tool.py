"""Moving handles: the gizmo, and G / R / S with axis locks and typed numbers."""

import numpy as np
from numpy.typing import NDArray

from splap_editor.engine.edit import Handle, Pose
from splap_editor.tools.tool import KeyEvent, PointerEvent, ToolContext
from splap_editor.viewport.gizmo import DOT, SCALE_BOX, VIEW_RING, Act, Lock, Part

MARKER_REACH_PX = 11.0

_KEY_PARTS = {"G": DOT, "R": VIEW_RING, "S": SCALE_BOX}
_AXES = {"X": 0, "Y": 1, "Z": 2}
_LABELS = {Act.TRANSLATE: "Move handle", Act.ROTATE: "Turn handle", Act.SCALE: "Scale handle"}
_TYPED = set("0123456789.-")


class TransformTool:
    """Stands before the chosen tool: a press on the gizmo, on a handle's marker, or a transform under way by key.

    Poses are worked out from those at the start of the drag, never from the
    frame before. Moves are previews; the release is one step of the history,
    Escape and the right button bring the old poses back.
    """

    name = "transform"

    def __init__(self, context: ToolContext) -> None:
        self._context = context
        self._starts: dict[int, tuple[Handle, Pose]] = {}
        self._by_key = False
        self._typed = ""
        self._pointer = (0.0, 0.0)
        self._has_moved = False

    @property
    def hint(self) -> str:
        """What to do, for the status line."""
        if self.is_active:
            return "X Y Z lock an axis (Shift: a plane), type a number, Ctrl snaps, Shift is fine, Esc cancels."
        return "Drag the gizmo, or G R S to move, turn, scale."

    @property
    def is_active(self) -> bool:
        """Whether a drag or a transform by key is under way."""
        return bool(self._starts)

    def pointer(self, event: PointerEvent) -> bool:
        """Drag the gizmo, choose handles by their markers, finish what a key began."""
        viewport = self._context.viewport
        if event.kind != "leave":
            self._pointer = event.xy
        if self.is_active:
            return self._continue(event)
        if self._context.session.scene is None:
            return False
        if event.kind == "press" and event.button == "left":
            part = viewport.gizmo_part(*event.xy)
            if part is not None:
                self._begin(part, event.xy, by_key=False)
                return True
            return self._choose_marker(event)
        if event.kind == "move" and not event.buttons:
            viewport.hover_gizmo(*event.xy)
            return viewport.gizmo.hovered is not None
        return False

    def key(self, event: KeyEvent) -> bool:
        """Take G, R, S, the locks, digits, Return and Escape."""
        if not event.pressed or event.ctrl or event.alt:
            return False
        if self.is_active:
            return self._key_while_active(event)
        if event.key in _KEY_PARTS and self._active_handles() and not event.shift:
            self._begin(_KEY_PARTS[event.key], self._pointer, by_key=True)
            return True
        return False

    def cancel(self) -> None:
        """Bring the poses from before the drag back."""
        if self.is_active:
            self._context.viewport.gizmo.cancel()
            self._finish()
            self._context.session.cancel_preview()

    def _continue(self, event: PointerEvent) -> bool:
        if event.kind == "move":
            # While a pose is on its way only the newest pointer position matters.
            self._context.session.drag(lambda: self._move(event))
        elif event.kind == "press" and event.button == "right":
            self.cancel()
        elif (event.kind == "press" and self._by_key and event.button == "left") or (
            event.kind == "release" and event.button == "left" and not self._by_key
        ):
            self._commit()
        return event.button != "middle" and event.kind != "wheel"

    def _key_while_active(self, event: KeyEvent) -> bool:
        gizmo = self._context.viewport.gizmo
        self._context.session.catch_up()
        if event.key == "Escape":
            self.cancel()
        elif event.key in ("Return", "Enter"):
            self._commit()
        elif event.key in _AXES:
            self._lock(Lock.PLANE if event.shift else Lock.AXIS, _AXES[event.key])
        elif event.key in _KEY_PARTS and self._by_key:
            start = self._pointer
            self.cancel()
            self._begin(_KEY_PARTS[event.key], start, by_key=True)
        elif event.key == "Backspace" or (event.text in _TYPED and event.text):
            self._typed = self._typed[:-1] if event.key == "Backspace" else self._typed + event.text
            self._show(gizmo.type(_number(self._typed)))
        return True

    def _lock(self, lock: Lock, axis: int) -> None:
        gizmo = self._context.viewport.gizmo
        part = gizmo.dragged
        if part.act is Act.SCALE:
            return  # handles scale alike along all axes
        if part.act is Act.ROTATE:
            lock = Lock.AXIS
        if (part.lock, part.axis) == (lock, axis):
            lock, axis = Lock.VIEW, 2
        self._show(gizmo.bind(lock, axis))

    def _begin(self, part: Part, xy: tuple[float, float], *, by_key: bool) -> None:
        viewport = self._context.viewport
        self._starts = {h.handle_id: (h, h.pose) for h in self._active_handles()}
        self._by_key = by_key
        self._typed = ""
        self._has_moved = False
        viewport.gizmo.begin(part, viewport.projection, *xy)
        viewport.begin_motion()

    def _move(self, event: PointerEvent) -> None:
        if self.is_active:
            self._show(self._context.viewport.gizmo.move(*event.xy, fine=event.shift, snap=event.ctrl))

    def _show(self, delta: NDArray[np.float64]) -> None:
        """Preview every handle of the drag moved by one world transform about their common pivot."""
        self._has_moved = True
        poses = {
            handle_id: pose.moved(delta, np.asarray(handle.region.center, np.float64))
            for handle_id, (handle, pose) in self._starts.items()
        }
        self._context.session.preview_poses(poses)
        self._context.hud.show(text=self._read_out())
        self._context.viewport.gizmo_changed()

    def _read_out(self) -> str:
        gizmo = self._context.viewport.gizmo
        part = gizmo.dragged
        bound = {Lock.AXIS: f" along {'XYZ'[part.axis]}", Lock.PLANE: f" across {'XYZ'[part.axis]}", Lock.VIEW: ""}
        typed = f"  [{self._typed}]" if self._typed else ""
        if part.act is Act.ROTATE:
            where = bound[part.lock].replace("along", "about")
            return f"Turn{where}: {np.degrees(gizmo.amount):.1f}°{typed}"
        if part.act is Act.SCALE:
            return f"Scale: {gizmo.amount:.3f} ×{typed}"
        return f"Move{bound[part.lock]}: {gizmo.amount:.4g}{typed}"

    def _commit(self) -> None:
        viewport = self._context.viewport
        self._context.session.catch_up()
        label = _LABELS[viewport.gizmo.dragged.act]
        if len(self._starts) > 1:
            label += "s"
        has_moved = self._has_moved
        viewport.gizmo.end()
        self._finish()
        if has_moved:
            self._context.session.commit_preview(label)
        viewport.gizmo_changed()

    def _finish(self) -> None:
        self._starts = {}
        self._typed = ""
        self._context.hud.clear()
        self._context.viewport.end_motion()
        self._context.viewport.gizmo_changed()

    def _choose_marker(self, event: PointerEvent) -> bool:
        scene, viewport = self._context.session.scene, self._context.viewport
        handles = scene.edit.active_handles
        if not handles:
            return False
        centers = np.array([np.asarray(h.region.center) + h.pose.translate for h in handles])
        pixels = viewport.projection.pixels(centers)
        distances = np.linalg.norm(pixels - np.array(event.xy), axis=1)
        nearest = int(np.argmin(distances))
        if not distances[nearest] <= MARKER_REACH_PX * viewport.gizmo.scale:
            return False
        chosen = handles[nearest].handle_id
        if event.shift:
            kept = scene.active_handles
            others = tuple(i for i in kept if i != chosen)
            scene.set_active_handles(others if chosen in kept else (*kept, chosen))
        else:
            scene.set_active_handles((chosen,))
        return True

    def _active_handles(self) -> list[Handle]:
        scene = self._context.session.scene
        if scene is None:
            return []
        return [h for h in scene.edit.active_handles if h.handle_id in scene.active_handles]


def _number(text: str) -> float | None:
    """Read what was typed so far; None until it is a number."""
    try:
        return float(text)
    except ValueError:
        return None
