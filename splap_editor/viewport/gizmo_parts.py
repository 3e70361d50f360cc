"""The parts of the gizmo and their shapes."""

from enum import Enum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from splap_editor.viewport.projection import Projection


class Act(Enum):
    """What a part does."""

    TRANSLATE = "translate"
    ROTATE = "rotate"
    SCALE = "scale"


class Lock(Enum):
    """What a part is bound to."""

    AXIS = "axis"
    PLANE = "plane"
    VIEW = "view"


class Part(NamedTuple):
    """One handle of the gizmo: an act, bound to an axis, to the plane across it, or to the screen."""

    act: Act
    lock: Lock
    axis: int = 2


ARROWS = tuple(Part(Act.TRANSLATE, Lock.AXIS, i) for i in range(3))
SQUARES = tuple(Part(Act.TRANSLATE, Lock.PLANE, i) for i in range(3))
DOT = Part(Act.TRANSLATE, Lock.VIEW)
RINGS = tuple(Part(Act.ROTATE, Lock.AXIS, i) for i in range(3))
VIEW_RING = Part(Act.ROTATE, Lock.VIEW)
SCALE_BOX = Part(Act.SCALE, Lock.VIEW)
PARTS = (*ARROWS, *SQUARES, DOT, *RINGS, VIEW_RING, SCALE_BOX)

# Lengths in units of the gizmo's size, the length of an arrow.
ARROW_START, ARROW_END = 0.2, 1.0
SQUARE_NEAR, SQUARE_FAR = 0.30, 0.48
RING_RADIUS, VIEW_RING_RADIUS, SCALE_BOX_AT = 0.86, 1.22, 1.22 / np.sqrt(2.0)
DOT_RADIUS = 0.085


def square_corners(axis: int) -> NDArray[np.float64]:
    """(4, 3) corners of the plane square across an axis, in gizmo units."""
    e = np.eye(3)
    u, v = e[(axis + 1) % 3], e[(axis + 2) % 3]
    return np.array(
        [
            a * u + b * v
            for a, b in (
                (SQUARE_NEAR, SQUARE_NEAR),
                (SQUARE_FAR, SQUARE_NEAR),
                (SQUARE_FAR, SQUARE_FAR),
                (SQUARE_NEAR, SQUARE_FAR),
            )
        ]
    )


def ring_points(
    part: Part, axes: NDArray[np.float64], sight: NDArray[np.float64], projection: Projection, is_whole: bool
) -> NDArray[np.float64]:
    """(K, 3) line of a rotation part about the world's zero, in gizmo units.

    The half of a ring behind its centre is left out unless ``is_whole``, or
    when the ring faces the viewer (``sight``: unit line of sight).
    """
    if part.lock is Lock.VIEW:
        u, v, radius, is_whole = projection.right, projection.up, VIEW_RING_RADIUS, True
    else:
        u, v, radius = axes[:, (part.axis + 1) % 3], axes[:, (part.axis + 2) % 3], RING_RADIUS
    middle, half = 0.0, np.pi
    if not is_whole and abs(sight @ np.cross(u, v)) < 0.985:
        middle, half = float(np.arctan2(-sight @ v, -sight @ u)), np.pi / 2.0
    angles = np.linspace(middle - half, middle + half, 65)[:, None]
    return radius * (np.cos(angles) * u + np.sin(angles) * v)


def line_of_sight(projection: Projection, point: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3,) unit vector from the eye to a world point."""
    if projection.is_parallel:
        return projection.direction
    sight = point - projection.eye
    return sight / np.linalg.norm(sight)


def polyline_distance(cursor: NDArray[np.float64], line: NDArray[np.float64]) -> float:
    """Least distance of the cursor to a polyline (K, 2) in pixels."""
    a, b = line[:-1], line[1:]
    edge = b - a
    length = np.maximum(np.einsum("ij,ij->i", edge, edge), 1e-12)
    t = np.clip(np.einsum("ij,ij->i", cursor - a, edge) / length, 0.0, 1.0)
    distances = np.linalg.norm(cursor - a - t[:, None] * edge, axis=1)
    return float(np.nanmin(distances)) if np.isfinite(distances).any() else np.inf


def is_inside(cursor: NDArray[np.float64], corners: NDArray[np.float64]) -> bool:
    """Inside a convex polygon (K, 2), either way round."""
    edge = np.roll(corners, -1, axis=0) - corners
    arm = cursor - corners
    side = edge[:, 0] * arm[:, 1] - edge[:, 1] * arm[:, 0]
    return bool((side >= 0).all() or (side <= 0).all())
