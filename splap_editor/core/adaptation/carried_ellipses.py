"""Ellipses carried along by the nodes around their rims: the compiled loops of kernel adaptation."""

import math
from typing import NamedTuple

import numba as nb
import numpy as np
from numpy.typing import NDArray

from splap_editor.core.arap.rotation_fit import rotation_quaternion, write_rotation

MIN_SHRINK = 1e-6
"""Least factor an axis may shrink by: a collapsed triangle still gives a splat with a logarithm."""

# Mixed second moment, relative to the mean one, below which an ellipse lies along its axes: far below float32's step.
_CIRCLE = 1e-9

_HALF_ROOT_3 = 0.5 * math.sqrt(3.0)

# Nodes fitted side by side: enough to fill vector registers many times, few enough for the processor's first cache.
_LANES = 128

# Rows of a lane. Of each vector three in a row: rest semi-axes, their images, the centre,
_AXIS_1, _AXIS_2, _IMAGE_1, _IMAGE_2, _CENTER = 0, 3, 6, 9, 12
# and what is fitted: the rotation row by row, semi-axes, their growths, cosine and sine of their turn in the plane.
_ROTATION, _FITTED_1, _FITTED_2, _GROWTH_1, _GROWTH_2, _COSINE, _SINE, _N_ROWS = 15, 24, 27, 30, 31, 32, 33, 34


class KernelArrays(NamedTuple):
    """What the compiled loops write.

    In carried order, that of `KernelBinding.order`, so that all but the drawn arrays are written in one sweep.

    Parameters
    ----------
    means : (N, 3) float64
        Deformed centres.
    rotations : (N, 3, 3) float64
        Polar factors, rest → deformed.
    growths, twists : (N, 2) float64
        Growth of the in-plane axes; cosine and sine of their turn within the plane.
    changed : (N,) bool
        Whether anything that carries the splat has moved.
    means_f32 : (N, 3) float32
        Centres to draw, in file order.
    axes_f32 : (N, 2, 3) float32
        In-plane axes to draw, in file order.
    """

    means: NDArray[np.float64]
    rotations: NDArray[np.float64]
    growths: NDArray[np.float64]
    twists: NDArray[np.float64]
    changed: NDArray[np.bool_]
    means_f32: NDArray[np.float32]
    axes_f32: NDArray[np.float32]


@nb.njit(nogil=True, cache=True, error_model="numpy", fastmath={"contract"})
def write_kernels(carriers, weights, motions, square_shifts, moved, resting, rotations, rest, out):
    """Move the corners of each inscribed triangle with their carriers and write the Steiner circumellipses.

    In groups of nodes: their triangles are carried one by one, the ellipses are found side by side by vector
    instructions, and the results are put in place one by one.
    """
    # Unpacked once: each access to an array of a tuple counts a reference.
    rest_means, rest_axes_f32, order, ellipses = rest
    means, turns, growths, twists, changed, means_f32, axes_f32 = out
    n = len(carriers)
    lanes = np.zeros(_N_ROWS * _LANES)
    for lo in range(0, n, _LANES):
        count = min(_LANES, n - lo)
        # Rows lie all over the file. Reading the places to be written lets the processor fetch them side by side.
        fetched = np.float32(0.0)
        for i in range(lo, lo + count):
            fetched += means_f32[order[i], 0] + axes_f32[order[i], 0, 0] + axes_f32[order[i], 1, 2]
        lanes[_AXIS_1] = fetched
        for lane in range(count):
            i = lo + lane
            any_moved = False
            for c in range(3):
                any_moved |= moved[carriers[i, 3 * c]]
                any_moved |= weights[i, 2 * c] < 1.0 and (
                    moved[carriers[i, 3 * c + 1]] or moved[carriers[i, 3 * c + 2]]
                )
            any_moved &= not resting[i]
            changed[i] = any_moved
            if any_moved:
                _carry_triangle(i, lane, carriers, weights, motions, square_shifts, rotations, ellipses, lanes)
        _fit_ellipses(count, lanes)
        for lane in range(count):
            i = lo + lane
            row = order[i]
            if not changed[i]:
                _write_rest(
                    i, row, rest_means, rest_axes_f32, means, turns, growths, twists, changed, means_f32, axes_f32
                )
                continue
            per_cutoff = ellipses[i, 11]
            for a in range(3):
                means[i, a] = means_f32[row, a] = lanes[(_CENTER + a) * _LANES + lane]
                axes_f32[row, 0, a] = per_cutoff * lanes[(_FITTED_1 + a) * _LANES + lane]
                axes_f32[row, 1, a] = per_cutoff * lanes[(_FITTED_2 + a) * _LANES + lane]
                for b in range(3):
                    turns[i, a, b] = lanes[(_ROTATION + 3 * a + b) * _LANES + lane]
            growths[i, 0], growths[i, 1] = lanes[_GROWTH_1 * _LANES + lane], lanes[_GROWTH_2 * _LANES + lane]
            twists[i, 0], twists[i, 1] = lanes[_COSINE * _LANES + lane], lanes[_SINE * _LANES + lane]


