"""Camera keys: where the camera stands at some frames, and the way in between."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.bbw.rigid_curves import rigid_curve, scale_curve
from splap_editor.core.place import Place

Vector = tuple[float, float, float]

LEAST_SINE = 1e-6
"""Of the angle between the line of sight and the upward vector."""


@dataclass(frozen=True)
class CameraPose:
    """Where a camera stands and looks, in the file's coordinates.

    Parameters
    ----------
    position, target : 3 floats
        The eye, and the point looked at, elsewhere.
    up : 3 floats
        To the top of the picture, of any length; not along the line of sight.
    angle : float
        Field of view from the lower to the upper edge, in degrees, above 0 and below 180.
    is_parallel : bool
        Orthographic, as high as the perspective picture is at the target.
    """

    position: Vector
    target: Vector
    up: Vector = (0.0, 0.0, 1.0)
    angle: float = 35.0
    is_parallel: bool = False

    def __post_init__(self) -> None:
        distance, length = self.distance, float(np.linalg.norm(self.up))
        if not 0.0 < distance < np.inf:
            raise ValueError("the target of a camera must be away from its position")
        sight = np.subtract(self.target, self.position) / distance
        if not 0.0 < length < np.inf or np.linalg.norm(np.cross(sight, np.divide(self.up, length))) < LEAST_SINE:
            raise ValueError("up of a camera must be a vector across the line of sight")
        if not 0.0 < self.angle < 180.0:
            raise ValueError(f"the angle of a camera must be above 0 and below 180 degrees, got {self.angle:g}")

    @property
    def distance(self) -> float:
        """From the eye to the target."""
        return float(np.linalg.norm(np.subtract(self.target, self.position)))

    @property
    def matrix(self) -> NDArray[np.float64]:
        """(4, 4) ``world_from_camera``: x to the right, y up, z out of the picture, as OpenGL, glTF and USD have it."""
        matrix = np.eye(4)
        back = np.subtract(self.position, self.target) / self.distance
        right = np.cross(self.up, back)
        right /= np.linalg.norm(right)
        matrix[:3, :3] = np.column_stack([right, np.cross(back, right), back])
        matrix[:3, 3] = self.position
        return matrix


@dataclass(frozen=True)
class CameraKey:
    """Where the camera stands at a frame."""

    frame: int
    pose: CameraPose


@dataclass(frozen=True, eq=False)
class CameraTrack:
    """A camera at frames one after another, as other programs hold one.

    Parameters
    ----------
    matrices : (F, 4, 4) float
        ``world_from_camera``, as of `CameraPose.matrix`.
    angles : (F,) float
        Fields of view from the lower to the upper edge, in degrees.
    distances : (F,) float
        From the eye to the target.
    is_parallel : bool
        Orthographic, as high as the perspective picture is at the target.
    """

    matrices: NDArray[np.float64]
    angles: NDArray[np.float64]
    distances: NDArray[np.float64]
    is_parallel: bool

    @property
    def heights(self) -> NDArray[np.float64]:
        """(F,) of the pictures at the target, in world units."""
        return 2.0 * self.distances * np.tan(np.radians(self.angles) / 2.0)

    @property
    def clipping(self) -> tuple[float, float]:
        """A near and a far distance that keep whatever is about the targets."""
        return 1e-3 * float(self.distances.min()), 1e3 * float(self.distances.max())


def camera_track(poses: Sequence[CameraPose], place: Place) -> CameraTrack:
    """Cameras of a scene as they stand once the whole is in its place; whether they are parallel, the first says."""
    matrices = np.array([pose.matrix for pose in poses])
    matrices[:, :3, :3] = place.rotation @ matrices[:, :3, :3]
    matrices[:, :3, 3] = matrices[:, :3, 3] @ place.matrix[:3, :3].T + place.matrix[:3, 3]
    angles = np.array([pose.angle for pose in poses])
    distances = np.array([pose.distance for pose in poses]) * place.scale
    return CameraTrack(matrices, angles, distances, poses[0].is_parallel)


def camera_between(keys: tuple[CameraKey, ...], frame: float, *, is_smooth: bool) -> CameraPose:
    """The camera at any frame; before the first key and after the last it stands still.

    It turns about its target: the target moves from key to key without
    going beyond either in any coordinate, distance (by its logarithm) and field
    of view likewise, and the camera turns by the shorter way. Keys that look
    at one target make an orbit about it.

    Parameters
    ----------
    keys : tuple of CameraKey
        At least one, ascending by frame.
    frame : float
        May lie between frames; at a key exactly its pose.
    is_smooth : bool
        Without corners; otherwise straight from key to key.
    """
    frames = np.array([key.frame for key in keys], np.float64)
    near = int(np.clip(np.searchsorted(frames, frame, side="right") - 1, 0, len(keys) - 1))
    after = min(near + 1, len(keys) - 1)
    before = keys[near].pose
    if frame <= frames[near] or near == after or before == keys[after].pose:
        return before
    values = np.array([[*key.pose.target, np.log(key.pose.distance), key.pose.angle] for key in keys], np.float64)
    x, y, z, log_distance, angle = scale_curve(frames, values, frame, is_smooth=is_smooth).tolist()
    turns = np.array([key.pose.matrix for key in keys])
    turns[:, :3, 3] = 0.0
    turn = rigid_curve(frames, turns, frame, is_smooth=is_smooth)
    position = np.array([x, y, z]) + np.exp(log_distance) * turn[:3, 2]
    return CameraPose(
        tuple(position.tolist()),
        (x, y, z),
        tuple(turn[:3, 1].tolist()),
        angle,
        before.is_parallel,
    )
