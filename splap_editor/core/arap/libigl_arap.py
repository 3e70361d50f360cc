"""The reference implementation of as-rigid-as-possible deformation, libigl's, on a triangle mesh."""

import igl
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from splap_editor.core.arap.problem import Constraints


def triangle_components(triangles: NDArray[np.integer], n: int) -> NDArray[np.int32]:
    """Connected component of each of n nodes in the graph of triangle edges; a node in no triangle is one by itself."""
    ends = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]]])
    adjacency = sp.coo_matrix((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(n, n))
    return connected_components(adjacency, directed=False)[1].astype(np.int32)


def libigl_arap(
    rest: NDArray[np.float64],
    triangles: NDArray[np.integer],
    constraints: Constraints,
    start: NDArray[np.float64],
    iterations: int,
) -> NDArray[np.float64]:
    """Positions after a number of libigl's local/global iterations of the spokes energy.

    Only triangles at free nodes and at their neighbours enter, which leaves the energy unchanged.

    Parameters
    ----------
    rest : (n, 3) float64
        Rest positions.
    triangles : (T, 3) int
        Triangles; several stars may hold the same one.
    constraints : Constraints
        What is held; components by `triangle_components`.
    start : (n, 3) float64
        Start, with the held nodes in place.
    iterations : int
        Number of iterations, at least 1.

    Returns
    -------
    (n, 3) float64
        ``start`` with the free nodes moved.
    """
    moved = start.copy()
    reach = constraints.free.copy()
    if not reach.any():
        return moved
    for _ in range(2):
        reach[triangles[reach[triangles].any(axis=1)]] = True
    near = constraints.free[triangles].any(axis=1) | reach[triangles].all(axis=1)
    nodes, local = np.unique(triangles[near], return_inverse=True)
    held = np.flatnonzero(constraints.held[nodes]).astype(np.int32)
    data = igl.ARAPData()
    data.max_iter = iterations
    data.energy = igl.ARAP_ENERGY_TYPE_SPOKES
    igl.arap_precomputation(rest[nodes], local.reshape(-1, 3).astype(np.int64), 3, held, data)
    moved[nodes] = igl.arap_solve(start[nodes][held], data, start[nodes])
    return moved
