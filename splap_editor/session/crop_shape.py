"""The box, ball or plane that a capture is cropped by: its handles, and what dragging them makes of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.removal import PickedBall, PickedBox, PickedSide, Vector
from splap_editor.core.splats.main_subject import MainSubject
from splap_editor.core.splats.rotations import matrices_to_quats
from splap_editor.core.splats.splats import LARGEST_COORDINATE

_ROOM = 1.05
"""A shape begins so many times as large as the subject."""

_THINNEST = 1e-3
"""No half side becomes shorter than this share of the longest one it had at the start of a drag."""


class CropKind(Enum):
    """What a capture is cropped by."""

    BOX = "box"
    BALL = "ball"
    PLANE = "plane"


@dataclass(frozen=True, eq=False)
class CropShape:
    """A box, ball or plane in the file's coordinates. Each change gives another one.

    Parameters
    ----------
    kind : CropKind
    center : (3,) float64
        Middle of the box or ball; a point of the plane.
    axes : (3, 3) float64
        Proper rotation; rows are the directions of the sides. The first one is the plane's normal.
    halves : (3,) float64
        Half the sides of the box, the radius of the ball three times; of the plane, how far it is drawn.
    """

    kind: CropKind
    center: NDArray[np.float64]
    axes: NDArray[np.float64]
    halves: NDArray[np.float64]

    @property
    def normals(self) -> NDArray[np.float64]:
        """(k, 3) unit vectors along which each handle is dragged: out of a face."""
        return self.axes[:1] if self.kind is CropKind.PLANE else np.concatenate([self.axes, -self.axes])

    @property
    def handles(self) -> NDArray[np.float64]:
        """(k, 3) where the handles are: in the middle of each face."""
        if self.kind is CropKind.PLANE:
            return self.center[None]
        return self.center + np.tile(self.halves, 2)[:, None] * self.normals

    @property
    def picked(self) -> PickedBox | PickedBall | PickedSide:
        """The same as a step of a removal has it; of the plane, the side that its normal points to."""
        if self.kind is CropKind.BALL:
            return PickedBall(_vector(self.center), float(self.halves[0]))
        if self.kind is CropKind.PLANE:
            return PickedSide(_vector(self.center), _vector(self.axes[0]))
        w, x, y, z = (float(value) for value in matrices_to_quats(self.axes.T[None])[0])
        return PickedBox(_vector(self.center), _vector(2.0 * self.halves), (w, x, y, z))

    @property
    def loops(self) -> list[NDArray[np.float64]]:
        """Closed lines to draw, each (K, 3)."""
        if self.kind is CropKind.BALL:
            angles = np.linspace(0.0, 2.0 * np.pi, 96, endpoint=False)[:, None]
            u, v, w = self.axes * self.halves[:, None]
            pairs = ((u, v), (v, w), (w, u))
            return [self.center + np.cos(angles) * a + np.sin(angles) * b for a, b in pairs]
        u, v, w = self.axes * self.halves[:, None]
        square = [v + w, w - v, -v - w, v - w]
        if self.kind is CropKind.PLANE:
            return [self.center + np.array(square)]
        ends = [self.center + side + np.array(square) for side in (u, -u)]
        return [*ends, *(np.array(edge) for edge in zip(*ends, strict=True))]

    def pulled(self, handle: int, amount: float) -> CropShape:
        """Drag a handle out by a length, in by a negative one; the face across stays, as does the ball's middle."""
        if self.kind is CropKind.PLANE:
            return self.moved(amount * self.axes[0])
        least = _THINNEST * float(self.halves.max())
        if self.kind is CropKind.BALL:
            return replace(self, halves=np.full(3, max(float(self.halves[0]) + amount, least)))
        halves = self.halves.copy()
        axis = handle % 3
        halves[axis] = max(halves[axis] + 0.5 * amount, least)
        shift = (halves[axis] - self.halves[axis]) * self.normals[handle]
        return replace(self, center=self.center + shift, halves=halves)

    def moved(self, offset: NDArray[np.float64]) -> CropShape:
        """Move the whole."""
        center = np.clip(self.center + offset, -LARGEST_COORDINATE, LARGEST_COORDINATE)
        return replace(self, center=center)

    def turned(self, axis: NDArray[np.float64], angle: float) -> CropShape:
        """Turn about its middle: a unit axis, radians."""
        x, y, z = axis
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        turn = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
        return replace(self, axes=self.axes @ turn.T)

    def carried(self, delta: NDArray[np.float64]) -> CropShape:
        """Move and turn it by a rigid transform (4, 4)."""
        center = delta[:3, :3] @ self.center + delta[:3, 3]
        center = np.clip(center, -LARGEST_COORDINATE, LARGEST_COORDINATE)
        return replace(self, center=center, axes=self.axes @ delta[:3, :3].T)

    def sized(self, center: NDArray[np.float64], sides: NDArray[np.float64]) -> CropShape:
        """Put it elsewhere, with sides (3,) of other lengths; of a ball, the first one is its diameter."""
        halves = 0.5 * np.asarray(sides, np.float64)
        if self.kind is CropKind.BALL:
            halves = np.full(3, halves[0])
        return replace(self, center=np.asarray(center, np.float64), halves=halves)


def shape_about(
    subject: MainSubject,
    kind: CropKind,
    axes: NDArray[np.float64] | None = None,
    points: NDArray[np.floating] | None = None,
) -> CropShape:
    """A shape with a little room about the main subject and what is seen beside it; a plane through their middle.

    The plane lies across the third axis.

    Its sides go along the rows of a rotation ``axes`` (3, 3), by default the axes of the file. Along others the
    subject's ``points`` (n, 3) say more than the corners of its box do.
    """
    subject = subject.seen or subject
    axes = np.eye(3) if axes is None else axes
    around = subject.corners if points is None or not len(points) else points
    extent = np.abs((around - subject.center) @ axes.T).max(axis=0)
    halves = _ROOM * np.maximum(extent, 1e-6 * max(subject.size, 1e-6))
    if kind is CropKind.PLANE:
        axes, halves = axes[[2, 0, 1]], halves[[2, 0, 1]]
    elif kind is CropKind.BALL:
        farthest = float(np.linalg.norm(subject.corners - subject.center, axis=1).max())
        halves = np.full(3, max(_ROOM * farthest, float(halves.max())))
    return CropShape(kind, np.asarray(subject.center, np.float64), axes, halves)


def _vector(values: NDArray[np.float64]) -> Vector:
    x, y, z = (float(value) for value in values)
    return x, y, z
