"""Coarser copies of a surface operator, for warm starts: cells that grow along the surface and never across a gap."""

from dataclasses import dataclass

import numba as nb
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Level:
    """One resolution of a surface with its Laplacian.

    Parameters
    ----------
    points : (n, 3) float64
        Node positions in world units.
    L : (n, n) sparse float64
        Positive semidefinite Laplacian.
    M : (n,) float64
        Lumped mass of each node.
    nodes : (n,) int64
        The node of the finest level that each node is.
    cells : (n_finer,) int64
        Node of this level whose cell holds each node of the next finer one; empty on the finest level.
    """

    points: NDArray[np.float64]
    L: sp.csr_array
    M: NDArray[np.float64]
    nodes: NDArray[np.int64]
    cells: NDArray[np.int64]

    @property
    def n_nodes(self) -> int:
        """Number of nodes."""
        return len(self.points)


def coarser_level(finer: Level, kept: NDArray[np.bool_], *, spacing: float = 2.0) -> Level:
    """Merge the nodes of a level into cells about a quarter as many.

    Cell centres are ``kept`` nodes and, greedily in node order, every node farther than the cell radius from all
    centres; each node joins the centre nearest along the edges of ``L``. Sheets without an edge between them therefore
    share no cell and no coarse edge, however close they lie. The coarse weight between cells I and J is the two-point
    flux

    ``w_IJ = Σ w_ij (e_ij · d_IJ) / |d_IJ|²``  over fine edges ``e_ij`` from I to J, ``d_IJ`` between the centres,

    the flux that a function rising steadily from one centre to the other sends through the cells' common border. Masses
    add up.

    Parameters
    ----------
    finer : Level
    kept : (n_finer,) bool
        Nodes that must stay nodes, such as constrained ones. A kept node's cell may hold others.
    spacing : float
        Cell radius in units of the mean node spacing ``√(ΣM / n)``.

    Returns
    -------
    Level
    """
    edges = sp.coo_array(finer.L)
    joined = (edges.row != edges.col) & (edges.data < 0)
    i, j, w = edges.row[joined], edges.col[joined], -edges.data[joined]
    e = finer.points[j] - finer.points[i]
    # Coincident nodes are neighbours at almost no distance, not unconnected ones.
    lengths = np.maximum(np.linalg.norm(e, axis=1), np.finfo(float).tiny)
    n = finer.n_nodes
    graph = sp.csr_array((lengths, (i, j)), shape=(n, n))
    radius = spacing * np.sqrt(finer.M.sum() / n)
    centers_of = _cell_centers(
        graph.indptr.astype(np.int64), graph.indices.astype(np.int64), graph.data, np.ascontiguousarray(kept), radius
    )
    centers, cells = np.unique(centers_of, return_inverse=True)
    m = len(centers)
    I, J = cells[i], cells[j]
    across = I != J
    I, J, w, e, lengths = I[across], J[across], w[across], e[across], lengths[across]
    d = finer.points[centers[J]] - finer.points[centers[I]]
    d2 = np.maximum(np.einsum("ij,ij->i", d, d), np.finfo(float).tiny)
    # An edge that runs backwards (across a crease) must not cancel the link.
    flux = w * np.maximum(np.einsum("ij,ij->i", e, d) / d2, 0.2 * lengths / np.sqrt(d2))
    links = sp.csr_array((flux, (I, J)), shape=(m, m))
    links = (links + links.T) / 2
    L = sp.csr_array(sp.diags_array(links.sum(axis=1)) - links)
    return Level(finer.points[centers], L, np.bincount(cells, finer.M, m), finer.nodes[centers], cells)


def prolonged(values: NDArray[np.float64], coarser: Level, finer: Level, *, n_sweeps: int = 4) -> NDArray[np.float64]:
    """Carry nodal values to the next finer level: constant in each cell, then smoothed along the surface.

    Parameters
    ----------
    values : (n_coarser,) float64
    coarser, finer : Level
        Neighbouring levels.
    n_sweeps : int
        Half-weighted neighbour averages; a cell is about as many edges wide.

    Returns
    -------
    (n_finer,) float64
    """
    diagonal = finer.L.diagonal()
    inverse = np.divide(1.0, diagonal, out=np.zeros_like(diagonal), where=diagonal > 0)
    values = values[coarser.cells].astype(np.float64)
    for _ in range(n_sweeps):
        # x - ½ D⁻¹ L x: the average of a value and its neighbours' mean.
        values = values - 0.5 * inverse * (finer.L @ values)
    return values


@nb.njit(nogil=True, cache=True)
def _cell_centers(indptr, indices, lengths, kept, radius):
    """Centre of each node's cell: kept nodes first, then whatever lies beyond the radius of all centres."""
    n = indptr.size - 1
    owner = np.full(n, -1, np.int64)
    nearest = np.full(n, np.inf)
    tentative = np.full(n, np.inf)
    touched = np.empty(n, np.int64)
    heap_keys = np.empty(indices.size + 1)
    heap_nodes = np.empty(indices.size + 1, np.int64)
    for sweep in range(2):
        for center in range(n):
            if (sweep == 0 and not kept[center]) or (sweep == 1 and nearest[center] <= radius):
                continue
            # Dijkstra from this centre, stopped at the radius and wherever another centre is nearer.
            tentative[center] = 0.0
            touched[0] = center
            n_touched = 1
            heap_keys[0] = 0.0
            heap_nodes[0] = center
            size = 1
            while size > 0:
                distance = heap_keys[0]
                node = heap_nodes[0]
                size -= 1
                key = heap_keys[size]
                moved = heap_nodes[size]
                hole = 0
                while True:
                    child = 2 * hole + 1
                    if child >= size:
                        break
                    if child + 1 < size and heap_keys[child + 1] < heap_keys[child]:
                        child += 1
                    if heap_keys[child] >= key:
                        break
                    heap_keys[hole] = heap_keys[child]
                    heap_nodes[hole] = heap_nodes[child]
                    hole = child
                heap_keys[hole] = key
                heap_nodes[hole] = moved
                if distance > tentative[node] or distance >= nearest[node]:
                    continue
                nearest[node] = distance
                owner[node] = center
                for q in range(indptr[node], indptr[node + 1]):
                    other = indices[q]
                    reached = distance + lengths[q]
                    if reached <= radius and reached < tentative[other] and reached < nearest[other]:
                        if tentative[other] == np.inf:
                            touched[n_touched] = other
                            n_touched += 1
                        tentative[other] = reached
                        hole = size
                        size += 1
                        while hole > 0:
                            parent = (hole - 1) // 2
                            if heap_keys[parent] <= reached:
                                break
                            heap_keys[hole] = heap_keys[parent]
                            heap_nodes[hole] = heap_nodes[parent]
                            hole = parent
                        heap_keys[hole] = reached
                        heap_nodes[hole] = other
            for q in range(n_touched):
                tentative[touched[q]] = np.inf
    return owner
