"""What an edit removes: the steps that say it, and the splats they come to in the open file."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from splap_editor.core.index_spaces import FileMask
from splap_editor.core.progress import Guard, StageProgress, silent, unguarded
from splap_editor.core.removal import Finder as Find
from splap_editor.core.removal import (
    Picked,
    PickedFloaters,
    PickedRange,
    RemovalStep,
    after_step,
    names_only_rows,
    removed_splats,
    rows_step,
)
from splap_editor.core.splats.splats import Splats


@dataclass(frozen=True, eq=False)
class Removal:
    """Splats that are left out of everything, and how they were chosen.

    Parameters
    ----------
    steps : tuple of RemovalStep
        As a recipe has them.
    mask : (N,) bool, optional
        What they come to; None where nothing is removed. Never written to.
    """

    steps: tuple[RemovalStep, ...] = ()
    mask: FileMask | None = None

    @property
    def n_removed(self) -> int:
        """How many splats are left out."""
        return 0 if self.mask is None else int(np.count_nonzero(self.mask))

    @property
    def nbytes(self) -> int:
        """Memory of the mask and of the rows that steps name."""
        rows = sum(getattr(step.picked, "rows", np.empty(0)).nbytes for step in self.steps)
        return rows + (0 if self.mask is None else self.mask.nbytes)

    def with_step(self, step: RemovalStep, splats: Splats) -> Removal:
        """Take a further step; ``splats`` are all of the file's."""
        before = np.zeros(splats.n_splats, bool) if self.mask is None else self.mask
        return self._after((*self.steps, step), after_step(before, step, splats.means, Finder(splats)))

    def with_rows(self, rows: FileMask, *, restores: bool = False) -> Removal:
        """Remove, or bring back, the splats of a mask (N,), by their rows.

        What was chosen by rows alone stays one list, however many steps it took.
        """
        before = np.zeros_like(rows) if self.mask is None else self.mask
        after = before & ~rows if restores else before | rows
        if np.array_equal(before, after):
            return self
        if names_only_rows(self.steps):
            return self._after((rows_step(after),), after)
        return self._after((*self.steps, rows_step(before ^ after, restores=restores)), after)

    @staticmethod
    def _after(steps: tuple[RemovalStep, ...], mask: FileMask) -> Removal:
        return Removal(steps, mask) if mask.any() else Removal()

    def like(self, other: Removal) -> bool:
        """Whether both leave out the same splats."""
        if self is other or self.mask is None or other.mask is None:
            return self.mask is other.mask
        return np.array_equal(self.mask, other.mask)


def removal_of(steps: Iterable[RemovalStep], splats: Splats, find: Find | None = None) -> Removal:
    """Find what the steps of a recipe remove from a file's splats.

    Parameters
    ----------
    steps : iterable of RemovalStep
    splats : Splats
        All of the file's.
    find : callable, optional
        A `Finder`, for who wants to be told how far it is.

    Raises
    ------
    ValueError
        A row is not in the file, or a quantity does not exist.
    """
    steps = tuple(steps)
    mask = removed_splats(steps, splats.means, find or Finder(splats)) if steps else None
    # Steps that remove nothing here may do so in another capture.
    return Removal(steps, mask if mask is not None and mask.any() else None)


class Finder:
    """Picks splats by a quantity or as floaters: what needs more than centres.

    Parameters
    ----------
    splats : Splats
        All of the file's.
    stages : callable
        ``stages(name)`` gives the progress callback of a stage.
    alone : callable
        ``alone(progress)`` is entered around a graph search.
    """

    def __init__(self, splats: Splats, *, stages: StageProgress = silent, alone: Guard = unguarded) -> None:
        self._splats = splats
        self.stages = stages
        self._alone = alone

    def __call__(self, picked: Picked, removed: FileMask) -> FileMask:
        """(N,) which of the splats that are left are picked."""
        if isinstance(picked, PickedFloaters):
            from splap_editor.engine.floaters import floating_rows

            return floating_rows(self._splats, removed, picked.strength, stages=self.stages)
        assert isinstance(picked, PickedRange)
        values = rest_values(picked.quantity, self._splats, removed, stages=self.stages, alone=self._alone)
        with np.errstate(invalid="ignore"):
            return (values >= picked.least) & (values <= picked.most)


def rest_values(
    name: str,
    splats: Splats,
    removed: FileMask | None = None,
    *,
    stages: StageProgress = silent,
    alone: Guard = unguarded,
) -> np.ndarray:
    """(N,) a quantity of a scene at rest, NaN for what is removed.

    Raises
    ------
    ValueError
        There is no such quantity, or it depends on a pose.
    """
    from splap_editor.core.splats.occupancy import occupancy_ellipses
    from splap_editor.engine.quantities import QUANTITIES, Snapshot, values_of

    allowed = [known.name for known in QUANTITIES.values() if known.is_of_rest]
    if name not in allowed:
        raise ValueError(f"splats cannot be removed by {name!r}: the quantities are {', '.join(allowed)}")
    ellipses = occupancy_ellipses(splats, removed=removed)
    graph = None
    if QUANTITIES[name].needs:
        from splap_editor.core.graph.options import GraphOptions
        from splap_editor.core.graph.splat_graph import splat_graph

        with alone(stages("graph")):
            graph = splat_graph(ellipses, GraphOptions(), progress=stages("graph"))
    return values_of(QUANTITIES[name], Snapshot(splats, ellipses, bare_graph=graph))
