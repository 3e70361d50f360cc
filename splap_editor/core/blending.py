"""Mixing the transforms of several handles at every node."""

import numba as nb
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from splap_editor.core.rotations import matrices_to_quats


def blended_linear(
    rest: NDArray[np.float64], weights: sp.csr_array, transforms: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Move every node by the weighted mean of the handles' affine maps.

    ``p' = Σ w_h T_h p + (1 - Σ w_h) p``, written as a displacement so that identity transforms give ``p`` back bit
    for bit.

    Parameters
    ----------
    rest : (n, 3) float64
        Rest positions in world units.
    weights : (n, H) sparse float64
        Weights ≥ 0 with row sums ≤ 1; the complement rests.
    transforms : (H, 4, 4) float64
        World transform of each handle, affine.

    Returns
    -------
    positions : (n, 3) float64
    rotations : (n, 3, 3) float64
        Rotation nearest to the mean linear map. Where that map has collapsed or turned inside out, as at a joint
        twisted by half a turn, the rotation of `blended_dual_quaternion` stands in for it.
    """
    A = transforms[:, :3, :3] - np.eye(3)
    quats, _, _ = _rigid_and_stretch(transforms)
    return _linear(
        np.ascontiguousarray(rest), *_rows(weights), np.ascontiguousarray(A), transforms[:, :3, 3].copy(), quats
    )


def blended_dual_quaternion(
    rest: NDArray[np.float64],
    weights: sp.csr_array,
    transforms: NDArray[np.float64],
    centers: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Move every node by the weighted mean screw motion of the handles.

    Dual-quaternion linear blending [1]_: the mean of rigid motions is rigid, so a twisted tube keeps its girth. Each
    affine transform is split as ``T_h = rigid_h ∘ stretch_h`` with a symmetric stretch about the handle's centre (the
    polar decomposition); the stretches are averaged linearly and applied first.

    Parameters
    ----------
    rest : (n, 3) float64
        Rest positions in world units.
    weights : (n, H) sparse float64
        Weights ≥ 0 with row sums ≤ 1; the complement rests.
    transforms : (H, 4, 4) float64
        World transform of each handle, affine.
    centers : (H, 3) float64
        Fixed point of each handle's stretch at rest.

    Returns
    -------
    positions : (n, 3) float64
    rotations : (n, 3, 3) float64
        Rotation of the mean motion. Of two motions more than half a turn apart the shorter way between them is taken.

    References
    ----------
    .. [1] Kavan, Collins, Žára and O'Sullivan, "Geometric Skinning with Approximate Dual Quaternion Blending",
       ACM TOG 27(4), 2008, Alg. 1 and Sec. 4.2 (the two-phase treatment of scale).
    """
    quats, rotations, stretches = _rigid_and_stretch(transforms)
    A, t = transforms[:, :3, :3], transforms[:, :3, 3]
    t = t + np.einsum("hij,hj->hi", A - rotations, centers)
    # Dual part of the unit dual quaternion: ½ (0, t) q.
    w, v = quats[:, :1], quats[:, 1:]
    duals = 0.5 * np.hstack([-np.sum(t * v, axis=1, keepdims=True), w * t + np.cross(t, v)])
    excess = stretches - np.eye(3)
    # Roundoff of the polar factor is no stretch.
    excess[np.abs(excess).max(axis=(1, 2), initial=0.0) < 1e-12] = 0.0
    offsets = -np.einsum("hij,hj->hi", excess, centers)
    return _dual_quaternion(
        np.ascontiguousarray(rest), *_rows(weights), quats, duals, excess, offsets, bool(excess.any())
    )


def _rows(weights):
    return weights.indptr.astype(np.int64), weights.indices.astype(np.int32), weights.data.astype(np.float64)


def _rigid_and_stretch(transforms):
    """Quaternions (H, 4) with w ≥ 0, rotations (H, 3, 3) and symmetric stretches S with linear part R S."""
    A = transforms[:, :3, :3]
    U, singular, Vt = np.linalg.svd(A)
    signs = np.ones_like(singular)
    signs[:, 2] = np.sign(np.linalg.det(U @ Vt))
    rotations = (U * signs[:, None, :]) @ Vt
    stretches = (np.swapaxes(Vt, 1, 2) * (signs * singular)[:, None, :]) @ Vt
    return np.ascontiguousarray(matrices_to_quats(rotations)), rotations, stretches


@nb.njit(nogil=True, cache=True, inline="always")
def _mean_quat(first, last, handles, values, quats, signs):
    """Pivot-aligned signs of a row's quaternions (into ``signs``), the mean's real part, and the rest's sign."""
    total = 0.0
    pivot = -1
    most = 0.0
    for q in range(first, last):
        total += values[q]
        if values[q] > most:
            most = values[q]
            pivot = handles[q]
    still = max(0.0, 1.0 - total)
    pw, px, py, pz = 1.0, 0.0, 0.0, 0.0
    if most >= still:
        pw, px, py, pz = quats[pivot, 0], quats[pivot, 1], quats[pivot, 2], quats[pivot, 3]
    still = still if pw >= 0 else -still
    w, x, y, z = still, 0.0, 0.0, 0.0
    for q in range(first, last):
        h = handles[q]
        dot = pw * quats[h, 0] + px * quats[h, 1] + py * quats[h, 2] + pz * quats[h, 3]
        signs[q - first] = values[q] if dot >= 0 else -values[q]
        w += signs[q - first] * quats[h, 0]
        x += signs[q - first] * quats[h, 1]
        y += signs[q - first] * quats[h, 2]
        z += signs[q - first] * quats[h, 3]
    length = np.sqrt(w * w + x * x + y * y + z * z)
    return w / length, x / length, y / length, z / length, length


@nb.njit(nogil=True, cache=True, inline="always")
def _put_rotation(R, w, x, y, z):
    R[0, 0] = 1 - 2 * (y * y + z * z)
    R[0, 1] = 2 * (x * y - w * z)
    R[0, 2] = 2 * (x * z + w * y)
    R[1, 0] = 2 * (x * y + w * z)
    R[1, 1] = 1 - 2 * (x * x + z * z)
    R[1, 2] = 2 * (y * z - w * x)
    R[2, 0] = 2 * (x * z - w * y)
    R[2, 1] = 2 * (y * z + w * x)
    R[2, 2] = 1 - 2 * (x * x + y * y)


@nb.njit(nogil=True, cache=True)
def _dual_quaternion(rest, indptr, handles, values, quats, duals, excess, offsets, stretched):
    n = rest.shape[0]
    positions = np.empty((n, 3))
    rotations = np.empty((n, 3, 3))
    signs = np.empty(quats.shape[0])
    for i in range(n):
        first, last = indptr[i], indptr[i + 1]
        px, py, pz = rest[i, 0], rest[i, 1], rest[i, 2]
        R = rotations[i]
        if first == last:
            positions[i, 0], positions[i, 1], positions[i, 2] = px, py, pz
            _put_rotation(R, 1.0, 0.0, 0.0, 0.0)
            continue
        w, x, y, z, length = _mean_quat(first, last, handles, values, quats, signs)
        dw, dx, dy, dz = 0.0, 0.0, 0.0, 0.0
        sx, sy, sz = px, py, pz
        for q in range(first, last):
            h = handles[q]
            s = signs[q - first] / length
            dw += s * duals[h, 0]
            dx += s * duals[h, 1]
            dy += s * duals[h, 2]
            dz += s * duals[h, 3]
            if stretched:
                v = values[q]
                E = excess[h]
                sx += v * (E[0, 0] * px + E[0, 1] * py + E[0, 2] * pz + offsets[h, 0])
                sy += v * (E[1, 0] * px + E[1, 1] * py + E[1, 2] * pz + offsets[h, 1])
                sz += v * (E[2, 0] * px + E[2, 1] * py + E[2, 2] * pz + offsets[h, 2])
        _put_rotation(R, w, x, y, z)
        # Translation: vector part of 2 d q*, q* the conjugate.
        tx = 2 * (-dw * x + dx * w - dy * z + dz * y)
        ty = 2 * (-dw * y + dx * z + dy * w - dz * x)
        tz = 2 * (-dw * z - dx * y + dy * x + dz * w)
        positions[i, 0] = R[0, 0] * sx + R[0, 1] * sy + R[0, 2] * sz + tx
        positions[i, 1] = R[1, 0] * sx + R[1, 1] * sy + R[1, 2] * sz + ty
        positions[i, 2] = R[2, 0] * sx + R[2, 1] * sy + R[2, 2] * sz + tz
    return positions, rotations


@nb.njit(nogil=True, cache=True)
def _linear(rest, indptr, handles, values, A, t, quats):
    n = rest.shape[0]
    positions = np.empty((n, 3))
    rotations = np.empty((n, 3, 3))
    signs = np.empty(quats.shape[0])
    X = np.empty((3, 3))
    C = np.empty((3, 3))
    for i in range(n):
        first, last = indptr[i], indptr[i + 1]
        R = rotations[i]
        if first == last:
            for a in range(3):
                positions[i, a] = rest[i, a]
            _put_rotation(R, 1.0, 0.0, 0.0, 0.0)
            continue
        for a in range(3):
            moved = 0.0
            for b in range(3):
                X[a, b] = 0.0
            for q in range(first, last):
                h = handles[q]
                v = values[q]
                moved += v * t[h, a]
                for b in range(3):
                    X[a, b] += v * A[h, a, b]
            for b in range(3):
                moved += X[a, b] * rest[i, b]
            positions[i, a] = rest[i, a] + moved
            X[a, a] += 1.0
        if not _polar(X, C):
            w, x, y, z, _ = _mean_quat(first, last, handles, values, quats, signs)
            _put_rotation(R, w, x, y, z)
        else:
            for a in range(3):
                for b in range(3):
                    R[a, b] = X[a, b]
    return positions, rotations


@nb.njit(nogil=True, cache=True)
def _polar(X, C):
    """Replace a matrix by its nearest rotation with Higham's scaled Newton steps; False if it has none to speak of."""
    for _ in range(12):
        norm2 = 0.0
        cofactor2 = 0.0
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            for d in range(3):
                e, f = (d + 1) % 3, (d + 2) % 3
                C[a, d] = X[b, e] * X[c, f] - X[b, f] * X[c, e]
                norm2 += X[a, d] * X[a, d]
                cofactor2 += C[a, d] * C[a, d]
        det = X[0, 0] * C[0, 0] + X[0, 1] * C[0, 1] + X[0, 2] * C[0, 2]
        # Relative to a cube of the same size; below that the polar factor is noise.
        if det <= 1e-9 * norm2 * np.sqrt(norm2):
            return False
        # X^-T = C / det; γ balances the two terms' Frobenius norms.
        gamma = np.sqrt(np.sqrt(cofactor2 / norm2) / det)
        change = 0.0
        for a in range(3):
            for d in range(3):
                new = 0.5 * (gamma * X[a, d] + C[a, d] / (gamma * det))
                change = max(change, abs(new - X[a, d]))
                X[a, d] = new
        if change < 1e-13:
            return True
    return True
