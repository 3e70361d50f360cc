"""Inner loops of as-rigid-as-possible deformation, on the CSR rows of one `ArapProblem`.

All sums run over ``w_ij``, the edge weights (``-L_ij``), and rest edges ``e_ij = rest_i - rest_j``.
"""

import math

import numba as nb

from splap_editor.core.arap.rotation_fit import rotation_quaternion, write_rotation


@nb.njit(nogil=True, cache=True, fastmath=True)
def fit_local_rotations(indptr, indices, weights, rest, positions, turn_rows, beta, rotations):
    """Local step, in place: each row's best rotation, given positions and its neighbours' newest rotations.

    Maximises ``trace(R_iᵀ S_i)``, ``S_i = Σ_j w_ij e'_ij e_ijᵀ + β Σ_j w_ij R_j`` (Levi and Gotsman 2015), one
    row after the other, so that the energy never rises.
    """
    for k in range(turn_rows.size):
        i = turn_rows[k]
        s00 = s01 = s02 = s10 = s11 = s12 = s20 = s21 = s22 = 0.0
        p0, p1, p2 = rest[i, 0], rest[i, 1], rest[i, 2]
        q0, q1, q2 = positions[i, 0], positions[i, 1], positions[i, 2]
        for m in range(indptr[i], indptr[i + 1]):
            j = indices[m]
            w = weights[m]
            e0, e1, e2 = w * (p0 - rest[j, 0]), w * (p1 - rest[j, 1]), w * (p2 - rest[j, 2])
            d0, d1, d2 = q0 - positions[j, 0], q1 - positions[j, 1], q2 - positions[j, 2]
            s00 += d0 * e0
            s01 += d0 * e1
            s02 += d0 * e2
            s10 += d1 * e0
            s11 += d1 * e1
            s12 += d1 * e2
            s20 += d2 * e0
            s21 += d2 * e1
            s22 += d2 * e2
        if beta > 0.0:
            for m in range(indptr[i], indptr[i + 1]):
                R = rotations[indices[m]]
                w = beta * weights[m]
                s00 += w * R[0, 0]
                s01 += w * R[0, 1]
                s02 += w * R[0, 2]
                s10 += w * R[1, 0]
                s11 += w * R[1, 1]
                s12 += w * R[1, 2]
                s20 += w * R[2, 0]
                s21 += w * R[2, 1]
                s22 += w * R[2, 2]
        a, b, c, d = rotation_quaternion(s00, s01, s02, s10, s11, s12, s20, s21, s22)
        write_rotation(rotations, i, a, b, c, d)


@nb.njit(nogil=True, cache=True, fastmath=True)
def write_global_rhs(indptr, indices, weights, rest, positions, rotations, free_rows, is_free, rhs):
    """Right-hand side of the global step ``Σ_j w_ij (x_i - x_j) = ½ Σ_j w_ij (R_i + R_j) e_ij``, free x_j kept left."""
    for k in range(free_rows.size):
        i = free_rows[k]
        b0 = b1 = b2 = 0.0
        s0 = s1 = s2 = 0.0
        p0, p1, p2 = rest[i, 0], rest[i, 1], rest[i, 2]
        for m in range(indptr[i], indptr[i + 1]):
            j = indices[m]
            w = weights[m]
            half = 0.5 * w
            e0, e1, e2 = half * (p0 - rest[j, 0]), half * (p1 - rest[j, 1]), half * (p2 - rest[j, 2])
            R = rotations[j]
            s0 += e0
            s1 += e1
            s2 += e2
            b0 += R[0, 0] * e0 + R[0, 1] * e1 + R[0, 2] * e2
            b1 += R[1, 0] * e0 + R[1, 1] * e1 + R[1, 2] * e2
            b2 += R[2, 0] * e0 + R[2, 1] * e1 + R[2, 2] * e2
            if is_free[j] == 0:
                b0 += w * positions[j, 0]
                b1 += w * positions[j, 1]
                b2 += w * positions[j, 2]
        R = rotations[i]
        rhs[k, 0] = b0 + R[0, 0] * s0 + R[0, 1] * s1 + R[0, 2] * s2
        rhs[k, 1] = b1 + R[1, 0] * s0 + R[1, 1] * s1 + R[1, 2] * s2
        rhs[k, 2] = b2 + R[2, 0] * s0 + R[2, 1] * s1 + R[2, 2] * s2


