"""Rotations fitted to 3 × 3 matrices, exactly and without a singular value decomposition."""

import math

import numba as nb
import numpy as np
from numpy.typing import NDArray

# Below this adjugate size (of a unit matrix) the largest eigenvalue is nearly double and the root found too inexact.
_NEARLY_DOUBLE = 1e-5


def fit_rotations(covariances: NDArray[np.float64]) -> NDArray[np.float64]:
    """Find the rotation closest to each edge covariance.

    The local step of as-rigid-as-possible deformation [1]_: ``R[i]``
    maximises ``trace(R[i] @ covariances[i])`` over proper rotations.

    Parameters
    ----------
    covariances : (N, 3, 3) float64
        ``sum_j w_ij e_ij e'_ij^T`` over the neighbours of splat ``i``; rest
        edges ``e`` and deformed edges ``e'`` in world units.

    Returns
    -------
    (N, 3, 3) float64
        Rotations with determinant +1. A degenerate covariance (rank < 2)
        yields one of the equally good rotations, never a reflection; a zero
        one yields the identity.

    Raises
    ------
    ValueError
        If the shape is not (N, 3, 3).

    References
    ----------
    .. [1] Sorkine and Alexa, "As-Rigid-As-Possible Surface Modeling",
       SGP 2007, Eq. 6.
    .. [2] Theobald, "Rapid calculation of RMSDs using a quaternion-based
       characteristic polynomial", Acta Cryst. A61, 2005: the largest root of
       Horn's quartic, here by Halley's method instead of Newton's.
    """
    covariances = np.ascontiguousarray(covariances, np.float64)
    if covariances.ndim != 3 or covariances.shape[1:] != (3, 3):
        raise ValueError(f"covariances must have shape (N, 3, 3), got {covariances.shape}")
    rotations = np.empty_like(covariances)
    _fit_all(covariances, rotations)
    return rotations


def nearest_rotations(matrices: NDArray[np.float64]) -> NDArray[np.float64]:
    """Find the rotation nearest to each matrix in the Frobenius norm, its polar factor where the determinant is > 0.

    Parameters
    ----------
    matrices : (N, 3, 3) float64
        Any matrices, for instance the linear part of affine maps.

    Returns
    -------
    (N, 3, 3) float64
        Rotations with determinant +1; degenerate input as in `fit_rotations`.
    """
    return fit_rotations(np.swapaxes(np.asarray(matrices, np.float64), 1, 2))


@nb.njit(nogil=True, cache=True)
def _fit_all(covariances, rotations):
    """Write the rotation nearest to each covariance."""
    for i in range(covariances.shape[0]):
        C = covariances[i]
        w, x, y, z = rotation_quaternion(
            C[0, 0], C[1, 0], C[2, 0], C[0, 1], C[1, 1], C[2, 1], C[0, 2], C[1, 2], C[2, 2]
        )
        write_rotation(rotations, i, w, x, y, z)


@nb.njit(nogil=True, cache=True)
def write_rotation(rotations, i, w, x, y, z):
    """Write unit quaternion (w, x, y, z) as matrix ``rotations[i]``."""
    rotations[i, 0, 0] = 1 - 2 * (y * y + z * z)
    rotations[i, 0, 1] = 2 * (x * y - w * z)
    rotations[i, 0, 2] = 2 * (x * z + w * y)
    rotations[i, 1, 0] = 2 * (x * y + w * z)
    rotations[i, 1, 1] = 1 - 2 * (x * x + z * z)
    rotations[i, 1, 2] = 2 * (y * z - w * x)
    rotations[i, 2, 0] = 2 * (x * z - w * y)
    rotations[i, 2, 1] = 2 * (y * z + w * x)
    rotations[i, 2, 2] = 1 - 2 * (x * x + y * y)


