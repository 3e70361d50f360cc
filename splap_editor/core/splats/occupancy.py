"""Occupancy ellipses: the part of each splat that is really there."""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.index_spaces import FileMask, FileRows, Nodes
from splap_editor.core.progress import Progress, no_progress, part_of
from splap_editor.core.splats.main_subject import MainSubject, main_subject
from splap_editor.core.splats.morton import morton_order
from splap_editor.core.splats.rotations import quats_to_matrices
from splap_editor.core.splats.splats import LARGEST_COORDINATE, Splats

MIN_CONTRIBUTION = 1.0 / 255.0
"""Least opacity that a renderer with eight bits a channel can show."""

NEEDLE_FLOOR = 1e-4
"""Least minor semi-axis in units of the major one: a splat of zero width still has a plane and an area."""

_BLOCK_ROWS = 1 << 15

LENGTHS = (1e-60, LARGEST_COORDINATE)
"""Scales below the first have squares that leave float64's range in products of four; no splat that is larger than
coordinates may be has a place that could be drawn."""


class InertReason(IntEnum):
    """Why a splat takes no part in the graph; `ACTIVE` if it does."""

    ACTIVE = 0
    TRANSPARENT = 1
    """Its opacity is at most the least visible one."""
    THRESHOLD = 2
    """Its cut-off V is 1 or more, which no kernel value reaches."""
    NON_FINITE = 3
    """A position, scale, rotation, opacity or cut-off is NaN, infinite or too large to compute with."""
    ZERO_QUATERNION = 4
    """Its rotation is undefined."""
    ZERO_SIZE = 5
    """Both in-plane scales are zero."""
    REMOVED = 6
    """The edit leaves it out."""
    FOLLOWS = 7
    """It is left out of the surface on purpose, see `splap_editor.core.graph.carriers`."""


@dataclass(frozen=True, eq=False)
class Ellipses:
    """Occupancy ellipses of the active splats, the nodes of everything that follows.

    Nodes are numbered along a Morton curve through their centres, so that
    neighbours in space are neighbours in memory.

    Parameters
    ----------
    rows : (n,) int64
        File row of each node.
    centers : (n, 3) float64
        Centres in world units.
    semi_axes : (n, 2, 3) float64
        Major and minor semi-axis as world vectors, at right angles.
    normals : (n, 3) float64
        Unit normals, right-handed with the semi-axes. Which side they point to
        means nothing.
    cutoffs : (n,) float64
        ``√λ``: semi-axis in units of the splat's standard deviation.
    axes : (n, 3) int8
        Stored scale and rotation column that the major axis, the minor axis
        and the normal come from.
    opacities : (n,) float64
        Effective opacities, in (0, 1].
    subject : MainSubject
        What the scene is of; its size is positive.
    n_splats : int
        Number of splats N in the file, inert ones included.
    inert : (N,) uint8
        `InertReason` of each splat in file order.
    """

    rows: FileRows
    centers: NDArray[np.float64]
    semi_axes: NDArray[np.float64]
    normals: NDArray[np.float64]
    cutoffs: NDArray[np.float64]
    axes: NDArray[np.int8]
    opacities: NDArray[np.float64]
    subject: MainSubject
    n_splats: int
    inert: NDArray[np.uint8]

    @property
    def n_nodes(self) -> int:
        """Number of active splats n."""
        return len(self.rows)

    @property
    def scene_scale(self) -> float:
        """Size s of the scene: the longest side of its main subject, in world units."""
        return self.subject.size

    @cached_property
    def node_of_row(self) -> Nodes:
        """(N,) node of each file row, -1 for an inert splat."""
        nodes = np.full(self.n_splats, -1, np.int64)
        nodes[self.rows] = np.arange(self.n_nodes)
        return nodes

    @cached_property
    def removed(self) -> FileMask | None:
        """(N,) what the edit leaves out; None where it leaves out nothing."""
        removed = self.inert == InertReason.REMOVED
        return removed if removed.any() else None

    @cached_property
    def reaches(self) -> NDArray[np.float64]:
        """(n,) major semi-axis in world units."""
        return np.sqrt(np.einsum("ij,ij->i", self.semi_axes[:, 0], self.semi_axes[:, 0]))