@nb.njit(nogil=True, cache=True, fastmath=True)
def energy_and_torques(indptr, indices, weights, rest, positions, rotations, turn_index, beta, torques):
    """Energy of all rows, and its derivative by a small rotation vector of each turning row.

    ``E = ½ Σ w_ij |x_ij - R_i e_ij|² + ¼ β Σ w_ij |R_i - R_j|²`` over directed edges; ``torques[k]`` is the
    gradient by ω for ``R_i → exp(ω) R_i``, ``k = turn_index[i]``, -1 for a row whose rotation is given.
    """
    energy = 0.0
    bending = 0.0
    for i in range(indptr.size - 1):
        R = rotations[i]
        r00, r01, r02, r10, r11, r12, r20, r21, r22 = (
            R[0, 0], R[0, 1], R[0, 2], R[1, 0], R[1, 1], R[1, 2], R[2, 0], R[2, 1], R[2, 2],
        )  # fmt: skip
        p0, p1, p2 = rest[i, 0], rest[i, 1], rest[i, 2]
        q0, q1, q2 = positions[i, 0], positions[i, 1], positions[i, 2]
        g0 = g1 = g2 = 0.0
        s00 = s01 = s02 = s10 = s11 = s12 = s20 = s21 = s22 = 0.0
        for m in range(indptr[i], indptr[i + 1]):
            j = indices[m]
            w = weights[m]
            e0, e1, e2 = p0 - rest[j, 0], p1 - rest[j, 1], p2 - rest[j, 2]
            t0 = r00 * e0 + r01 * e1 + r02 * e2
            t1 = r10 * e0 + r11 * e1 + r12 * e2
            t2 = r20 * e0 + r21 * e1 + r22 * e2
            x0, x1, x2 = q0 - positions[j, 0], q1 - positions[j, 1], q2 - positions[j, 2]
            d0, d1, d2 = x0 - t0, x1 - t1, x2 - t2
            energy += w * (d0 * d0 + d1 * d1 + d2 * d2)
            g0 += w * (x1 * t2 - x2 * t1)
            g1 += w * (x2 * t0 - x0 * t2)
            g2 += w * (x0 * t1 - x1 * t0)
            if beta > 0.0:
                Q = rotations[j]
                s00 += w * Q[0, 0]
                s01 += w * Q[0, 1]
                s02 += w * Q[0, 2]
                s10 += w * Q[1, 0]
                s11 += w * Q[1, 1]
                s12 += w * Q[1, 2]
                s20 += w * Q[2, 0]
                s21 += w * Q[2, 1]
                s22 += w * Q[2, 2]
                d0, d1, d2 = r00 - Q[0, 0], r10 - Q[1, 0], r20 - Q[2, 0]
                bending += w * (d0 * d0 + d1 * d1 + d2 * d2)
                d0, d1, d2 = r01 - Q[0, 1], r11 - Q[1, 1], r21 - Q[2, 1]
                bending += w * (d0 * d0 + d1 * d1 + d2 * d2)
                d0, d1, d2 = r02 - Q[0, 2], r12 - Q[1, 2], r22 - Q[2, 2]
                bending += w * (d0 * d0 + d1 * d1 + d2 * d2)
        if beta > 0.0:
            # The torque of the second term is the axial part of (β Σ w R_j) R_iᵀ.
            g0 += beta * ((s10 * r20 + s11 * r21 + s12 * r22) - (s20 * r10 + s21 * r11 + s22 * r12))
            g1 += beta * ((s20 * r00 + s21 * r01 + s22 * r02) - (s00 * r20 + s01 * r21 + s02 * r22))
            g2 += beta * ((s00 * r10 + s01 * r11 + s02 * r12) - (s10 * r00 + s11 * r01 + s12 * r02))
        k = turn_index[i]
        if k >= 0:
            torques[k, 0] = g0
            torques[k, 1] = g1
            torques[k, 2] = g2
    return 0.5 * energy + 0.25 * beta * bending


