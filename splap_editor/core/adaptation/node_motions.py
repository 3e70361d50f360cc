"""How the neighbourhood of each node moves: the affine maps that carry the ellipses."""

import math

import numba as nb
import numpy as np

from splap_editor.core.adaptation.kernel_binding import STRETCH_DAMPING

# Displacements below this share of the scene scale and rotation entries this close to the identity are rounding
# errors of a solver: such a node has not moved.
STILL_SHARE = 1e-12
STILL_ROTATION = 1e-10


@nb.njit(nogil=True, cache=True, error_model="numpy", fastmath={"contract"})
def find_moved(rest, positions, rotations, resting, still, moved):
    """Mark the nodes, but those held at rest, that are displaced by more than ``still`` along an axis, or turned."""
    for i in range(len(positions)):
        moved[i] = not resting[i] and _has_moved(i, rest, positions, rotations, still)


@nb.njit(nogil=True, cache=True, error_model="numpy", fastmath={"contract"})
def find_motions(
    stencils, inverse_moments, dampings, rest, positions, rotations, resting, still, moved, motions, square_shifts
):
    """Affine map x ↦ A x + b of each node's neighbourhood, as the columns of A and then b; how far each went, squared.

    A node that `find_moved` would not mark has the identity, and went nowhere.
    """
    for i in range(len(positions)):
        moved[i] = not resting[i] and _has_moved(i, rest, positions, rotations, still)
        square_shifts[i] = _square_shift(i, rest, positions) if moved[i] else 0.0
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
def find_ring_motions(hops, indptr, indices, rest, positions, rotations, resting, still, moved, motions, square_shifts):
    """Least-squares affine map of each node's ``hops``-ring, as in `find_motions`; moved if any of the ring is."""
    n = len(positions)
    seen = np.full(n, -1, np.int64)
    ring = np.empty(n, np.int64)
    moments, cross = np.empty((3, 3)), np.empty((3, 3))
    for i in range(n):
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
        moved[i] = False
        moments[:] = 0.0
        cross[:] = 0.0
        for k in range(end):
            j = ring[k]
            moved[i] |= not resting[j] and _has_moved(j, rest, positions, rotations, still)
            for a in range(3):
                for b in range(3):
                    edge = rest[j, b] - rest[i, b]
                    moments[a, b] += edge * (rest[j, a] - rest[i, a])
                    cross[a, b] += edge * (positions[j, a] - positions[i, a])
        moved[i] &= not resting[i]
        square_shifts[i] = _square_shift(i, rest, positions) if moved[i] else 0.0
        trace = moments[0, 0] + moments[1, 1] + moments[2, 2]
        # Directions that the ring does not span turn with the node; the share is too small to be felt in the others.
        damping = 1e-6 if trace > 1e-90 else 1.0
        shrink = 1.0 / trace if trace > 1e-90 else 0.0
        for a in range(3):
            motions[i, 9 + a] = positions[i, a]
            for b in range(3):
                moments[a, b] = shrink * moments[a, b] + (damping if a == b else 0.0)
                cross[a, b] = shrink * cross[a, b] + damping * rotations[i, a, b]
        inverse = np.linalg.inv(moments)
        for a in range(3):
            for b in range(3):
                A = cross[a, 0] * inverse[0, b] + cross[a, 1] * inverse[1, b] + cross[a, 2] * inverse[2, b]
                motions[i, 3 * b + a] = A
                motions[i, 9 + a] -= A * rest[i, b]


@nb.njit(inline="always")
def _square_shift(i, rest, positions):
    """How far a node went, squared."""
    x, y, z = positions[i, 0] - rest[i, 0], positions[i, 1] - rest[i, 1], positions[i, 2] - rest[i, 2]
    return x * x + y * y + z * z


@nb.njit(inline="always")
def _has_moved(i, rest, positions, rotations, still):
    """Whether a node has moved farther than ``still``, or turned."""
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
