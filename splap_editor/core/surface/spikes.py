"""Spikes: single splats that a pose draws out into needles."""

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.index_spaces import Nodes
from splap_editor.core.surface.posed_surface import PosedSurface

GROWN = 2.5
"""A spike grew at least so many times as long as it was,"""

AGAINST = 2.0
"""so many times as much as those around it,"""

LONG = 0.02
"""and is this long, two standard deviations each way, in units of s: shorter, it is not seen."""


def spikes(posed: PosedSurface, rest_axes: NDArray[np.float32]) -> tuple[Nodes, NDArray[np.float64]]:
    """Find splats that are drawn out far more than those around them.

    Parameters
    ----------
    posed : PosedSurface
    rest_axes : (n, 2, 3) float32
        In-plane axes at rest, one standard deviation long, in world units.

    Returns
    -------
    nodes : (S,) int64
        Ascending.
    growths : (S,) float64
        How many times as long each is.
    """
    rest, now = (_lengths(axes) for axes in (rest_axes, posed.axes))
    growths = now / np.maximum(rest, np.finfo(np.float32).tiny)
    nodes = np.flatnonzero((growths > GROWN) & (4.0 * now > LONG * posed.scale))
    nodes = nodes[growths[nodes] > AGAINST * _around(posed, nodes, growths)]
    return nodes, growths[nodes]


def _lengths(axes: NDArray[np.float32]) -> NDArray[np.float64]:
    """(n,) length of the longer axis."""
    return np.sqrt(np.einsum("nai,nai->na", axes, axes, dtype=np.float64).max(axis=1))


def _around(posed: PosedSurface, nodes: Nodes, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """(S,) median of the values of what is near each node along the surface; inf where nothing is."""
    near = posed.neighborhoods
    medians = [
        np.median(values[near.indices[near.indptr[node] : near.indptr[node + 1]]])
        if near.indptr[node + 1] > near.indptr[node]
        else np.inf
        for node in nodes
    ]
    return np.array(medians, np.float64)