@nb.njit(nogil=True, cache=True, fastmath=True)
def turn(rotations, turn_rows, vectors, step, turned):
    """Write ``exp(step · vectors[k]) rotations[i]`` for each turning row i to ``turned``."""
    for k in range(turn_rows.size):
        i = turn_rows[k]
        v0, v1, v2 = step * vectors[k, 0], step * vectors[k, 1], step * vectors[k, 2]
        square = v0 * v0 + v1 * v1 + v2 * v2
        half = 0.5 * math.sqrt(square)
        w = math.cos(half)
        scale = 0.5 * math.sin(half) / half if half > 1e-9 else 0.5
        x, y, z = scale * v0, scale * v1, scale * v2
        a00, a01, a02 = 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)
        a10, a11, a12 = 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)
        a20, a21, a22 = 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)
        R = rotations[i]
        T = turned[i]
        for c in range(3):
            c0, c1, c2 = R[0, c], R[1, c], R[2, c]
            T[0, c] = a00 * c0 + a01 * c1 + a02 * c2
            T[1, c] = a10 * c0 + a11 * c1 + a12 * c2
            T[2, c] = a20 * c0 + a21 * c1 + a22 * c2


@nb.njit(nogil=True, cache=True, fastmath=True)
def blend_rigid(rows, rest, samples, weights, sample_rest, sample_positions, sample_quats, positions, rotations):
    """Move each row by the weighted mean of its samples' rigid motions, and turn it by their mean quaternion.

    ``rows`` are the nodes to move; ``samples`` and ``weights`` hold their k samples and shares.
    """
    for row in range(rows.size):
        i = rows[row]
        x0 = x1 = x2 = 0.0
        a = b = c = d = 0.0
        first = samples[i, 0]
        f0, f1 = sample_quats[first, 0], sample_quats[first, 1]
        f2, f3 = sample_quats[first, 2], sample_quats[first, 3]
        for m in range(samples.shape[1]):
            share = weights[i, m]
            if share == 0.0:
                continue
            j = samples[i, m]
            w, x, y, z = sample_quats[j, 0], sample_quats[j, 1], sample_quats[j, 2], sample_quats[j, 3]
            e0, e1, e2 = rest[i, 0] - sample_rest[j, 0], rest[i, 1] - sample_rest[j, 1], rest[i, 2] - sample_rest[j, 2]
            t0, t1, t2 = 2 * (y * e2 - z * e1), 2 * (z * e0 - x * e2), 2 * (x * e1 - y * e0)
            x0 += share * (sample_positions[j, 0] + e0 + w * t0 + y * t2 - z * t1)
            x1 += share * (sample_positions[j, 1] + e1 + w * t1 + z * t0 - x * t2)
            x2 += share * (sample_positions[j, 2] + e2 + w * t2 + x * t1 - y * t0)
            if w * f0 + x * f1 + y * f2 + z * f3 < 0.0:
                share = -share
            a += share * w
            b += share * x
            c += share * y
            d += share * z
        positions[i, 0] = x0
        positions[i, 1] = x1
        positions[i, 2] = x2
        length = math.sqrt(a * a + b * b + c * c + d * d)
        if length < 1e-12:
            a, b, c, d, length = f0, f1, f2, f3, 1.0
        write_rotation(rotations, i, a / length, b / length, c / length, d / length)
