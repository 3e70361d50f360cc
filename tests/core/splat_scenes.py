"""Small scenes for the tests of the stages, and the same scenes turned, scaled and shuffled."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from splap_editor.core.splats.splats import Splats

SIGMA_CUT = float(np.sqrt(-2.0 * np.log(1.0 / 255.0 / 0.9)))
"""Semi-axis in standard deviations of a splat of opacity 0.9."""


def splats_of(
    means: NDArray[np.float64], semi_axes: NDArray[np.float64], frames: NDArray[np.float64] | None = None
) -> Splats:
    """Splats of opacity 0.9 whose ellipses have the given (N, 2) semi-axes, in the given (N, 3, 3) frames or flat."""
    n = len(means)
    frames = np.tile(np.eye(3), (n, 1, 1)) if frames is None else frames
    quats = Rotation.from_matrix(frames).as_quat()[:, [3, 0, 1, 2]] if n else np.empty((0, 4))
    return Splats(
        means=np.asarray(means, np.float64),
        log_scales=np.log(np.broadcast_to(semi_axes, (n, 2)) / SIGMA_CUT),
        quats=quats,
        logit_opacities=np.full(n, np.log(9.0)),
        sh0=np.zeros((n, 3)),
        shN=np.zeros((n, 0, 3)),
    )


def sheet(
    n: int, size: float = 1.0, cover: float = 4.0, height: float = 0.0, tilt: float = 0.0, seed: int = 0
) -> Splats:
    """About n randomly turned splats of aspect 1 to 2, jittered about a square grid, flat but for a tilt in radians."""
    rng = np.random.default_rng(seed)
    side = round(np.sqrt(n))
    step = size / side
    grid = (np.stack(np.meshgrid(*[np.arange(side)] * 2), axis=-1).reshape(-1, 2) + 0.5) * step
    flat = grid + rng.uniform(-0.35, 0.35, grid.shape) * step
    means = np.column_stack([flat, np.full(len(flat), height)])
    aspects = rng.uniform(1.0, 2.0, len(flat))
    radius = step * np.sqrt(cover / np.pi)
    axes = radius * np.stack([np.sqrt(aspects), 1.0 / np.sqrt(aspects)], axis=1)
    turns = Rotation.from_rotvec(rng.uniform(0.0, np.pi, len(flat))[:, None] * [0.0, 0.0, 1.0])
    tilts = Rotation.from_rotvec(tilt * rng.normal(size=(len(flat), 3)) * [1.0, 1.0, 0.0])
    return splats_of(means, axes, (tilts * turns).as_matrix())


def ball(n: int, cover: float = 4.0, seed: int = 0) -> Splats:
    """Tangent splats at random on a bumpy ball of radius about 1."""
    rng = np.random.default_rng(seed)
    normals = rng.normal(size=(n, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    means = normals * (1.0 + 0.1 * np.sin(4.0 * normals[:, 0]) * np.sin(3.0 * normals[:, 1]))[:, None]
    tangents = np.cross(normals, rng.normal(size=(n, 3)))
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    frames = np.stack([tangents, np.cross(normals, tangents), normals], axis=2)
    aspects = rng.uniform(1.0, 2.0, n)
    axes = np.sqrt(4.0 * cover / n) * np.stack([np.sqrt(aspects), 1.0 / np.sqrt(aspects)], axis=1)
    return splats_of(means, axes, frames)


def cloud(n: int, size: float = 0.4, seed: int = 0) -> Splats:
    """Ellipses of aspect up to 10 at any place in the unit cube and any angle."""
    rng = np.random.default_rng(seed)
    axes = size * np.exp(rng.uniform(-1.5, 0.0, (n, 1))) * np.stack([np.ones(n), rng.uniform(0.1, 1.0, n)], axis=1)
    return splats_of(rng.uniform(size=(n, 3)), axes, Rotation.random(n, random_state=seed).as_matrix())


def joined(*parts: Splats) -> Splats:
    """All splats of several scenes, one after the other."""
    names = ("means", "log_scales", "quats", "logit_opacities", "sh0", "shN")
    return Splats(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in names})


def shuffled(splats: Splats, order: NDArray[np.int64]) -> Splats:
    """The same splats in another file order: row r holds what was in row ``order[r]``."""
    names = ("means", "log_scales", "quats", "logit_opacities", "sh0", "shN")
    return Splats(**{name: getattr(splats, name)[order] for name in names})


def moved(splats: Splats, rotation: Rotation, scale: float, shift: NDArray[np.float64]) -> Splats:
    """The same splats turned, scaled and shifted."""
    turned = rotation * Rotation.from_quat(splats.quats[:, [1, 2, 3, 0]])
    return replace(
        splats,
        means=scale * rotation.apply(splats.means) + shift,
        log_scales=splats.log_scales + np.log(scale),
        quats=turned.as_quat()[:, [3, 0, 1, 2]],
    )


def row_edges(rows: NDArray[np.int64], edges: NDArray[np.integer]) -> set[frozenset[int]]:
    """Edges between nodes as sets of file rows."""
    return {frozenset(pair) for pair in rows[edges].tolist()}
