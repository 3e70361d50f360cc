"""Curves through rigid motions and through scales, for poses between keyframes.

Motions are blended along screws: the blend of two motions depends on nothing
but the two, so handles that share a motion at each key share it in between,
and what moves rigidly from key to key moves rigidly on the way.
"""

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from splap_editor.core.splats.rotations import matrices_to_quats

_HALF_TURN_W = 1e-9
_STEEPEST = 3.0
"""A tangent up to this multiple of both neighbouring slopes keeps a cubic from overshooting (Fritsch and Carlson)."""


def rigid_log(motion: NDArray[np.float64]) -> NDArray[np.float64]:
    """Twist of a rigid motion: the screw that leads from rest to it in unit time.

    Parameters
    ----------
    motion : (4, 4) float64
        Proper rotation and translation.

    Returns
    -------
    (6,) float64
        Angular velocity (3,) in radians, at most π long, and velocity (3,) of the origin. Of the two ways through a
        half turn the one whose axis has its first sizeable component positive.
    """
    quat = matrices_to_quats(motion[None, :3, :3])[0]
    w, axis = quat[0], quat[1:]
    if w < _HALF_TURN_W and axis[np.abs(axis) > 1e-6][0] < 0.0:
        w, axis = -w, -axis
    sine = float(np.linalg.norm(axis))
    angle = 2.0 * np.arctan2(sine, w)
    spin = axis * (angle / sine if sine > 1e-12 else 2.0)
    K = _cross_matrix(spin)
    half = angle / 2.0
    # (1 - half cot half) / angle², by its series where that cancels.
    bend = 1.0 / 12.0 + angle**2 / 720.0 if angle < 1e-3 else (1.0 - half / np.tan(half)) / angle**2
    shift = motion[:3, 3]
    return np.concatenate([spin, shift - 0.5 * K @ shift + bend * K @ (K @ shift)])


def rigid_exp(twist: NDArray[np.float64]) -> NDArray[np.float64]:
    """(4, 4) rigid motion after following a twist (6,), as `rigid_log` gives it, for unit time."""
    spin, velocity = twist[:3], twist[3:]
    angle = float(np.linalg.norm(spin))
    K = _cross_matrix(spin)
    if angle < 1e-4:
        a, b, c = 1.0 - angle**2 / 6.0, 0.5 - angle**2 / 24.0, 1.0 / 6.0 - angle**2 / 120.0
    else:
        a = np.sin(angle) / angle
        b = (1.0 - np.cos(angle)) / angle**2
        c = (angle - np.sin(angle)) / angle**3
    motion = np.eye(4)
    motion[:3, :3] += a * K + b * K @ K
    motion[:3, 3] = velocity + b * K @ velocity + c * K @ (K @ velocity)
    return motion


def screw_blend(start: NDArray[np.float64], end: NDArray[np.float64], share: float) -> NDArray[np.float64]:
    """(4, 4) motion a share of the way along the screw from one rigid motion to another [1]_.

    The same whatever frame either is expressed in; turns by the shorter way.

    References
    ----------
    .. [1] Kavan et al., "Geometric Skinning with Approximate Dual Quaternion Blending", TOG 2008: ScLERP.
    """
    return start @ rigid_exp(share * rigid_log(_inverse(start) @ end))


def rigid_curve(
    times: NDArray[np.float64], motions: NDArray[np.float64], time: float, *, is_smooth: bool
) -> NDArray[np.float64]:
    """Point of a curve through rigid motions.

    Parameters
    ----------
    times : (K,) float64
        Ascending, K ≥ 1; before the first and after the last the curve stands still.
    motions : (K, 4, 4) float64
        The curve passes through them.
    time : float
    is_smooth : bool
        A cubic in De Casteljau's construction of screws, with Catmull-Rom tangents that are never steeper than the
        motion on both sides asks for, flat at the ends; otherwise one screw from key to key.

    Returns
    -------
    (4, 4) float64
        Rigid. Between two equal motions it is that motion.
    """
    k = _segment(times, time)
    if k is None or time == times[k]:
        return motions[0] if time < times[0] else motions[-1] if k is None else motions[k]
    start, end, length = motions[k], motions[k + 1], times[k + 1] - times[k]
    share = (time - times[k]) / length
    if not is_smooth:
        return screw_blend(start, end, share)
    slopes = [
        rigid_log(_inverse(motions[i]) @ motions[i + 1]) / (times[i + 1] - times[i])
        if 0 <= i < len(times) - 1
        else None
        for i in (k - 1, k, k + 1)
    ]
    leave = _twist_tangent(slopes[0], slopes[1], times, k)
    arrive = _twist_tangent(slopes[1], slopes[2], times, k + 1)
    points = [start, start @ rigid_exp(leave * (length / 3.0)), end @ rigid_exp(-arrive * (length / 3.0)), end]
    while len(points) > 1:
        points = [screw_blend(a, b, share) for a, b in pairwise(points)]
    return points[0]


