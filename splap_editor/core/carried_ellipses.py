"""Compiled loops of kernel adaptation: how neighbourhoods move, and the ellipses they carry."""

import math
from typing import NamedTuple

import numba as nb
import numpy as np
from numpy.typing import NDArray

from splap_editor.core.kernel_binding import STRETCH_DAMPING
from splap_editor.core.rotation_fit import rotation_quaternion, write_rotation

MIN_SHRINK = 1e-6
"""Least factor an axis may shrink by: a collapsed triangle still gives a splat with a logarithm."""

# Displacements below this share of the scene scale and rotation entries this close to the identity are rounding
# errors of a solver: such a node has not moved.
STILL_SHARE = 1e-12
STILL_ROTATION = 1e-10

# Mixed second moment, relative to the mean one, below which an ellipse lies along its axes: far below float32's step.
_CIRCLE = 1e-9

_HALF_ROOT_3 = 0.5 * math.sqrt(3.0)


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
def find_moved(rest, positions, rotations, still, moved):
    """Mark the nodes that are displaced by more than ``still`` along an axis, or turned."""
    for i in range(len(positions)):
        moved[i] = _has_moved(i, rest, positions, rotations, still)


@nb.njit(nogil=True, cache=True, error_model="numpy", fastmath={"contract"})
def find_motions(stencils, inverse_moments, dampings, rest, positions, rotations, still, moved, motions):
    """Affine map x ↦ A x + b of each node's neighbourhood, as the columns of A and then b.

    A node that `find_moved` would not mark has the identity.
    """
    for i in range(len(positions)):
        moved[i] = _has_moved(i, rest, positions, rotations, still)
        if not moved[i]:
            for k in range(12):
                motions[i, k] = 1.0 if k == 0 or k == 4 or k == 8 else 0.0
            continue
        px, py, pz = rest[i, 0], rest[i, 1], rest[i, 2]
        qx, qy, qz = positions[i, 0], positions[i, 1], positions[i, 2]
        damping = dampings[i]
        if damping == 0.0:
            for k in range(9):
                motions[i, k] = rotations[i, k % 3, k // 3]
        else:
            xx = xy = xz = yx = yy = yz = zx = zy = zz = square = 0.0
            for k in range(stencils.shape[1]):
                j = stencils[i, k]
                ex, ey, ez = rest[j, 0] - px, rest[j, 1] - py, rest[j, 2] - pz
                fx, fy, fz = positions[j, 0] - qx, positions[j, 1] - qy, positions[j, 2] - qz
                xx += fx * ex
                xy += fx * ey
                xz += fx * ez
                yx += fy * ex
                yy += fy * ey
                yz += fy * ez
                zx += fz * ex
                zy += fz * ey
                zz += fz * ez
                square += fx * fx + fy * fy + fz * fz
            # The damping is a known share of the summed squares at rest; its target is the rotation times the growth.
            pull = damping * math.sqrt(square * STRETCH_DAMPING / damping)
            xx, xy, xz = xx + pull * rotations[i, 0, 0], xy + pull * rotations[i, 0, 1], xz + pull * rotations[i, 0, 2]
            yx, yy, yz = yx + pull * rotations[i, 1, 0], yy + pull * rotations[i, 1, 1], yz + pull * rotations[i, 1, 2]
            zx, zy, zz = zx + pull * rotations[i, 2, 0], zy + pull * rotations[i, 2, 1], zz + pull * rotations[i, 2, 2]
            ixx, ixy, ixz = inverse_moments[i, 0], inverse_moments[i, 1], inverse_moments[i, 2]
            iyy, iyz, izz = inverse_moments[i, 3], inverse_moments[i, 4], inverse_moments[i, 5]
            motions[i, 0] = xx * ixx + xy * ixy + xz * ixz
            motions[i, 1] = yx * ixx + yy * ixy + yz * ixz
            motions[i, 2] = zx * ixx + zy * ixy + zz * ixz
            motions[i, 3] = xx * ixy + xy * iyy + xz * iyz
            motions[i, 4] = yx * ixy + yy * iyy + yz * iyz
            motions[i, 5] = zx * ixy + zy * iyy + zz * iyz
            motions[i, 6] = xx * ixz + xy * iyz + xz * izz
            motions[i, 7] = yx * ixz + yy * iyz + yz * izz
            motions[i, 8] = zx * ixz + zy * iyz + zz * izz
        for a in range(3):
            motions[i, 9 + a] = positions[i, a] - (motions[i, a] * px + motions[i, 3 + a] * py + motions[i, 6 + a] * pz)


@nb.njit(nogil=True, cache=True, error_model="numpy", fastmath={"contract"})
def carry_triangles(carriers, weights, centers, semi_axes, motions, moved, lo, hi, carried, images):
    """Move the corners of the inscribed triangles of nodes lo to hi - 1 with their carriers.

    Row i - lo of ``images`` becomes centre, major and minor conjugate half-diameter of the moved triangle's Steiner
    circumellipse; ``carried`` tells whether any carrier has moved.
    """
    blend = np.empty(12)
    for i in range(lo, hi):
        any_moved = False
        for k in range(9):
            any_moved |= weights[i, k] > 0.0 and moved[carriers[i, k]]
        carried[i - lo] = any_moved
        if not any_moved:
            continue
        mx = my = mz = ax = ay = az = bx = by = bz = 0.0
        for c in range(3):
            # Corner c of the triangle is the centre + along v1 + across v2.
            along = 1.0 if c == 0 else -0.5
            across = 0.0 if c == 0 else (_HALF_ROOT_3 if c == 1 else -_HALF_ROOT_3)
            px = centers[i, 0] + along * semi_axes[i, 0, 0] + across * semi_axes[i, 1, 0]
            py = centers[i, 1] + along * semi_axes[i, 0, 1] + across * semi_axes[i, 1, 1]
            pz = centers[i, 2] + along * semi_axes[i, 0, 2] + across * semi_axes[i, 1, 2]
            k = 3 * c
            j0, j1, j2 = carriers[i, k], carriers[i, k + 1], carriers[i, k + 2]
            w0, w1, w2 = weights[i, k], weights[i, k + 1], weights[i, k + 2]
            for k in range(12):
                blend[k] = w0 * motions[j0, k] + w1 * motions[j1, k] + w2 * motions[j2, k]
            x = blend[0] * px + blend[3] * py + blend[6] * pz + blend[9]
            y = blend[1] * px + blend[4] * py + blend[7] * pz + blend[10]
            z = blend[2] * px + blend[5] * py + blend[8] * pz + blend[11]
            # The affine map from the reference triangle to the moved one, applied to its centre, v1 and v2.
            third = 1.0 / 3.0
            mx, my, mz = mx + third * x, my + third * y, mz + third * z
            third *= 2.0 * along
            ax, ay, az = ax + third * x, ay + third * y, az + third * z
            third = 2.0 / 3.0 * across
            bx, by, bz = bx + third * x, by + third * y, bz + third * z
        k = i - lo
        images[k, 0], images[k, 1], images[k, 2] = mx, my, mz
        images[k, 3], images[k, 4], images[k, 5] = ax, ay, az
        images[k, 6], images[k, 7], images[k, 8] = bx, by, bz


@nb.njit(nogil=True, cache=True, error_model="numpy", fastmath={"contract"})
def map_rings(hops, indptr, indices, centers, semi_axes, positions, rotations, moved, lo, hi, carried, images):
    """Map ellipses by the least-squares affine map of their node's ``hops``-ring; rows as in `carry_triangles`."""
    seen = np.full(len(positions), -1, np.int64)
    ring = np.empty(len(positions), np.int64)
    moments, cross = np.empty((3, 3)), np.empty((3, 3))
    for i in range(lo, hi):
        seen[i], ring[0] = i, i
        first, end = 0, 1
        for _ in range(hops):
            last = end
            for k in range(first, last):
                for e in range(indptr[ring[k]], indptr[ring[k] + 1]):
                    j = indices[e]
                    if seen[j] != i:
                        seen[j], ring[end] = i, j
                        end += 1
            first = last
        any_moved = False
        moments[:] = 0.0
        cross[:] = 0.0
        for k in range(end):
            j = ring[k]
            any_moved |= moved[j]
            for a in range(3):
                for b in range(3):
                    edge = centers[j, b] - centers[i, b]
                    moments[a, b] += edge * (centers[j, a] - centers[i, a])
                    cross[a, b] += edge * (positions[j, a] - positions[i, a])
        carried[i - lo] = any_moved
        if not any_moved:
            continue
        trace = moments[0, 0] + moments[1, 1] + moments[2, 2]
        # Directions that the ring does not span turn with the node; the share is too small to be felt in the others.
        damping = 1e-6 if trace > 1e-90 else 1.0
        shrink = 1.0 / trace if trace > 1e-90 else 0.0
        for a in range(3):
            for b in range(3):
                moments[a, b] = shrink * moments[a, b] + (damping if a == b else 0.0)
                cross[a, b] = shrink * cross[a, b] + damping * rotations[i, a, b]
        inverse = np.linalg.inv(moments)
        for a in range(3):
            images[i - lo, a] = positions[i, a]
            images[i - lo, 3 + a] = images[i - lo, 6 + a] = 0.0
            for b in range(3):
                A = cross[a, 0] * inverse[0, b] + cross[a, 1] * inverse[1, b] + cross[a, 2] * inverse[2, b]
                images[i - lo, 3 + a] += A * semi_axes[i, 0, b]
                images[i - lo, 6 + a] += A * semi_axes[i, 1, b]


@nb.njit(nogil=True, cache=True, error_model="numpy", fastmath={"contract"})
def write_kernels(lo, hi, carried, images, rest, rotations, out):
    """Write the kernels of nodes lo to hi - 1 from the conjugate half-diameters of their moved ellipses.

    The map of the rest plane is split into a stretch within the plane and a rotation. The principal axes of the
    stretched ellipse are named after the rest axes they are within 45° of.
    """
    # Unpacked once: each access to an array of a tuple counts a reference.
    rest_means, rest_axes_f32, order, semi_axes, lengths, cutoffs = rest
    means, turns, growths, twists, changed, means_f32, axes_f32 = out
    for i in range(lo, hi):
        row = order[i]
        if not carried[i - lo]:
            _write_rest(i, row, rest_means, rest_axes_f32, means, turns, growths, twists, changed, means_f32, axes_f32)
            continue
        length1, length2 = lengths[i, 0], lengths[i, 1]
        per1, per2 = 1.0 / length1, 1.0 / length2
        e1 = _times(per1, (semi_axes[i, 0, 0], semi_axes[i, 0, 1], semi_axes[i, 0, 2]))
        e2 = _times(per2, (semi_axes[i, 1, 0], semi_axes[i, 1, 1], semi_axes[i, 1, 2]))
        e3 = _cross(e1, e2)
        g1 = _times(per1, (images[i - lo, 3], images[i - lo, 4], images[i - lo, 5]))
        g2 = _times(per2, (images[i - lo, 6], images[i - lo, 7], images[i - lo, 8]))
        normal = _cross(g1, g2)
        area = math.sqrt(_dot(normal, normal))
        gram11, gram12, gram22 = _dot(g1, g1), _dot(g1, g2), _dot(g2, g2)
        if area > MIN_SHRINK * (gram11 + gram22) and area > MIN_SHRINK * MIN_SHRINK:
            # Polar decomposition of a 3 × 2 matrix: the rotation is the matrix plus its cofactor, to unit length.
            q3 = _times(1.0 / area, normal)
            s = 1.0 / math.sqrt(gram11 + gram22 + 2.0 * area)
            q1, q2 = _times(s, _plus(g1, _cross(g2, q3))), _times(s, _plus(g2, _cross(q3, g1)))
            h11, h12, h21, h22 = s * (gram11 + area), s * gram12, s * gram12, s * (gram22 + area)
        else:
            # Collapsed: there is no plane to be read off, the node's own takes its place.
            q1, q2 = _turned(rotations, i, e1), _turned(rotations, i, e2)
            q3 = _cross(q1, q2)
            h11, h12, h21, h22 = _dot(q1, g1), _dot(q1, g2), _dot(q2, g1), _dot(q2, g2)
        # The map in the plane applied to the rest ellipse: second moments of the new one in the frame (q1, q2).
        h11, h12, h21, h22 = h11 * length1, h12 * length2, h21 * length1, h22 * length2
        length11, length22, cosine, sine = _principal_lengths(
            h11 * h11 + h12 * h12, h11 * h21 + h12 * h22, h21 * h21 + h22 * h22, h11 * h22 - h12 * h21
        )
        growth1, growth2 = max(per1 * length11, MIN_SHRINK), max(per2 * length22, MIN_SHRINK)
        per_sigma = 1.0 / cutoffs[i]
        sigma1, sigma2 = per_sigma * growth1 * length1, per_sigma * growth2 * length2
        for a in range(3):
            means[i, a] = means_f32[row, a] = images[i - lo, a]
            axes_f32[row, 0, a] = sigma1 * (cosine * q1[a] + sine * q2[a])
            axes_f32[row, 1, a] = sigma2 * (cosine * q2[a] - sine * q1[a])
            for b in range(3):
                turns[i, a, b] = q1[a] * e1[b] + q2[a] * e2[b] + q3[a] * e3[b]
        growths[i, 0], growths[i, 1] = growth1, growth2
        twists[i, 0], twists[i, 1] = cosine, sine
        changed[i] = True


@nb.njit(nogil=True, cache=True, error_model="numpy", fastmath={"contract"})
def adapt_inert(carriers, weights, rest, positions, rotations, moved, out):
    """Move and turn the splats outside the graph with the blended rigid motion of their carriers."""
    rest_means, rest_axes_f32, order, _, _, _ = rest
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


@nb.njit(nogil=True, cache=True, error_model="numpy", fastmath={"contract"})
def _principal_lengths(b11, b12, b22, root_determinant):
    """Half-lengths along the axes nearest to the first and second, with cosine and sine of their turn (within 45°)."""
    middle, half = 0.5 * (b11 + b22), 0.5 * (b11 - b22)
    if abs(b12) <= _CIRCLE * middle:
        # On the axes already; of a circle, whose axes are anywhere, this keeps those of the rest frame.
        return math.sqrt(b11), math.sqrt(b22), 1.0, 0.0
    spread = math.sqrt(half * half + b12 * b12)
    cosine = math.sqrt(0.5 + 0.5 * abs(half) / spread)
    large = math.sqrt(middle + spread)
    # From the determinant, since the difference of middle and spread would lose a needle's width.
    small = abs(root_determinant) / large
    sine = 0.5 * b12 / (cosine * spread)
    if half >= 0.0:
        return large, small, cosine, sine
    return small, large, cosine, -sine


@nb.njit(inline="always")
def _has_moved(i, rest, positions, rotations, still):
    displaced = max(
        abs(positions[i, 0] - rest[i, 0]), abs(positions[i, 1] - rest[i, 1]), abs(positions[i, 2] - rest[i, 2])
    )
    # A rotation differs from the identity in its skew part, or is a half turn with a smaller trace.
    skew = max(
        abs(rotations[i, 1, 0] - rotations[i, 0, 1]),
        abs(rotations[i, 2, 0] - rotations[i, 0, 2]),
        abs(rotations[i, 2, 1] - rotations[i, 1, 2]),
    )
    trace = rotations[i, 0, 0] + rotations[i, 1, 1] + rotations[i, 2, 2]
    return displaced > still or skew > STILL_ROTATION or trace < 2.0


@nb.njit(inline="always")
def _write_rest(i, row, rest_means, rest_axes_f32, means, turns, growths, twists, changed, means_f32, axes_f32):
    for a in range(3):
        means[i, a] = means_f32[row, a] = rest_means[i, a]
        axes_f32[row, 0, a] = rest_axes_f32[i, 0, a]
        axes_f32[row, 1, a] = rest_axes_f32[i, 1, a]
        for b in range(3):
            turns[i, a, b] = 1.0 if a == b else 0.0
    growths[i, 0] = growths[i, 1] = 1.0
    twists[i, 0], twists[i, 1] = 1.0, 0.0
    changed[i] = False


@nb.njit
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@nb.njit
def _cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@nb.njit
def _plus(a, b):
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@nb.njit
def _times(s, a):
    return s * a[0], s * a[1], s * a[2]


@nb.njit
def _turned(rotations, i, a):
    return (
        rotations[i, 0, 0] * a[0] + rotations[i, 0, 1] * a[1] + rotations[i, 0, 2] * a[2],
        rotations[i, 1, 0] * a[0] + rotations[i, 1, 1] * a[1] + rotations[i, 1, 2] * a[2],
        rotations[i, 2, 0] * a[0] + rotations[i, 2, 1] * a[1] + rotations[i, 2, 2] * a[2],
    )
