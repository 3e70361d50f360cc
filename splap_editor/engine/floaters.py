"""Floaters of a file's splats, from what is at hand: its graph, and what its splats contribute to pictures."""

import numpy as np

from splap_editor.core.graph.options import GraphOptions
from splap_editor.core.graph.splat_graph import SplatGraph, splat_graph
from splap_editor.core.index_spaces import FileMask
from splap_editor.core.progress import Guard, StageProgress, silent, unguarded
from splap_editor.core.splats.contributions import contributions
from splap_editor.core.splats.floaters import Floaters, floaters
from splap_editor.core.splats.occupancy import Ellipses, occupancy_ellipses
from splap_editor.core.splats.splats import Splats


def scene_floaters(
    splats: Splats,
    ellipses: Ellipses,
    graph: SplatGraph | None = None,
    *,
    stages: StageProgress = silent,
    alone: Guard = unguarded,
) -> Floaters:
    """Weigh the evidence that the nodes of a scene float; any strength can be asked of the result.

    Parameters
    ----------
    splats : Splats
    ellipses : Ellipses
        Of those that are left.
    graph : SplatGraph, optional
        Theirs, as `GraphOptions` has it by default; made here without.
    stages : callable
        ``stages(name)`` gives the progress callback of a stage.
    alone : callable
        ``alone(progress)`` is entered around the graph search.
    """
    if graph is None:
        with alone(stages("graph")):
            graph = splat_graph(ellipses, GraphOptions(), progress=stages("graph"))
    shown = contributions(splats, ellipses, progress=stages("contributions"))
    return floaters(splats, ellipses, graph.matrix(), shown)


def floating_rows(
    splats: Splats,
    removed: FileMask | None,
    strength: float,
    *,
    stages: StageProgress = silent,
    alone: Guard = unguarded,
) -> FileMask:
    """(N,) what floats at a strength among the splats that are left, inert ones never."""
    mask = np.zeros(splats.n_splats, bool)
    if strength <= 0.0:
        return mask
    ellipses = occupancy_ellipses(splats, removed=removed)
    if ellipses.n_nodes:
        found = scene_floaters(splats, ellipses, stages=stages, alone=alone)
        mask[ellipses.rows[found.at(strength)]] = True
    return mask
