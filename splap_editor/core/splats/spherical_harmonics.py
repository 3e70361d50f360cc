"""Real spherical harmonics with the signs of 3DGS: evaluated, and turned with the splats that carry them."""

import numba as nb
import numpy as np
from numpy.typing import NDArray

from splap_editor.core.progress import Progress, no_progress
from splap_editor.core.twofold_loop import TwofoldLoop

SH_C0 = 0.28209479177387814
MAX_SH_DEGREE = 4

# Bands 1 to l are recovered from their values in the first 2 l + 1 of these directions. Found by minimising the
# condition number of all four bands at once; it is 3.2 at worst.
_DIRECTIONS = np.array(
    [
        [0.499, -0.091, 0.862],
        [0.045, -0.368, -0.929],
        [0.708, 0.459, -0.536],
        [-0.190, -0.921, 0.340],
        [0.363, 0.819, 0.444],
        [0.752, -0.405, 0.520],
        [-0.056, 0.983, 0.173],
        [0.098, -0.595, 0.798],
        [-0.748, 0.112, 0.655],
    ]
)
_DIRECTIONS /= np.linalg.norm(_DIRECTIONS, axis=1, keepdims=True)

_BLOCK_ROWS = 1 << 16
"""Rows that are turned between two words of progress."""


@nb.njit(inline="always")
def _write_basis(x, y, z, degree, out):
    """Write the basis functions of degrees 1 to ``degree`` in a direction to ``out``, band by band."""
    xx, yy, zz = x * x, y * y, z * z
    if degree >= 1:
        out[0] = -0.4886025119029199 * y
        out[1] = 0.4886025119029199 * z
        out[2] = -0.4886025119029199 * x
    if degree >= 2:
        out[3] = 1.0925484305920792 * x * y
        out[4] = -1.0925484305920792 * y * z
        out[5] = 0.31539156525252005 * (2.0 * zz - xx - yy)
        out[6] = -1.0925484305920792 * x * z
        out[7] = 0.5462742152960396 * (xx - yy)
    if degree >= 3:
        out[8] = -0.5900435899266435 * y * (3.0 * xx - yy)
        out[9] = 2.890611442640554 * x * y * z
        out[10] = -0.4570457994644658 * y * (4.0 * zz - xx - yy)
        out[11] = 0.3731763325901154 * z * (2.0 * zz - 3.0 * xx - 3.0 * yy)
        out[12] = -0.4570457994644658 * x * (4.0 * zz - xx - yy)
        out[13] = 1.445305721320277 * z * (xx - yy)
        out[14] = -0.5900435899266435 * x * (xx - 3.0 * yy)
    if degree >= 4:
        out[15] = 2.5033429417967046 * x * y * (xx - yy)
        out[16] = -1.7701307697799304 * y * z * (3.0 * xx - yy)
        out[17] = 0.9461746957575601 * x * y * (7.0 * zz - 1.0)
        out[18] = -0.6690465435572892 * y * z * (7.0 * zz - 3.0)
        out[19] = 0.10578554691520431 * (zz * (35.0 * zz - 30.0) + 3.0)
        out[20] = -0.6690465435572892 * x * z * (7.0 * zz - 3.0)
        out[21] = 0.47308734787878004 * (xx - yy) * (7.0 * zz - 1.0)
        out[22] = -1.7701307697799304 * x * z * (xx - 3.0 * yy)
        out[23] = 0.6258357354491761 * (xx * (xx - 3.0 * yy) - yy * (3.0 * xx - yy))


def sh_basis(directions: NDArray[np.floating], degree: int) -> NDArray[np.float64]:
    """Real spherical harmonics of degrees 1 to ``degree`` in the order and with the signs of 3DGS.

    Parameters
    ----------
    directions : (N, 3) float
        Unit vectors, camera → splat.
    degree : int
        0 to 4.

    Returns
    -------
    (N, (degree + 1)² - 1) float64
        Band by band, order -l to l; band 1 is ``0.48860251 (-y, z, -x)``. The constant band is left out.

    Raises
    ------
    ValueError
        If ``directions`` is not (N, 3) or the degree is not 0 to 4.
    """
    directions = np.asarray(directions, np.float64)
    if directions.ndim != 2 or directions.shape[1] != 3:
        raise ValueError(f"directions must have shape (N, 3), got {directions.shape}")
    if not 0 <= degree <= MAX_SH_DEGREE:
        raise ValueError(f"spherical-harmonic degree must be 0 to {MAX_SH_DEGREE}, got {degree}")
    basis = np.empty(((degree + 1) ** 2 - 1, len(directions)))
    x, y, z = directions.T
    _write_basis.py_func(x, y, z, degree, basis)
    return np.ascontiguousarray(basis.T)


