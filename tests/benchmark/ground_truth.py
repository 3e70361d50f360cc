"""What is true on a known surface: distances along it, places worth pulling at, and how the mesh itself deforms."""

from dataclasses import dataclass

import igl
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import dijkstra
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree

from splap_editor.io.sample_shapes import Surface

THIN_WALL = 0.04
"""Walls thinner than this share of s move as one: going through them is no detour."""


@dataclass(frozen=True, eq=False)
class Pull:
    """One handle at an ambiguous place, pulled away from the surface it nearly touches.

    Parameters
    ----------
    center : (3,) float64
    move : (3,) float64
        0.2 s away from the nearest point of the other surface.
    handle, fixed, keypoints : (…,) int64
        Vertices of the mesh: moved, kept, and compared.
    """

    center: NDArray[np.float64]
    move: NDArray[np.float64]
    handle: NDArray[np.int64]
    fixed: NDArray[np.int64]
    keypoints: NDArray[np.int64]


class GroundTruth:
    """A surface that answers how far apart, how deformed.

    Parameters
    ----------
    surface : Surface
        Mesh of one connected part.
    """

    def __init__(self, surface: Surface) -> None:
        self.surface = surface
        self.vertices = surface.vertices
        self.size = float(np.ptp(surface.vertices, axis=0).max())
        self.normals = np.asarray(igl.per_vertex_normals(surface.vertices, surface.faces))
        self.tree = cKDTree(self.vertices)
        self.graph = self._distance_graph()

    def _distance_graph(self) -> sp.csr_matrix:
        """Mesh edges, both diagonals of each pair of faces, and chords through walls thinner than `THIN_WALL`."""
        faces, points = self.surface.faces, self.vertices
        edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
        corners = np.roll(faces, 1, axis=1).T.reshape(-1)
        order = np.lexsort(np.sort(edges, axis=1).T)
        same = (np.sort(edges, axis=1)[order][1:] == np.sort(edges, axis=1)[order][:-1]).all(1)
        opposite = np.stack([corners[order][1:][same], corners[order][:-1][same]], 1)
        chords = self.tree.query_pairs(THIN_WALL * self.size, output_type="ndarray")
        step = points[chords[:, 1]] - points[chords[:, 0]]
        step /= np.maximum(np.linalg.norm(step, axis=1, keepdims=True), 1e-12)
        inward = (step * self.normals[chords[:, 0]]).sum(1) < -0.7
        facing = (self.normals[chords[:, 0]] * self.normals[chords[:, 1]]).sum(1) < -0.5
        chords = chords[inward & facing & self.surface.closed]
        pairs = np.concatenate([edges, opposite, chords])
        pairs = np.unique(np.sort(pairs, axis=1), axis=0)
        lengths = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1)
        graph = sp.coo_matrix((lengths, pairs.T), shape=(len(points), len(points))).tocsr()
        return graph + graph.T

    def distances(self, sources: NDArray[np.int64] | int, limit: float = np.inf) -> NDArray[np.float64]:
        """Distances along the surface from vertices to all vertices, inf beyond ``limit``."""
        return dijkstra(self.graph, indices=sources, limit=limit)

    def wrong_share(
        self, points: NDArray[np.float64], edges: NDArray[np.integer], rng: np.random.Generator, n_sources: int = 800
    ) -> float:
        """Share of edges whose ends are far apart along the surface, from the edges at a sample of the points.

        Wrong means a way along the surface longer than 2.5 times the edge plus 0.04 s.
        """
        vertices = self.tree.query(points)[1]
        sources = rng.choice(len(points), min(n_sources, len(points)), replace=False)
        both = np.concatenate([edges, edges[:, ::-1]])
        both = both[np.isin(both[:, 0], sources)]
        if not len(both):
            return 0.0
        both = both[np.argsort(both[:, 0], kind="stable")]
        starts = np.flatnonzero(np.r_[True, np.diff(both[:, 0]) > 0])
        wrong = 0
        for part in np.split(both, starts[1:]):
            allowed = 2.5 * np.linalg.norm(points[part[:, 1]] - points[part[0, 0]], axis=1) + 0.04 * self.size
            along = self.distances(vertices[part[0, 0]], limit=allowed.max())
            wrong += np.count_nonzero(along[vertices[part[:, 1]]] > allowed)
        return wrong / len(both)

    def pulls(self, n_pulls: int, seed: int = 0) -> list[Pull]:
        """Handles at places close in space and far along the surface, spread over the object."""
        vertices = np.random.default_rng(seed).permutation(len(self.vertices))[:600]
        # Where nothing nearly touches, as in a labyrinth of wide tunnels, the opposite wall will do.
        for gap, detour in ((0.06, 0.3), (0.2, 0.2)):
            found = [(vertex, self._away(vertex, gap * self.size, detour * self.size)) for vertex in vertices]
            found = [(vertex, move) for vertex, move in found if move is not None]
            if found:
                chosen = farthest_points(self.vertices[[vertex for vertex, _ in found]], n_pulls)
                return [self._pull(*found[index]) for index in chosen]
        raise ValueError("the surface comes close to itself nowhere")

    def _away(self, vertex: int, gap: float, detour: float) -> NDArray[np.float64] | None:
        """0.2 s away from the nearest surface facing the vertex, if that is near in space and far along the surface."""
        close = np.array(self.tree.query_ball_point(self.vertices[vertex], gap))
        step = self.vertices[close] - self.vertices[vertex]
        distance = np.linalg.norm(step, axis=1)
        facing = (self.normals[close] @ self.normals[vertex] < -0.5) & (step @ self.normals[vertex] > 0.8 * distance)
        if not facing.any():
            return None
        nearest = np.argmin(np.where(facing, distance, np.inf))
        if self.distances(vertex, limit=detour)[close[nearest]] < np.inf:
            return None
        return -0.2 * self.size * step[nearest] / distance[nearest]

    def _pull(self, vertex: int, move: NDArray[np.float64]) -> Pull:
        center = self.vertices[vertex]
        handle = np.flatnonzero(self.distances(vertex, limit=0.05 * self.size) < np.inf)
        far = np.linalg.norm(self.vertices - center, axis=1) > 0.5 * self.size
        far[handle] = False
        free = np.setdiff1d(np.flatnonzero(~far), handle)
        keypoints = free[farthest_points(self.vertices[free], 100)]
        return Pull(center, move, handle, np.flatnonzero(far), keypoints)

    def laplacian(self) -> sp.csr_matrix:
        """Positive semidefinite cotangent Laplacian of the mesh."""
        return sp.csr_matrix(-igl.cotmatrix(self.vertices, self.surface.faces))


