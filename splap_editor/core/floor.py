"""The plane of a floor, found among splats of which not all belong to it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.place import fitted_plane

REACH = 0.12
"""About a place, the floor is looked for within so many sizes of the scene."""

_TRIES = 256
_FLATNESS = 0.05
"""What is farther from a tried plane than this share of the reach does not speak for it."""

_TUKEY = 4.685
"""Residuals beyond so many deviations weigh nothing: 95 % efficient where they are normal."""

_ROUNDS = 20


@dataclass(frozen=True, eq=False)
class Floor:
    """A plane and the points that lie in it.

    Parameters
    ----------
    middle : (3,) float64
        Of the points in it.
    normal : (3,) float64
        Unit; its side means nothing.
    inside : (n,) bool
        Which of the points asked about lie in it.
    """

    middle: NDArray[np.float64]
    normal: NDArray[np.float64]
    inside: NDArray[np.bool_]


def floor_plane(points: NDArray[np.floating], reach: float) -> Floor:
    """Fit the plane that most of some points lie in, whatever stands on it or floats about it.

    Planes through three points each are tried and scored by truncated squared distances [1]_; the best is refined by
    weighted least squares with Tukey's biweight, its width from the median deviation. Always the same result for the
    same points.

    Parameters
    ----------
    points : (n, 3) float
        About the place that is asked for.
    reach : float
        Radius they were taken within, or might have been: what counts as flat is a share of it. In their unit.

    Raises
    ------
    ValueError
        There are fewer than three, or they lie on a line.

    References
    ----------
    .. [1] Torr and Zisserman, "MLESAC", CVIU 2000: the M-estimator variant, MSAC.
    """
    points = np.asarray(points, np.float64)
    if len(points) < 3:
        raise ValueError("there are too few splats here to tell a floor: click elsewhere, or give three points")
    middle, normal = _tried_plane(points, _FLATNESS * reach)
    for _ in range(_ROUNDS):
        off = np.abs((points - middle) @ normal)
        near = off <= 2.0 * _FLATNESS * reach
        width = _TUKEY * max(1.4826 * float(np.median(off[near])) if near.any() else 0.0, 1e-9 * reach)
        weights = np.where(off < width, (1.0 - (off / width) ** 2) ** 2, 0.0)
        if np.count_nonzero(weights) < 3:
            break
        before = normal
        middle = weights @ points / weights.sum()
        normal = np.linalg.eigh((points - middle).T * weights @ (points - middle))[1][:, 0]
        if abs(before @ normal) > 1.0 - 1e-14:
            break
    inside = np.abs((points - middle) @ normal) <= _FLATNESS * reach
    # Complains where they lie on a line.
    fitted_plane(points[inside] if np.count_nonzero(inside) >= 3 else points)
    return Floor(middle, normal, inside)


def _tried_plane(points: NDArray[np.floating], tolerance: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Best of planes through three points each."""
    rng = np.random.default_rng(0)
    # A few thousand tell a plane as well as all.
    scored = points[rng.choice(len(points), 2000, replace=False)] if len(points) > 2000 else points
    corners = points[np.array([rng.choice(len(points), 3, replace=False) for _ in range(_TRIES)])]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    is_plane = lengths > 0.0
    if not is_plane.any():
        return fitted_plane(points)
    corners, normals = corners[is_plane, 0], normals[is_plane] / lengths[is_plane, None]
    off = scored @ normals.T - (corners * normals).sum(axis=1)
    best = int(np.argmin(np.minimum((off / tolerance) ** 2, 1.0).sum(axis=0)))
    return corners[best], normals[best]
