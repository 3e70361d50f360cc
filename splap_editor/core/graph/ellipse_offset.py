"""How far two ellipses in space are from touching: exactly, and without a search in two dimensions.

With ``y`` the coordinates in the unit disk of Ω_j, a point of Ω_j has in the
frame of Ω_i the in-plane coordinates ``c + A y`` (Ω_i is their unit disk) and
the height ``z0 + g·y``. Everything below is a small convex problem in ``y``.
"""

import numba as nb
import numpy as np
from numpy.typing import NDArray

from splap_editor.core.splats.occupancy import Ellipses

_NEWTON_STEPS = 60


def disc_rows(ellipses: Ellipses) -> NDArray[np.float64]:
    """Ellipses as rows the compiled loops read in one piece.

    Parameters
    ----------
    ellipses : Ellipses
        Occupancy ellipses of n nodes.

    Returns
    -------
    (n, 12) float64
        Centre, major semi-axis, minor semi-axis (world units), unit normal.
    """
    flat = ellipses.semi_axes.reshape(-1, 6)
    return np.ascontiguousarray(np.concatenate([ellipses.centers, flat, ellipses.normals], axis=1))


def normal_offsets(ellipses: Ellipses, pairs: NDArray[np.integer]) -> NDArray[np.float64]:
    """Normal-wise offset of pairs of ellipses, in both directions.

    ``δ_ij = min |Z(x)|`` over the points x of Ω_j whose projection along the
    normal of Ω_i falls into Ω_i [1]_. The heights that occur form an interval;
    its end nearest to zero is found by bisection on the chord that the two
    ellipses leave at one height, to within rounding.

    Parameters
    ----------
    ellipses : Ellipses
        Occupancy ellipses of n nodes.
    pairs : (E, 2) int
        Nodes i, j.

    Returns
    -------
    (E, 2) float64
        ``δ_ij`` and ``δ_ji`` in world units; +inf where no translation along
        the normal makes the two meet.

    Raises
    ------
    ValueError
        If ``pairs`` has another shape or names a node that does not exist.

    References
    ----------
    .. [1] SpLap, 3DV 2026, supplement B.
    """
    return _normal_offsets(disc_rows(ellipses), _checked_pairs(pairs, ellipses.n_nodes))


def touch_scales(ellipses: Ellipses, pairs: NDArray[np.integer], epsilon: float) -> NDArray[np.float64]:
    """Factor at which two ellipses, shrunk or grown about their centres, just meet.

    They meet if the normal-wise offset is at most ε in both directions. The
    scale is 0 for a common centre, small where each centre lies inside the
    other ellipse, 1 where only the rims touch.

    Parameters
    ----------
    ellipses : Ellipses
        Occupancy ellipses of n nodes.
    pairs : (E, 2) int
        Nodes i, j; the order of a pair does not matter.
    epsilon : float
        Tolerance along the normals in world units, not negative.

    Returns
    -------
    (E,) float64
        Dimensionless; +inf where no factor makes them meet (parallel planes
        farther apart than ε).

    Raises
    ------
    ValueError
        If ``pairs`` has another shape or names a node that does not exist, or
        ``epsilon`` is negative.
    """
    if not epsilon >= 0.0:
        raise ValueError(f"epsilon must not be negative, got {epsilon}")
    return _touch_scales(disc_rows(ellipses), _checked_pairs(pairs, ellipses.n_nodes), float(epsilon))


def _checked_pairs(pairs: NDArray[np.integer], n_nodes: int) -> NDArray[np.int64]:
    checked = np.ascontiguousarray(pairs, np.int64)
    if checked.ndim != 2 or checked.shape[1] != 2:
        raise ValueError(f"pairs must have shape (E, 2), got {checked.shape}")
    if len(checked) and not (checked.min() >= 0 and checked.max() < n_nodes):
        raise ValueError(f"pairs must name nodes 0 to {n_nodes - 1}, got {checked.min()} to {checked.max()}")
    return checked


@nb.njit(nogil=True, cache=True, error_model="numpy")
def _in_frame(discs, i, j):
    """``c, A, z0, g`` of ellipse j in the frame of ellipse i."""
    dx, dy, dz = discs[j, 0] - discs[i, 0], discs[j, 1] - discs[i, 1], discs[j, 2] - discs[i, 2]
    px, py, pz = discs[i, 3], discs[i, 4], discs[i, 5]
    qx, qy, qz = discs[i, 6], discs[i, 7], discs[i, 8]
    nx, ny, nz = discs[i, 9], discs[i, 10], discs[i, 11]
    ux, uy, uz = discs[j, 3], discs[j, 4], discs[j, 5]
    vx, vy, vz = discs[j, 6], discs[j, 7], discs[j, 8]
    p = 1.0 / (px * px + py * py + pz * pz)
    q = 1.0 / (qx * qx + qy * qy + qz * qz)
    return (
        (dx * px + dy * py + dz * pz) * p,
        (dx * qx + dy * qy + dz * qz) * q,
        (ux * px + uy * py + uz * pz) * p,
        (vx * px + vy * py + vz * pz) * p,
        (ux * qx + uy * qy + uz * qz) * q,
        (vx * qx + vy * qy + vz * qz) * q,
        dx * nx + dy * ny + dz * nz,
        ux * nx + uy * ny + uz * nz,
        vx * nx + vy * ny + vz * nz,
    )