@nb.njit(nogil=True, cache=True, fastmath={"contract", "reassoc", "arcp", "nsz"})
def rotation_quaternion(a00, a01, a02, a10, a11, a12, a20, a21, a22):
    """Unit quaternion (w, x, y, z) of the rotation R that maximises ``trace(Rᵀ A)``.

    The quaternion is the eigenvector of Horn's symmetric traceless 4 × 4 matrix for its largest
    eigenvalue. Scaled to ``|A| = 1`` the characteristic polynomial is ``t⁴ - 2 t² - 8 det(A) t + det(N)``,
    whose largest root lies in [1, √3]; all roots are real, so Halley's method from above falls on it monotonically.
    """
    square = a00 * a00 + a01 * a01 + a02 * a02 + a10 * a10 + a11 * a11 + a12 * a12 + a20 * a20 + a21 * a21 + a22 * a22
    if square < 1e-280:
        return 1.0, 0.0, 0.0, 0.0
    scale = 1.0 / math.sqrt(square)
    xx, xy, xz = a00 * scale, a10 * scale, a20 * scale
    yx, yy, yz = a01 * scale, a11 * scale, a21 * scale
    zx, zy, zz = a02 * scale, a12 * scale, a22 * scale
    n00, n01, n02, n03 = xx + yy + zz, yz - zy, zx - xz, xy - yx
    n11, n12, n13 = xx - yy - zz, xy + yx, zx + xz
    n22, n23, n33 = yy - xx - zz, yz + zy, zz - xx - yy
    p, q, r = n22 * n33 - n23 * n23, n12 * n33 - n13 * n23, n12 * n23 - n13 * n22
    s, t, u = n02 * n33 - n03 * n23, n02 * n23 - n03 * n22, n02 * n13 - n03 * n12
    c0 = (
        n00 * (n11 * p - n12 * q + n13 * r)
        - n01 * (n01 * p - n12 * s + n13 * t)
        + n02 * (n01 * q - n11 * s + n13 * u)
        - n03 * (n01 * r - n11 * t + n12 * u)
    )
    c1 = -8.0 * (xx * (yy * zz - yz * zy) - xy * (yx * zz - yz * zx) + xz * (yx * zy - yy * zx))
    top = _largest_root(c0, c1)
    m00, m11, m22, m33 = n00 - top, n11 - top, n22 - top, n33 - top
    # Every column of the adjugate of N - top I is a multiple of the eigenvector: take the longest.
    p, q, r = m22 * m33 - n23 * n23, n12 * m33 - n13 * n23, n12 * n23 - n13 * m22
    s, t, u = n02 * m33 - n03 * n23, n02 * n23 - n03 * m22, n02 * n13 - n03 * n12
    d00 = m11 * p - n12 * q + n13 * r
    d01 = -(n01 * p - n12 * s + n13 * t)
    d02 = n01 * q - m11 * s + n13 * u
    d03 = -(n01 * r - m11 * t + n12 * u)
    if abs(d00) > 0.1:
        # Long enough; turns of less than a right angle mostly end here.
        length = 1.0 / math.sqrt(d00 * d00 + d01 * d01 + d02 * d02 + d03 * d03)
        return d00 * length, d01 * length, d02 * length, d03 * length
    d11 = m00 * p - n02 * s + n03 * t
    d12 = -(m00 * q - n01 * s + n03 * u)
    d13 = m00 * r - n01 * t + n02 * u
    v = m00 * m11 - n01 * n01
    d22 = v * m33 - m00 * n13 * n13 - m11 * n03 * n03 + 2.0 * n01 * n03 * n13
    d23 = -(v * n23 - m00 * n12 * n13 - m11 * n02 * n03 + n01 * (n02 * n13 + n03 * n12))
    d33 = v * m22 - m00 * n12 * n12 - m11 * n02 * n02 + 2.0 * n01 * n02 * n12
    best, w, x, y, z = _longest_column(d00, d01, d02, d03, d11, d12, d13, d22, d23, d33)
    if best < _NEARLY_DOUBLE:
        return _top_eigenvector(n00, n01, n02, n03, n11, n12, n13, n22, n23, n33)
    length = 1.0 / math.sqrt(w * w + x * x + y * y + z * z)
    return w * length, x * length, y * length, z * length


