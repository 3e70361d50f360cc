"""Colour maps for quantities, told apart by colour-blind eyes too.

Viridis and magma by S. van der Walt and N. Smith (CC0), cividis by Nuñez,
Anderton and Renslow ("Optimizing colormaps with consideration for color
vision deficiency", PLOS ONE 2018), purple-orange from ColorBrewer by
C. Brewer (Apache 2.0), the eight label colours by Okabe and Ito (2008).
"""

import numpy as np
from numpy.typing import NDArray

_STOPS = {
    "viridis": "440154 481a6c 472f7d 414487 39568c 31688e 2a788e 23888e 1f988b 22a884 35b779 54c568 7ad151 a5db36 "
    "d2e21b fde725",
    "cividis": "00224e 002e6c 1e3a6f 35456c 47516c 575d6d 666970 757575 848279 948e77 a59c74 b7a96e c8b866 dbc75a "
    "eed649 fee838",
    "magma": "000004 0b0924 20114b 3b0f70 57157e 721f81 8c2981 a8327d c43c75 de4968 f1605d fa7f5e fe9f6d febf84 "
    "fddea0 fcfdbf",
    "purple-orange": "2d004b 471a74 634094 8073ac a198c5 bfbbda d8daeb ededf3 f9efe1 fee0b6 fdc57f f3a649 e08214 "
    "c2660b a24e07 7f3b08",
}


def _rgb(stops: str) -> NDArray[np.uint8]:
    return np.array([[int(stop[k : k + 2], 16) for k in (0, 2, 4)] for stop in stops.split()], np.uint8)


def _ramp(stops: str) -> NDArray[np.uint8]:
    places = np.linspace(0.0, 15.0, 256)
    rgb = _rgb(stops).astype(np.float64)
    return np.rint(np.stack([np.interp(places, np.arange(16), rgb[:, k]) for k in range(3)], axis=1)).astype(np.uint8)


COLORMAPS: dict[str, NDArray[np.uint8]] = {name: _ramp(stops) for name, stops in _STOPS.items()}
"""(256, 3) uint8 by name, low values first. The last is two-sided: its middle means no change."""

TWO_SIDED = "purple-orange"

LABEL_COLORS = _rgb("56b4e9 e69f00 009e73 f0e442 cc79a7 0072b2 d55e00 b0b0b0")
"""(8, 3) uint8 for values that are names; they repeat."""

UNDEFINED = (70, 72, 78)
"""Colour of splats for which a quantity is not defined."""


def shares(values: NDArray[np.float64], low: float, high: float, *, is_log: bool = False) -> NDArray[np.float64]:
    """Place of values in a range, 0 at ``low`` and 1 at ``high``, clipped; NaN stays NaN.

    Parameters
    ----------
    values : (N,) float64
    low, high : float
        With ``is_log`` both greater than 0. An empty range puts everything from ``high`` on at 1, the rest at 0.
    is_log : bool
        Equal ratios are equally far apart; values of 0 and below are at 0.
    """
    values = np.asarray(values, np.float64)
    if is_log:
        with np.errstate(divide="ignore", invalid="ignore"):
            logs = np.where(values > 0.0, np.log(values), np.where(np.isnan(values), np.nan, -np.inf))
        values, low, high = logs, float(np.log(low)), float(np.log(high))
    if not high > low:
        return np.where(np.isnan(values), np.nan, (values >= high).astype(np.float64))
    return np.clip((values - low) / (high - low), 0.0, 1.0)


def mapped_colors(places: NDArray[np.float64], name: str) -> NDArray[np.uint8]:
    """(N, 3) uint8 colours of places 0..1 (N,) on a colour map; `UNDEFINED` for NaN."""
    rgb = COLORMAPS[name][np.rint(255.0 * np.nan_to_num(places)).astype(np.intp)]
    rgb[np.isnan(places)] = UNDEFINED
    return rgb


def label_colors(values: NDArray[np.float64]) -> NDArray[np.uint8]:
    """(N, 3) uint8 colours of whole numbers (N,) that are names; `UNDEFINED` for NaN."""
    rgb = LABEL_COLORS[np.nan_to_num(values).astype(np.intp) % len(LABEL_COLORS)]
    rgb[np.isnan(values)] = UNDEFINED
    return rgb
