"""What is true on a known surface: distances along it, places worth pulling at, and how the mesh itself deforms."""

import heapq
from dataclasses import dataclass, field

import igl
import numba as nb
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
    handle, fixed : (…,) int64 or None
        Vertices of the mesh: moved and kept. None where the references are known: the handle is then a ball of
        radius 0.02 s.
    keypoints : (K, 3) float64
        Points of the mesh that are compared.
    references : dict of (K, 3) float64
        Where each solver takes them on the mesh, if known.
    rows : (K,) int64, optional
        Splats they are paired with, if known.
    """

    center: NDArray[np.float64]
    move: NDArray[np.float64]
    handle: NDArray[np.int64] | None
    fixed: NDArray[np.int64] | None
    keypoints: NDArray[np.float64]
    references: dict[str, NDArray[np.float64]] = field(default_factory=dict)
    rows: NDArray[np.int64] | None = None


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
        # The first wall a chord meets is its own; what lies much farther is on the far side of the next one.
        lengths = np.linalg.norm(points[chords[:, 1]] - points[chords[:, 0]], axis=1)
        thickness = np.full(len(points), np.inf)
        for end in range(2):
            np.minimum.at(thickness, chords[:, end], lengths)
        chords = chords[lengths <= 1.4 * thickness[chords].min(axis=1)]
        pairs = np.concatenate([edges, opposite, chords])
        pairs = np.unique(np.sort(pairs, axis=1), axis=0)
        lengths = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1)
        graph = sp.coo_matrix((lengths, pairs.T), shape=(len(points), len(points))).tocsr()
        return graph + graph.T

    def distances(self, sources: NDArray[np.int64] | int, limit: float = np.inf) -> NDArray[np.float64]:
        """Distances along the surface from vertices to all vertices, inf beyond ``limit``."""
        return dijkstra(self.graph, indices=sources, limit=limit)

    def vertices_of(self, points: NDArray[np.float64]) -> NDArray[np.int64]:
        """(n,) nearest corner of each point's nearest face: the nearest vertex may lie across a narrow gap."""
        _, faces, feet = igl.point_mesh_squared_distance(points, self.vertices, self.surface.faces)
        corners = self.surface.faces[faces]
        squares = np.square(self.vertices[corners] - feet[:, None]).sum(2)
        return np.take_along_axis(corners, squares.argmin(1)[:, None], 1)[:, 0]

    def are_near(
        self, starts: NDArray[np.int64], ends: NDArray[np.int64], limits: NDArray[np.float64]
    ) -> NDArray[np.bool_]:
        """Whether the way along the surface between two vertices is within a limit, pair by pair."""
        order = np.argsort(starts, kind="stable")
        near = np.zeros(len(starts), bool)
        firsts = np.append(np.flatnonzero(np.diff(starts[order], prepend=-1)), len(order))
        graph = self.graph
        _near_pairs(graph.indptr, graph.indices, graph.data, order, firsts, starts, ends, limits, near)
        return near

    def wrong_edges(self, points: NDArray[np.float64], edges: NDArray[np.integer]) -> NDArray[np.bool_]:
        """(E,) edges whose ends are far apart along the surface: more than 2.5 times the edge plus 0.04 s."""
        vertices = self.vertices_of(points)
        lengths = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
        return ~self.are_near(vertices[edges[:, 0]], vertices[edges[:, 1]], 2.5 * lengths + 0.04 * self.size)

    def neighbors(self, points: NDArray[np.float64], k: int = 30) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """The k points nearest in space whose way along the surface is at most 1.3 times the straight one plus 0.02.

        Returns row starts and points by rising distance: what perfect knowledge of the surface would take.
        """
        n, n_asked = len(points), min(8 * k + 1, len(points))
        distances, candidates = cKDTree(points).query(points, n_asked)
        vertices = self.vertices_of(points)
        starts = np.repeat(vertices, n_asked - 1)
        ends, straight = vertices[candidates[:, 1:].ravel()], distances[:, 1:].ravel()
        near = self.are_near(starts, ends, 1.3 * straight + 0.02 * self.size / 2.6).reshape(n, -1)
        near &= np.cumsum(near, axis=1) <= k
        indptr = np.concatenate([[0], np.cumsum(near.sum(1))]).astype(np.int32)
        return indptr, candidates[:, 1:][near].astype(np.int32)

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

    def spread_pulls(self, n_pulls: int) -> list[Pull]:
        """Handles at farthest points, each pushed 0.2 s out along the normal."""
        chosen = farthest_points(self.vertices, n_pulls)
        return [self._pull(vertex, 0.2 * self.size * self.normals[vertex]) for vertex in chosen]

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
        keypoints = self.vertices[free[farthest_points(self.vertices[free], 100)]]
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
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Plain local/global steps of spokes ARAP from rest, in plain numpy; parts without a constraint stay at rest.

    Returns positions and the rotations, rest → deformed, that the last step used; the identity where nothing is free.
    """
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
        turns = np.tile(np.eye(3), (len(rest), 1, 1))
        placed[near], turns[near] = plain_arap(
            rest[near], sp.csr_matrix(L)[near][:, near], local[kept], placed[kept], iterations
        )
        return placed, turns
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
    R[~is_free] = np.eye(3)
    return positions, R


@nb.njit(nogil=True, cache=True)
def _near_pairs(indptr, indices, lengths, order, firsts, starts, ends, limits, near):
    """Truncated Dijkstra from each start to as far as its pairs' largest limit."""
    distances = np.full(len(indptr) - 1, np.inf)
    touched = np.empty(len(indptr) - 1, np.int64)
    for group in range(len(firsts) - 1):
        pairs = order[firsts[group] : firsts[group + 1]]
        limit = limits[pairs].max()
        source = starts[pairs[0]]
        distances[source], touched[0], n_touched = 0.0, source, 1
        heap = [(0.0, source)]
        while len(heap):
            distance, vertex = heapq.heappop(heap)
            if distance > distances[vertex]:
                continue
            for e in range(indptr[vertex], indptr[vertex + 1]):
                other, way = np.int64(indices[e]), distance + lengths[e]
                if way < distances[other] and way <= limit:
                    if distances[other] == np.inf:
                        touched[n_touched] = other
                        n_touched += 1
                    distances[other] = way
                    heapq.heappush(heap, (way, other))
        for pair in pairs:
            near[pair] = distances[ends[pair]] <= limits[pair]
        for i in range(n_touched):
            distances[touched[i]] = np.inf
