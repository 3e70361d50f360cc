"""Rotation matrices from the quaternions of splat files, and back."""

import numpy as np
from numpy.typing import NDArray


def quats_to_matrices(quats: NDArray[np.floating]) -> NDArray[np.float64]:
    """Rotation matrices of quaternions of any length.

    Parameters
    ----------
    quats : (N, 4) float
        w, x, y, z; ``q`` and ``-q`` and any multiple of them are the same rotation.

    Returns
    -------
    (N, 3, 3) float64
        Proper rotations, local → world. A zero or non-finite quaternion has no direction and gives NaN.

    Raises
    ------
    ValueError
        If ``quats`` is not (N, 4).
    """
    quats = np.asarray(quats, np.float64)
    if quats.ndim != 2 or quats.shape[1] != 4:
        raise ValueError(f"quats must have shape (N, 4), got {quats.shape}")
    with np.errstate(divide="ignore", invalid="ignore", over="ignore", under="ignore"):
        # Dividing by the largest entry first keeps the squared length of very long and very short ones in range.
        quats = quats / np.abs(quats).max(axis=1, initial=0.0, keepdims=True)
        w, x, y, z = (quats / np.linalg.norm(quats, axis=1, keepdims=True)).T
    matrices = np.empty((len(quats), 3, 3))
    matrices[:, 0, 0] = 1.0 - 2.0 * (y * y + z * z)
    matrices[:, 0, 1] = 2.0 * (x * y - w * z)
    matrices[:, 0, 2] = 2.0 * (x * z + w * y)
    matrices[:, 1, 0] = 2.0 * (x * y + w * z)
    matrices[:, 1, 1] = 1.0 - 2.0 * (x * x + z * z)
    matrices[:, 1, 2] = 2.0 * (y * z - w * x)
    matrices[:, 2, 0] = 2.0 * (x * z - w * y)
    matrices[:, 2, 1] = 2.0 * (y * z + w * x)
    matrices[:, 2, 2] = 1.0 - 2.0 * (x * x + y * y)
    return matrices


def matrices_to_quats(matrices: NDArray[np.floating]) -> NDArray[np.float64]:
    """Unit quaternions of rotation matrices.

    Each quaternion is read off its largest component, so that no half turn loses digits (Shepperd's method [1]_).

    Parameters
    ----------
    matrices : (N, 3, 3) float
        Proper rotations.

    Returns
    -------
    (N, 4) float64
        w, x, y, z of unit length with w ≥ 0.

    Raises
    ------
    ValueError
        If ``matrices`` is not (N, 3, 3).

    References
    ----------
    .. [1] Shepperd, "Quaternion from Rotation Matrix", J. Guidance and Control 1(3), 1978.
    """
    matrices = np.asarray(matrices, np.float64)
    if matrices.ndim != 3 or matrices.shape[1:] != (3, 3):
        raise ValueError(f"matrices must have shape (N, 3, 3), got {matrices.shape}")
    rows = np.moveaxis(matrices, 0, 2)
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = rows
    # outer[a, b] = 4 q_a q_b: its row of the largest diagonal entry is the quaternion up to length.
    outer = np.empty((4, 4, len(matrices)))
    outer[0] = 1.0 + xx + yy + zz, zy - yz, xz - zx, yx - xy
    outer[1] = outer[0, 1], 1.0 + xx - yy - zz, xy + yx, xz + zx
    outer[2] = outer[0, 2], outer[1, 2], 1.0 - xx + yy - zz, yz + zy
    outer[3] = outer[0, 3], outer[1, 3], outer[2, 3], 1.0 - xx - yy + zz
    largest = np.argmax(np.einsum("aan->an", outer), axis=0)
    quats = outer[largest, :, np.arange(len(matrices))]
    quats /= np.linalg.norm(quats, axis=1, keepdims=True)
    return np.where(quats[:, :1] < 0.0, -quats, quats)


def quat_products(left: NDArray[np.floating], right: NDArray[np.floating]) -> NDArray[np.float64]:
    """Hamilton products: the rotation ``right`` followed by ``left``.

    Parameters
    ----------
    left, right : (N, 4) float
        w, x, y, z; the length of a product is the product of the lengths.

    Returns
    -------
    (N, 4) float64
        ``left * right``, row by row.
    """
    a, b, c, d = np.asarray(left, np.float64).T
    w, x, y, z = np.asarray(right, np.float64).T
    return np.stack(
        [
            a * w - b * x - c * y - d * z,
            a * x + b * w + c * z - d * y,
            a * y - b * z + c * w + d * x,
            a * z + b * y - c * x + d * w,
        ],
        axis=1,
    )
