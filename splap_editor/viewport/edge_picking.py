"""Which edge lies under the cursor."""

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.index_spaces import FileRows
from splap_editor.viewport.projection import Projection

END_PX, END_SHARE = 7.0, 0.3
"""So near to an end, or by such a share of a short edge, the splat is meant and not the edge."""

_DEPTH_SLACK = 0.02


def edge_under(
    projection: Projection,
    positions: NDArray[np.floating],
    edges: FileRows,
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
    edges, positions = np.asarray(edges), np.asarray(positions)
    if 2 * len(edges) < len(positions):
        pixels = projection.pixels(positions[edges].reshape(-1, 3)).reshape(-1, 2, 2)
    else:
        pixels = projection.pixels(positions)[edges]
    # Most edges are nowhere near; what follows is for the few whose box holds the pixel.
    ends = pixels[:, 0], pixels[:, 1]
    reached = (np.minimum(*ends) <= np.add(xy, reach_px)) & (np.maximum(*ends) >= np.subtract(xy, reach_px))
    near = np.flatnonzero(reached.all(axis=1))
    if not len(near):
        return None
    start, step = pixels[near, 0], pixels[near, 1] - pixels[near, 0]
    to = np.asarray(xy) - start
    square = np.maximum(np.einsum("ij,ij->i", step, step), 1e-12)
    t = np.clip(np.einsum("ij,ij->i", to, step) / square, 0.0, 1.0)
    away = np.linalg.norm(to - t[:, None] * step, axis=1)
    ends = np.minimum(np.linalg.norm(to, axis=1), np.linalg.norm(to - step, axis=1))
    away[~((away <= reach_px) & (ends > np.minimum(END_PX, END_SHARE * np.sqrt(square))))] = np.inf
    if np.isfinite(depth):
        depths = projection.depths(positions[edges[near]].reshape(-1, 3)).reshape(-1, 2)
        at = depths[:, 0] + t * (depths[:, 1] - depths[:, 0])
        away[at > depth + _DEPTH_SLACK * extent] = np.inf
    nearest = int(np.argmin(away))
    return int(near[nearest]) if np.isfinite(away[nearest]) else None
