"""Poses: how far a handle is moved, turned and scaled about its centre."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.splats.rotations import matrices_to_quats, quats_to_matrices
from splap_editor.core.splats.splats import LARGEST_COORDINATE

SCALES = (1e-6, 1e6)
"""Least and largest scale of a handle. A coordinate times a scale stays well within single precision, 3.4e38."""


@dataclass(frozen=True)
class Pose:
    """A pose about a centre: ``x → center + translate + R (scale · (x - center))``.

    Parameters
    ----------
    translate : 3 floats
        World units.
    rotate : 4 floats
        Unit quaternion, w x y z.
    scale : float or 3 floats
        Uniform, or along the world axes before the rotation; greater than 0.
    """

    translate: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rotate: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    scale: float | tuple[float, float, float] = 1.0

    def __post_init__(self) -> None:
        if isinstance(self.scale, (list, tuple)):
            object.__setattr__(self, "scale", tuple(self.scale))

    @property
    def is_identity(self) -> bool:
        """Whether the pose leaves everything where it is."""
        return self == Pose()

    def matrix(self, center: NDArray[np.float64]) -> NDArray[np.float64]:
        """(4, 4) world transform of the pose about ``center``."""
        transform = np.eye(4)
        transform[:3, :3] = quats_to_matrices(np.array([self.rotate]))[0] * np.asarray(self.scale)
        transform[:3, 3] = center + np.array(self.translate) - transform[:3, :3] @ center
        return transform

    def moved(self, delta: NDArray[np.float64], center: NDArray[np.float64]) -> "Pose":
        """Follow the pose by a world similarity, as far as the limits of a pose allow.

        Parameters
        ----------
        delta : (4, 4) float64
            Rotation times a uniform positive scale, and a translation.
        center : (3,) float64
            The centre that the pose turns about.
        """
        scale = float(np.cbrt(np.linalg.det(delta[:3, :3])))
        turn = delta[:3, :3] / scale @ quats_to_matrices(np.array([self.rotate]))[0]
        at = delta[:3, :3] @ (center + np.array(self.translate)) + delta[:3, 3] - center
        at = np.clip(at, -LARGEST_COORDINATE, LARGEST_COORDINATE)
        quat = matrices_to_quats(turn[None])[0]
        scales = np.clip(np.asarray(self.scale) * scale, *SCALES)
        return Pose(tuple(at.tolist()), tuple(quat.tolist()), scales.tolist())
