"""Tears: where a pose takes apart what was one piece of surface to look at."""

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from splap_editor.core.graph.ellipse_offset import touch_scales
from splap_editor.core.index_spaces import Nodes
from splap_editor.core.surface.posed_surface import PosedSurface, near_rows

OPEN = 0.01
"""What opened or grew by less is not seen, in units of s: ten pixels where the subject is a thousand long."""

WEIGHTS = (1.46, -0.58, -3.08, 3.29)
"""Of 1, the logarithm of the touch scale, the sine of the step out of the tangent planes, and how open both rims are:
surface that goes on."""

_FARTHEST_TOUCH = (0.1, 8.0)


class Tears(NamedTuple):
    """Pairs of nodes between which the surface tore.

    Parameters
    ----------
    pairs : (T, 2) int32
    gaps : (T,) float64
        What is open between them, in units of s.
    odds : (T,) float64
        Logarithm of how many times likelier each is of one surface than of two; all above 0.
    others : (Q, 2) int32
        Pairs that parted and are of two surfaces.
    """

    pairs: NDArray[np.int32]
    gaps: NDArray[np.float64]
    odds: NDArray[np.float64]
    others: NDArray[np.int32]


def tears(posed: PosedSurface, epsilon: float) -> Tears:
    """Find what a pose tore apart.

    Splats that lie beside each other and do not hang together may be two
    surfaces that pass near each other, and rightly part; or one surface whose
    contact was missed. By one pair the two are hard to tell apart: surface goes
    on where ellipses overlap, the step from one to the other lies in both
    tangent planes, and each is at a rim: what is near it along its own surface
    lies behind it. Where one surface rests on another, both go on beneath. So
    each pair has its neighbours' say: what they show on average decides.

    Parameters
    ----------
    posed : PosedSurface
    epsilon : float
        Tolerance of a contact along the normals in world units.

    Returns
    -------
    Tears
        Pairs between which a gap has opened that no splat bridges.
    """
    pairs, _ = posed.partings
    if not len(pairs):
        return Tears(pairs, np.zeros(0), np.zeros(0), pairs)
    odds = _smoothed(posed, pairs, evidence(posed, pairs, epsilon) @ np.array(WEIGHTS))
    others = pairs[odds <= 0.0]
    goes_on = (odds > 0.0) & ~posed.cut[pairs].all(axis=1)
    pairs, odds = pairs[goes_on], odds[goes_on]
    gaps = _gaps(posed, pairs)
    is_open = (gaps > OPEN) & ~_are_bridged(posed, pairs)
    return Tears(pairs[is_open], gaps[is_open], odds[is_open], others)


def evidence(posed: PosedSurface, pairs: Nodes, epsilon: float) -> NDArray[np.float64]:
    """(P, 4) what the model weighs of pairs (P, 2) at rest: see `WEIGHTS`."""
    ellipses = posed.ellipses
    touch = np.log(np.clip(touch_scales(ellipses, pairs, epsilon), *_FARTHEST_TOUCH))
    return np.column_stack([np.ones(len(pairs)), touch, slants(posed, pairs), openness(posed, pairs)])


def slants(posed: PosedSurface, pairs: Nodes) -> NDArray[np.float64]:
    """(P,) sine of the angle by which the step between two nodes at rest rises out of their tangent planes."""
    ellipses = posed.ellipses
    step = ellipses.centers[pairs[:, 1]] - ellipses.centers[pairs[:, 0]]
    length = np.maximum(np.linalg.norm(step, axis=1), np.finfo(float).tiny)
    rises = [np.abs(np.einsum("ij,ij->i", step, ellipses.normals[pairs[:, end]])) / length for end in (0, 1)]
    return np.maximum(*rises)


