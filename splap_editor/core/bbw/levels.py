"""Coarser copies of a surface operator, for warm starts: cells that grow along the surface and never across a gap."""

from dataclasses import dataclass

import numba as nb
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from splap_editor.core.index_spaces import Nodes
from splap_editor.core.surface.shortest_paths import settle


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
    nodes: Nodes
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
    return Level(
        finer.points[centers], L, np.asarray(np.bincount(cells, finer.M, m), np.float64), finer.nodes[centers], cells
    )


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
    keys, items = np.empty(1024), np.empty(1024, np.int64)
    near, far = np.empty(n, np.int64), np.empty(n)
    for sweep in range(2):
        for center in range(n):
            if (sweep == 0 and not kept[center]) or (sweep == 1 and nearest[center] <= radius):
                continue
            nearest[center] = 0.0
            keys[0], items[0] = 0.0, center
            # It ends at the radius, and wherever another centre is no farther.
            n_won, keys, items = settle(indptr, indices, lengths, radius, nearest, keys, items, 1, near, far)
            for i in range(n_won):
                owner[near[i]] = center
    return owner
