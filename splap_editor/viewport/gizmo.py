"""The gizmo: which part is under the cursor, and what dragging it does. Pure geometry, drawn by `GizmoActor`."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from splap_editor.core.pose import SCALES
from splap_editor.core.splats.splats import LARGEST_COORDINATE
from splap_editor.viewport.camera import turn
from splap_editor.viewport.gizmo_parts import (
    ARROW_END,
    ARROW_START,
    DOT,
    DOT_RADIUS,
    PARTS,
    RING_RADIUS,
    SCALE_BOX,
    SCALE_BOX_AT,
    VIEW_RING,
    Act,
    Lock,
    Part,
    is_inside,
    line_of_sight,
    polyline_distance,
    ring_points,
    square_corners,
)
from splap_editor.viewport.projection import Projection

_FINE = 0.1
_EDGE_ON = 0.12


@dataclass(frozen=True, eq=False)
class _Drag:
    """Everything a drag depends on, as it was when it started."""

    part: Part
    projection: Projection
    frame: NDArray[np.float64]
    axes: NDArray[np.float64]
    axis: NDArray[np.float64]
    start: NDArray[np.float64]

    @property
    def origin(self) -> NDArray[np.float64]:
        return self.frame[:3, 3]


@dataclass(frozen=True, eq=False)
class Claim:
    """Where the gizmo stands for a tool, and what of it is shown.

    Parameters
    ----------
    frame : (4, 4) float64, optional
        None: it is not shown.
    acts : set of Act
    carries_all : bool
        See `Gizmo`.
    """

    frame: NDArray[np.float64] | None
    acts: frozenset[Act] = frozenset(Act)
    carries_all: bool = False


@dataclass(eq=False)
class Gizmo:
    """Transforms a frame by pointer moves, in device pixels from the top left.

    Each move yields the whole world transform since the drag began, from the
    pointer position and the state at its start; nothing is accumulated.

    Parameters
    ----------
    acts : set of Act
        Which kinds of parts are shown.
    is_local : bool
        Axes of the frame instead of those of the world.
    scale : float
        Device pixels per logical pixel.
    is_muted : bool
        No part is shown or found, but the one that is dragged by key.
    world_axes : (3, 3) float64
        Columns X, Y, Z of the world in the coordinates that are drawn.
    unit : float
        A world unit in these coordinates: what numbers, typed and told, and steps are in.
    carries_all : bool
        What is dragged is the whole scene: the coordinates that are drawn go along with the drag.
    size_px, grab_px : float
        Length of an arrow and reach of the cursor in logical pixels.
    angle_snap_rad, scale_snap : float
        Steps of snapped rotation and scaling; translation snaps to powers of ten of a world unit, about 40 px wide.
    """

    acts: frozenset[Act] = frozenset(Act)
    is_local: bool = False
    is_muted: bool = False
    scale: float = 1.0
    size_px: float = 88.0
    grab_px: float = 8.0
    angle_snap_rad: float = np.radians(5.0)
    scale_snap: float = 0.1
    world_axes: NDArray[np.float64] = field(default_factory=lambda: np.eye(3))
    unit: float = 1.0
    carries_all: bool = False
    frame: NDArray[np.float64] | None = None
    hovered: Part | None = None
    typed: float | None = None
    delta: NDArray[np.float64] = field(default_factory=lambda: np.eye(4))
    amount: float = 0.0
    _drag: _Drag | None = None

    # State --------------------------------------------------------------------------------------------------------

    def attach(self, frame: ArrayLike) -> None:
        """Show the gizmo at a frame (4, 4): origin, and axes for the local orientation. Not while dragging."""
        self.frame = np.array(frame, np.float64)

    def detach(self) -> None:
        """Hide the gizmo; a drag under way is dropped."""
        self.frame = self.hovered = self._drag = self.typed = None

    @property
    def is_shown(self) -> bool:
        """Attached to a frame."""
        return self.frame is not None

    @property
    def dragged(self) -> Part | None:
        """Part of the drag under way."""
        return self._drag.part if self._drag else None

    @property
    def axes(self) -> NDArray[np.float64]:
        """(3, 3) unit axes as columns, in the chosen orientation."""
        if self._drag:
            if not self.carries_all:
                return self._drag.axes
            # What is drawn turns with the drag; the axes stay where they are.
            A = self.delta[:3, :3]
            return (A / np.cbrt(np.linalg.det(A))).T @ self._drag.axes
        if not self.is_local:
            return self.world_axes
        u, _, vt = np.linalg.svd(self._attached[:3, :3])
        return u @ vt if np.linalg.det(u @ vt) > 0 else u @ np.diag([1.0, 1.0, -1.0]) @ vt

    @property
    def shown_frame(self) -> NDArray[np.float64]:
        """(4, 4) frame where the gizmo is drawn: it travels with a drag, but neither turns nor scales."""
        shown = (self._drag.frame if self._drag else self._attached).copy()
        if self._drag and self._drag.part.act is Act.TRANSLATE and not self.carries_all:
            shown[:3, 3] += self.delta[:3, 3]
        return shown

    def arm_length(self, projection: Projection) -> float:
        """World length of an arrow, so that it has constant size on the screen."""
        return self.size_px * self.scale * projection.world_per_pixel(self.shown_frame[:3, 3])

    def is_part_shown(self, part: Part, projection: Projection) -> bool:
        """Whether a part is seen: not when it points at the viewer or is edge-on; alone while it is dragged."""
        if not self.is_shown or part.act not in self.acts:
            return False
        if self._drag:
            return part == self._drag.part
        if self.is_muted:
            return False
        if part.lock is Lock.VIEW or part.act is Act.ROTATE:
            return True
        toward = abs(float(self.axes[:, part.axis] @ line_of_sight(projection, self._attached[:3, 3])))
        return bool(toward < 0.985 if part.lock is Lock.AXIS else toward > 0.2)

    @property
    def _attached(self) -> NDArray[np.float64]:
        """The frame, for what is asked only while there is one."""
        assert self.frame is not None
        return self.frame

    @property
    def _dragging(self) -> _Drag:
        """The drag, for what is asked only while there is one."""
        assert self._drag is not None
        return self._drag

    # Hit test -----------------------------------------------------------------------------------------------------

    def hit(self, projection: Projection, x: float, y: float) -> Part | None:
        """Part under the cursor, the nearest within reach; arrows and dot win over rings, all of them over squares."""
        if not self.is_shown:
            return None
        cursor = np.array([x, y], np.float64)
        reach = self.grab_px * self.scale
        best, nearest = None, reach
        for part in PARTS:
            if self.is_part_shown(part, projection):
                distance = self._distance(part, projection, cursor)
                if distance < nearest:
                    best, nearest = part, distance
        return best

    def _distance(self, part: Part, projection: Projection, cursor: NDArray[np.float64]) -> float:
        """Pixels from the cursor to a part, a little in favour of small and important ones."""
        origin, size = self._attached[:3, 3], self.arm_length(projection)
        axes, px = self.axes, self.scale
        if part == DOT:
            return max(float(np.linalg.norm(projection.pixel(origin) - cursor)) - DOT_RADIUS * self.size_px * px, 0.0)
        if part == SCALE_BOX:
            at = origin + SCALE_BOX_AT * size * (projection.right + projection.up)
            return max(float(np.linalg.norm(projection.pixel(at) - cursor)) - 5.0 * px, 0.0)
        if part.lock is Lock.PLANE:
            corners = projection.pixels(origin + size * square_corners(part.axis) @ axes.T)
            return 3.0 * px if is_inside(cursor, corners) else np.inf
        if part.act is Act.TRANSLATE:
            ends = origin + np.outer([ARROW_START * size, ARROW_END * size], axes[:, part.axis])
            return polyline_distance(cursor, projection.pixels(ends))
        points = ring_points(part, axes, line_of_sight(projection, origin), projection, False)
        distances = polyline_distance(cursor, projection.pixels(origin + size * points))
        return distances + 1.0 * px

    # Drag ---------------------------------------------------------------------------------------------------------

    def begin(self, part: Part, projection: Projection, x: float, y: float) -> None:
        """Start a drag of a part, or a keyboard transform (G, R, S: `DOT`, `VIEW_RING`, `SCALE_BOX`)."""
        if not self.is_shown:
            raise ValueError("the gizmo is attached to nothing")
        # Before the axes are asked for: of a drag that is bound anew they are those at its start.
        self.delta, self.amount = np.eye(4), 0.0
        sight = line_of_sight(projection, self._attached[:3, 3])
        axes = self.axes
        axis = projection.direction if part.lock is Lock.VIEW else axes[:, part.axis]
        if part == VIEW_RING:
            axis = sight
        start = np.array([x, y], np.float64)
        self._drag = _Drag(part, projection, self._attached.copy(), axes, axis, start)
        self._pointer, self._virtual, self._is_fine, self._turns = start, start, False, 0.0
        self.typed = None

    def bind(self, lock: Lock, axis: int = 2) -> NDArray[np.float64]:
        """Bind the drag under way to an axis or a plane (X, Shift+X …) or free it again; yields the delta."""
        drag, pointer = self._dragging, self._pointer
        typed, is_fine = self.typed, self._is_fine
        self.begin(Part(drag.part.act, lock, axis), drag.projection, *drag.start)
        self.typed = typed
        return self.move(*pointer, fine=is_fine)

    def move(self, x: float, y: float, *, fine: bool = False, snap: bool = False) -> NDArray[np.float64]:
        """World transform (4, 4) since the start of the drag; a typed number wins over the pointer.

        Parameters
        ----------
        x, y : float
            Device pixels.
        fine : bool
            A tenth of the motion, from where it was switched on.
        snap : bool
            Round to steps.
        """
        pointer = np.array([x, y], np.float64)
        self._virtual = self._virtual + (pointer - self._pointer) * (_FINE if self._is_fine else 1.0)
        self._pointer, self._is_fine = pointer, fine
        act = {Act.TRANSLATE: self._translation, Act.ROTATE: self._rotation, Act.SCALE: self._scaling}
        self.delta = act[self._dragging.part.act](snap)
        return self.delta

    def type(self, value: float | None) -> NDArray[np.float64]:
        """Take a typed number (world units, degrees, a factor) instead of the pointer; None: the pointer again.

        A number that no pose could follow becomes the nearest that one can.
        """
        if value is not None:
            is_factor = self._dragging.part.act is Act.SCALE
            value = float(np.clip(value, *(SCALES if is_factor else (-LARGEST_COORDINATE, LARGEST_COORDINATE))))
        self.typed = value
        return self.move(*self._pointer, fine=self._is_fine)

    def end(self) -> NDArray[np.float64]:
        """Finish the drag: its last delta; the gizmo stays at the old frame until it is attached to the new one."""
        delta, self._drag, self.typed = self.delta, None, None
        return delta

    def cancel(self) -> None:
        """Drop the drag; the gizmo is back where it was."""
        self._drag, self.typed, self.delta = None, None, np.eye(4)

    def _translation(self, snap: bool) -> NDArray[np.float64]:
        drag, projection = self._dragging, self._dragging.projection
        if self.typed is not None:
            axis = drag.axes[:, 0] if drag.part.lock is Lock.VIEW else drag.axis
            self.amount, shift = self.typed, self.typed * self.unit * axis
        elif drag.part.lock is Lock.AXIS:
            first, last = (projection.on_line(x, y, drag.origin, drag.axis) for x, y in (drag.start, self._virtual))
            amount = last - first
            if snap:
                step = self._translation_step()
                amount = round(amount / step) * step
            self.amount, shift = amount / self.unit, amount * drag.axis
        else:
            begin, end = (projection.on_plane(x, y, drag.origin, drag.axis) for x, y in (drag.start, self._virtual))
            shift = end - begin
            if snap:
                step = self._translation_step()
                local = np.round(drag.axes.T @ shift / step) * step
                if drag.part.lock is Lock.PLANE:
                    local[drag.part.axis] = 0.0
                shift = drag.axes @ local
            self.amount = float(np.linalg.norm(shift)) / self.unit
        delta = np.eye(4)
        delta[:3, 3] = shift
        return delta

    def _translation_step(self) -> float:
        drag = self._dragging
        about = drag.projection.world_per_pixel(drag.origin) * 40.0 * self.scale
        return float(self.unit * 10.0 ** np.round(np.log10(about / self.unit)))

    def _rotation(self, snap: bool) -> NDArray[np.float64]:
        drag = self._dragging
        if self.typed is not None:
            angle = np.radians(self.typed)
        else:
            # The pointer's angle is known up to whole turns: take the one nearest to where the drag has been.
            angle = self._pointer_angle(self._virtual) - self._pointer_angle(drag.start)
            if not self._is_edge_on():
                angle += 2.0 * np.pi * np.round((self._turns - angle) / (2.0 * np.pi))
            self._turns = angle
            if snap:
                angle = np.round(angle / self.angle_snap_rad) * self.angle_snap_rad
        self.amount = float(angle)
        return _about(drag.origin, turn(drag.axis, angle))

    def _is_edge_on(self) -> bool:
        drag = self._dragging
        return abs(float(drag.axis @ line_of_sight(drag.projection, drag.origin))) < _EDGE_ON

    def _pointer_angle(self, xy: NDArray[np.float64]) -> float:
        drag, projection = self._dragging, self._dragging.projection
        if self._is_edge_on():
            # Seen edge-on the ring is a line: motion along it, as on the rim of a wheel.
            sight = line_of_sight(projection, drag.origin)
            along = np.cross(drag.axis, -sight)
            unit = projection.world_per_pixel(drag.origin)
            tangent = projection.pixel(drag.origin + along * unit * 10.0) - projection.pixel(drag.origin)
            return float((xy - drag.start) @ tangent / np.linalg.norm(tangent)) / (
                RING_RADIUS * self.size_px * self.scale
            )
        u, v = _across(drag.axis)
        arm = projection.on_plane(xy[0], xy[1], drag.origin, drag.axis) - drag.origin
        return float(np.arctan2(arm @ v, arm @ u))

    def _scaling(self, snap: bool) -> NDArray[np.float64]:
        drag = self._dragging
        if self.typed is not None:
            factor = self.typed
        else:
            center = drag.projection.pixel(drag.origin)
            reach = max(float(np.linalg.norm(drag.start - center)), 1.0)
            factor = max(float(np.linalg.norm(self._virtual - center)) / reach, 0.01)
            if snap:
                factor = max(np.round(factor / self.scale_snap), 1.0) * self.scale_snap
        self.amount = float(factor)
        along = np.outer(drag.axis, drag.axis)
        if drag.part.lock is Lock.VIEW:
            return _about(drag.origin, np.eye(3) * factor)
        if drag.part.lock is Lock.PLANE:
            return _about(drag.origin, np.eye(3) * factor + (1.0 - factor) * along)
        return _about(drag.origin, np.eye(3) + (factor - 1.0) * along)


def _about(point: NDArray[np.float64], A: NDArray[np.float64]) -> NDArray[np.float64]:
    T = np.eye(4)
    T[:3, :3] = A
    T[:3, 3] = point - A @ point
    return T


def _across(axis: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    u = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    u /= np.linalg.norm(u)
    return u, np.cross(axis, u)
