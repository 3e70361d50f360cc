"""Two parts tied together: the contacts by which they meet best."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from splap_editor.core.graph.ellipse_offset import touch_scales
from splap_editor.core.splats.occupancy import Ellipses

RIM_DEPTH = 4.0
"""A rim is as deep as so many times the reach of the splats that face each other."""

N_CANDIDATES = 12
"""Nearest centres on the other side among which a splat looks for its best contact."""


def best_contacts(
    ellipses: Ellipses,
    first: NDArray[np.integer],
    second: NDArray[np.integer],
    epsilon: float,
    *,
    reach: float = np.inf,
) -> NDArray[np.int64]:
    """Contacts by which two sets of nodes are best joined.

    Each node of one set ranks its nearest ones of the other by touch scale,
    then by distance; those that choose each other are joined, at least the best
    pair of all. Along a gap this gives about one contact for each splat of its
    rims, and none for what lies behind them.

    Parameters
    ----------
    ellipses : Ellipses
        n nodes.
    first, second : (A,), (B,) int
        Nodes; none belongs to both.
    epsilon : float
        Tolerance of a contact along the normals in world units.
    reach : float
        Largest distance of two centres that are joined, in world units.

    Returns
    -------
    (P, 2) int64
        Pairs of nodes, one of each set, the best first; none if a set is empty or nothing is near enough.
    """
    first, second = np.unique(first), np.unique(second)
    if not len(first) or not len(second):
        return np.empty((0, 2), np.int64)
    pairs = np.concatenate([near_pairs(ellipses, first, second), near_pairs(ellipses, second, first)[:, ::-1]])
    pairs = np.unique(pairs, axis=0)
    apart = np.linalg.norm(ellipses.centers[pairs[:, 0]] - ellipses.centers[pairs[:, 1]], axis=1)
    pairs = pairs[apart <= reach]
    pairs = pairs[contact_order(ellipses, pairs, epsilon)]
    # The best of each end comes first in the order.
    best_of_first, best_of_second = (np.unique(pairs[:, side], return_index=True)[1] for side in (0, 1))
    chosen = np.intersect1d(best_of_first, best_of_second)
    return pairs[np.union1d(chosen, [0]) if len(pairs) else chosen]


def facing_rims(
    ellipses: Ellipses, first: NDArray[np.integer], second: NDArray[np.integer]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Nodes of two sets that face each other across the gap between them.

    Parameters
    ----------
    ellipses : Ellipses
    first, second : (A,), (B,) int
        Nodes; at least one each, none of both.

    Returns
    -------
    (a,), (b,) int64
        Those hardly farther from the other set than the nearest ones are, ascending.
    """
    swapped = len(first) > len(second)
    few, many = (second, first) if swapped else (first, second)
    # Trees that are asked once need not be good ones.
    apart, near = cKDTree(ellipses.centers[many], balanced_tree=False, compact_nodes=False).query(ellipses.centers[few])
    nearest = int(np.argmin(apart))
    depth = RIM_DEPTH * float(ellipses.reaches[[few[nearest], many[near[nearest]]]].max())
    few = few[apart <= apart[nearest] + depth]
    tree = cKDTree(ellipses.centers[few])
    apart = tree.query(ellipses.centers[many], distance_upper_bound=float(apart[nearest]) + depth)[0]
    rims = np.unique(few).astype(np.int64), np.unique(many[np.isfinite(apart)]).astype(np.int64)
    return (rims[1], rims[0]) if swapped else rims


def near_pairs(ellipses: Ellipses, a: NDArray[np.integer], b: NDArray[np.integer]) -> NDArray[np.int64]:
    """(P, 2) each node of a with its nearest ones of b."""
    k = min(N_CANDIDATES, len(b))
    near = cKDTree(ellipses.centers[b]).query(ellipses.centers[a], k=k)[1].reshape(len(a), k)
    return np.stack([np.repeat(a, k), b[near.ravel()]], axis=1).astype(np.int64)


def contact_order(ellipses: Ellipses, pairs: NDArray[np.integer], epsilon: float) -> NDArray[np.int64]:
    """Order of pairs (P, 2) by touch scale, those that never touch by distance after all others."""
    scales = touch_scales(ellipses, pairs.astype(np.int32), epsilon)
    apart = np.linalg.norm(ellipses.centers[pairs[:, 0]] - ellipses.centers[pairs[:, 1]], axis=1)
    return np.lexsort((pairs[:, 1], pairs[:, 0], apart, scales))