def farthest_points(points: NDArray[np.float64], n: int) -> NDArray[np.int64]:
    """Indices of ``n`` points, each the farthest from those before it."""
    chosen = [0]
    distances = np.linalg.norm(points - points[0], axis=1)
    while len(chosen) < min(n, len(points)):
        chosen.append(int(np.argmax(distances)))
        distances = np.minimum(distances, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return np.array(chosen)


def plain_arap(
    rest: NDArray[np.float64],
    L: sp.csr_matrix,
    constrained: NDArray[np.int64],
    targets: NDArray[np.float64],
    iterations: int = 10,
) -> NDArray[np.float64]:
    """Plain local/global steps of spokes ARAP from rest, in plain numpy; parts without a constraint stay at rest."""
    is_free = np.ones(len(rest), bool)
    is_free[constrained] = False
    # What is farther than two steps from the free region has no say in it.
    adjacency = sp.csr_matrix(abs(L))
    near = adjacency @ (adjacency @ is_free.astype(float)) > 0
    near |= is_free
    if not near.all():
        placed = rest.copy()
        placed[constrained] = targets
        kept = np.flatnonzero(near & ~is_free)
        local = np.cumsum(near) - 1
        inner = plain_arap(rest[near], sp.csr_matrix(L)[near][:, near], local[kept], placed[kept], iterations)
        placed[near] = inner
        return placed
    n = len(rest)
    W = (sp.diags(L.diagonal()) - L).tocoo()
    W.sum_duplicates()
    i, j, w = W.row, W.col, W.data
    free = np.flatnonzero(is_free)
    sums = np.asarray(W.sum(axis=1)).ravel()
    # A hair of stiffness to the rest pose keeps parts without a constraint solvable.
    hair = 1e-9 * abs(sums).mean()
    system = (sp.diags(sums + hair) - W.tocsr()).tocsr()
    factor = splu(system[free][:, free].tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    edges = rest[i] - rest[j]
    positions = rest.copy()
    positions[constrained] = targets
    fixed_part = system[free][:, constrained] @ targets
    for _ in range(iterations):
        moved = positions[i] - positions[j]
        outer = (w[:, None, None] * edges[:, :, None] * moved[:, None, :]).reshape(-1, 9)
        S = np.stack([np.bincount(i, outer[:, entry], n) for entry in range(9)], 1).reshape(n, 3, 3)
        U, _, Vt = np.linalg.svd(S)
        flip = np.linalg.det(U @ Vt) < 0
        Vt[flip, 2] *= -1
        R = np.swapaxes(U @ Vt, 1, 2)
        turned = 0.5 * w[:, None] * np.einsum("eij,ej->ei", R[i] + R[j], edges)
        right = np.stack([np.bincount(i, turned[:, axis], n) for axis in range(3)], 1) + hair * rest
        positions[free] = factor.solve(right[free] - fixed_part)
    return positions
