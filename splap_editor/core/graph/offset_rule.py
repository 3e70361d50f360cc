"""The paper's rule: every pair of ellipses that comes within a gap of each other is an edge."""

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.graph.ellipse_tree import EllipseTree, offset_pairs
from splap_editor.core.progress import Progress


def offset_edges(tree: EllipseTree, epsilon: float, progress: Progress) -> tuple[NDArray[np.int32], None]:
    """Every two ellipses whose normal-wise offset is at most ε in one direction at least [1]_.

    Parameters
    ----------
    tree : EllipseTree
    epsilon : float
        World units.
    progress : Progress

    Returns
    -------
    edges : (E, 2) int32
        Nodes, each pair once.
    touch : None
        The rule ranks nothing.

    References
    ----------
    .. [1] SpLap, 3DV 2026, Sec. 4.1 and supplement B.
    """
    buffer = np.empty((1 << 18, 2), np.int32)
    chunks, start, n = [np.empty((0, 2), np.int32)], 0, len(tree.nodes)
    while start < n:
        end, count = offset_pairs(start, *tree.arrays, epsilon, buffer)
        if end == start:
            buffer = np.empty((2 * len(buffer), 2), np.int32)
            continue
        chunks.append(buffer[:count].copy())
        start = end
        progress(0.9 * start / n)
    return np.concatenate(chunks), None
