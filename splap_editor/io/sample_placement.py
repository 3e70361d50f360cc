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
    faces, points = _random_points(surface, 5 * n_even + n_splats, rng)
    pool, spare = slice(0, 5 * n_even), np.arange(5 * n_even, len(points))
    # Random dart throwing fills 0.7 / r² per unit of area; a little closer leaves some to drop.
    radius = np.sqrt(0.62 * surface.areas.sum() / max(n_even, 1))
    # Both sides of a thin wall have opposite normals: as coordinates these keep the sides from competing.
    taken = _far_apart(np.hstack([points[pool], radius * surface.normals[faces[pool]]]), radius)[:n_even]
    chosen = np.concatenate([taken, spare[: n_splats - len(taken)]])
    return faces[chosen], points[chosen]


def _random_points(surface: Surface, n: int, rng: np.random.Generator) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
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
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    scales: NDArray[np.float64],
    overhang: float,
    rng: np.random.Generator,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Major axes, each the roomiest of six directions, and scales shortened to what the surface carries there."""
    major = random_tangents(normals, rng)
    if np.isinf(overhang):
        return major, scales
    minor = np.cross(normals, major)
    sample = np.concatenate([surface.vertices, _random_points(surface, 12 * len(surface.faces), rng)[1]])
    tree = cKDTree(sample)
    resolution = np.sqrt(surface.areas.sum() / len(sample))
    best, best_scales = major, np.zeros_like(scales)
    for angle in np.arange(6) * np.pi / 6:
        along = np.cos(angle) * major + np.sin(angle) * minor
        across = np.cross(normals, along)
        room = np.stack([
            _room(tree, points, axis, 2 * scales[:, column], overhang, resolution)
            for column, axis in enumerate((along, across))
        ], 1)  # fmt: skip
        better = (room.prod(1) > best_scales.prod(1))[:, None]
        best, best_scales = np.where(better, along, best), np.where(better, room, best_scales)
    return best, best_scales


def _room(
    tree: cKDTree,
    points: NDArray[np.float64],
    axes: NDArray[np.float64],
    reaches: NDArray[np.float64],
    overhang: float,
    resolution: float,
) -> NDArray[np.float64]:
    """One-sigma lengths along the axes whose two-sigma ends stay within the overhang of the surface."""
    lengths = np.zeros_like(reaches)
    open_ = np.arange(len(points))
    for share in (1.0, 0.75, 0.55, 0.4, 0.3, 0.2):
        step = (share * reaches[open_])[:, None] * axes[open_]
        ends = np.concatenate([points[open_] - step, points[open_] + step])
        off = tree.query(ends)[0].reshape(2, -1).max(0)
        fits = off <= overhang * share * reaches[open_] + resolution
        lengths[open_] = share * reaches[open_] / 2
        open_ = open_[~fits]
        if not len(open_):
            break
    return lengths


def tilted_frames(
    axes: NDArray[np.float64], normals: NDArray[np.float64], tilt: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Frames with columns major axis, minor axis, normal: turned about a random tangent, normal sign random."""
    hinges = random_tangents(normals, rng)
    # The angle of a two-dimensional Gaussian tilt is Rayleigh: median 1.177 sigma.
    angles = np.radians(tilt) / 1.177 * np.sqrt(-2 * np.log(1 - rng.random(len(normals))))
    sign = np.where(rng.random(len(normals)) < 0.5, -1.0, 1.0)[:, None]
    cosine, sine = np.cos(angles)[:, None], np.sin(angles)[:, None]

    def turned(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
        along = (hinges * vectors).sum(1, keepdims=True)
        return cosine * vectors + sine * np.cross(hinges, vectors) + (1 - cosine) * along * hinges

    first, third = turned(axes), sign * turned(normals)
    return np.stack([first, np.cross(third, first), third], 2)
