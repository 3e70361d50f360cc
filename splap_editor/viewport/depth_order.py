"""Back-to-front order of splats."""

import numba as nb
import numpy as np
from numpy.typing import NDArray

from splap_editor.core.index_spaces import RowsByPlace
from splap_editor.core.twofold_loop import TwofoldLoop

_BINS = 1 << 16


@nb.njit(nogil=True, cache=True)
def _counting_sort_compiled(means, direction, order):
    """Write rows from the farthest to the nearest along ``direction`` to ``order``; within a bin by row."""
    n = means.shape[0]
    keys = np.empty(n, np.float32)
    nearest, farthest = np.float32(np.inf), np.float32(-np.inf)
    for i in range(n):
        depth = means[i, 0] * direction[0] + means[i, 1] * direction[1] + means[i, 2] * direction[2]
        keys[i] = depth
        nearest, farthest = min(nearest, depth), max(farthest, depth)
    scale = np.float32(_BINS - 1) / max(farthest - nearest, np.float32(1e-30))
    starts = np.zeros(_BINS + 1, np.int32)
    for i in range(n):
        starts[_bin(farthest - keys[i], scale) + 1] += 1
    for b in range(_BINS):
        starts[b + 1] += starts[b]
    for i in range(n):
        b = _bin(farthest - keys[i], scale)
        order[starts[b]] = i
        starts[b] += 1


@nb.njit(inline="always")
def _bin(behind, scale):
    """Bin of a distance to the farthest splat; that of one that is no number is the last."""
    place = behind * scale
    # A comparison with NaN is false: nothing but a number in range is ever converted.
    return np.int64(place) if 0.0 <= place <= _BINS - 1 else np.int64(_BINS - 1)


def _counting_sort_plain(means, direction, order):
    with np.errstate(invalid="ignore", over="ignore"):
        behind = means @ direction
        farthest, nearest = np.fmax.reduce(behind, initial=-np.inf), np.fmin.reduce(behind, initial=np.inf)
        np.subtract(farthest, behind, out=behind)
        behind *= np.float32(_BINS - 1) / max(farthest - nearest, np.float32(1e-30))
    # Nothing but a number in range is converted.
    np.nan_to_num(behind, copy=False, nan=_BINS - 1, posinf=_BINS - 1, neginf=_BINS - 1)
    np.clip(behind, 0.0, _BINS - 1, out=behind)
    # A stable sort of 16-bit keys is a radix sort.
    order[:] = np.argsort(behind.astype(np.uint16), kind="stable")


counting_sort = TwofoldLoop(_counting_sort_compiled, _counting_sort_plain)


def depth_order(means: NDArray[np.float32], direction: NDArray[np.floating]) -> RowsByPlace:
    """Rows of splats from the farthest to the nearest along a viewing direction.

    A counting sort on depths quantised to 16 bits: centres nearer to each
    other than 1/65535 of the depth range keep their file order. It releases
    the GIL; call it on the worker.

    Parameters
    ----------
    means : (N, 3) float32, C-contiguous
        Centres, in any common frame. One whose depth is not finite comes somewhere.
    direction : (3,) float
        From the eye into the scene, any length but zero.

    Returns
    -------
    (N,) int32
        A permutation of the rows, farthest first.

    Raises
    ------
    ValueError
        ``means`` is no C-contiguous (N, 3) float32 array.
    """
    if means.ndim != 2 or means.shape[1] != 3 or means.dtype != np.float32 or not means.flags.c_contiguous:
        raise ValueError(f"means must be a C-contiguous (N, 3) float32 array, got {means.shape} {means.dtype}")
    order = np.empty(len(means), np.int32)
    counting_sort(means, np.ascontiguousarray(direction, np.float32), order)
    return order