@nb.njit(inline="always")
def _carry_triangle(i, lane, carriers, weights, motions, square_shifts, rotations, ellipses, lanes):
    """Fill a lane with both rest semi-axes, their images under the triangle's affine map, and its centre."""
    mx = my = mz = ax = ay = az = bx = by = bz = 0.0
    for c in range(3):
        # Corner c of the triangle is the centre + along v1 + across v2.
        along = 1.0 if c == 0 else -0.5
        across = 0.0 if c == 0 else (_HALF_ROOT_3 if c == 1 else -_HALF_ROOT_3)
        px = ellipses[i, 0] + along * ellipses[i, 3] + across * ellipses[i, 6]
        py = ellipses[i, 1] + along * ellipses[i, 4] + across * ellipses[i, 7]
        pz = ellipses[i, 2] + along * ellipses[i, 5] + across * ellipses[i, 8]
        x = y = z = 0.0
        w0, w1 = np.float64(weights[i, 2 * c]), np.float64(weights[i, 2 * c + 1])
        for k in range(3):
            j = carriers[i, 3 * c + k]
            w = w0 if k == 0 else (w1 if k == 1 else 1.0 - w0 - w1)
            x += w * (motions[j, 0] * px + motions[j, 3] * py + motions[j, 6] * pz + motions[j, 9])
            y += w * (motions[j, 1] * px + motions[j, 4] * py + motions[j, 7] * pz + motions[j, 10])
            z += w * (motions[j, 2] * px + motions[j, 5] * py + motions[j, 8] * pz + motions[j, 11])
        mx, my, mz = mx + x, my + y, mz + z
        ax, ay, az = ax + along * x, ay + along * y, az + along * z
        bx, by, bz = bx + across * x, by + across * y, bz + across * z
    third = 1.0 / 3.0
    mx, my, mz = third * mx, third * my, third * mz
    # Beside a handle's rim the maps of its nodes and of those that stay differ so much that a corner may overshoot.
    x, y, z = mx - ellipses[i, 0], my - ellipses[i, 1], mz - ellipses[i, 2]
    square, farthest = x * x + y * y + z * z, square_shifts[i]
    if square > farthest * (1.0 + 1e-9):
        for c in range(9):
            farthest = max(farthest, square_shifts[carriers[i, c]])
        if square > farthest:
            share = math.sqrt(farthest / square)
            mx, my, mz = ellipses[i, 0] + share * x, ellipses[i, 1] + share * y, ellipses[i, 2] + share * z
    ax, ay, az = 2.0 * third * ax, 2.0 * third * ay, 2.0 * third * az
    bx, by, bz = 2.0 * third * bx, 2.0 * third * by, 2.0 * third * bz
    for a in range(3):
        lanes[(_AXIS_1 + a) * _LANES + lane] = ellipses[i, 3 + a]
        lanes[(_AXIS_2 + a) * _LANES + lane] = ellipses[i, 6 + a]
    _put(lanes, _IMAGE_1, lane, (ax, ay, az))
    _put(lanes, _IMAGE_2, lane, (bx, by, bz))
    _put(lanes, _CENTER, lane, (mx, my, mz))
    # Growths along the semi-axes, and that of the area between them: all squared.
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    grow1 = ellipses[i, 9] ** 2 * (ax * ax + ay * ay + az * az)
    grow2 = ellipses[i, 10] ** 2 * (bx * bx + by * by + bz * bz)
    area = ellipses[i, 9] ** 2 * ellipses[i, 10] ** 2 * (nx * nx + ny * ny + nz * nz)
    if area > MIN_SHRINK**2 * (grow1 + grow2) ** 2 and area > MIN_SHRINK**4:
        return
    # Collapsed: there is no plane to be read off, the axes take the node's own rotation and keep their growths.
    grow1, grow2 = max(math.sqrt(grow1), MIN_SHRINK), max(math.sqrt(grow2), MIN_SHRINK)
    for a in range(3):
        turned1 = turned2 = 0.0
        for b in range(3):
            turned1 += rotations[i, a, b] * ellipses[i, 3 + b]
            turned2 += rotations[i, a, b] * ellipses[i, 6 + b]
        lanes[(_IMAGE_1 + a) * _LANES + lane], lanes[(_IMAGE_2 + a) * _LANES + lane] = grow1 * turned1, grow2 * turned2


