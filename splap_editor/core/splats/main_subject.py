"""The main subject of a capture: where it is and how large, whatever floats about it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from splap_editor.core.progress import Progress, no_progress, part_of
from splap_editor.core.splats.smallest_box import smallest_box

_SAMPLE = 40_000
"""So many splats tell where the subject is; more cost time and move its size by less than a spacing."""

_BLOCK_ROWS = 1 << 13
_K = 8
_FAINT = 0.25
"""Share of the median opacity below which a splat is haze wherever it lies."""

_SPARSE = 3.2
"""A splat belongs to no surface if its ``_K`` nearest lie so many times farther off than is usual."""

_MUTUAL = 4
"""A splat belongs to a surface if so many of its neighbours count it among theirs."""

_SPECK = 2e-3
"""Share of the splats that a clump must hold to be a part of anything."""

_GAP = 0.1
"""Clumps nearer to the subject than this share of its radius are parts of it."""

_SECOND = 0.8
"""Share of the subject's splats from which another clump is a subject as well."""


@dataclass(frozen=True, eq=False)
class MainSubject:
    """A box about what a capture is of.

    Parameters
    ----------
    size : float
        Its longest side in world units; 0 if there are no splats or all coincide.
    center : (3,) float64
        Middle of the box, in world units.
    half_axes : (3, 3) float64
        From the middle to three faces, as world vectors at right angles, the longest first.
    """

    size: float
    center: NDArray[np.float64]
    half_axes: NDArray[np.float64]

    @property
    def corners(self) -> NDArray[np.float64]:
        """(8, 3) corners of the box, in world units."""
        signs = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)])
        return self.center + signs @ self.half_axes

    def holds(self, points: NDArray[np.floating], *, room: float = 0.0) -> NDArray[np.bool_]:
        """Which points (n, 3) lie in the box, or outside of a face by no more than ``room`` in world units."""
        inside = np.ones(len(points), bool)
        for half_axis in self.half_axes:
            length = np.linalg.norm(half_axis)
            if length > 0.0:
                axis = half_axis / length
                inside &= np.abs(points @ axis - self.center @ axis) <= length + room
        return inside


def main_subject(
    points: NDArray[np.floating], opacities: NDArray[np.floating], progress: Progress = no_progress
) -> MainSubject:
    """Find what a capture is of, floaters and haze left out.

    A surface is dense and its splats are neighbours of each other: those whose
    nearest lie unusually far, or do not count them among their own nearest, are
    haze. What remains falls into clumps. The subject is the largest one with
    all that lie close to it, and any other nearly as large.

    Turning, moving or shuffling the splats moves the result with them, up to rounding.

    Parameters
    ----------
    points : (n, 3) float
        Finite centres in world units.
    opacities : (n,) float
        In (0, 1].
    progress : Progress
        Told the share of steps taken; may cancel.

    Returns
    -------
    MainSubject
        Of a clean scene, the smallest box about all centres, see `smallest_box`.
    """
    if not len(points):
        return MainSubject(0.0, np.zeros(3), np.zeros((3, 3)))
    centers = np.asarray(points, np.float64)
    middle = centers.mean(axis=0)
    sample = _sample(centers - middle, np.asarray(opacities, np.float64), part_of(progress, 0.0, 0.6))
    progress(0.6)
    kept = sample[_subject_of(sample, part_of(progress, 0.6, 0.9))] if len(sample) > 4 * _K else sample
    progress(0.9)
    center, half_axes = smallest_box(kept, part_of(progress, 0.9, 1.0))
    return MainSubject(2.0 * float(np.linalg.norm(half_axes[0])), center + middle, half_axes)


def _sample(points: NDArray[np.float64], opacities: NDArray[np.float64], progress: Progress) -> NDArray[np.float64]:
    """Points that are not faint, thinned evenly over their opacities, which have nothing to do with place."""
    visible = opacities >= _FAINT * np.median(opacities)
    progress(0.2)
    points, opacities = points[visible], opacities[visible]
    step = -(-len(points) // _SAMPLE)
    if step == 1:
        return points
    progress(0.4)
    # By opacity and then by distance, one sort after the other.
    order = np.argsort(np.einsum("ij,ij->i", points, points), kind="stable")
    progress(0.6)
    return points[order[np.argsort(opacities[order], kind="stable")[::step]]]


def _subject_of(points: NDArray[np.float64], progress: Progress) -> NDArray[np.bool_]:
    """Which points the subject is made of."""
    n = len(points)
    tree = cKDTree(points)
    progress(0.2)
    distances, neighbors = np.empty((n, _K + 1)), np.empty((n, _K + 1), np.intp)
    for lo in range(0, n, _BLOCK_ROWS):
        progress(0.2 + 0.3 * lo / n)
        block = slice(lo, lo + _BLOCK_ROWS)
        distances[block], neighbors[block] = tree.query(points[block], _K + 1)
    progress(0.5)
    row_ends = np.arange(0, n * _K + 1, _K)
    near = sparse.csr_array((np.ones(n * _K, np.int32), neighbors[:, 1:].ravel(), row_ends), shape=(n, n))
    spacings = distances[:, -1]
    is_solid = (spacings <= _SPARSE * np.median(spacings)) & (near.multiply(near.T).sum(axis=1) >= _MUTUAL)
    where = np.flatnonzero(is_solid)
    _, labels = connected_components(near[where][:, where], directed=False)
    is_part = np.bincount(labels, minlength=1) >= max(_K, _SPECK * len(where))
    where, labels = where[is_part[labels]], labels[is_part[labels]]
    chosen = np.zeros(n, bool)
    least = 1.0
    while len(where):
        progress(0.9)
        group = _grown(points[where], labels)
        if group.sum() < least:
            break
        least = max(least, _SECOND * group.sum())
        chosen[where[group]] = True
        where, labels = where[~group], labels[~group]
    # Where nothing hangs together, as in a handful of far points, all is the subject.
    return chosen if chosen.any() else ~chosen


def _grown(points: NDArray[np.float64], labels: NDArray[np.integer]) -> NDArray[np.bool_]:
    """Which points are of the largest clump, or of one close to it, or close to those."""
    inside = labels == np.argmax(np.bincount(labels))
    newest = inside
    while True:
        center = points[inside].mean(axis=0)
        gap = _GAP * np.sqrt(np.square(points[inside] - center).sum(axis=1).max())
        rest = np.flatnonzero(~inside)
        distances, _ = cKDTree(points[newest]).query(points[rest], distance_upper_bound=gap)
        newest = np.isin(labels, labels[rest[np.isfinite(distances)]])
        if not newest.any():
            return inside
        inside = inside | newest
