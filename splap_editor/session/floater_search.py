"""What floats about the subject of the open scene, found once; any strength can then be asked of it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from splap_editor.core.graph.options import GraphOptions
from splap_editor.core.graph.splat_graph import SplatGraph, splat_graph
from splap_editor.core.index_spaces import FileMask, FileRow, FileRows
from splap_editor.core.progress import Guard, StageProgress, silent, unguarded
from splap_editor.core.removal import PickedFloaters, RemovalStep
from splap_editor.core.splats.floaters import Floaters
from splap_editor.core.splats.occupancy import Ellipses, occupancy_ellipses
from splap_editor.core.splats.splats import Splats
from splap_editor.engine.floaters import scene_floaters
from splap_editor.engine.removal import Removal
from splap_editor.engine.surface import Surface


@dataclass(frozen=True, eq=False)
class FloaterSearch:
    """Likelihoods of the splats that a removal leaves.

    Parameters
    ----------
    ellipses : Ellipses
        Of those splats.
    touching : (n, n) csr_array
        Their graph.
    floaters : Floaters
    before : Removal
        What was removed when they were looked at.
    """

    ellipses: Ellipses
    touching: csr_array
    floaters: Floaters
    before: Removal

    def found(self, strength: float) -> "FoundFloaters":
        """What floats at a strength, and what of it hangs together."""
        nodes = np.flatnonzero(self.floaters.at(strength))
        labels = connected_components(self.touching[nodes][:, nodes], directed=False)[1]
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


def floater_search(
    splats: Splats,
    removal: Removal,
    surface: Surface | None,
    *,
    stages: StageProgress = silent,
    alone: Guard = unguarded,
) -> FloaterSearch:
    """Look at the splats that are left, as `splap_editor.engine.floaters.floating_rows` does for a recipe.

    Parameters
    ----------
    splats : Splats
        All of the file's.
    removal : Removal
        What is left out already.
    surface : Surface, optional
        Its graph is taken where it is the one that a recipe would make.
    stages : callable
        ``stages(name)`` gives the progress callback of a stage.
    alone : callable
        ``alone(progress)`` is entered around a graph search.
    """
    graph: SplatGraph | None = None
    if (
        surface is not None
        and surface.options == GraphOptions()
        and surface.ellipses is surface.visible
        and _leaves_out(surface, removal)
    ):
        ellipses, graph = surface.ellipses, surface.graph
    else:
        ellipses = occupancy_ellipses(splats, removed=removal.mask)
    if graph is None:
        with alone(stages("graph")):
            graph = splat_graph(ellipses, GraphOptions(), progress=stages("graph"))
    return FloaterSearch(ellipses, graph.matrix(), scene_floaters(splats, ellipses, graph, stages=stages), removal)


def _leaves_out(surface: Surface, removal: Removal) -> bool:
    """Whether a surface was made without the splats of a removal, and with all others."""
    removed = surface.ellipses.removed
    if removed is None or removal.mask is None:
        return removed is None and removal.mask is None
    return np.array_equal(removed, removal.mask)