def sh_colors(
    sh0: NDArray[np.floating], shN: NDArray[np.floating], directions: NDArray[np.floating]
) -> NDArray[np.float64]:
    """Colours seen along given directions.

    Parameters
    ----------
    sh0 : (N, 3) float
        Constant coefficients.
    shN : (N, K, 3) float
        Coefficients of degrees 1 and up, ``K = (degree + 1)² - 1``.
    directions : (N, 3) float
        Unit vectors, camera → splat, in the frame the coefficients are in.

    Returns
    -------
    (N, 3) float64
        Linear RGB as 3DGS renders it: 0.5 + the harmonic sum, not below 0; it may exceed 1.

    Raises
    ------
    ValueError
        If ``directions`` is not (N, 3) or K is not that of a degree from 0 to 4.
    """
    colors = 0.5 + SH_C0 * np.asarray(sh0, np.float64)
    colors += np.einsum("nk,nkc->nc", sh_basis(directions, _degree(shN)), np.asarray(shN, np.float64))
    return np.maximum(colors, 0.0)


def view_colors(
    sh0: NDArray[np.floating],
    shN: NDArray[np.floating],
    positions: NDArray[np.floating],
    rotations: NDArray[np.floating],
    camera: NDArray[np.floating],
) -> NDArray[np.float32]:
    """Colours of turned splats seen from a camera, from the coefficients at rest.

    Looking along ``d`` at a splat turned by ``R`` is looking along ``Rᵀ d`` at the splat at rest, so that a display
    needs no turned coefficients.

    Parameters
    ----------
    sh0 : (N, 3) float
        Constant coefficients at rest.
    shN : (N, K, 3) float
        Coefficients of degrees 1 and up at rest. C-contiguous float32 is read in place, anything else copied.
    positions : (N, 3) float
        Deformed centres in world units.
    rotations : (N, 3, 3) float
        Rotation of each splat, rest → deformed.
    camera : (3,) float
        Camera position in world units.

    Returns
    -------
    (N, 3) float32
        Linear RGB, not below 0. A splat at the camera itself gets the colour of a zero direction.

    Raises
    ------
    ValueError
        If K is not that of a degree from 0 to 4.
    """
    colors = np.empty((len(positions), 3), np.float32)
    write_view_colors(
        np.ascontiguousarray(sh0, np.float32),
        np.ascontiguousarray(shN, np.float32),
        np.ascontiguousarray(positions, np.float64),
        np.ascontiguousarray(rotations, np.float64),
        np.ascontiguousarray(camera, np.float64),
        _degree(shN),
        colors,
    )
    return colors


def rotated_sh(
    shN: NDArray[np.floating],
    rotations: NDArray[np.floating],
    changed: NDArray[np.bool_] | None = None,
    progress: Progress = no_progress,
) -> NDArray[np.floating]:
    """Turn the view-dependent colour of splats with the splats.

    The turned function takes along ``d`` the value the function at rest takes along ``Rᵀ d``. It is evaluated in
    2 l + 1 fixed directions per band and its coefficients are read off by the inverse of the basis there, which is
    exact since a band is closed under rotation.

    Parameters
    ----------
    shN : (N, K, 3) float
        Coefficients of degrees 1 to 4, ``K = (degree + 1)² - 1``; the constant band does not turn.
    rotations : (N, 3, 3) float
        Proper rotations, rest → deformed.
    changed : (N,) bool, optional
        Rows to turn; None turns all. Rows whose rotation is exactly the identity are copied bit for bit either way.
    progress : Progress
        Told the share of rows done; may cancel.

    Returns
    -------
    (N, K, 3)
        Turned coefficients, float32 if ``shN`` is, else float64. A coefficient that is not finite spoils no more than
        its band and channel.

    Raises
    ------
    ValueError
        If K is not that of a degree from 0 to 4 or the number of rows differs.
    """
    degree = _degree(shN)
    if np.shape(rotations) != (len(shN), 3, 3):
        raise ValueError(f"rotations must have shape ({len(shN)}, 3, 3), got {np.shape(rotations)}")
    turned: NDArray[np.floating] = np.empty(np.shape(shN), np.float32 if shN.dtype.itemsize <= 4 else np.float64)
    if changed is None:
        changed = np.ones(len(shN), np.bool_)
    for lo in range(0, len(shN), _BLOCK_ROWS):
        progress(lo / len(shN))
        rows = slice(lo, lo + _BLOCK_ROWS)
        turned[rows] = shN[rows]
        if degree:
            turns = np.ascontiguousarray(rotations[rows], np.float64)
            _rotate_sh(turned[rows], turns, np.ascontiguousarray(changed[rows]), degree)
    return turned


