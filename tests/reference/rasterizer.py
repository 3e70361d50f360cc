"""Slow and plain pictures of a few splats, to hold the shaders against."""

import numpy as np

from splap_editor.viewport.projection import Projection

LOW_PASS = 0.3


def _pixel_grid(projection: Projection):
    ys, xs = np.mgrid[0 : projection.height, 0 : projection.width] + 0.5
    return xs, ys


def _covariance(projection: Projection, mean, u, v, thickness):
    """EWA: (2, 2) covariance in px² of one splat and its centre in pixels; y downwards."""
    view = projection.view_from_world
    x, y, z = view[:3, :3] @ mean + view[:3, 3]
    normal = np.cross(u, v)
    length = np.linalg.norm(normal)
    w = normal / length * thickness if length > 0 else np.zeros(3)
    axes = view[:3, :3] @ np.stack([u, v, w], axis=1)
    zoom = np.array([projection.clip_from_view[0, 0], projection.clip_from_view[1, 1]])
    focal = 0.5 * zoom * [projection.width, projection.height]
    if projection.is_parallel:
        J = np.array([[focal[0], 0.0, 0.0], [0.0, focal[1], 0.0]])
    else:
        slope = np.clip(np.array([x, y]) / -z, -1.3 / zoom, 1.3 / zoom)
        J = np.array([[focal[0], 0.0, focal[0] * slope[0]], [0.0, focal[1], focal[1] * slope[1]]]) / -z
    J[1] *= -1.0
    return J @ axes @ axes.T @ J.T + LOW_PASS * np.eye(2), projection.pixel(mean)


def splats_picture(projection: Projection, means, u, v, thickness, cutoffs, rgba, background):
    """Alpha-blended Gaussians, back to front in float64; (H, W, 3) in 0..1."""
    xs, ys = _pixel_grid(projection)
    picture = np.broadcast_to(np.asarray(background, float), (*xs.shape, 3)).copy()
    for i in np.argsort(-projection.depths(means), kind="stable"):
        C, center = _covariance(projection, means[i], u[i], v[i], thickness[i])
        d = np.stack([xs - center[0], ys - center[1]], axis=-1)
        square = np.einsum("hwi,ij,hwj->hw", d, np.linalg.inv(C), d)
        alpha = rgba[i, 3] * np.exp(-0.5 * square)
        alpha[(alpha < 1.0 / 255.0) | (square > cutoffs[i] ** 2)] = 0.0
        picture += alpha[..., None] * (rgba[i, :3] - picture)
    return picture


def ellipses_picture(projection: Projection, means, u, v, cutoffs, rgb, background):
    """Nearest occupancy ellipse of each pixel, unlit, no rims; colours (H, W, 3) and rows (H, W), -1 for none."""
    xs, ys = _pixel_grid(projection)
    depth = np.full(xs.shape, np.inf)
    rows = np.full(xs.shape, -1)
    rays = [projection.ray(x, y) for x, y in zip(xs.ravel(), ys.ravel(), strict=True)]
    starts = np.array([r[0] for r in rays]).reshape(*xs.shape, 3)
    directions = np.array([r[1] for r in rays]).reshape(*xs.shape, 3)
    for i in range(len(means)):
        normal = np.cross(u[i], v[i])
        with np.errstate(divide="ignore", invalid="ignore"):
            t = ((means[i] - starts) @ normal) / (directions @ normal)
        local = starts + t[..., None] * directions - means[i]
        coordinates = local @ np.linalg.pinv(np.stack([u[i], v[i]], axis=1)).T
        hit = (np.sum(coordinates**2, axis=-1) <= cutoffs[i] ** 2) & (t > 0) & (t < depth)
        depth[hit], rows[hit] = t[hit], i
    picture = np.broadcast_to(np.asarray(background, float), (*xs.shape, 3)).copy()
    picture[rows >= 0] = rgb[rows[rows >= 0]]
    return picture, rows


def points_picture(projection: Projection, means, rgb, diameter_px, background):
    """Flat discs of constant size, nearest on top; colours (H, W, 3) and rows (H, W), -1 for none."""
    xs, ys = _pixel_grid(projection)
    rows = np.full(xs.shape, -1)
    centers = projection.pixels(means)
    for i in np.argsort(-projection.depths(means), kind="stable"):
        rows[np.hypot(xs - centers[i, 0], ys - centers[i, 1]) <= diameter_px / 2.0] = i
    picture = np.broadcast_to(np.asarray(background, float), (*xs.shape, 3)).copy()
    picture[rows >= 0] = rgb[rows[rows >= 0]]
    return picture, rows


def psnr(picture, reference) -> float:
    """Peak signal-to-noise ratio in dB of pictures in 0..1."""
    return float(-10.0 * np.log10(np.mean((np.asarray(picture) - reference) ** 2)))
