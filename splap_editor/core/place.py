"""Where a whole scene stands: moved, turned and scaled about a point after everything else."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.pose import LARGEST_COORDINATE, SCALES
from splap_editor.core.splats.rotations import matrices_to_quats, quat_products, quats_to_matrices
from splap_editor.core.splats.spherical_harmonics import rotated_sh
from splap_editor.core.splats.splats import Splats


@dataclass(frozen=True)
class Place:
    """A similarity of the whole scene: ``x → center + translate + scale R (x - center)``.

    Handles, pins, mends and removals are in the file's coordinates: the place comes after them.

    Parameters
    ----------
    center, translate : 3 floats
        In the file's units.
    rotate : 4 floats
        Unit quaternion, w x y z.
    scale : float
        Greater than 0.
    """

    center: tuple[float, float, float] = (0.0, 0.0, 0.0)
    translate: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rotate: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    scale: float = 1.0

    @property
    def is_identity(self) -> bool:
        """Whether everything stays where it is."""
        return (self.translate, self.rotate, self.scale) == (Place.translate, Place.rotate, Place.scale)

    @property
    def rotation(self) -> NDArray[np.float64]:
        """(3, 3) the turn."""
        return quats_to_matrices(np.array([self.rotate]))[0]

    @property
    def matrix(self) -> NDArray[np.float64]:
        """(4, 4) from the file's coordinates to those it is written in."""
        transform, center = np.eye(4), np.array(self.center)
        transform[:3, :3] = self.scale * self.rotation
        transform[:3, 3] = center + self.translate - transform[:3, :3] @ center
        return transform

    def followed_by(self, delta: NDArray[np.float64]) -> "Place":
        """Go on by a similarity (4, 4) of what is written, about the same center; kept within the limits of a place.

        Parameters
        ----------
        delta : (4, 4) float64
            Rotation times a positive scale, and a translation.
        """
        scale = float(np.cbrt(np.linalg.det(delta[:3, :3])))
        turn = delta[:3, :3] / scale @ self.rotation
        center = np.array(self.center)
        moved = delta[:3, :3] @ (center + self.translate) + delta[:3, 3] - center
        quat = matrices_to_quats(turn[None])[0]
        return replace(
            self,
            translate=tuple(np.clip(moved, -LARGEST_COORDINATE, LARGEST_COORDINATE).tolist()),
            rotate=tuple(quat.tolist()),
            scale=float(np.clip(self.scale * scale, *SCALES)),
        )


def placed_points(points: NDArray[np.floating], place: Place) -> NDArray[np.float64]:
    """(n, 3) points where the place puts them."""
    center = np.array(place.center)
    return (np.asarray(points, np.float64) - center) @ (place.scale * place.rotation).T + center + place.translate


def placed_splats(splats: Splats, place: Place) -> Splats:
    """Move, turn and scale splats as one body, their view-dependent colour and their normals' axes with them.

    Parameters
    ----------
    splats : Splats
    place : Place

    Returns
    -------
    Splats
        Arrays of the same types; those that the place does not change are the same. Splats of two scales keep two.
    """
    if place.is_identity:
        return splats
    turns, grows = place.rotate != Place.rotate, place.scale != 1.0
    changed = replace(splats, means=placed_points(splats.means, place).astype(splats.means.dtype))
    if grows:
        radii = splats.filter_radii
        changed = replace(
            changed,
            log_scales=(np.asarray(splats.log_scales, np.float64) + np.log(place.scale)).astype(
                splats.log_scales.dtype
            ),
            filter_radii=None if radii is None else (np.asarray(radii, np.float64) * place.scale).astype(radii.dtype),
        )
    if turns:
        # A product of stored quaternions keeps their lengths.
        quats = quat_products(np.array([place.rotate]), np.asarray(splats.quats, np.float64))
        n = splats.n_splats
        shN = splats.shN
        if shN.shape[1]:
            rotations = np.broadcast_to(place.rotation, (n, 3, 3))
            shN = rotated_sh(shN, rotations, np.ones(n, bool)).astype(shN.dtype, copy=False)
        changed = replace(changed, quats=quats.astype(splats.quats.dtype), shN=shN)
    return changed
