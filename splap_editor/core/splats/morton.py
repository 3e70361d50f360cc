"""The order along which neighbours in space become neighbours in memory."""

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.progress import Progress, no_progress

_BITS = 21
_SPREAD = (
    (32, 0x1F00000000FFFF),
    (16, 0x1F0000FF0000FF),
    (8, 0x100F00F00F00F00F),
    (4, 0x10C30C30C30C30C3),
    (2, 0x1249249249249249),
)


def morton_codes(points: NDArray[np.float64]) -> NDArray[np.uint64]:
    """Place of each point along the Z-order curve through their bounding cube.

    Parameters
    ----------
    points : (n, 3) float64
        Finite positions, any unit.

    Returns
    -------
    (n,) uint64
        21 bits an axis, interleaved. Points closer than 5e-7 of the bounding
        cube may share a code; points that all coincide have code 0.
    """
    if not len(points):
        return np.zeros(0, np.uint64)
    low = points.min(axis=0)
    side = float((points.max(axis=0) - low).max())
    steps = (2.0**_BITS - 1.0) / side if side > 0.0 else 0.0
    cells = ((points - low) * steps).astype(np.uint64)
    return _spread(cells[:, 0]) | _spread(cells[:, 1]) << np.uint64(1) | _spread(cells[:, 2]) << np.uint64(2)


def morton_order(points: NDArray[np.float64], progress: Progress = no_progress) -> NDArray[np.int64]:
    """Permutation that sorts points along the Z-order curve.

    It depends on where the points are and not on the order they come in, as
    long as no two coincide; coinciding points keep their order.

    Parameters
    ----------
    points : (n, 3) float64
        Finite positions, any unit.
    progress : Progress
        Told the share of steps taken; may cancel.

    Returns
    -------
    (n,) int64
        Index of the point that comes first, second, ...
    """
    codes = morton_codes(points)
    progress(0.4)
    order = np.argsort(codes, kind="stable")
    progress(0.8)
    ordered = codes[order]
    progress(0.9)
    tied = np.zeros(len(codes), bool)
    tied[1:] = ordered[1:] == ordered[:-1]
    tied[:-1] |= tied[1:]
    if tied.any():
        some = order[tied]
        x, y, z = points[some].T
        order[tied] = some[np.lexsort((z, y, x, codes[some]))]
    return order


def _spread(values: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """Put two zero bits between the bits of each 21-bit value."""
    for shift, mask in _SPREAD:
        values = (values | values << np.uint64(shift)) & np.uint64(mask)
    return values
