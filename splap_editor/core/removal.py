"""What is removed from a scene: steps that each pick splats by row, place or quantity."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.index_spaces import FileMask, FileRows
from splap_editor.core.splats.rotations import quats_to_matrices
from splap_editor.core.splats.splats import LARGEST_COORDINATE

Vector = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class PickedRows:
    """Splats by file row.

    Parameters
    ----------
    rows : (k,) int32
        Ascending, each once.
    """

    rows: FileRows

    def __eq__(self, other: object) -> bool:
        return isinstance(other, PickedRows) and np.array_equal(self.rows, other.rows)

    def __hash__(self) -> int:
        return hash(self.rows.tobytes())


@dataclass(frozen=True)
class PickedBox:
    """Splats whose centre lies in a box, its faces included.

    Parameters
    ----------
    center, size : 3 floats
        Middle, and lengths of the sides, in the file's units.
    rotate : 4 floats
        Unit quaternion w, x, y, z that turns the world's axes to the box's.
    """

    center: Vector
    size: Vector
    rotate: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class PickedBall:
    """Splats whose centre lies within a distance of a point, in the file's units."""

    center: Vector
    radius: float


@dataclass(frozen=True)
class PickedSide:
    """Splats whose centre lies on the side of a plane that its normal, of any length but zero, points to."""

    point: Vector
    normal: Vector


@dataclass(frozen=True)
class PickedRange:
    """Splats for which a quantity is within bounds, both included; where it is not defined they are never picked."""

    quantity: str
    least: float = -np.inf
    most: float = np.inf


@dataclass(frozen=True)
class PickedFloaters:
    """What floats about the subject, see `splap_editor.core.splats.floaters`; 0 takes nothing."""

    strength: float = 0.5


Picked = PickedRows | PickedBox | PickedBall | PickedSide | PickedRange | PickedFloaters


@dataclass(frozen=True)
class RemovalStep:
    """One step of a removal.

    Parameters
    ----------
    picked : Picked
    outside : bool
        Everything else is meant, as when a box is cropped to.
    restores : bool
        Brought back rather than removed.
    """

    picked: Picked
    outside: bool = False
    restores: bool = False


_BLOCK_ROWS = 1 << 14

Finder = Callable[[Picked, FileMask], FileMask]
"""``find(picked, removed)``: (N,) splats of a range or of floaters, those already removed left out of account."""


def removed_splats(steps: Iterable[RemovalStep], means: NDArray[np.floating], find: Finder | None = None) -> FileMask:
    """Take the steps of a removal in turn.

    Parameters
    ----------
    steps : iterable of RemovalStep
    means : (N, 3) float
        Centres in the file's units.
    find : callable, optional
        Needed for ranges and floaters.

    Returns
    -------
    (N,) bool
        What is removed in the end.

    Raises
    ------
    ValueError
        A row is not in the file.
    """
    removed = np.zeros(len(means), bool)
    for step in steps:
        removed = after_step(removed, step, means, find)
    return removed


def after_step(
    removed: FileMask, step: RemovalStep, means: NDArray[np.floating], find: Finder | None = None
) -> FileMask:
    """(N,) what is removed once a further step is taken; see `removed_splats`."""
    picked = step.picked
    if isinstance(picked, PickedRange | PickedFloaters):
        assert find is not None
        inside = find(picked, removed)
    else:
        inside = picked_splats(picked, means)
    if step.outside:
        inside = ~inside
    return removed & ~inside if step.restores else removed | inside


def picked_splats(picked: PickedRows | PickedBox | PickedBall | PickedSide, means: NDArray[np.floating]) -> FileMask:
    """(N,) which splats are picked by row or by where their centre (N, 3) lies.

    Raises
    ------
    ValueError
        A row is not in the file.
    """
    if isinstance(picked, PickedRows):
        found = np.zeros(len(means), bool)
        if len(picked.rows) and not 0 <= picked.rows[0] <= picked.rows[-1] < len(means):
            raise ValueError(
                f"row {picked.rows[-1]} is named, but the file has rows 0 to {len(means) - 1}: "
                "the recipe was made for another file"
            )
        found[picked.rows] = True
        return found
    found = np.empty(len(means), bool)
    # Block by block and column by column: what is worked on stays in the cache, and means may be views into a file.
    for lo in range(0, len(means), _BLOCK_ROWS):
        block = slice(lo, lo + _BLOCK_ROWS)
        found[block] = _picked_by_place(picked, np.array(means[block].T, np.float64, order="C"))
    return found


def _picked_by_place(picked: PickedBox | PickedBall | PickedSide, points: NDArray[np.float64]) -> FileMask:
    """(n,) which of some points (3, n), which are overwritten, are picked."""
    if isinstance(picked, PickedSide):
        normal = np.asarray(picked.normal, np.float64)
        normal = normal / np.abs(normal).max()
        return normal @ points > normal @ np.asarray(picked.point)
    points -= np.array(picked.center)[:, None]
    if isinstance(picked, PickedBall):
        points *= points
        return points.sum(axis=0) <= picked.radius**2
    local = quats_to_matrices(np.array([picked.rotate]))[0].T @ points
    return (np.abs(local) <= 0.5 * np.array(picked.size)[:, None]).all(axis=0)


def rows_step(mask: FileMask, *, restores: bool = False) -> RemovalStep:
    """A step that names the splats of a mask (N,) by row."""
    return RemovalStep(PickedRows(np.flatnonzero(mask).astype(np.int32)), restores=restores)


def names_only_rows(steps: Sequence[RemovalStep]) -> bool:
    """Whether every step goes by file row, and so holds for one file alone."""
    return all(isinstance(step.picked, PickedRows) for step in steps)


LARGEST_SIZE = 4.0 * LARGEST_COORDINATE
"""Largest side of a box, and radius of a ball: as far as any two splats can be apart."""
