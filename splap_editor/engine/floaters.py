"""Floaters of a file's splats, by row."""

import numpy as np

from splap_editor.core.index_spaces import FileMask
from splap_editor.core.progress import Runner, StageProgress, in_turn, silent
from splap_editor.core.splats.floaters import floaters
from splap_editor.core.splats.occupancy import occupancy_ellipses
from splap_editor.core.splats.splats import Splats


def floating_rows(
    splats: Splats,
    removed: FileMask | None,
    strength: float,
    *,
    stages: StageProgress = silent,
    run: Runner = in_turn,
) -> FileMask:
    """(N,) what floats at a strength among the splats that are left, inert ones never."""
    mask = np.zeros(splats.n_splats, bool)
    if strength <= 0.0:
        return mask
    ellipses = occupancy_ellipses(splats, removed=removed)
    if ellipses.n_nodes:
        mask[ellipses.rows[floaters(splats, ellipses, stages=stages, run=run).at(strength)]] = True
    return mask