@nb.njit(nogil=True, cache=True, error_model="numpy", fastmath={"contract"})
def _fit_ellipses(count, lanes):
    """Split each lane's map of the rest plane into a stretch within the plane and a rotation.

    The rows from ``_ROTATION`` on receive the rotation, the semi-axes of the stretched ellipse, their growths, and the
    cosine and sine of their turn from the rest axes they are within 45° of. Free of branches, and all in one array with
    rows a known distance apart, so that the loop becomes vector instructions.
    """
    for lane in range(count):
        v1 = _held(lanes, _AXIS_1, lane)
        v2 = _held(lanes, _AXIS_2, lane)
        length1, length2 = math.sqrt(_dot(v1, v1)), math.sqrt(_dot(v2, v2))
        per1, per2 = 1.0 / length1, 1.0 / length2
        e1, e2 = _times(per1, v1), _times(per2, v2)
        e3 = _cross(e1, e2)
        g1 = _times(per1, _held(lanes, _IMAGE_1, lane))
        g2 = _times(per2, _held(lanes, _IMAGE_2, lane))
        # Polar decomposition of a 3 × 2 matrix: the rotation is the matrix plus its cofactor, to unit length.
        normal = _cross(g1, g2)
        area = math.sqrt(_dot(normal, normal))
        q3 = _times(1.0 / area, normal)
        gram11, gram12, gram22 = _dot(g1, g1), _dot(g1, g2), _dot(g2, g2)
        s = 1.0 / math.sqrt(gram11 + gram22 + 2.0 * area)
        q1, q2 = _times(s, _plus(g1, _cross(g2, q3))), _times(s, _plus(g2, _cross(q3, g1)))
        # Second moments, in the frame (q1, q2), of the rest ellipse stretched by the symmetric other factor.
        h11, h12, h21, h22 = (
            s * (gram11 + area) * length1,
            s * gram12 * length2,
            s * gram12 * length1,
            s * (gram22 + area) * length2,
        )
        b11, b12, b22 = h11 * h11 + h12 * h12, h11 * h21 + h12 * h22, h21 * h21 + h22 * h22
        middle, half = 0.5 * (b11 + b22), 0.5 * (b11 - b22)
        # On the axes already; of a circle, whose axes are anywhere, this keeps those of the rest frame.
        straight = abs(b12) <= _CIRCLE * middle
        spread = math.sqrt(half * half + b12 * b12) + (1.0 if straight else 0.0)
        cosine = math.sqrt(0.5 + 0.5 * abs(half) / spread)
        large = math.sqrt(middle + spread)
        # From the determinant, since the difference of middle and spread would lose a needle's width.
        small = (h11 * h22 - h12 * h21) / large
        sine = 0.5 * b12 / (cosine * spread)
        sine = 0.0 if straight else (sine if half >= 0.0 else -sine)
        cosine = 1.0 if straight else cosine
        root1, root2 = math.sqrt(b11), math.sqrt(b22)
        half1 = root1 if straight else (large if half >= 0.0 else small)
        half2 = root2 if straight else (small if half >= 0.0 else large)
        growth1, growth2 = per1 * half1, per2 * half2
        growth1 = growth1 if growth1 > MIN_SHRINK else MIN_SHRINK
        growth2 = growth2 if growth2 > MIN_SHRINK else MIN_SHRINK
        axis1 = _times(growth1 * length1, _plus(_times(cosine, q1), _times(sine, q2)))
        axis2 = _times(growth2 * length2, _plus(_times(cosine, q2), _times(-sine, q1)))
        _put(lanes, _ROTATION, lane, _plus(_plus(_times(q1[0], e1), _times(q2[0], e2)), _times(q3[0], e3)))
        _put(lanes, _ROTATION + 3, lane, _plus(_plus(_times(q1[1], e1), _times(q2[1], e2)), _times(q3[1], e3)))
        _put(lanes, _ROTATION + 6, lane, _plus(_plus(_times(q1[2], e1), _times(q2[2], e2)), _times(q3[2], e3)))
        _put(lanes, _FITTED_1, lane, axis1)
        _put(lanes, _FITTED_2, lane, axis2)
        lanes[_GROWTH_1 * _LANES + lane], lanes[_GROWTH_2 * _LANES + lane] = growth1, growth2
        lanes[_COSINE * _LANES + lane], lanes[_SINE * _LANES + lane] = cosine, sine


