"""Slow and plain pictures of a few splats, and what each splat contributes to them."""

import numpy as np

BLUR, ROOM, REACH, DARK, TRAINED_WIDTH = 0.3, 0.25, 8.0, 1.0 / 255.0, 800


def contributions(splats, ellipses, width):
    """(n,) summed weights and (n,) peaks, by a dense picture for each corner of a dodecahedron."""
    subject, n = ellipses.subject, ellipses.n_nodes
    weights, peaks = np.zeros(n), np.zeros(n)
    frame = subject.half_axes / np.linalg.norm(subject.half_axes, axis=1, keepdims=True)
    frame[2] = np.cross(frame[0], frame[1])
    golden = (1 + np.sqrt(5)) / 2
    corners = [[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    for p in (-1 / golden, 1 / golden):
        for q in (-golden, golden):
            corners += [[0, p, q], [p, q, 0], [q, 0, p]]
    views = []
    for corner in np.array(corners) / np.sqrt(3):
        across = np.cross(np.eye(3)[np.argmin(abs(corner))], corner)
        across /= np.linalg.norm(across)
        view = np.stack([across, np.cross(corner, across), corner]) @ frame
        extent = 1.05 * np.maximum(abs(view[:2] @ subject.half_axes.T).sum(axis=1), 0.05 * subject.size)
        views.append((view, extent))
    pixel = 2 * max(extent.max() for _, extent in views) / width
    for view, extent in views:
        picture_weights, picture_peaks = _picture(splats, ellipses, view, extent, pixel)
        weights += picture_weights
        peaks = np.maximum(peaks, picture_peaks)
    return weights * (pixel / subject.size) ** 2 / len(views), peaks


def _picture(splats, ellipses, view, extent, pixel):
    subject = ellipses.subject
    columns, lines = np.ceil(2 * extent / pixel).astype(int)
    ys, xs = np.mgrid[0:lines, 0:columns] + 0.5
    local = (ellipses.centers - subject.center) @ view.T
    trained = BLUR * min(1, subject.size / TRAINED_WIDTH / pixel) ** 2
    light = np.ones((lines, columns))
    weights, peaks = np.zeros(ellipses.n_nodes), np.zeros(ellipses.n_nodes)
    for i in np.argsort(local[:, 2], kind="stable"):
        if not subject.holds(ellipses.centers[[i]], room=ROOM * subject.size)[0]:
            continue
        row = ellipses.rows[i]
        axes = _rotation(splats.quats[row].astype(float))[:, : splats.n_scales] * splats.scales[row]
        flat = view[:2] @ axes @ axes.T @ view[:2].T / pixel**2
        blurred = flat + BLUR * np.eye(2)
        dimming = np.sqrt(np.linalg.det(flat + trained * np.eye(2)) / np.linalg.det(blurred))
        d = np.stack([xs - columns / 2 - local[i, 0] / pixel, ys - lines / 2 - local[i, 1] / pixel], axis=-1)
        square = np.einsum("hwa,ab,hwb->hw", d, np.linalg.inv(blurred), d)
        kernel = splats.opacities[row] * np.exp(-0.5 * square)
        kernel[(square > min(ellipses.cutoffs[i] ** 2, REACH)) | (light <= DARK)] = 0
        alpha = np.minimum(0.99, dimming * kernel)
        weights[i], peaks[i] = (alpha * light).sum(), (kernel * light).max()
        light *= 1 - alpha
    return weights, peaks


def _rotation(quat):
    w, x, y, z = quat / np.linalg.norm(quat)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