def openness(posed: PosedSurface, pairs: Nodes) -> NDArray[np.float64]:
    """(P,) how little of either's surface lies on the other's side at rest: about 0.6 between two rims, else about 0.

    What is near a splat along the surface lies all around it, and at a rim on one side only: the mean direction there
    then points away from who faces the rim.
    """
    ellipses = posed.ellipses
    nodes, places = np.unique(pairs, return_inverse=True)
    places = places.reshape(pairs.shape)
    near = near_rows(posed.neighborhoods, nodes)
    owners = np.repeat(np.arange(len(nodes)), np.diff(near.indptr))
    steps = _directions(ellipses.centers[near.indices] - ellipses.centers[nodes[owners]])
    counts = np.maximum(np.diff(near.indptr), 1)
    means = np.stack([np.bincount(owners, steps[:, axis], len(nodes)) / counts for axis in range(3)], axis=1)
    step = _directions(ellipses.centers[pairs[:, 1]] - ellipses.centers[pairs[:, 0]])
    open_ = np.zeros(len(pairs))
    for end, sign in ((0, -0.5), (1, 0.5)):
        normals = ellipses.normals[pairs[:, end]]
        flat = step - np.einsum("pi,pi->p", step, normals)[:, None] * normals
        open_ += sign * np.einsum("pi,pi->p", means[places[:, end]], flat)
    return open_


def _directions(steps: NDArray[np.float64]) -> NDArray[np.float64]:
    """(m, 3) steps of length 1; 0 where they have none."""
    return steps / np.maximum(np.linalg.norm(steps, axis=1, keepdims=True), np.finfo(float).tiny)


def _smoothed(posed: PosedSurface, pairs: Nodes, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """(P,) mean of the values of the pairs that lie beside each pair."""
    n = posed.n_nodes
    sums = np.bincount(pairs.ravel(), np.repeat(values, 2), n)
    counts = np.bincount(pairs.ravel(), minlength=n).astype(np.float64)
    beside = posed.beside.within(counts > 0.0)
    beside = np.concatenate([beside, beside[:, ::-1]])
    more = [np.bincount(beside[:, 0], each[beside[:, 1]], n) for each in (sums, counts)]
    means = (sums + more[0]) / np.maximum(counts + more[1], 1.0)
    return means[pairs].mean(axis=1)


def _gaps(posed: PosedSurface, pairs: Nodes) -> NDArray[np.float64]:
    """(P,) what is open between two nodes in the pose beyond what was at rest, and beyond what their ellipses cover."""
    rest, moved = posed.distances(pairs)
    step = posed.positions[pairs[:, 1]] - posed.positions[pairs[:, 0]]
    step /= np.maximum(moved, np.finfo(float).tiny)[:, None]
    covered = np.zeros(len(pairs))
    for end in (0, 1):
        along = np.einsum("pai,pi->pa", posed.axes[pairs[:, end]], step)
        covered += np.sqrt(np.einsum("pa,pa->p", along, along))
    return np.minimum(moved - rest, moved - covered) / posed.scale


def _are_bridged(posed: PosedSurface, pairs: Nodes) -> NDArray[np.bool_]:
    """(P,) whether a third splat lies beside both ends and is parted from neither."""
    n, (parted, _) = posed.n_nodes, posed.partings
    if not len(pairs):
        return np.zeros(0, bool)
    concerned = np.zeros(n, bool)
    concerned[pairs] = True
    around = posed.beside.pairs
    beside = around[concerned[around[:, 0]] | concerned[around[:, 1]]]
    keys = beside[:, 0].astype(np.int64) * n + beside[:, 1]
    beside = beside[~np.isin(keys, parted[:, 0].astype(np.int64) * n + parted[:, 1])]
    rest, moved = posed.distances(beside)
    beside = beside[moved - rest <= OPEN * posed.scale]
    upper = sp.csr_array((np.ones(len(beside), np.int32), (beside[:, 0], beside[:, 1])), shape=(n, n))
    whole = sp.csr_array(upper + upper.T)
    return np.asarray(whole[pairs[:, 0]].multiply(whole[pairs[:, 1]]).sum(axis=1)).ravel() > 0
