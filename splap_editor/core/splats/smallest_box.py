"""The box of the least edges about a set of points, at any angle."""

from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from splap_editor.core.progress import Progress, no_progress, part_of

_N_SUPPORTS = 100
"""Directions an octant in which the outermost points are looked for: 5 degrees apart."""

_N_STARTS = 5
_SHRINK = 0.5
_FINEST_RAD = 1e-8
_MOST_STEPS = 100


def smallest_box(
    points: NDArray[np.float64], progress: Progress = no_progress
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Find the box about points whose three sides have the least sum.

    Unlike the axis-aligned box it turns with the points; unlike that along
    their principal axes it does not spin where these are nearly equal; and a
    box is its own smallest box. Found by descents from the best of a grid of
    frames, so now and then a box that is smaller by a fraction of a percent is missed.

    Parameters
    ----------
    points : (n, 3) float64
        At least one.
    progress : Progress
        Told the share of steps taken; may cancel.

    Returns
    -------
    center : (3,) float64
    half_axes : (3, 3) float64
        From the centre to three faces, at right angles, the longest first.
    """
    mean = points.mean(axis=0)
    centered = points - mean
    _, principal = np.linalg.eigh(centered.T @ centered)
    extremes = _outermost(centered @ principal, part_of(progress, 0.0, 0.5))
    frame = principal @ _best_frame(extremes, part_of(progress, 0.5, 1.0))
    along = centered @ frame
    low, high = along.min(axis=0), along.max(axis=0)
    order = np.argsort(low - high, kind="stable")
    half = 0.5 * (high - low)
    return mean + frame @ (0.5 * (low + high)), (frame * half).T[order]


def _outermost(points: NDArray[np.float64], progress: Progress) -> NDArray[np.float64]:
    """Points that lie farthest out in some direction of a fixed set, which mirroring an axis does not change."""
    i = np.arange(_N_SUPPORTS) + 0.5
    z = i / _N_SUPPORTS
    angle = 0.5 * np.pi * ((i * 0.5 * (np.sqrt(5.0) - 1.0)) % 1.0)
    flat = np.sqrt(1.0 - z * z)
    octant = np.column_stack([flat * np.cos(angle), flat * np.sin(angle), z])
    found: list[NDArray[np.intp]] = []
    # A direction and its opposite share the products.
    for signs in product((1.0,), (-1.0, 1.0), (-1.0, 1.0)):
        for directions in np.array_split(octant * signs, 10):
            along = points @ directions.T
            progress(len(found) / 80)
            found += [along.argmin(axis=0), along.argmax(axis=0)]
    return points[np.unique(np.concatenate(found))]


def _best_frame(points: NDArray[np.float64], progress: Progress) -> NDArray[np.float64]:
    """(3, 3) rotation whose columns are the directions in which the widths of the points have the least sum."""
    steps = np.array(list(product(np.linspace(-1.0, 1.0, 5), repeat=3)))
    frames = _starts()
    best = frames[np.argsort(_sums(points, frames), kind="stable")[:_N_STARTS]]
    results = []
    for done, frame in enumerate(best):
        progress(done / len(best))
        results.append(_descended(points, frame, steps))
    return min(results, key=lambda result: result[0])[1]


def _starts() -> NDArray[np.float64]:
    """Rotations about 15 degrees apart, as far as a box can tell them apart."""
    angles = np.linspace(-0.25 * np.pi, 0.25 * np.pi, 7)
    return Rotation.from_rotvec(np.array(list(product(angles, repeat=3)))).as_matrix()


def _descended(
    points: NDArray[np.float64], frame: NDArray[np.float64], steps: NDArray[np.float64]
) -> tuple[float, NDArray[np.float64]]:
    """Least sum of widths near a frame, and where; the sum has kinks there, so no gradient is asked."""
    reach, least = 0.15, float(_sums(points, frame[None])[0])
    for _ in range(_MOST_STEPS):
        frames = frame @ Rotation.from_rotvec(reach * steps).as_matrix()
        sums = _sums(points, frames)
        k = int(np.argmin(sums))
        if sums[k] < least:
            least, frame = float(sums[k]), frames[k]
        else:
            reach *= _SHRINK
            if reach < _FINEST_RAD:
                break
    return least, frame


def _sums(points: NDArray[np.float64], frames: NDArray[np.float64]) -> NDArray[np.float64]:
    """(F,) sums of the three widths of the points along the columns of each frame."""
    along = points @ frames.transpose(1, 0, 2).reshape(3, -1)
    return (along.max(axis=0) - along.min(axis=0)).reshape(-1, 3).sum(axis=1)
