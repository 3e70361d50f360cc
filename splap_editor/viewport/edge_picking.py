"""Which edge lies under the cursor."""

import numpy as np
from numpy.typing import NDArray

from splap_editor.viewport.projection import Projection

END_PX, END_SHARE = 7.0, 0.3
"""So near to an end, or by such a share of a short edge, the splat is meant and not the edge."""

_DEPTH_SLACK = 0.02


def edge_under(
    projection: Projection,
    positions: NDArray[np.floating],
    edges: NDArray[np.integer],
    xy: tuple[float, float],
    reach_px: float,
    *,
    depth: float = np.inf,
    extent: float = 1.0,
) -> int | None:
    """Nearest edge to a pixel.

    Parameters
    ----------
    projection : Projection
    positions : (N, 3) float
        World positions of the splats.
    edges : (E, 2) int
        Rows joined.
    xy : 2 floats
        Device pixels.
    reach_px : float
        Edges farther from the pixel do not count, nor do those of which it is at an end.
    depth : float
        Distance before the eye of the surface under the pixel; what lies behind it does not count.
    extent : float
        Size of the scene, by which an edge may lie under the surface that it belongs to.

    Returns
    -------
    int or None
        Index into ``edges``.
    """
    if not len(edges):
        return None
    rows, places = np.unique(np.asarray(edges), return_inverse=True)
    pixels = projection.pixels(np.asarray(positions)[rows])[places.reshape(-1, 2)]
    start, step = pixels[:, 0], pixels[:, 1] - pixels[:, 0]
    to = np.asarray(xy) - start
    square = np.einsum("ij,ij->i", step, step)
    with np.errstate(invalid="ignore", divide="ignore"):
        t = np.clip(np.einsum("ij,ij->i", to, step) / square, 0.0, 1.0)
    away = np.linalg.norm(to - t[:, None] * step, axis=1)
    ends = np.minimum(np.linalg.norm(to, axis=1), np.linalg.norm(to - step, axis=1))
    away[~((away <= reach_px) & (ends > np.minimum(END_PX, END_SHARE * np.sqrt(square))))] = np.inf
    if np.isfinite(depth):
        near = np.flatnonzero(np.isfinite(away))
        depths = projection.depths(np.asarray(positions)[np.asarray(edges)[near]].reshape(-1, 3)).reshape(-1, 2)
        at = depths[:, 0] + t[near] * (depths[:, 1] - depths[:, 0])
        away[near[at > depth + _DEPTH_SLACK * extent]] = np.inf
    nearest = int(np.argmin(away))
    return nearest if np.isfinite(away[nearest]) else None