@nb.njit(nogil=True, cache=True, error_model="numpy", fastmath={"contract"})
def adapt_inert(carriers, weights, rest, positions, rotations, moved, out):
    """Move and turn the splats outside the graph with the blended rigid motion of their carriers."""
    rest_means, rest_axes_f32, order, _ = rest
    means, turns, growths, twists, changed, means_f32, axes_f32 = out
    blend = np.empty((3, 3))
    for r in range(len(carriers)):
        i = len(positions) + r
        row = order[i]
        _write_rest(i, row, rest_means, rest_axes_f32, means, turns, growths, twists, changed, means_f32, axes_f32)
        for k in range(carriers.shape[1]):
            changed[i] |= weights[r, k] > 0.0 and moved[carriers[r, k]]
        if not changed[i]:
            continue
        blend[:] = 0.0
        for a in range(3):
            means[i, a] = 0.0
            for k in range(carriers.shape[1]):
                j, w = carriers[r, k], weights[r, k]
                value = positions[j, a]
                for b in range(3):
                    value += rotations[j, a, b] * (rest_means[i, b] - rest_means[j, b])
                    blend[a, b] += w * rotations[j, a, b]
                means[i, a] += w * value
            means_f32[row, a] = means[i, a]
        B = blend
        w, x, y, z = rotation_quaternion(
            B[0, 0], B[0, 1], B[0, 2], B[1, 0], B[1, 1], B[1, 2], B[2, 0], B[2, 1], B[2, 2]
        )
        write_rotation(turns, i, w, x, y, z)
        for axis in range(2):
            u = (rest_axes_f32[i, axis, 0], rest_axes_f32[i, axis, 1], rest_axes_f32[i, axis, 2])
            axes_f32[row, axis, 0], axes_f32[row, axis, 1], axes_f32[row, axis, 2] = _turned(turns, i, u)


@nb.njit(inline="always")
def _write_rest(i, row, rest_means, rest_axes_f32, means, turns, growths, twists, changed, means_f32, axes_f32):
    """Put a splat that nothing has moved at rest."""
    for a in range(3):
        means[i, a] = means_f32[row, a] = rest_means[i, a]
        axes_f32[row, 0, a] = rest_axes_f32[i, 0, a]
        axes_f32[row, 1, a] = rest_axes_f32[i, 1, a]
        for b in range(3):
            turns[i, a, b] = 1.0 if a == b else 0.0
    growths[i, 0] = growths[i, 1] = 1.0
    twists[i, 0], twists[i, 1] = 1.0, 0.0
    changed[i] = False


@nb.njit(inline="always")
def _held(lanes, row, lane):
    """Vector that begins in a row of a lane."""
    return lanes[row * _LANES + lane], lanes[(row + 1) * _LANES + lane], lanes[(row + 2) * _LANES + lane]


@nb.njit(inline="always")
def _put(lanes, row, lane, vector):
    """Write a vector from a row of a lane on."""
    lanes[row * _LANES + lane] = vector[0]
    lanes[(row + 1) * _LANES + lane] = vector[1]
    lanes[(row + 2) * _LANES + lane] = vector[2]


@nb.njit(inline="always")
def _dot(a, b):
    """Dot product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@nb.njit(inline="always")
def _cross(a, b):
    """Cross product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@nb.njit(inline="always")
def _plus(a, b):
    """Sum."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@nb.njit(inline="always")
def _times(s, a):
    """Vector times a number."""
    return s * a[0], s * a[1], s * a[2]


@nb.njit(inline="always")
def _turned(rotations, i, a):
    """Vector turned by the rotation of row i."""
    return (
        rotations[i, 0, 0] * a[0] + rotations[i, 0, 1] * a[1] + rotations[i, 0, 2] * a[2],
        rotations[i, 1, 0] * a[0] + rotations[i, 1, 1] * a[1] + rotations[i, 1, 2] * a[2],
        rotations[i, 2, 0] * a[0] + rotations[i, 2, 1] * a[1] + rotations[i, 2, 2] * a[2],
    )
