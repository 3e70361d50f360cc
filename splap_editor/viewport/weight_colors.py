"""Weights of a handle as bands of colour, so that steps between them read as iso-lines on the surface."""

import numpy as np
from numpy.typing import NDArray

BAND_COLORS = np.array(
    [
        (68, 1, 84),
        (72, 40, 120),
        (62, 74, 137),
        (49, 104, 142),
        (38, 130, 142),
        (31, 158, 137),
        (53, 183, 121),
        (110, 206, 88),
        (181, 222, 43),
        (253, 231, 37),
    ],
    np.uint8,
)
"""Ten steps of viridis: lightness rises evenly, for the colour-blind too."""

REST_COLOR = (58, 60, 66)
"""Where the handle has no say."""

_SHARE = 236


def weight_tints(weights: NDArray[np.float64], *, n_bands: int = len(BAND_COLORS)) -> NDArray[np.uint8]:
    """Tint splats by a weight, one colour for each tenth.

    Parameters
    ----------
    weights : (N,) float64
        Weights in 0..1; NaN and 0 are where the handle has no say.
    n_bands : int
        Number of steps, at most the colours there are.

    Returns
    -------
    (N, 4) uint8
        Colour, and its share of the splat's own.
    """
    tints = np.empty((len(weights), 4), np.uint8)
    tints[:, :3] = REST_COLOR
    tints[:, 3] = _SHARE
    felt = np.flatnonzero(weights > 0)
    bands = np.minimum((weights[felt] * n_bands).astype(np.int64), n_bands - 1)
    colors = BAND_COLORS[np.rint(np.linspace(0, len(BAND_COLORS) - 1, n_bands)).astype(np.int64)]
    tints[felt, :3] = colors[bands]
    return tints