def scale_curve(
    times: NDArray[np.float64], scales: NDArray[np.float64], time: float, *, is_smooth: bool
) -> NDArray[np.float64]:
    """Point of a curve through scales, monotone from key to key in each component.

    Parameters
    ----------
    times : (K,) float64
        Ascending, K ≥ 1; before the first and after the last the curve stands still.
    scales : (K, D) float64
    time : float
    is_smooth : bool
        Monotone cubic, flat at the ends and where the scale turns back; otherwise linear.

    Returns
    -------
    (D,) float64
        Within the range of the two keys around.
    """
    k = _segment(times, time)
    if k is None or time == times[k]:
        return scales[0] if time < times[0] else scales[-1] if k is None else scales[k]
    length = times[k + 1] - times[k]
    share = (time - times[k]) / length
    step = scales[k + 1] - scales[k]
    if not is_smooth:
        return scales[k] + share * step
    slopes = np.diff(scales, axis=0) / np.diff(times)[:, None]
    leave, arrive = (length * _scale_tangent(slopes, times, i) for i in (k, k + 1))
    u, v = share, 1.0 - share
    point = scales[k] + step * u * u * (3.0 - 2.0 * u) + leave * u * v * v - arrive * u * u * v
    return np.clip(point, np.minimum(scales[k], scales[k + 1]), np.maximum(scales[k], scales[k + 1]))


def _segment(times: NDArray[np.float64], time: float) -> int | None:
    """Index of the key at or before ``time``; None before the first and from the last on."""
    k = int(np.searchsorted(times, time, side="right")) - 1
    return k if 0 <= k < len(times) - 1 else None


def _twist_tangent(
    before: NDArray[np.float64] | None, after: NDArray[np.float64] | None, times: NDArray[np.float64], k: int
) -> NDArray[np.float64]:
    if before is None or after is None:
        return np.zeros(6)
    mean = _mean_slope(before, after, times, k)
    for part in (slice(0, 3), slice(3, 6)):
        length = np.linalg.norm(mean[part])
        limit = _STEEPEST * min(np.linalg.norm(before[part]), np.linalg.norm(after[part]))
        if length > limit:
            mean[part] *= limit / length
    return mean


def _scale_tangent(slopes: NDArray[np.float64], times: NDArray[np.float64], k: int) -> NDArray[np.float64]:
    if not 0 < k < len(times) - 1:
        return np.zeros(slopes.shape[1])
    before, after = slopes[k - 1], slopes[k]
    limit = _STEEPEST * np.minimum(np.abs(before), np.abs(after))
    mean = np.clip(_mean_slope(before, after, times, k), -limit, limit)
    return np.where(before * after > 0.0, mean, 0.0)


def _mean_slope(before: ArrayLike, after: ArrayLike, times: NDArray[np.float64], k: int) -> NDArray[np.float64]:
    """Slope at key ``k`` of the parabola through it and its neighbours."""
    left, right = times[k] - times[k - 1], times[k + 1] - times[k]
    return (right * np.asarray(before) + left * np.asarray(after)) / (left + right)


def _cross_matrix(v: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def _inverse(motion: NDArray[np.float64]) -> NDArray[np.float64]:
    inverse = np.eye(4)
    inverse[:3, :3] = motion[:3, :3].T
    inverse[:3, 3] = -motion[:3, :3].T @ motion[:3, 3]
    return inverse
