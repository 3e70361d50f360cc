"""The plane that an object is most nearly mirrored about."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from splap_editor.core.progress import Progress, no_progress

_SAMPLES = 2000
_DIRECTIONS = 60
_REFINED = 5
_ROUNDS = 12
_KEPT_SHARE = 0.8
"""Share of the points that have to match: captures have holes and floaters."""


@dataclass(frozen=True, eq=False)
class Plane:
    """A plane ``normal · (x - point) = 0``.

    Parameters
    ----------
    point : (3,) float64
        A point on it, world units.
    normal : (3,) float64
        Unit vector; its sign means nothing.
    error : float
        Of a symmetry plane: root mean square distance between the mirrored points and the nearest ones, the worst
        fifth left out, world units; 0 of a plane that was chosen.
    """

    point: NDArray[np.float64]
    normal: NDArray[np.float64]
    error: float = 0.0

    def mirrored(self, points: ArrayLike) -> NDArray[np.float64]:
        """(…, 3) points behind the mirror."""
        points = np.asarray(points, np.float64)
        heights = (points - self.point) @ self.normal
        return points - 2.0 * heights[..., None] * self.normal

    def mirrored_vectors(self, vectors: ArrayLike) -> NDArray[np.float64]:
        """(…, 3) vectors behind the mirror."""
        vectors = np.asarray(vectors, np.float64)
        return vectors - 2.0 * (vectors @ self.normal)[..., None] * self.normal


def symmetry_plane(points: ArrayLike, *, progress: Progress = no_progress) -> Plane:
    """Find the plane about which points are most nearly mirrored.

    Planes through the centre in directions all round, along the principal
    and the world's axes are compared on a sample; the best few are refined
    as rigid shapes are registered [1]_: match each mirrored point with its
    nearest, then take the plane that mirrors the matches best, which is an
    eigenvector problem.

    Parameters
    ----------
    points : (N, 3) float
        World units, at least one; the same points give the same plane whatever their number of threads or runs.
    progress : callable

    Returns
    -------
    Plane
        The better its ``error``, the more symmetric the object; a plane is given in any case.

    Raises
    ------
    ValueError
        If ``points`` is not (N, 3) with N ≥ 1.

    References
    ----------
    .. [1] Besl and McKay, "A Method for Registration of 3-D Shapes", PAMI 1992.
    """
    points = np.asarray(points, np.float64)
    if points.ndim != 2 or points.shape[1] != 3 or not len(points):
        raise ValueError(f"points must have shape (N, 3) with N >= 1, got {points.shape}")
    sample = points[np.linspace(0, len(points) - 1, min(len(points), _SAMPLES)).astype(np.int64)]
    tree = cKDTree(points)
    center = object_center(points)
    axes = np.linalg.svd(sample - center, full_matrices=False)[2]
    normals = np.concatenate([np.eye(3), axes, _half_sphere(_DIRECTIONS)])
    tried = []
    for done, normal in enumerate(normals):
        plane = Plane(center, normal)
        tried.append(Plane(center, normal, _matched(plane, sample, tree)[1]))
        progress(0.6 * done / len(normals))
    tried.sort(key=lambda plane: plane.error)
    refined = []
    for done, plane in enumerate(tried[:_REFINED]):
        refined.append(_refined(plane, sample, tree))
        progress(0.6 + 0.4 * (done + 1) / _REFINED)
    return min(refined, key=lambda plane: plane.error)


def _refined(plane: Plane, sample: NDArray[np.float64], tree: cKDTree) -> Plane:
    best = plane
    for _ in range(_ROUNDS):
        matches, _, kept = _matches(plane, sample, tree)
        left, right = sample[kept], matches[kept]
        middle = (left.mean(axis=0) + right.mean(axis=0)) / 2.0
        # |mirror(p) - q|² = |p - q|² + 4 (n·p)(n·q) with p, q from the middle: the smallest eigenvector has the least.
        cross = (left - middle).T @ (right - middle)
        normal = np.linalg.eigh(cross + cross.T)[1][:, 0]
        plane = Plane(middle, normal)
        error = _matched(plane, sample, tree)[1]
        if error >= best.error:
            break
        best = plane = Plane(middle, normal, error)
    return best


def _matched(plane: Plane, sample: NDArray[np.float64], tree: cKDTree) -> tuple[NDArray[np.float64], float]:
    matches, distances, kept = _matches(plane, sample, tree)
    return matches, float(np.sqrt(np.mean(distances[kept] ** 2)))


def _matches(
    plane: Plane, sample: NDArray[np.float64], tree: cKDTree
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Nearest points of the mirrored sample, their distances, and which of them count."""
    distances, indices = tree.query(plane.mirrored(sample))
    kept = np.argsort(distances, kind="stable")[: max(int(_KEPT_SHARE * len(sample)), 1)]
    return tree.data[indices], distances, kept


def object_center(points: ArrayLike) -> NDArray[np.float64]:
    """(3,) centre of the box around points (N, 3), the outermost half percent on each side left out."""
    return np.percentile(np.asarray(points, np.float64), [0.5, 99.5], axis=0).mean(axis=0)


def _half_sphere(n: int) -> NDArray[np.float64]:
    """(n, 3) directions, evenly over a half sphere (Fibonacci lattice)."""
    heights = (np.arange(n) + 0.5) / n
    turns = np.pi * (1.0 + np.sqrt(5.0)) * np.arange(n)
    rims = np.sqrt(1.0 - heights**2)
    return np.stack([rims * np.cos(turns), rims * np.sin(turns), heights], axis=1)
