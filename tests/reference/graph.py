"""Slow twins of occupancy → Laplacian: as the formulas read, one splat or pair at a time."""

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import Delaunay, QhullError
from scipy.spatial.transform import Rotation

from splap_editor.core.graph.splat_graph import SplatGraph
from splap_editor.core.splats.occupancy import Ellipses
from splap_editor.core.splats.splats import Splats
from splap_editor.core.surface.geodesics import Neighborhoods


def occupancy_ellipse(splats: Splats, row: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(2, 3) semi-axes, the larger first, and unit normal of one splat with finite, positive numbers."""
    scales = np.exp(splats.log_scales[row])
    opacity = 1.0 / (1.0 + np.exp(-splats.logit_opacities[row]))
    threshold = 0.0 if splats.thresholds is None else splats.thresholds[row]
    cutoff = np.sqrt(-2.0 * np.log(max(threshold, 1.0 / 255.0 / opacity)))
    w, x, y, z = splats.quats[row]
    frame = Rotation.from_quat([x, y, z, w]).as_matrix()
    major, minor = np.argsort(-scales)[:2]
    semi_axes = cutoff * np.array([scales[major] * frame[:, major], scales[minor] * frame[:, minor]])
    normal = np.cross(semi_axes[0], semi_axes[1])
    return semi_axes, normal / np.linalg.norm(normal)


def _coordinates(
    ellipses: Ellipses, i: int, points: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Squared radius in the unit disk of ellipse i and height above it, of (m, 3) points."""
    offset = points - ellipses.centers[i]
    axes = ellipses.semi_axes[i]
    in_plane = offset @ axes.T / (axes**2).sum(axis=1)
    return (in_plane**2).sum(axis=1), offset @ ellipses.normals[i]


def sampled_offset(ellipses: Ellipses, i: int, j: int, *, n_angles: int = 720, n_radii: int = 200) -> float:
    """``δ_ij`` by sampling all of Ω_j, at most a little above the true one; inf where no sample counts."""
    angles = np.linspace(0.0, 2.0 * np.pi, n_angles, endpoint=False)
    radii = np.linspace(0.0, 1.0, n_radii)
    disk = radii[:, None, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    points = ellipses.centers[j] + disk.reshape(-1, 2) @ ellipses.semi_axes[j]
    squared, heights = _coordinates(ellipses, i, points)
    heights = heights[squared <= 1.0]
    if not len(heights):
        return np.inf
    return 0.0 if heights.min() <= 0.0 <= heights.max() else float(np.abs(heights).min())


def searched_touch(ellipses: Ellipses, i: int, j: int, epsilon: float) -> float:
    """Touch scale of Ω_j in the frame of Ω_i by two nested searches, down the slope of Ω_j and across it."""
    gradient = ellipses.semi_axes[j] @ ellipses.normals[i]
    steep = np.linalg.norm(gradient)
    down = gradient / steep
    across = np.array([-down[1], down[0]])
    height = (ellipses.centers[j] - ellipses.centers[i]) @ ellipses.normals[i]
    bound = 10.0 * (1.0 + np.sqrt(_coordinates(ellipses, i, ellipses.centers[j : j + 1])[0][0]))

    def factor(a: float, b: float) -> float:
        y = a * down + b * across
        point = ellipses.centers[j] + y @ ellipses.semi_axes[j]
        return float(np.sqrt(max(y @ y, _coordinates(ellipses, i, point[None])[0][0])))

    def least(a: float) -> float:
        return minimize_scalar(lambda b: factor(a, b), bounds=(-bound, bound), options={"xatol": 1e-10}).fun

    low, high = (-epsilon - height) / steep, (epsilon - height) / steep
    inside = minimize_scalar(least, bounds=(low, high), options={"xatol": 1e-10}).fun
    return min(inside, least(low), least(high))


def all_pairs(n: int) -> NDArray[np.int64]:
    """(E, 2) every pair i < j."""
    return np.stack(np.triu_indices(n, 1), axis=1)


def touch_rule(
    touch: NDArray[np.float64],
    reaches: NDArray[np.float64],
    *,
    short_list: int,
    n_partners: int,
    redundancy: float,
    n_near: int,
    peer_ratio: float,
    fragment_size: int,
    fragment_reach: float,
) -> set[tuple[int, int]]:
    """Edges of the touch rule from an (n, n) matrix of touch scales, by sorting everything."""
    n = len(touch)
    short: list[list[int]] = []
    lists: list[list[int]] = []
    for i in range(n):
        peers = [j for j in range(n) if j != i and reaches[j] <= peer_ratio * reaches[i] and touch[i, j] <= 1.0]
        short.append(sorted(peers, key=lambda j: (touch[i, j], j))[:short_list])
        kept: list[int] = []
        for j in short[i]:
            if all(touch[j, k] >= redundancy * touch[i, j] for k in kept):
                kept.append(j)
        lists.append(kept[:n_partners])
    edges = _mutual(touch, reaches, lists, n_partners, peer_ratio)
    near = _mutual(touch, reaches, [peers[:n_near] for peers in short], n_near, peer_ratio)
    pairs = sorted((touch[i, j], i, j) for i, j in all_pairs(n) if touch[i, j] <= fragment_reach)
    for limit, size in ((1.0, n), (fragment_reach, fragment_size)):
        while True:
            parts = _parts(n, edges)
            largest = max(parts, key=lambda part: (len(part), -min(part)))
            # Each of the components in question picks its best contact with another one.
            picked = set()
            for part in parts:
                if part is largest or len(part) > size:
                    continue
                for f, i, j in pairs:
                    if f <= limit and (i in part) != (j in part):
                        picked.add((i, j))
                        break
            if not picked:
                break
            edges |= picked
    for _ in range(2):
        neighbours = [{j for edge in edges if i in edge for j in edge} - {i} for i in range(n)]
        edges |= {(i, j) for i, j in near if neighbours[i] & neighbours[j]}
    return {(int(i), int(j)) for i, j in edges}


def _mutual(
    touch: NDArray[np.float64], reaches: NDArray[np.float64], lists: list[list[int]], length: int, peer_ratio: float
) -> set[tuple[int, int]]:
    """Pairs that list each other, or whose smaller one would list the larger if that were not too large."""
    worst = [touch[i, kept[-1]] if len(kept) == length else 1.0 for i, kept in enumerate(lists)]
    pairs = set()
    for i, j in all_pairs(len(lists)):
        small, large = (i, j) if reaches[i] <= reaches[j] else (j, i)
        foreign = reaches[large] > peer_ratio * reaches[small] and touch[i, j] <= worst[small]
        if small in lists[large] and (large in lists[small] or foreign):
            pairs.add((i, j))
    return pairs


def _parts(n: int, edges: set[tuple[int, int]]) -> list[set[int]]:
    """Connected components."""
    parts = [{i} for i in range(n)]
    for i, j in edges:
        one = next(part for part in parts if i in part)
        other = next(part for part in parts if j in part)
        if one is not other:
            parts.remove(other)
            one |= other
    return parts


def nearest_nodes(graph: SplatGraph, k: int) -> list[list[tuple[float, int]]]:
    """The k nearest (distance, node) of every node, from all distances."""
    distances = dijkstra(graph.matrix(), directed=False)
    return [
        sorted((d, j) for j, d in enumerate(row) if j != i and np.isfinite(d))[:k] for i, row in enumerate(distances)
    ]


def star(ellipses: Ellipses, neighborhoods: Neighborhoods, i: int, horizon: float) -> set[frozenset[int]]:
    """Triangles at node i of the Delaunay triangulation of it and its neighbours, laid into its tangent plane."""
    nodes = neighborhoods.indices[neighborhoods.indptr[i] : neighborhoods.indptr[i + 1]]
    offsets = ellipses.centers[nodes] - ellipses.centers[i]
    flat = offsets - np.outer(offsets @ ellipses.normals[i], ellipses.normals[i])
    u = ellipses.semi_axes[i, 0] / np.linalg.norm(ellipses.semi_axes[i, 0])
    v = np.cross(ellipses.normals[i], u)
    plane = np.stack([flat @ u, flat @ v], axis=1)
    lengths = np.linalg.norm(offsets, axis=1)
    plane *= (lengths / np.linalg.norm(plane, axis=1))[:, None]
    try:
        triangles = Delaunay(np.concatenate([[[0.0, 0.0]], plane])).simplices
    except QhullError:
        return set()
    star = set()
    for triangle in triangles[(triangles == 0).any(axis=1)]:
        a, b = plane[triangle[triangle > 0] - 1]
        # Circumcentre c: a·c = |a|²/2, b·c = |b|²/2.
        center = np.linalg.solve(np.array([a, b]), 0.5 * np.array([a @ a, b @ b]))
        if np.abs(center).max() <= horizon * lengths.max():
            star.add(frozenset([i, *nodes[triangle[triangle > 0] - 1]]))
    return star


def cotangent_laplacian(
    centers: NDArray[np.float64], triangles: NDArray[np.integer]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Dense L and masses of the union of stars, angle by angle; negative weights set to zero."""
    n = len(centers)
    weights, masses = np.zeros((n, n)), np.zeros(n)
    for triangle in triangles:
        for c in range(3):
            apex, a, b = (centers[triangle[(c + s) % 3]] for s in range(3))
            one, other = a - apex, b - apex
            doubled_area = np.linalg.norm(np.cross(one, other))
            i, j = triangle[(c + 1) % 3], triangle[(c + 2) % 3]
            weights[i, j] += one @ other / doubled_area / 2.0 / 3.0
            weights[j, i] += one @ other / doubled_area / 2.0 / 3.0
            masses[triangle[c]] += doubled_area / 2.0 / 3.0 / 3.0
    weights = np.maximum(weights, 0.0)
    return np.diag(weights.sum(axis=1)) - weights, masses


def is_positive_semidefinite(L: sp.sparray) -> bool:
    """Whether no eigenvalue is below zero by more than rounding."""
    dense = L.toarray()
    return bool(np.linalg.eigvalsh(dense).min() >= -1e-10 * np.abs(dense).max())
