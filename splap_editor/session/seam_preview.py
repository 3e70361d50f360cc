"""The seam along which two parts would be taken apart, found in the background."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import minimum_spanning_tree
from scipy.spatial import cKDTree

from splap_editor.core.graph.options import Separation
from splap_editor.core.index_spaces import FileRows
from splap_editor.engine.strokes import stroke_seam
from splap_editor.engine.surface import Surface

N_BESIDE = 8
"""Nearest cut contacts among which the line of a seam goes on."""


@dataclass(frozen=True, eq=False)
class FoundSeam:
    """What a separation would cut.

    Parameters
    ----------
    stroke : Separation
    rows : (E, 2) int64
        File rows of each contact cut.
    line : (S, 2) int64
        Pairs of contacts whose middles, joined, draw the seam.
    length : float
        Of that line at rest, in world units.
    """

    stroke: Separation
    rows: FileRows
    line: NDArray[np.int64]
    length: float


def found_seam(surface: Surface, stroke: Separation) -> FoundSeam:
    """Find what a separation would cut in a surface as it is mended so far; for the worker.

    Raises
    ------
    ValueError
        Both parts are nearest to the same splat.
    """
    ellipses = surface.ellipses
    edges = stroke_seam(ellipses, surface.graph, stroke).edges
    line, length = seam_line(ellipses.centers[edges].mean(axis=1))
    return FoundSeam(stroke, ellipses.rows[edges], line, length)


def seam_line(middles: NDArray[np.float64]) -> tuple[NDArray[np.int64], float]:
    """Shortest tree over the middles (E, 3) of the contacts of a seam: pairs (S, 2), and its length."""
    n = len(middles)
    if n < 2:
        return np.empty((0, 2), np.int64), 0.0
    k = min(N_BESIDE + 1, n)
    apart, beside = cKDTree(middles).query(middles, k=k)
    # Spanning trees of older scipy take no other integers.
    starts, ends = np.repeat(np.arange(n, dtype=np.int32), k), beside.ravel().astype(np.int32)
    # One more than the distance: middles that coincide are joined too.
    near = sp.coo_array((apart.ravel() + 1.0, (starts, ends)), shape=(n, n)).tocsr()
    near.setdiag(0.0)
    near.eliminate_zeros()
    tree = minimum_spanning_tree(near.maximum(near.T)).tocoo()
    line = np.stack([tree.row, tree.col], axis=1).astype(np.int64)
    return line, float(np.linalg.norm(middles[line[:, 0]] - middles[line[:, 1]], axis=1).sum())