@nb.njit(nogil=True, cache=True, error_model="numpy")
def _meeting(c0, c1, a00, a01, a10, a11, limit):
    """Minimise ``max(|y|², |c + A y|²)``: the minimum, and y.

    The dual is a concave function of one number t in [0, 1],
    ``φ(t) = t (1 - t) Σ_k e_k² / (1 - t + t s_k)`` with s_k the eigenvalues of
    A Aᵀ and e the coordinates of c along its eigenvectors (the contact function
    of Perram and Wertheim in the plane); its maximum is found by Newton's
    method inside a shrinking bracket. Every φ(t) is a lower bound, so the
    search ends with inf at the first one above ``limit``.
    """
    p, q, r = a00 * a00 + a01 * a01, a00 * a10 + a01 * a11, a10 * a10 + a11 * a11
    half = 0.5 * (p - r)
    radius = np.sqrt(half * half + q * q)
    s1 = 0.5 * (p + r) + radius
    # Perpendicular planes have s2 = 0 and the maximum at t = 1, where d2 vanishes with it.
    s2 = max((a00 * a11 - a01 * a10) ** 2 / s1, 1e-24)
    cos, sin = 1.0, 0.0
    if radius > 0.0:
        # Of the two half-angle formulas, the one without cancellation.
        if half >= 0.0:
            cos = np.sqrt(0.5 * (1.0 + half / radius))
            sin = 0.5 * q / (radius * cos)
        else:
            sin = np.sqrt(0.5 * (1.0 - half / radius))
            cos = 0.5 * q / (radius * sin)
    e1, e2 = c0 * cos + c1 * sin, c1 * cos - c0 * sin
    w1, w2 = e1 * e1, e2 * e2
    if w1 + w2 == 0.0:
        return 0.0, 0.0, 0.0
    low, high = 1.0 / (1.0 + np.sqrt(s1)), 1.0 / (1.0 + np.sqrt(s2))
    t = (w1 * low + w2 * high) / (w1 + w2)
    if low < high:
        for _ in range(_NEWTON_STEPS):
            # Reciprocals once: divisions are what this loop's time goes to.
            r1, r2 = 1.0 / (1.0 - t + t * s1), 1.0 / (1.0 - t + t * s2)
            v1, v2 = w1 * r1, w2 * r2
            if t * (1.0 - t) * (v1 + v2) > limit:
                return np.inf, 0.0, 0.0
            here, there = (1.0 - t) * (1.0 - t), t * t
            slope = v1 * r1 * (here - there * s1) + v2 * r2 * (here - there * s2)
            if slope > 0.0:
                low = t
            else:
                high = t
            bend = 2.0 * (v1 * s1 * r1 * r1 + v2 * s2 * r2 * r2)
            new = t + slope / bend if bend > 0.0 else 0.5 * (low + high)
            if not low <= new <= high:
                new = 0.5 * (low + high)
            # The next step would be of the order of this one's square, and the maximum is flat.
            done = abs(new - t) <= 1e-5 * min(t, 1.0 - t)
            t = new
            if done:
                break
    d1, d2 = 1.0 - t + t * s1, 1.0 - t + t * s2
    f1, f2 = e1 / d1, e2 / d2
    x0, x1 = cos * f1 - sin * f2, sin * f1 + cos * f2
    squared = t * (1.0 - t) * (w1 / d1 + w2 / d2)
    return squared, -t * (a00 * x0 + a10 * x1), -t * (a01 * x0 + a11 * x1)


