"""Few values that stand for many: a table of 256 numbers, and a palette of vectors."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.progress import Progress, no_progress, part_of
from splap_editor.io.formats.bare_splats import BLOCK_ROWS, row_blocks

_BINS = 1 << 14
_ROUNDS = 24
LARGEST_PALETTE = 1 << 16


def codebook(
    values: NDArray[np.floating], progress: Progress = no_progress
) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
    """Choose 256 numbers that stand for all with little squared error.

    Lloyd's iteration on a histogram, from a start that gives crowded and
    sparse stretches their share.

    Parameters
    ----------
    values : array of float
        Finite.
    progress : Progress
        Told the share done; may cancel.

    Returns
    -------
    numbers : (256,) float32
        Rising.
    labels : uint8, shape of ``values``
        The nearest number of each.
    """
    low, high = float(values.min()), float(values.max())
    if high <= low:
        return np.full(256, low, np.float32), np.zeros(values.shape, np.uint8)
    flat = values.reshape(-1)
    # In double precision, as neighbouring single numbers leave no room for bins between them.
    counts, edges = np.histogram(np.empty(0), _BINS, (low, high))
    for cells in row_blocks(len(flat), part_of(progress, 0.0, 0.5)):
        counts += np.histogram(flat[cells].astype(np.float64), _BINS, (low, high))[0]
    middles = (edges[:-1] + edges[1:]) / 2
    # The square root of the density lies between equal steps and equal counts.
    share = np.cumsum(np.sqrt(counts))
    numbers = np.interp((np.arange(256) + 0.5) / 256 * share[-1], share, middles)
    for _ in range(_ROUNDS):
        nearest = np.searchsorted((numbers[1:] + numbers[:-1]) / 2, middles)
        mass = np.bincount(nearest, counts, 256)
        centre = np.bincount(nearest, counts * middles, 256)
        numbers = np.where(mass > 0, centre / np.maximum(mass, 1), numbers)
    # The ends are met: a splat must not shrink or pale for being the extreme.
    numbers[0], numbers[-1] = low, high
    numbers = np.sort(numbers).astype(np.float32)
    exact = numbers.astype(np.float64)
    bounds, labels = (exact[1:] + exact[:-1]) / 2, np.empty(len(flat), np.uint8)
    for cells in row_blocks(len(flat), part_of(progress, 0.5, 1.0)):
        labels[cells] = np.searchsorted(bounds, flat[cells])
    return numbers, labels.reshape(values.shape)


def palette(vectors: NDArray[np.float32], progress: Progress) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Choose vectors that stand for all, by halving the groups across their widest direction.

    Parameters
    ----------
    vectors : (n, d) float32
        Finite.
    progress : Progress
        Told the share of levels done.

    Returns
    -------
    entries : (p, d) float32
        A power of two of them, at most 65,536 and no more than vectors.
    labels : (n,) int64
        The entry of each.
    """
    n = len(vectors)
    n_levels = min(LARGEST_PALETTE.bit_length(), n.bit_length()) - 1
    order = np.arange(n)
    # Group g holds places bounds[g] to bounds[g + 1] of the order, and is never empty.
    bounds = np.array([0, n])
    for level in range(n_levels):
        told = part_of(progress, level / (n_levels + 1), (level + 1) / (n_levels + 1))
        sizes = np.diff(bounds)
        group = np.repeat(np.arange(len(sizes)), sizes)
        means, squares = _group_means(vectors, order, bounds, part_of(told, 0.0, 0.7), with_squares=True)
        widest = (squares - means**2).argmax(axis=1)
        keys = np.empty(n, np.float32)
        for places in row_blocks(n, part_of(told, 0.7, 0.9)):
            keys[places] = vectors[order[places], widest[group[places]]]
        # Whole groups at a time, of as many rows as are worked on at once, or the one group that has more.
        cuts = np.unique(bounds[np.searchsorted(bounds, [*range(0, n, BLOCK_ROWS), n])])
        for lo, hi in pairwise(cuts.tolist()):
            told(0.9 + 0.1 * lo / n)
            order[lo:hi] = order[lo:hi][np.lexsort((keys[lo:hi], group[lo:hi]))]
        # Halves of equal size keep every group alive to the last level.
        middles = bounds[:-1] + sizes // 2
        bounds = np.sort(np.concatenate([bounds, middles]))
        told(1.0)
    entries, _ = _group_means(vectors, order, bounds, part_of(progress, n_levels / (n_levels + 1), 1.0))
    sizes = np.diff(bounds)
    labels = np.empty(n, np.int64)
    labels[order] = np.repeat(np.arange(len(sizes)), sizes)
    return entries.astype(np.float32), labels


def _group_means(
    vectors: NDArray[np.float32],
    order: NDArray[np.int64],
    bounds: NDArray[np.int64],
    progress: Progress,
    *,
    with_squares: bool = False,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(g, d) means of groups of vectors in an order, and of their squares if these are wanted, else zeros."""
    sums = np.zeros((2, len(bounds) - 1, vectors.shape[1]))
    for places in row_blocks(len(order), progress):
        block = vectors[order[places]].astype(np.float64)
        first, last = np.searchsorted(bounds, (places.start, places.stop - 1), side="right") - 1
        starts = np.maximum(bounds[first : last + 1] - places.start, 0)
        sums[0, first : last + 1] += np.add.reduceat(block, starts, axis=0)
        if with_squares:
            sums[1, first : last + 1] += np.add.reduceat(np.square(block, out=block), starts, axis=0)
    sums /= np.diff(bounds)[:, None]
    return sums[0], sums[1]