@nb.njit(nogil=True, cache=True)
def _longest_column(d00, d01, d02, d03, d11, d12, d13, d22, d23, d33):
    """Size of the largest diagonal entry of a symmetric 4 × 4 matrix of rank 1, and the column that it stands in."""
    w, x, y, z = d00, d01, d02, d03
    best = abs(d00)
    if abs(d11) > best:
        best = abs(d11)
        w, x, y, z = d01, d11, d12, d13
    if abs(d22) > best:
        best = abs(d22)
        w, x, y, z = d02, d12, d22, d23
    if abs(d33) > best:
        best = abs(d33)
        w, x, y, z = d03, d13, d23, d33
    return best, w, x, y, z


@nb.njit(nogil=True, cache=True, fastmath={"contract", "reassoc", "arcp", "nsz"})
def _largest_root(c0, c1):
    """Largest root of ``t⁴ - 2 t² + c1 t + c0``, whose roots are all real, by Halley's method from above."""
    # With det(A) = 0 the quartic is biquadratic, so this start is the root itself on flat neighbourhoods.
    top = min(1.7320508075688774, math.sqrt(1.0 + math.sqrt(max(0.0, 1.0 - c0))) + 0.5 * abs(c1))
    for _ in range(50):
        square = top * top
        value = ((square - 2.0) * top + c1) * top + c0
        slope = 4.0 * (square - 1.0) * top + c1
        divisor = 2.0 * slope * slope - value * (12.0 * square - 4.0)
        if divisor <= 0.0:
            break
        step = 2.0 * value * slope / divisor
        top -= step
        # Convergence is cubic: what is left after this step is below rounding.
        if abs(step) < 1e-7:
            break
    return top


@nb.njit(nogil=True, cache=True)
def _top_eigenvector(n00, n01, n02, n03, n11, n12, n13, n22, n23, n33):
    """Eigenvector of a symmetric 4 × 4 matrix for its largest eigenvalue, by Jacobi's method: slow and always right."""
    A = np.empty((4, 4))
    A[0, 0], A[1, 1], A[2, 2], A[3, 3] = n00, n11, n22, n33
    A[0, 1], A[0, 2], A[0, 3] = n01, n02, n03
    A[1, 2], A[1, 3], A[2, 3] = n12, n13, n23
    V = np.zeros((4, 4))
    for i in range(4):
        V[i, i] = 1.0
        for j in range(i):
            A[i, j] = A[j, i]
    for _ in range(20):
        off = 0.0
        for i in range(3):
            for j in range(i + 1, 4):
                off += abs(A[i, j])
        if off < 1e-300:
            break
        for i in range(3):
            for j in range(i + 1, 4):
                if abs(A[i, j]) < 1e-300:
                    continue
                theta = 0.5 * (A[j, j] - A[i, i]) / A[i, j]
                tangent = 1.0 / (abs(theta) + math.sqrt(theta * theta + 1.0))
                if theta < 0.0:
                    tangent = -tangent
                cosine = 1.0 / math.sqrt(tangent * tangent + 1.0)
                sine = tangent * cosine
                for k in range(4):
                    left, right = A[k, i], A[k, j]
                    A[k, i] = cosine * left - sine * right
                    A[k, j] = sine * left + cosine * right
                for k in range(4):
                    left, right = A[i, k], A[j, k]
                    A[i, k] = cosine * left - sine * right
                    A[j, k] = sine * left + cosine * right
                    left, right = V[k, i], V[k, j]
                    V[k, i] = cosine * left - sine * right
                    V[k, j] = sine * left + cosine * right
    top = 0
    for i in range(1, 4):
        if A[i, i] > A[top, top]:
            top = i
    return V[0, top], V[1, top], V[2, top], V[3, top]
