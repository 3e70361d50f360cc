"""The main subject of a capture: where it is and how large, whatever floats about it."""

from dataclasses import dataclass, replace

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

_ROUNDS = 3
"""So often what is usual is told anew by those that are near enough to it; it settles after two."""

_MUTUAL = 4
"""A splat belongs to a surface if so many of its neighbours count it among theirs."""

_SPECK = 2e-3
"""Share of the splats that a clump must hold to be a part of anything."""

_GAP = 0.1
"""Clumps nearer to the subject than this share of its radius are parts of it."""

_SECOND = 0.8
"""Share of the subject's splats from which another clump is a subject as well."""

_COHERENT = 0.07
"""Beside the subject a splat belongs to a sparser part if its ``_K`` nearest lie within this share of the size."""

_SEEN = 0.02
"""Share of the subject's splats that a clump of a sparser part must hold to be seen as one."""

_BESIDE = 1.0
"""What goes on farther from the subject than this many times its size is no part of it: a floor, a wall."""


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
    seen : MainSubject, optional
        The same with the sparser parts beside it: what a picture of the subject shows, though the size does not go by
        it. None where there are none.
    """

    size: float
    center: NDArray[np.float64]
    half_axes: NDArray[np.float64]
    seen: "MainSubject | None" = None

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
    sample = _sample(centers - middle, np.asarray(opacities, np.float64), part_of(progress, 0.0, 0.4))
    if len(sample) <= 4 * _K:
        return _boxed(sample, middle, progress)
    near = _nearest(sample, part_of(progress, 0.4, 0.6))
    chosen = _subject_of(sample, near, part_of(progress, 0.6, 0.8))
    subject = _boxed(sample[chosen], middle, part_of(progress, 0.8, 0.9))
    is_near = subject.holds(sample + middle, room=_BESIDE * subject.size)
    beside = _parts_beside(sample, near, chosen, subject.size, is_near)
    if not beside.any():
        return subject
    return replace(subject, seen=_boxed(sample[chosen | beside], middle, part_of(progress, 0.9, 1.0)))


def _boxed(points: NDArray[np.float64], middle: NDArray[np.float64], progress: Progress) -> MainSubject:
    """The smallest box about points that are given from a middle."""
    center, half_axes = smallest_box(points, progress)
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


@dataclass(frozen=True, eq=False)
class _Nearest:
    """The ``_K`` nearest of each point: as a graph, how far the last is, and how many count the point among theirs."""

    graph: sparse.csr_array
    spacings: NDArray[np.float64]
    n_mutual: NDArray[np.integer]


def _nearest(points: NDArray[np.float64], progress: Progress) -> _Nearest:
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
    graph = sparse.csr_array((np.ones(n * _K, np.int32), neighbors[:, 1:].ravel(), row_ends), shape=(n, n))
    return _Nearest(graph, distances[:, -1], graph.multiply(graph.T).sum(axis=1))


def _subject_of(points: NDArray[np.float64], near: _Nearest, progress: Progress) -> NDArray[np.bool_]:
    """Which points the subject is made of."""
    n = len(points)
    where = np.flatnonzero(_is_solid(near))
    _, labels = connected_components(near.graph[where][:, where], directed=False)
    is_part = np.bincount(labels, minlength=1) >= max(_K, _SPECK * len(where))
    where, labels = where[is_part[labels]], labels[is_part[labels]]
    chosen = np.zeros(n, bool)
    least = 1.0
    while len(where):
        progress(0.5)
        group = _grown(points[where], labels, labels == np.argmax(np.bincount(labels)))
        if group.sum() < least:
            break
        least = max(least, _SECOND * group.sum())
        chosen[where[group]] = True
        where, labels = where[~group], labels[~group]
    # Where nothing hangs together, as in a handful of far points, all is the subject.
    return chosen if chosen.any() else ~chosen


def _is_solid(near: _Nearest) -> NDArray[np.bool_]:
    """Which points lie as close as is usual on a surface, and what is usual is told by those that do: not by haze."""
    is_solid = np.ones(len(near.spacings), bool)
    for _ in range(_ROUNDS):
        usual = np.median(near.spacings[is_solid])
        is_solid = (near.spacings <= _SPARSE * usual) & (near.n_mutual >= _MUTUAL)
        if not is_solid.any():
            break
    return is_solid


def _parts_beside(
    points: NDArray[np.float64],
    near: _Nearest,
    chosen: NDArray[np.bool_],
    size: float,
    is_near: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """Which points are of parts that hang on to the chosen ones, though sparser than they: thin, dark, see-through.

    Haze is too far apart for that, and a clump that floats elsewhere does not come close.
    """
    is_coherent = ~chosen & (near.spacings <= _COHERENT * size) & (near.n_mutual >= _MUTUAL)
    where = np.flatnonzero(is_coherent)
    _, labels = connected_components(near.graph[where][:, where], directed=False)
    n_all = np.bincount(labels, minlength=1)
    n_near = np.bincount(labels, is_near[where], minlength=1)
    is_part = (n_all >= max(_K, _SEEN * chosen.sum())) & (n_near >= 0.9 * n_all)
    beside = np.zeros(len(points), bool)
    if not is_part.any():
        return beside
    where, labels = where[is_part[labels]], labels[is_part[labels]]
    all_ = np.concatenate([np.flatnonzero(chosen), where])
    # The chosen ones are one clump, whose label comes before those of the parts.
    begun = np.concatenate([np.zeros(int(chosen.sum()), labels.dtype), labels + 1])
    beside[all_[_grown(points[all_], begun, begun == 0)]] = True
    return beside & ~chosen


def _grown(points: NDArray[np.float64], labels: NDArray[np.integer], inside: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which points are inside, or of a clump close to those, or close to one that is."""
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
