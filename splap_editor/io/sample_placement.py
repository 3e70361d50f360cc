"""Where sample splats lie on a surface, and how they are turned and sized there."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from splap_editor.io.sample_shapes import Surface


def even_points(
    surface: Surface, n_splats: int, jitter: float, rng: np.random.Generator
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Faces and points of the splats: evenly spread ones first, the rest at random."""
    n_even = round(n_splats * (1 - jitter))
    faces, points = random_points(surface, 5 * n_even + n_splats, rng)
    pool, spare = slice(0, 5 * n_even), np.arange(5 * n_even, len(points))
    # Five darts for each place fill about 0.5 / r² per unit of area; a little closer leaves some to drop.
    radius = np.sqrt(0.47 * surface.areas.sum() / max(n_even, 1))
    # Both sides of a thin wall have opposite normals: as coordinates these keep the sides from competing.
    taken = _far_apart(np.hstack([points[pool], radius * surface.normals[faces[pool]]]), radius)[:n_even]
    chosen = np.concatenate([taken, spare[: n_splats - len(taken)]])
    return faces[chosen], points[chosen]


def random_points(surface: Surface, n: int, rng: np.random.Generator) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Area-weighted random faces and points on them."""
    faces = rng.choice(len(surface.faces), n, p=surface.areas / surface.areas.sum())
    u, v = rng.random((2, n))
    u, v = np.where(u + v > 1, [1 - u, 1 - v], [u, v])
    a, b, c = (surface.vertices[surface.faces[faces, corner]] for corner in range(3))
    return faces, a + u[:, None] * (b - a) + v[:, None] * (c - a)


def _far_apart(points: NDArray[np.float64], radius: float) -> NDArray[np.int64]:
    """Indices of points no two of which are closer than ``radius``, earlier points first served."""
    pairs = cKDTree(points).query_pairs(radius, output_type="ndarray")
    first, second = pairs.min(axis=1, initial=len(points)), pairs.max(axis=1, initial=-1)
    open_, taken = np.ones(len(points), bool), np.zeros(len(points), bool)
    while open_.any():
        live = open_[first] & open_[second]
        first, second = first[live], second[live]
        served = open_.copy()
        served[second] = False  # someone earlier is still in the running
        taken |= served
        open_[served] = False
        open_[second[served[first]]] = False
    return np.flatnonzero(taken)


def random_tangents(normals: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """A random unit tangent for each normal."""
    tangents = np.cross(normals, rng.standard_normal(normals.shape))
    return tangents / np.linalg.norm(tangents, axis=1, keepdims=True)


def fitted_axes(
    surface: Surface,
    centers: NDArray[np.float64],
    normals: NDArray[np.float64],
    reaches: NDArray[np.float64],
    overhang: float,
    rng: np.random.Generator,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Major axes, each the roomiest of four directions, and semi-axes (N, 2) shortened to what the surface carries.

    How far an end may stand in the air is half-normal with deviation ``overhang``, splat by splat.
    """
    major = random_tangents(normals, rng)
    if np.isinf(overhang):
        return major, reaches
    minor = np.cross(normals, major)
    allowed = overhang * abs(rng.standard_normal(len(centers)))
    air = _Air(surface, rng)
    best, best_reaches = major, np.zeros_like(reaches)
    for angle in np.arange(4) * np.pi / 4:
        along = np.cos(angle) * major + np.sin(angle) * minor
        across = np.cross(normals, along)
        room = np.stack([
            air.room(centers, axis, reaches[:, column], allowed) for column, axis in enumerate((along, across))
        ], 1)  # fmt: skip
        better = (room.prod(1) > best_reaches.prod(1))[:, None]
        best, best_reaches = np.where(better, along, best), np.where(better, room, best_reaches)
    return best, best_reaches


class _Air:
    """What lies outside a surface, known from dense samples of it; for a sheet, both sides."""

    def __init__(self, surface: Surface, rng: np.random.Generator) -> None:
        faces, self.points = random_points(surface, max(20_000, 5 * len(surface.faces)), rng)
        self.normals, self.closed = surface.normals[faces], surface.closed
        self.tree = cKDTree(self.points)
        self.resolution = np.sqrt(surface.areas.sum() / len(self.points))

    def distances(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Distance of each point into the air, 0 inside the solid."""
        gap, nearest = self.tree.query(points)
        height = ((points - self.points[nearest]) * self.normals[nearest]).sum(1)
        beside = np.maximum(np.sqrt(np.maximum(gap**2 - height**2, 0)) - 1.5 * self.resolution, 0)
        if not self.closed:
            return np.hypot(height, beside)
        return np.where(height < -0.3 * gap, 0.0, np.hypot(np.maximum(height, 0), beside))

    def room(
        self,
        centers: NDArray[np.float64],
        axes: NDArray[np.float64],
        reaches: NDArray[np.float64],
        allowed: NDArray[np.float64],
    ) -> NDArray[np.float64]:
        """Largest share of each reach at which neither end stands farther in the air than allowed, at least 0.1."""
        lengths = 0.1 * reaches
        open_ = np.arange(len(centers))
        for share in (1.0, 0.8, 0.64, 0.5, 0.4, 0.3, 0.2):
            step = (share * reaches[open_])[:, None] * axes[open_]
            ends = np.concatenate([centers[open_] - step, centers[open_] + step])
            fits = self.distances(ends).reshape(2, -1).max(0) <= allowed[open_]
            lengths[open_[fits]] = share * reaches[open_[fits]]
            open_ = open_[~fits]
        return lengths


def tilted_normals(normals: NDArray[np.float64], tilt: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """Normals off by a median of ``tilt`` degrees in random directions, their sign random."""
    # The angle of a two-dimensional Gaussian tilt is Rayleigh: median 1.177 sigma.
    angles = np.radians(tilt) / 1.177 * np.sqrt(-2 * np.log(1 - rng.random(len(normals))))[:, None]
    sign = np.where(rng.random(len(normals)) < 0.5, -1.0, 1.0)[:, None]
    return sign * (np.cos(angles) * normals + np.sin(angles) * random_tangents(normals, rng))
