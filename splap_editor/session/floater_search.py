"""What floats about the subject of the open scene, found once; any strength can then be asked of it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from splap_editor.core.index_spaces import FileMask, FileRow, FileRows
from splap_editor.core.progress import StageProgress, silent
from splap_editor.core.removal import PickedFloaters, RemovalStep
from splap_editor.core.splats.floaters import Floaters
from splap_editor.core.splats.occupancy import Ellipses, occupancy_ellipses
from splap_editor.core.splats.splats import Splats
from splap_editor.engine.floaters import scene_floaters
from splap_editor.engine.removal import Removal


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

    def found(self, strength: float) -> "FoundFloaters":
        """What floats at a strength, and what of it hangs together."""
        nodes = np.flatnonzero(self.floaters.at(strength))
        labels = connected_components(self.floaters.touching[nodes][:, nodes], directed=False)[1]
        return FoundFloaters(self.ellipses.rows[nodes], labels, self.ellipses.n_splats)

    def removal(self, strength: float) -> Removal:
        """Removal once they are taken: the step keeps the strength, so that it replays on another capture."""
        mask = self.found(strength).mask
        if self.before.mask is not None:
            mask = mask | self.before.mask
        return Removal((*self.before.steps, RemovalStep(PickedFloaters(strength))), mask)


@dataclass(frozen=True, eq=False)
class FoundFloaters:
    """Splats that float, in groups that hang together.

    Parameters
    ----------
    rows : (k,) int
        Their file rows.
    labels : (k,) int
        Group of each.
    n_splats : int
        Of the file.
    """

    rows: FileRows
    labels: NDArray[np.int32]
    n_splats: int

    @property
    def mask(self) -> FileMask:
        """(N,) which of the file's splats float."""
        mask = np.zeros(self.n_splats, bool)
        mask[self.rows] = True
        return mask

    @property
    def groups(self) -> NDArray[np.intp]:
        """Labels of the groups, the largest first."""
        return np.argsort(-np.bincount(self.labels), kind="stable") if len(self.labels) else np.empty(0, np.intp)

    def rows_of(self, label: int) -> FileRows:
        """File rows of a group."""
        return self.rows[self.labels == label]

    def group_of(self, row: FileRow) -> int | None:
        """Label of the group that a splat is in, if it floats."""
        at = np.flatnonzero(self.rows == row)
        return int(self.labels[at[0]]) if len(at) else None


def floater_search(splats: Splats, removal: Removal, *, stages: StageProgress = silent) -> FloaterSearch:
    """Look at the splats that are left, as `splap_editor.engine.floaters.floating_rows` does for a recipe.

    Parameters
    ----------
    splats : Splats
        All of the file's.
    removal : Removal
        What is left out already.
    stages : callable
        ``stages(name)`` gives the progress callback of a stage.
    """
    ellipses = occupancy_ellipses(splats, removed=removal.mask)
    return FloaterSearch(ellipses, scene_floaters(splats, ellipses, stages=stages), removal)
