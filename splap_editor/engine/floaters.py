"""Floaters of a file's splats, from what they are and what they contribute to pictures."""

import numpy as np

from splap_editor.core.index_spaces import FileMask
from splap_editor.core.progress import StageProgress, silent
from splap_editor.core.splats.contributions import contributions
from splap_editor.core.splats.floaters import Floaters, floaters
from splap_editor.core.splats.occupancy import Ellipses, occupancy_ellipses
from splap_editor.core.splats.splats import Splats


def scene_floaters(splats: Splats, ellipses: Ellipses, *, stages: StageProgress = silent) -> Floaters:
    """Weigh the evidence that the nodes of a scene float; any strength can be asked of the result.

    Parameters
    ----------
    splats : Splats
    ellipses : Ellipses
        Of those that are left.
    stages : callable
        ``stages(name)`` gives the progress callback of a stage.
    """
    shown = contributions(splats, ellipses, progress=stages("contributions"))
    return floaters(ellipses, shown, progress=stages("floaters"))


def floating_rows(
    splats: Splats, removed: FileMask | None, strength: float, *, stages: StageProgress = silent
) -> FileMask:
    """(N,) what floats at a strength among the splats that are left, inert ones never."""
    mask = np.zeros(splats.n_splats, bool)
    if strength <= 0.0:
        return mask
    ellipses = occupancy_ellipses(splats, removed=removed)
    if ellipses.n_nodes:
        mask[ellipses.rows[scene_floaters(splats, ellipses, stages=stages).at(strength)]] = True
    return mask
