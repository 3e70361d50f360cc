"""Weights of a handle as bands of colour, so that steps between them read as iso-lines on the surface."""

import numpy as np
from numpy.typing import NDArray

from splap_editor.viewport.colormaps import COLORMAPS

BAND_COLORS = COLORMAPS["viridis"][np.rint(np.linspace(0, 255, 10)).astype(np.intp)]
"""One for each tenth of a weight."""

REST_COLOR = (58, 60, 66)
"""Where the handle has no say."""

_SHARE = 236


def weight_tints(weights: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Tint splats by a weight, one colour for each tenth.

    Parameters
    ----------
    weights : (N,) float64
        Weights in 0..1; NaN and 0 are where the handle has no say.

    Returns
    -------
    (N, 4) uint8
        Colour, and its share of the splat's own.
    """
    tints = np.empty((len(weights), 4), np.uint8)
    tints[:, :3] = REST_COLOR
    tints[:, 3] = _SHARE
    felt = np.flatnonzero(weights > 0)
    n_bands = len(BAND_COLORS)
    tints[felt, :3] = BAND_COLORS[np.minimum((weights[felt] * n_bands).astype(np.intp), n_bands - 1)]
    return tints
