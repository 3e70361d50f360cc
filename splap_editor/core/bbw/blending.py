"""Mixing the transforms of several handles at every node."""

import numba as nb
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from splap_editor.core.arap.rotation_fit import rotation_quaternion, write_rotation
from splap_editor.core.splats.rotations import matrices_to_quats


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
        Proper rotation nearest to the mean linear map, one of the equally near ones where that map has collapsed, as at
        a joint twisted by half a turn.
    """
    displacements = np.ascontiguousarray(transforms[:, :3] - np.eye(3, 4))
    return _linear(np.ascontiguousarray(rest), *_csr_parts(weights), displacements, _turns(transforms[:, :3, :3]))


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
    # Where no two quaternions point apart, signs need no care; rest agrees with all of them, which have w ≥ 0.
    agree = bool((quats @ quats.T >= 0).all())
    rest = np.ascontiguousarray(rest)
    return _dual_quaternion(
        rest, *_csr_parts(weights), np.hstack([quats, duals]), agree, excess, offsets, bool(excess.any())
    )


def _csr_parts(weights: sp.csr_array) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.float64]]:
    indptr, indices = weights.indptr.astype(np.int32, copy=False), weights.indices.astype(np.int32, copy=False)
    return indptr, indices, weights.data.astype(np.float64, copy=False)


def _rigid_and_stretch(transforms):
    """Quaternions (H, 4) with w ≥ 0, rotations (H, 3, 3) and symmetric stretches S with linear part R S."""
    A = transforms[:, :3, :3]
    U, singular, Vt = np.linalg.svd(A)
    signs = np.ones_like(singular)
    signs[:, 2] = np.sign(np.linalg.det(U @ Vt))
    rotations = (U * signs[:, None, :]) @ Vt
    stretches = (np.swapaxes(Vt, 1, 2) * (signs * singular)[:, None, :]) @ Vt
    return np.ascontiguousarray(matrices_to_quats(rotations)), rotations, stretches


def _turns(A):
    """Axis, scale times cosine and scale times sine of each linear map (H, 5) that turns and scales evenly, else NaN.

    Where such a map alone mixes with rest, ``(1 - v) I + v s R`` is a scaled turn about the same axis across it, so
    its nearest rotation follows from one complex number.
    """
    turns = np.full((len(A), 5), np.nan)
    for handle, linear in enumerate(A):
        scale = np.cbrt(np.linalg.det(linear))
        if not scale > 0 or np.abs(linear.T @ linear - scale**2 * np.eye(3)).max() > 1e-13 * scale**2:
            continue
        w, *v = matrices_to_quats(linear[None] / scale)[0]
        sine = np.linalg.norm(v)
        axis = np.array(v) / sine if sine > 0 else np.array([1.0, 0.0, 0.0])
        turns[handle] = [*axis, scale * (w * w - sine * sine), scale * 2.0 * w * sine]
    return turns


@nb.njit(nogil=True, cache=True)
def _aligned_shares(first, last, handles, values, screws, shares):
    """Weights of a row's handles (into ``shares``), negative for the far one of a quaternion's two signs.

    Signs agree with the quaternion of the largest weight, rest included. Rest keeps its sign: all quaternions have
    w ≥ 0.
    """
    still = 1.0
    pivot = -1
    most = 0.0
    for q in range(first, last):
        still -= values[q]
        if values[q] > most:
            most = values[q]
            pivot = handles[q]
    for q in range(first, last):
        h = handles[q]
        dot = screws[h, 0]
        if most >= still:
            dot *= screws[pivot, 0]
            dot += screws[pivot, 1] * screws[h, 1] + screws[pivot, 2] * screws[h, 2] + screws[pivot, 3] * screws[h, 3]
        shares[q - first] = values[q] if dot >= 0 else -values[q]


@nb.njit(nogil=True, cache=True)
def _dual_quaternion(rest, indptr, handles, values, screws, agree, excess, offsets, stretched):
    """Blend each node's screws and stretches by its weights, the missing share at rest."""
    n = rest.shape[0]
    positions = np.empty((n, 3))
    rotations = np.empty((n, 3, 3))
    shares = np.empty(screws.shape[0])
    for i in range(n):
        first, last = indptr[i], indptr[i + 1]
        sx, sy, sz = rest[i, 0], rest[i, 1], rest[i, 2]
        if first == last:
            positions[i, 0], positions[i, 1], positions[i, 2] = sx, sy, sz
            write_rotation(rotations, i, 1.0, 0.0, 0.0, 0.0)
            continue
        if not agree:
            _aligned_shares(first, last, handles, values, screws, shares)
        still = 1.0
        w, x, y, z = 0.0, 0.0, 0.0, 0.0
        dw, dx, dy, dz = 0.0, 0.0, 0.0, 0.0
        for q in range(first, last):
            screw = screws[handles[q]]
            still -= values[q]
            s = values[q] if agree else shares[q - first]
            w += s * screw[0]
            x += s * screw[1]
            y += s * screw[2]
            z += s * screw[3]
            dw += s * screw[4]
            dx += s * screw[5]
            dy += s * screw[6]
            dz += s * screw[7]
        if stretched:
            px, py, pz = sx, sy, sz
            for q in range(first, last):
                v = values[q]
                h = handles[q]
                E = excess[h]
                sx += v * (E[0, 0] * px + E[0, 1] * py + E[0, 2] * pz + offsets[h, 0])
                sy += v * (E[1, 0] * px + E[1, 1] * py + E[1, 2] * pz + offsets[h, 1])
                sz += v * (E[2, 0] * px + E[2, 1] * py + E[2, 2] * pz + offsets[h, 2])
        w += max(0.0, still)
        unit = 1.0 / np.sqrt(w * w + x * x + y * y + z * z)
        w, x, y, z = w * unit, x * unit, y * unit, z * unit
        dw, dx, dy, dz = dw * unit, dx * unit, dy * unit, dz * unit
        write_rotation(rotations, i, w, x, y, z)
        R = rotations[i]
        # Translation: vector part of 2 d q*, q* the conjugate.
        tx = 2 * (-dw * x + dx * w - dy * z + dz * y)
        ty = 2 * (-dw * y + dx * z + dy * w - dz * x)
        tz = 2 * (-dw * z - dx * y + dy * x + dz * w)
        positions[i, 0] = R[0, 0] * sx + R[0, 1] * sy + R[0, 2] * sz + tx
        positions[i, 1] = R[1, 0] * sx + R[1, 1] * sy + R[1, 2] * sz + ty
        positions[i, 2] = R[2, 0] * sx + R[2, 1] * sy + R[2, 2] * sz + tz
    return positions, rotations