def _degree(shN):
    if np.ndim(shN) != 3 or shN.shape[2] != 3 or shN.shape[1] not in (0, 3, 8, 15, 24):
        raise ValueError(f"shN must have shape (N, K, 3) with K = 0, 3, 8, 15 or 24, got {np.shape(shN)}")
    return round((shN.shape[1] + 1) ** 0.5) - 1


def _band_inverses():
    basis = sh_basis(_DIRECTIONS, MAX_SH_DEGREE)
    inverses = np.zeros((MAX_SH_DEGREE + 1, 9, 9))
    for band in range(1, MAX_SH_DEGREE + 1):
        n = 2 * band + 1
        inverses[band, :n, :n] = np.linalg.inv(basis[:n, band**2 - 1 : band**2 - 1 + n])
    return inverses


_INVERSES = _band_inverses()


@nb.njit(nogil=True, cache=True)
def _rotate_sh(coefficients, rotations, changed, degree):
    """Turn the coefficients of changed splats in place, each band from its values in a few directions."""
    basis = np.empty((9, 24))
    values = np.empty((9, 3))
    for i in range(len(coefficients)):
        R = rotations[i]
        identity = R[0, 0] == 1.0 and R[1, 1] == 1.0 and R[2, 2] == 1.0 and R[0, 1] == R[0, 2] == R[1, 2] == 0.0
        if not changed[i] or identity:
            continue
        for k in range(2 * degree + 1):
            x, y, z = _DIRECTIONS[k]
            _write_basis(
                R[0, 0] * x + R[1, 0] * y + R[2, 0] * z,
                R[0, 1] * x + R[1, 1] * y + R[2, 1] * z,
                R[0, 2] * x + R[1, 2] * y + R[2, 2] * z,
                degree,
                basis[k],
            )
        for band in range(1, degree + 1):
            n = 2 * band + 1
            first = band * band - 1
            for k in range(n):
                r = g = b = 0.0
                for m in range(n):
                    y = basis[k, first + m]
                    r += y * coefficients[i, first + m, 0]
                    g += y * coefficients[i, first + m, 1]
                    b += y * coefficients[i, first + m, 2]
                values[k, 0], values[k, 1], values[k, 2] = r, g, b
            for m in range(n):
                r = g = b = 0.0
                for k in range(n):
                    y = _INVERSES[band, m, k]
                    r += y * values[k, 0]
                    g += y * values[k, 1]
                    b += y * values[k, 2]
                coefficients[i, first + m, 0] = r
                coefficients[i, first + m, 1] = g
                coefficients[i, first + m, 2] = b


@nb.njit(nogil=True, cache=True, fastmath={"contract", "reassoc", "arcp", "nsz"})
def _view_colors_compiled(sh0, shN, positions, rotations, camera, degree, colors):
    """Write the colour of each splat as the camera sees it, in the frame that its rotation has turned."""
    basis = np.empty(24, np.float32)
    n_coefficients = shN.shape[1]
    for i in range(len(positions)):
        r = np.float32(0.5) + np.float32(SH_C0) * sh0[i, 0]
        g = np.float32(0.5) + np.float32(SH_C0) * sh0[i, 1]
        b = np.float32(0.5) + np.float32(SH_C0) * sh0[i, 2]
        if degree:
            dx = positions[i, 0] - camera[0]
            dy = positions[i, 1] - camera[1]
            dz = positions[i, 2] - camera[2]
            shrink = 1.0 / np.sqrt(max(dx * dx + dy * dy + dz * dz, 1e-30))
            R = rotations[i]
            _write_basis(
                shrink * (R[0, 0] * dx + R[1, 0] * dy + R[2, 0] * dz),
                shrink * (R[0, 1] * dx + R[1, 1] * dy + R[2, 1] * dz),
                shrink * (R[0, 2] * dx + R[1, 2] * dy + R[2, 2] * dz),
                degree,
                basis,
            )
            for k in range(n_coefficients):
                r += basis[k] * shN[i, k, 0]
                g += basis[k] * shN[i, k, 1]
                b += basis[k] * shN[i, k, 2]
        colors[i, 0] = max(r, np.float32(0.0))
        colors[i, 1] = max(g, np.float32(0.0))
        colors[i, 2] = max(b, np.float32(0.0))


def _view_colors_plain(sh0, shN, positions, rotations, camera, degree, colors):
    seen = sh0.astype(np.float64) * SH_C0 + 0.5
    if degree:
        along = positions - camera
        along /= np.sqrt(np.maximum((along * along).sum(axis=1, keepdims=True), 1e-30))
        at_rest = np.einsum("nji,nj->ni", rotations, along)
        seen += np.einsum("nk,nkc->nc", sh_basis(at_rest, degree), shN)
    np.maximum(seen, 0.0, out=colors, casting="same_kind")


write_view_colors = TwofoldLoop(_view_colors_compiled, _view_colors_plain)
