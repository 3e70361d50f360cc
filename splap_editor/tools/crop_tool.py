"""Cropping to a box or ball, or by a plane: handles on the faces, what goes tinted, Return takes it."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.index_spaces import FileMask
from splap_editor.core.options import Choice, option
from splap_editor.core.place import file_points, placed_points
from splap_editor.core.removal import RemovalStep, picked_splats
from splap_editor.session.crop_shape import CropKind, CropShape, shape_about
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.tools.bindings import Binding
from splap_editor.tools.tool import KeyEvent, PointerEvent, Tool, ToolContext
from splap_editor.viewport.gizmo import Claim
from splap_editor.viewport.gizmo_parts import Act

GRAB_PX = 14.0
GOES_TINT = (229, 72, 77, 150)
TURN_RAD = float(np.radians(5.0))
_COLOR, _LIT = (0.95, 0.95, 0.98), (1.0, 0.8, 0.3)
_STUB = 0.12
"""Length of a handle, as a share of the mean half side."""


@dataclass(frozen=True)
class CropOptions:
    """What is cropped by, and which side goes.

    Parameters
    ----------
    kind : str
    inside : bool
    """

    kind: str = option(
        "box",
        "What to crop by.",
        label="Shape",
        choices={"box": Choice("Box"), "ball": Choice("Sphere"), "plane": Choice("Plane")},
    )
    inside: bool = option(False, "Remove what is inside; else what is outside. Of a plane: one side.", label="Inside")


@dataclass(frozen=True)
class CropNumbers:
    """Where the shape is in the placed scene, along the axes in the corner.

    Parameters
    ----------
    x, y, z : float
        Its middle.
    width, depth, height : float
        Its sides; of a ball, the first one is its diameter.
    """

    x: float = option(0.0, "Middle of the shape along X.", label="X", step=0.1)
    y: float = option(0.0, "Middle of the shape along Y.", label="Y", step=0.1)
    z: float = option(0.0, "Middle of the shape along Z.", label="Z", step=0.1)
    width: float = option(1.0, "First side, or diameter of the sphere.", label="W", above=0.0, step=0.1)
    depth: float = option(1.0, "Second side of the box.", label="D", above=0.0, step=0.1)
    height: float = option(1.0, "Third side of the box.", label="H", above=0.0, step=0.1)


class CropStroke:
    """Drags one handle along its normal, from the state at the press."""

    def __init__(self, tool: "CropTool", press: PointerEvent, handle: int, shape: CropShape) -> None:
        self.tool, self.handle, self.before = tool, handle, shape
        self.projection = tool.context.viewport.projection
        self.from_ = self._along(press)

    def _along(self, event: PointerEvent) -> float:
        at, normal = self.before.handles[self.handle], self.before.normals[self.handle]
        return self.projection.on_line(*event.xy, at, normal)

    def move(self, event: PointerEvent) -> None:
        """Follow the pointer."""
        self.tool.show(self.before.pulled(self.handle, self._along(event) - self.from_))

    def end(self, event: PointerEvent) -> None:
        """Leave it there; what goes is taken by Return."""
        self.move(event)

    def cancel(self) -> None:
        """Put the shape from before back."""
        self.tool.show(self.before)


class CropMover:
    """Moves and turns the shape by the gizmo at its middle."""

    def __init__(self, tool: "CropTool") -> None:
        self._tool = tool
        self._before: CropShape | None = None

    def begin(self) -> bool:
        """Remember the shape."""
        self._before = self._tool.shape
        return self._before is not None

    def show(self, delta: NDArray[np.float64]) -> None:
        """Move what it was at the start."""
        if self._before is not None:
            self._tool.show(self._before.carried(delta))

    def take(self, act: Act) -> None:
        """Leave it there."""
        if self._tool.shape is not None:
            self._tool.show(self._tool.shape)

    def drop(self) -> None:
        """Put the shape from before back."""
        if self._before is not None and self._tool.shape is not None:
            self._tool.show(self._before)


class CropTool(Tool):
    """The shape shows once the tool is in use; Return removes what is tinted in one step, Escape leaves it all."""

    name = "crop"
    option_kinds: ClassVar[tuple[type, ...]] = (CropOptions, CropNumbers)

    def __init__(self, context: ToolContext) -> None:
        super().__init__(context)
        self.shape: CropShape | None = None
        self.mover = CropMover(self)
        self._lit: int | None = None
        self._is_dismissed = False
        self._options, self._numbers = context.held(CropOptions), context.held(CropNumbers)
        self._options.changed.connect(self._on_options)
        self._numbers.entered.connect(self._on_numbers)
        SceneFollower(context.session, self.drop, removed_changed=self._redraw, edit_changed=self._on_place)

    # Shape --------------------------------------------------------------------------------------------------------

    def show(self, shape: CropShape) -> None:
        """Show a shape, tint what would go, and say how much that is."""
        self.shape = shape
        self._show_numbers(shape)
        self._redraw()
        self.context.claim(self.claim)

    @property
    def claim(self) -> Claim:
        """A gizmo at the middle of the shape, but for what its kind cannot do."""
        if self.shape is None:
            return Claim(None)
        frame = np.eye(4)
        frame[:3, :3], frame[:3, 3] = self.shape.axes.T, self.shape.center
        acts = {Act.TRANSLATE} if self.shape.kind is CropKind.BALL else {Act.TRANSLATE, Act.ROTATE}
        return Claim(frame, frozenset(acts))

    def begin(self) -> None:
        """Show a shape about the subject and the sparser parts beside it."""
        self._is_dismissed = False
        scene = self.context.session.shown_scene
        axes, kind = scene.edit.place.rotation, CropKind(self._options.value.kind)
        is_turned = not np.array_equal(axes, np.eye(3))
        points = self.context.viewport.splats.subject_points() if is_turned else None
        self.show(shape_about(scene.ellipses.subject, kind, axes, points))

    def drop(self) -> None:
        """Show no shape, and no tint."""
        had, self.shape, self._lit = self.shape is not None, None, None
        if had:
            viewport = self.context.viewport
            for name in ("crop", "crop handles", "crop lit"):
                viewport.rings.hide(name)
            self.context.paint(None)
            self.context.hud.show()
            self.context.claim(self.claim)
            viewport.request_render()

    def goes(self) -> FileMask:
        """(N,) which of the splats that are left would be removed."""
        scene, shape = self.context.session.shown_scene, self.shape
        assert shape is not None
        inside = picked_splats(shape.picked, scene.splats.means)
        return (inside if self._options.value.inside else ~inside) & ~scene.removed

    def cancel(self) -> None:
        """Leave the shape."""
        super().cancel()
        self.drop()
        self._is_dismissed = False

    # Gestures -----------------------------------------------------------------------------------------------------

    def taken_up(self) -> None:
        """Show the shape, wherever the pointer is."""
        if self.context.session.scene is not None:
            self.begin()

    def hover(self, event: PointerEvent) -> bool:
        """Light up the handle under the pointer."""
        if self.shape is None and not self._is_dismissed:
            self.begin()
        lit = self._under(event.xy)
        if lit != self._lit:
            self._lit = lit
            self._draw_handles()
        return False

    def pull(self, press: PointerEvent) -> CropStroke | bool:
        """Begin to drag what is under the pointer."""
        handle = self._under(press.xy)
        return False if self.shape is None or handle is None else CropStroke(self, press, handle, self.shape)

    def wake(self, event: PointerEvent) -> bool:
        """Show a shape again once it has been left."""
        if self.shape is None:
            self.begin()
        return True

    def turn(self, event: KeyEvent) -> bool:
        """Turn the shape about the line of sight."""
        if self.shape is None:
            return False
        sign = 1.0 if event.key == "BracketRight" else -1.0
        self.show(self.shape.turned(self.context.viewport.projection.direction, sign * TURN_RAD))
        return True

    def take(self, event: KeyEvent) -> bool:
        """Remove what is tinted: one step of the history, kept as the shape and not as rows."""
        if self.shape is None:
            return False
        session = self.context.session
        scene = session.shown_scene
        step = RemovalStep(self.shape.picked, outside=not self._options.value.inside)
        try:
            n = session.steps.change_removal(scene.edit.removal.with_step(step, scene.splats), "Crop")
        except ValueError as error:
            self.context.hud.show(text=f"Nothing was removed: {error}")
            return True
        if n:
            self._is_dismissed = True
            self.drop()
        return True

    def let_go(self, event: KeyEvent) -> bool:
        """Leave the shape until the next click."""
        had = self.shape is not None
        self.drop()
        self._is_dismissed = True
        return had

    def _under(self, xy: tuple[float, float]) -> int | None:
        shape, viewport = self.shape, self.context.viewport
        if shape is None:
            return None
        feet, tips = (viewport.projection.pixels(places) for places in self._stubs(shape).swapaxes(0, 1))
        # Anywhere along a stub, not at its ends alone.
        along, way = tips - feet, np.array(xy) - feet
        shares = np.clip((way * along).sum(axis=1) / np.maximum((along * along).sum(axis=1), 1e-12), 0.0, 1.0)
        distances = np.nan_to_num(np.linalg.norm(way - shares[:, None] * along, axis=1), nan=np.inf)
        nearest = int(np.argmin(distances))
        return nearest if distances[nearest] <= GRAB_PX * viewport.gizmo.scale else None

    # Options ------------------------------------------------------------------------------------------------------

    def _on_options(self) -> None:
        if self.shape is None:
            return
        if self.shape.kind.value != self._options.value.kind:
            self.begin()
        else:
            self._redraw()

    def _show_numbers(self, shape: CropShape) -> None:
        place = self.context.session.shown_scene.edit.place
        values = (*placed_points(shape.center[None], place)[0], *(2.0 * place.scale * shape.halves))
        self._numbers.show(CropNumbers(*(float(np.float32(value)) for value in values)))

    def _on_place(self) -> None:
        if self.shape is not None:
            self._show_numbers(self.shape)

    def _on_numbers(self) -> None:
        if self.shape is None:
            return
        place = self.context.session.shown_scene.edit.place
        x, y, z, *sides = (getattr(self._numbers.value, name) for name in ("x", "y", "z", "width", "depth", "height"))
        center = file_points(np.array([[x, y, z]]), place)[0]
        self.show(self.shape.sized(center, np.array(sides) / place.scale))

    # Drawing ------------------------------------------------------------------------------------------------------

    def _redraw(self) -> None:
        shape = self.shape
        if shape is None or self.context.session.scene is None:
            return
        self.context.viewport.rings.show("crop", shape.loops, _COLOR, width_px=1.6)
        self._draw_handles()
        goes = self.goes()
        tints = np.zeros((len(goes), 4), np.uint8)
        tints[goes] = GOES_TINT
        self.context.paint(tints)
        n, left = int(np.count_nonzero(goes)), int(np.count_nonzero(~self.context.session.shown_scene.removed))
        self.context.hud.show(text=f"{n:,} splats go, {left - n:,} stay · Return takes it, Esc leaves")
        self.context.viewport.request_render()

    def _draw_handles(self) -> None:
        shape, rings = self.shape, self.context.viewport.rings
        if shape is None:
            return
        stubs = list(self._stubs(shape))
        rings.show("crop handles", stubs, _COLOR, width_px=6.0, is_closed=False)
        lit = [] if self._lit is None else [stubs[self._lit]]
        rings.show("crop lit", lit, _LIT, width_px=7.0, is_closed=False)
        self.context.viewport.request_render()

    @staticmethod
    def _stubs(shape: CropShape) -> NDArray[np.float64]:
        """(k, 2, 3) line of each handle, out of its face."""
        arm = _STUB * float(shape.halves.mean())
        return np.stack([shape.handles, shape.handles + arm * shape.normals], axis=1)

    bindings = (
        Binding(("Drag",), pull, "A handle of the crop: its face", "drag a face", at_once=True),
        Binding(("Click",), wake, "Show the shape again"),
        Binding(("[", "]"), turn, "Turn the shape about the line of sight", "turn"),
        Binding(("Return", "Enter"), take, "Remove what is tinted", "take it"),
        Binding(("Esc",), let_go, "Leave the shape", "leave"),
    )
