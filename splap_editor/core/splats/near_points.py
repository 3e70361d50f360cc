"""The nearest points in space: by scipy's tree where that is loaded, else by one that needs nothing but numpy.

Loading ``scipy.spatial`` takes half a second and 40 MiB, as much as all else that ``splap-editor info`` does.
"""

import sys
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.progress import Progress, no_progress

_LEAF = 48
"""Points of a box at most."""

_BLOCK_ROWS = 1 << 13
_FIRST, _MORE = 8, 32
"""Boxes whose points are looked at together: at first, and then as long as one is near enough."""


def nearest_points(
    points: NDArray[np.float64], k: int, progress: Progress = no_progress
) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Find the nearest points of each, itself among them.

    Parameters
    ----------
    points : (n, 3) float64
        Finite; at least ``k``.
    k : int
    progress : Progress
        Told the share of points done; may cancel.

    Returns
    -------
    distances : (n, k) float64
        Rising.
    indices : (n, k) intp
        Which; of several as far away, any.
    """
    if "scipy.spatial" in sys.modules:
        return _by_tree(points, k, progress)
    return nearest_in_boxes(points, k, progress)


def are_near(
    points: NDArray[np.float64], others: NDArray[np.float64], reach: float, progress: Progress = no_progress
) -> NDArray[np.bool_]:
    """Which points (n, 3) lie nearer than ``reach`` to any of the others (m, 3)."""
    if "scipy.spatial" in sys.modules:
        from scipy.spatial import cKDTree

        distances, _ = cKDTree(others).query(points, distance_upper_bound=reach)
        return np.isfinite(distances)
    return are_near_in_boxes(points, others, reach, progress)


def _by_tree(points: NDArray[np.float64], k: int, progress: Progress) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    from scipy.spatial import cKDTree

    n = len(points)
    tree = cKDTree(points)
    distances, indices = np.empty((n, k)), np.empty((n, k), np.intp)
    for lo in range(0, n, _BLOCK_ROWS):
        progress(lo / n)
        block = slice(lo, lo + _BLOCK_ROWS)
        distances[block], indices[block] = tree.query(points[block], k)
    return distances, indices


class _Boxes:
    """Points in boxes of about the same number, which hold what lies together."""

    def __init__(self, points: NDArray[np.float64]) -> None:
        n = len(points)
        self.order = np.arange(n)
        bounds = [0, n]
        while (parts := len(bounds) - 1) * _LEAF < n:
            halves = [0]
            for lo, hi in pairwise(bounds):
                middle = (lo + hi) // 2
                held = points[self.order[lo:hi]]
                widest = np.ptp(held, axis=0).argmax()
                self.order[lo:hi] = self.order[lo:hi][np.argpartition(held[:, widest], middle - lo)]
                halves += [middle, hi]
            assert len(halves) == 2 * parts + 1
            bounds = halves
        self.starts, self.ends = np.array(bounds[:-1]), np.array(bounds[1:])
        self.points = points[self.order]
        self.low = np.minimum.reduceat(self.points, self.starts, axis=0)
        self.high = np.maximum.reduceat(self.points, self.starts, axis=0)

    def squares_from(self, low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.float64]:
        """(m,) squared gaps between the boxes and another."""
        gaps = np.maximum(np.maximum(self.low - high, low - self.high), 0.0)
        return np.einsum("ij,ij->i", gaps, gaps)

    def places(self, boxes: NDArray[np.intp]) -> NDArray[np.intp]:
        """Places in the order of the points of some boxes."""
        return np.concatenate([np.arange(self.starts[box], self.ends[box]) for box in boxes])


def _squares(points: NDArray[np.float64], others: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, m) squared distances."""
    found = np.zeros((len(points), len(others)))
    for axis in range(3):
        gaps = points[:, axis, None] - others[:, axis]
        found += np.square(gaps, out=gaps)
    return found


def nearest_in_boxes(
    points: NDArray[np.float64], k: int, progress: Progress = no_progress
) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """As `nearest_points`, without scipy: of boxes of points, the near ones are looked through."""
    boxes = _Boxes(points)
    distances, indices = np.empty((len(points), k)), np.empty((len(points), k), np.intp)
    for number, (lo, hi) in enumerate(zip(boxes.starts, boxes.ends, strict=True)):
        if number % _FIRST == 0:
            progress(number / len(boxes.starts))
        own = boxes.points[lo:hi]
        gaps = boxes.squares_from(boxes.low[number], boxes.high[number])
        nearest = np.argsort(gaps, kind="stable")
        squares, found = np.full((len(own), k), np.inf), np.zeros((len(own), k), np.intp)
        at, step = 0, _FIRST
        while at < len(nearest) and gaps[nearest[at]] <= squares.max():
            places = boxes.places(nearest[at : at + step])
            all_squares = np.column_stack([squares, _squares(own, boxes.points[places])])
            all_found = np.column_stack([found, np.broadcast_to(boxes.order[places], (len(own), len(places)))])
            best = np.argpartition(all_squares, k - 1, axis=1)[:, :k]
            squares, found = np.take_along_axis(all_squares, best, 1), np.take_along_axis(all_found, best, 1)
            at, step = at + step, _MORE
        rising = np.argsort(squares, axis=1, kind="stable")
        distances[boxes.order[lo:hi]] = np.sqrt(np.take_along_axis(squares, rising, 1))
        indices[boxes.order[lo:hi]] = np.take_along_axis(found, rising, 1)
    return distances, indices


def are_near_in_boxes(
    points: NDArray[np.float64], others: NDArray[np.float64], reach: float, progress: Progress = no_progress
) -> NDArray[np.bool_]:
    """As `are_near`, without scipy."""
    near = np.zeros(len(points), bool)
    if not len(points) or not len(others):
        return near
    mine, theirs = _Boxes(points), _Boxes(others)
    for number, (lo, hi) in enumerate(zip(mine.starts, mine.ends, strict=True)):
        if number % _FIRST == 0:
            progress(number / len(mine.starts))
        gaps = theirs.squares_from(mine.low[number], mine.high[number])
        left = np.arange(lo, hi)
        nearest = np.argsort(gaps, kind="stable")
        nearest = nearest[gaps[nearest] < reach * reach]
        for at in range(0, len(nearest), _FIRST):
            places = theirs.places(nearest[at : at + _FIRST])
            is_near = (_squares(mine.points[left], theirs.points[places]) < reach * reach).any(axis=1)
            near[mine.order[left[is_near]]] = True
            left = left[~is_near]
            if not len(left):
                break
    return near


def connected_labels(n: int, starts: NDArray[np.integer], ends: NDArray[np.integer]) -> NDArray[np.intp]:
    """(n,) number of each point's part of a graph, parts numbered as their first points come.

    Parameters
    ----------
    n : int
        Points.
    starts, ends : (m,) int
        Which are connected, in any direction.
    """
    labels = np.arange(n, dtype=np.int32)
    while True:
        low = np.minimum(labels[starts], labels[ends])
        lower = labels.copy()
        for side in (starts, ends):
            np.minimum.at(lower, side, low)
            # Roots hear of it too, so that what they stand for goes with them.
            np.minimum.at(lower, labels[side], low)
        while not np.array_equal(further := lower[lower], lower):
            lower = further
        if np.array_equal(lower, labels):
            return np.unique(labels, return_inverse=True)[1].reshape(-1)
        labels = lower
