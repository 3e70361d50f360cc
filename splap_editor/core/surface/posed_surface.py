"""A surface and where a pose takes it: what the searches for tears, webs and spikes look at."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from splap_editor.core.compressed_rows import gathered
from splap_editor.core.index_spaces import NodeMask, Nodes
from splap_editor.core.splats.occupancy import Ellipses
from splap_editor.core.surface.geodesics import Neighborhoods

N_BESIDE = 12
"""So many of the nearest in space are beside a splat."""

PARTED = 0.006
"""Two splats that lie beside each other are parted once they are so much farther from each other, in units of s."""


class Beside(NamedTuple):
    """Which nodes lie beside each other at rest.

    Parameters
    ----------
    pairs : (B, 2) int32
        Nodes i < j, ascending, each pair once.
    lengths : (B,) float64
        How far apart they are, in world units.
    """

    pairs: NDArray[np.int32]
    lengths: NDArray[np.float64]

    def within(self, nodes: NodeMask) -> NDArray[np.int32]:
        """(W, 2) pairs both of whose nodes are among some (n,)."""
        return self.pairs[nodes[self.pairs[:, 0]] & nodes[self.pairs[:, 1]]]


@dataclass(frozen=True, eq=False)
class PosedSurface:
    """Nodes at rest and in a pose.

    Parameters
    ----------
    ellipses : Ellipses
        n nodes at rest.
    beside : Beside
        Of them.
    neighborhoods : Neighborhoods
        Nearest along the surface.
    L : (n, n) csr_array
        Laplacian, by which neighbours pull at each other.
    positions : (n, 3) float64
        Where the nodes went, in world units.
    axes : (n, 2, 3) float32
        In-plane axes in the pose, one standard deviation long, in world units.
    seen : (n,) float64
        Area that each node fills in a picture, in units of s², see `splap_editor.core.splats.contributions`.
    cut, tied : (n,) bool
        Nodes about a cut, or a contact, that was made by hand: there, what parts or is drawn out is meant to.
    """

    ellipses: Ellipses
    beside: Beside
    neighborhoods: Neighborhoods
    L: sp.csr_array
    positions: NDArray[np.float64]
    axes: NDArray[np.float32]
    seen: NDArray[np.float64]
    cut: NodeMask
    tied: NodeMask

    @property
    def n_nodes(self) -> int:
        """Number of nodes n."""
        return self.ellipses.n_nodes

    @property
    def scale(self) -> float:
        """Size s of the scene in world units."""
        return self.ellipses.scene_scale

    def distances(self, pairs: Nodes) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(P,) distances of pairs (P, 2) of nodes at rest and in the pose, in world units."""
        rest, posed = (_distances(points, pairs) for points in (self.ellipses.centers, self.positions))
        return rest, posed

    @cached_property
    def moved(self) -> NodeMask:
        """(n,) nodes that are not at rest."""
        return np.any(self.positions != self.ellipses.centers, axis=1)

    @cached_property
    def links(self) -> tuple[NDArray[np.int32], NDArray[np.float64], NDArray[np.float64]]:
        """(E, 2) nodes i < j that pull at each other, one at least moved; how far apart at rest and in the pose."""
        n, moved = self.n_nodes, self.moved
        starts = np.repeat(np.arange(n, dtype=np.int32), np.diff(self.L.indptr))
        kept = (starts < self.L.indices) & (moved[starts] | moved[self.L.indices]) & (self.L.data < 0.0)
        links = np.stack([starts[kept], self.L.indices[kept]], axis=1).astype(np.int32, copy=False)
        return links, *self.distances(links)

    @cached_property
    def ways(self) -> sp.csr_array:
        """(n, n) how far apart at rest all nodes are that pull at each other, in units of s."""
        starts = np.repeat(np.arange(self.n_nodes, dtype=np.int32), np.diff(self.L.indptr))
        kept = starts != self.L.indices
        pairs = np.stack([starts[kept], self.L.indices[kept]], axis=1)
        lengths = np.maximum(_distances(self.ellipses.centers, pairs) / self.scale, np.finfo(float).tiny)
        return sp.csr_array((lengths, (pairs[:, 0], pairs[:, 1])), shape=self.L.shape)

    @cached_property
    def partings(self) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
        """(P, 2) parted nodes beside each other, not near along the surface; (P,) by how much, in units of s."""
        pairs, lengths = self.beside
        either = self.moved[pairs[:, 0]] | self.moved[pairs[:, 1]]
        pairs, lengths = pairs[either], lengths[either]
        opening = (_distances(self.positions, pairs) - lengths) / self.scale
        parted = np.flatnonzero(opening > PARTED)
        parted = parted[~self._are_near(pairs[parted])]
        return pairs[parted], opening[parted]

    def _are_near(self, pairs: Nodes) -> NDArray[np.bool_]:
        """(P,) whether one of two nodes is among the other's nearest along the surface."""
        n = self.n_nodes
        near = np.zeros(len(pairs), bool)
        for first, second in (pairs.T, pairs.T[::-1]):
            asking = np.unique(first)
            rows = near_rows(self.neighborhoods, asking)
            keys = np.repeat(asking, np.diff(rows.indptr)) * n + rows.indices
            near |= np.isin(first.astype(np.int64) * n + second, keys)
        return near


def pairs_beside(ellipses: Ellipses) -> Beside:
    """Find the pairs of nodes of which one is among the nearest in space of the other."""
    n = ellipses.n_nodes
    k = min(N_BESIDE + 1, n)
    if k < 2:
        return Beside(np.empty((0, 2), np.int32), np.empty(0))
    near = cKDTree(ellipses.centers).query(ellipses.centers, k)[1]
    starts = np.repeat(np.arange(n), k)
    low, high = np.minimum(starts, near.ravel()), np.maximum(starts, near.ravel())
    pairs = np.stack(np.divmod(np.unique((low * n + high)[low < high]), n), axis=1).astype(np.int32)
    return Beside(pairs, _distances(ellipses.centers, pairs))


def near_rows(neighborhoods: Neighborhoods, nodes: Nodes) -> sp.csr_array:
    """(k, n) which nodes are nearest along the surface to each of some nodes, as ones."""
    n = neighborhoods.n_nodes
    indptr, places, _ = gathered(neighborhoods.indptr, nodes)
    return sp.csr_array((np.ones(len(places)), neighborhoods.indices[places], indptr), shape=(len(nodes), n))


def _distances(points: NDArray[np.float64], pairs: Nodes) -> NDArray[np.float64]:
    steps = points[pairs[:, 0]] - points[pairs[:, 1]]
    return np.sqrt(np.einsum("pi,pi->p", steps, steps))