@nb.njit(nogil=True, cache=True, error_model="numpy")
def one_way_touch(discs, i, j, epsilon, limit):
    """Least f at which ellipses i and j, scaled by f, have a normal-wise offset of at most ε in the frame of i.

    Returns inf as soon as f is known to exceed ``limit``.
    """
    c0, c1, a00, a01, a10, a11, z0, g0, g1 = _in_frame(discs, i, j)
    steep = np.sqrt(g0 * g0 + g1 * g1)
    if abs(z0) - epsilon > limit * steep:
        return np.inf
    squared, y0, y1 = _meeting(c0, c1, a00, a01, a10, a11, limit * limit)
    if squared > limit * limit:
        return np.inf
    height = z0 + g0 * y0 + g1 * y1
    if abs(height) <= epsilon:
        return np.sqrt(squared)
    # The optimum without the tolerance is out of it, so by convexity the one with it lies on the edge
    # z0 + g·y = ±ε, a line: minimise max(a1 + s², a2 + 2 b2 s + c2 s²) along it.
    if steep == 0.0:
        return np.inf
    foot = ((epsilon if height > 0.0 else -epsilon) - z0) / (steep * steep)
    y0, y1 = foot * g0, foot * g1
    d0, d1 = -g1 / steep, g0 / steep
    x0, x1 = c0 + a00 * y0 + a01 * y1, c1 + a10 * y0 + a11 * y1
    v0, v1 = a00 * d0 + a01 * d1, a10 * d0 + a11 * d1
    a1, a2 = y0 * y0 + y1 * y1, x0 * x0 + x1 * x1
    b2, c2 = x0 * v0 + x1 * v1, v0 * v0 + v1 * v1
    if a2 <= a1 or c2 == 0.0:
        return np.sqrt(max(a1, a2))
    end = -b2 / c2
    least = a2 + b2 * end
    if a1 + end * end <= least:
        return np.sqrt(max(least, 0.0))
    # The two parabolas cross between 0, where the second is higher, and its lowest point, where the first is.
    a, c = c2 - 1.0, a2 - a1
    root = np.sqrt(max(b2 * b2 - a * c, 0.0))
    s = -c / (b2 - root) if b2 <= 0.0 else -c / (b2 + root)
    return np.sqrt(a1 + s * s)


@nb.njit(nogil=True, cache=True, error_model="numpy")
def two_way_touch(discs, i, j, epsilon, limit):
    """Touch scale of ellipses i and j: the larger of both directions; inf as soon as it is known to exceed ``limit``.

    The same bits for i, j and for j, i.
    """
    first, second = min(i, j), max(i, j)
    f = one_way_touch(discs, first, second, epsilon, limit)
    if f > limit:
        return np.inf
    return max(f, one_way_touch(discs, second, first, epsilon, limit))


@nb.njit(nogil=True, cache=True, error_model="numpy")
def _touch_scales(discs, pairs, epsilon):
    """Touch scale of each pair, (E,)."""
    out = np.empty(len(pairs))
    for e in range(len(pairs)):
        out[e] = two_way_touch(discs, pairs[e, 0], pairs[e, 1], epsilon, np.inf)
    return out


@nb.njit(nogil=True, cache=True, error_model="numpy")
def _reaches_height(height, c0, c1, a00, a01, a10, a11, z0, g0, g1):
    """Whether the part of Ω_j above Ω_i has a point at this height: two intervals of its chord overlap."""
    squared = g0 * g0 + g1 * g1
    foot = (height - z0) / squared
    y0, y1 = foot * g0, foot * g1
    left = 1.0 - y0 * y0 - y1 * y1
    if left < 0.0:
        return False
    steep, half = np.sqrt(squared), np.sqrt(left)
    d0, d1 = -g1 / steep, g0 / steep
    x0, x1 = c0 + a00 * y0 + a01 * y1, c1 + a10 * y0 + a11 * y1
    v0, v1 = a00 * d0 + a01 * d1, a10 * d0 + a11 * d1
    b, c = x0 * v0 + x1 * v1, v0 * v0 + v1 * v1
    inside = b * b - c * (x0 * x0 + x1 * x1 - 1.0)
    if inside < 0.0 or c == 0.0:
        return c == 0.0 and x0 * x0 + x1 * x1 <= 1.0
    root = np.sqrt(inside)
    return (-b - root) / c <= half and (-b + root) / c >= -half


@nb.njit(nogil=True, cache=True, error_model="numpy")
def _one_way_offset(discs, i, j):
    """Least height of ellipse j over ellipse i within the normal column of i; inf where j does not reach into it."""
    c0, c1, a00, a01, a10, a11, z0, g0, g1 = _in_frame(discs, i, j)
    squared, y0, y1 = _meeting(c0, c1, a00, a01, a10, a11, 1.0)
    if squared > 1.0:
        return np.inf
    height = z0 + g0 * y0 + g1 * y1
    if g0 * g0 + g1 * g1 <= 1e-32 * height * height:
        return abs(height)
    if _reaches_height(0.0, c0, c1, a00, a01, a10, a11, z0, g0, g1):
        return 0.0
    low, high = 0.0, height
    for _ in range(60):
        middle = 0.5 * (low + high)
        if _reaches_height(middle, c0, c1, a00, a01, a10, a11, z0, g0, g1):
            high = middle
        else:
            low = middle
    return abs(high)


@nb.njit(nogil=True, cache=True, error_model="numpy")
def _normal_offsets(discs, pairs):
    """Offset of each pair as either end sees it, (E, 2)."""
    out = np.empty((len(pairs), 2))
    for e in range(len(pairs)):
        out[e, 0] = _one_way_offset(discs, pairs[e, 0], pairs[e, 1])
        out[e, 1] = _one_way_offset(discs, pairs[e, 1], pairs[e, 0])
    return out