def occupancy_ellipses(
    splats: Splats,
    *,
    min_contribution: float = MIN_CONTRIBUTION,
    removed: FileMask | None = None,
    progress: Progress = no_progress,
) -> Ellipses:
    """Ellipses on which the splats contribute visibly.

    A kernel counts where it exceeds ``max(V, c / α)``, an ellipse with
    semi-axes ``√λ σ``, ``λ = -2 ln max(V, c / α)`` [1]_. A splat with three
    scales takes its two largest, unless the layout names the normal axis.

    Parameters
    ----------
    splats : Splats
        The scene, in file order.
    min_contribution : float
        Least visible contribution c, in (0, 1).
    removed : (N,) bool, optional
        Splats that are left out: they are inert, and the subject is found without them.
    progress : Progress
        Told the share of steps taken, block by block; may cancel.

    Returns
    -------
    Ellipses
        One per active splat. A splat whose minor scale vanishes gets a width
        of 1e-4 of its length. A file without an active splat yields none.

    Raises
    ------
    ValueError
        If ``min_contribution`` is outside (0, 1).

    References
    ----------
    .. [1] SpLap, 3DV 2026, Eq. 4 and supplement A.
    """
    if not 0.0 < min_contribution < 1.0:
        raise ValueError(f"min_contribution must lie between 0 and 1, got {min_contribution}")
    n = splats.n_splats
    axes, inert = np.empty((n, 3), np.int8), np.empty(n, np.uint8)
    sigmas, levels = np.empty((n, 2)), np.empty(n)
    with np.errstate(all="ignore"):
        # Rows that overflow or hold NaN are found by their results.
        scales = splats.scales
        progress(0.1)
        opacities = splats.opacities
        for block in _blocks(n, part_of(progress, 0.15, 0.4)):
            axes[block] = _ordered_axes(scales[block], splats.normal_axis)
            sigmas[block] = np.take_along_axis(scales[block], axes[block, :2].astype(np.int64), axis=1)
            thresholds = np.zeros(len(axes[block])) if splats.thresholds is None else np.abs(splats.thresholds[block])
            levels[block] = np.maximum(thresholds.astype(np.float64), min_contribution / opacities[block])
            inert[block] = _inert_reasons(splats, block, sigmas[block], thresholds, min_contribution)
        if removed is not None:
            inert[removed] = InertReason.REMOVED
        rows = np.flatnonzero(inert == InertReason.ACTIVE)
        centers = np.asarray(splats.means[rows], np.float64)
        order = morton_order(centers, part_of(progress, 0.4, 0.5))
    progress(0.5)
    rows, centers = rows[order], centers[order]
    progress(0.52)
    axes, sigmas, opacities = axes[rows], sigmas[rows], np.asarray(opacities[rows], np.float64)
    progress(0.54)
    semi_axes, normals = np.empty((len(rows), 2, 3)), np.empty((len(rows), 3))
    cutoffs = np.sqrt(-2.0 * np.log(levels[rows]))
    major = cutoffs * sigmas[:, 0]
    for block in _blocks(len(rows), part_of(progress, 0.56, 0.8)):
        matrices = quats_to_matrices(np.asarray(splats.quats[rows[block]], np.float64))
        columns = np.take_along_axis(matrices.swapaxes(1, 2), axes[block, :, None].astype(int), axis=1)
        minor = np.maximum(cutoffs[block] * sigmas[block, 1], NEEDLE_FLOOR * major[block])
        semi_axes[block] = columns[:, :2] * np.stack([major[block], minor], axis=1)[:, :, None]
        normals[block] = np.cross(columns[:, 0], columns[:, 1])
    return Ellipses(
        rows=rows,
        centers=centers,
        semi_axes=semi_axes,
        normals=normals,
        cutoffs=cutoffs,
        axes=axes,
        opacities=opacities,
        subject=_subject(centers, opacities, major, part_of(progress, 0.8, 1.0)),
        n_splats=n,
        inert=inert,
    )


def _blocks(n: int, progress: Progress) -> Iterator[slice]:
    """Rows to be looked at together; ``progress`` may cancel before each of them."""
    for lo in range(0, n, _BLOCK_ROWS):
        progress(lo / n)
        yield slice(lo, lo + _BLOCK_ROWS)


def _subject(
    centers: NDArray[np.float64], opacities: NDArray[np.float64], major: NDArray[np.float64], progress: Progress
) -> MainSubject:
    """The main subject; where all centres coincide, a cube as large as the largest splat, or of side 1."""
    subject = main_subject(centers, opacities, progress)
    if subject.size > 0.0:
        return subject
    half = float(major.max(initial=0.0)) or 0.5
    return MainSubject(2.0 * half, subject.center, half * np.eye(3))


def _ordered_axes(scales: NDArray[np.float64], normal_axis: int | None) -> NDArray[np.int8]:
    """(N, 3) stored columns of the major axis, the minor axis and the normal; equal scales keep their order."""
    scales = np.where(np.isnan(scales), np.inf, scales)
    if scales.shape[1] == 2:
        scales = np.concatenate([scales, np.full((len(scales), 1), -1.0)], axis=1)
    elif normal_axis is not None:
        scales[:, normal_axis] = -1.0
    return np.argsort(-scales, axis=1, kind="stable").astype(np.int8)


def _inert_reasons(
    splats: Splats,
    block: slice,
    sigmas: NDArray[np.float64],
    thresholds: NDArray[np.floating],
    min_contribution: float,
) -> NDArray[np.uint8]:
    """Reason why each splat of a block is inert; where several hold, the one that says most about the file."""
    scales, opacities, quats = splats.scales[block], splats.opacities[block], splats.quats[block]
    reasons = np.zeros(len(scales), np.uint8)
    reasons[sigmas[:, 0] < LENGTHS[0]] = InertReason.ZERO_SIZE
    reasons[thresholds >= 1.0] = InertReason.THRESHOLD
    reasons[min_contribution / opacities >= 1.0] = InertReason.TRANSPARENT
    reasons[~np.any(quats, axis=1)] = InertReason.ZERO_QUATERNION
    finite = np.isfinite(opacities) & np.isfinite(thresholds) & (scales < LENGTHS[1]).all(axis=1)
    finite &= np.isfinite(quats).all(axis=1) & (np.abs(splats.means[block]) < LENGTHS[1]).all(axis=1)
    reasons[~finite] = InertReason.NON_FINITE
    return reasons