@nb.njit(nogil=True, cache=True)
def _linear(rest, indptr, handles, values, displacements, turns):
    """Positions and rotations; ``displacements`` (H, 3, 4) are the affine maps less the identity."""
    n = rest.shape[0]
    positions = np.empty((n, 3))
    rotations = np.empty((n, 3, 3))
    for i in range(n):
        px, py, pz = rest[i, 0], rest[i, 1], rest[i, 2]
        a00, a01, a02, a10, a11, a12, a20, a21, a22 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        tx, ty, tz = 0.0, 0.0, 0.0
        for q in range(indptr[i], indptr[i + 1]):
            v = values[q]
            D = displacements[handles[q]]
            a00 += v * D[0, 0]
            a01 += v * D[0, 1]
            a02 += v * D[0, 2]
            a10 += v * D[1, 0]
            a11 += v * D[1, 1]
            a12 += v * D[1, 2]
            a20 += v * D[2, 0]
            a21 += v * D[2, 1]
            a22 += v * D[2, 2]
            tx += v * D[0, 3]
            ty += v * D[1, 3]
            tz += v * D[2, 3]
        positions[i, 0] = px + (a00 * px + a01 * py + a02 * pz + tx)
        positions[i, 1] = py + (a10 * px + a11 * py + a12 * pz + ty)
        positions[i, 2] = pz + (a20 * px + a21 * py + a22 * pz + tz)
        largest = max(abs(a00), abs(a01), abs(a02), abs(a10), abs(a11), abs(a12), abs(a20), abs(a21), abs(a22))
        # Nodes at rest and nodes that are only shifted, most of a scene, need no fit.
        if largest == 0.0:
            write_rotation(rotations, i, 1.0, 0.0, 0.0, 0.0)
            continue
        re, im = 0.0, 0.0
        if indptr[i + 1] - indptr[i] == 1:
            v = values[indptr[i]]
            turn = turns[handles[indptr[i]]]
            re, im = 1.0 - v + v * turn[3], v * turn[4]
        length = np.sqrt(re * re + im * im)
        # Not for maps that are no even turn (NaN), nor at a joint that has collapsed.
        if length > 1e-6:
            # Half the angle, by whichever of sine and cosine loses no digits.
            major = np.sqrt(0.5 * (1.0 + abs(re) / length))
            minor = 0.5 * im / (length * major)
            w, sine = (major, minor) if re > 0 else (minor, major)
            write_rotation(rotations, i, w, sine * turn[0], sine * turn[1], sine * turn[2])
        else:
            w, x, y, z = rotation_quaternion(a00 + 1.0, a01, a02, a10, a11 + 1.0, a12, a20, a21, a22 + 1.0)
            write_rotation(rotations, i, w, x, y, z)
    return positions, rotations
