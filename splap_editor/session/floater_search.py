"""What floats about the subject of the open scene, found once; any strength can then be asked of it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.index_spaces import FileMask, FileRow, FileRows
from splap_editor.core.progress import Runner, StageProgress, in_turn, silent
from splap_editor.core.removal import PickedFloaters, RemovalStep, rows_step
from splap_editor.core.splats.floater_evidence import REASONS
from splap_editor.core.splats.floaters import Floaters, floaters
from splap_editor.core.splats.occupancy import Ellipses, occupancy_ellipses
from splap_editor.core.splats.splats import Splats
from splap_editor.engine.removal import Removal

_WORDS = tuple(REASONS)


@dataclass(frozen=True, eq=False)
class FoundFloaters:
    """Splats that float at a strength, in groups that hang together: the largest is group 0.

    Parameters
    ----------
    strength : float
    rows : (k,) int
        Their file rows.
    labels : (k,) int
        Group of each.
    sizes : (g,) int
        How many splats are in each group.
    reasons : (g,) int
        What gives most of its splats away, a place in `REASONS`.
    n_splats : int
        Of the file.
    """

    strength: float
    rows: FileRows
    labels: NDArray[np.integer]
    sizes: NDArray[np.integer]
    reasons: NDArray[np.integer]
    n_splats: int

    @property
    def mask(self) -> FileMask:
        """(N,) which of the file's splats float."""
        mask = np.zeros(self.n_splats, bool)
        mask[self.rows] = True
        return mask

    @property
    def n_groups(self) -> int:
        """Number of groups g."""
        return len(self.sizes)

    def reason(self, group: int) -> str:
        """What gives a group away, in words."""
        return _WORDS[self.reasons[group]]

    def rows_of(self, group: int) -> FileRows:
        """File rows of a group."""
        return self.rows[self.labels == group]

    def group_of(self, row: FileRow) -> int | None:
        """The group that a splat is in, if it floats."""
        at = np.flatnonzero(self.rows == row)
        return int(self.labels[at[0]]) if len(at) else None


@dataclass(frozen=True, eq=False)
class FloaterSearch:
    """Likelihoods of the splats that a removal leaves.

    Parameters
    ----------
    ellipses : Ellipses
        Of those splats.
    floaters : Floaters
    before : Removal
        What was removed when they were looked at.
    """

    ellipses: Ellipses
    floaters: Floaters
    before: Removal

    def found(self, strength: float) -> FoundFloaters:
        """What floats at a strength, and what of it hangs together."""
        floats = self.floaters.at(strength)
        nodes = np.flatnonzero(floats)
        labels, sizes = np.unique(self.floaters.ties.pieces(floats)[nodes], return_inverse=True, return_counts=True)[1:]
        order = np.argsort(-sizes, kind="stable")
        places = np.empty_like(order)
        places[order] = np.arange(len(order))
        labels = places[labels]
        counts = np.zeros((len(sizes), len(_WORDS)), np.int64)
        np.add.at(counts, (labels, self.floaters.reasons[nodes]), 1)
        rows = self.ellipses.rows[nodes]
        return FoundFloaters(strength, rows, labels, sizes[order], counts.argmax(axis=1), self.ellipses.n_splats)

    def removal(self, found: FoundFloaters, kept: FileMask | None = None) -> Removal:
        """Removal once they are taken: the step keeps the strength, so that it replays on another capture.

        What of them is kept (N,) is brought back by a further step, by row.
        """
        mask, steps = found.mask, [RemovalStep(PickedFloaters(found.strength))]
        if kept is not None and (kept & mask).any():
            steps.append(rows_step(kept & mask, restores=True))
            mask &= ~kept
        if not mask.any():
            return self.before
        if self.before.mask is not None:
            mask |= self.before.mask
        return Removal((*self.before.steps, *steps), mask)


def floater_search(
    splats: Splats,
    removal: Removal,
    ellipses: Ellipses | None = None,
    *,
    stages: StageProgress = silent,
    run: Runner = in_turn,
) -> FloaterSearch:
    """Look at the splats that are left, as `splap_editor.engine.floaters.floating_rows` does for a recipe.

    Parameters
    ----------
    splats : Splats
        All of the file's.
    removal : Removal
        What is left out already.
    ellipses : Ellipses, optional
        Those at hand; they serve if they are of all active splats that are left.
    stages : callable
        ``stages(name)`` gives the progress callback of a stage.
    run : Runner
        Runs parts of the splats, and pictures.
    """
    if ellipses is None or not removal.like(Removal(mask=ellipses.removed)):
        ellipses = occupancy_ellipses(splats, removed=removal.mask, progress=stages("occupancy"))
    return FloaterSearch(ellipses, floaters(splats, ellipses, stages=stages, run=run), removal)
