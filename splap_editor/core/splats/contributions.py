"""What each splat contributes to pictures of the scene from all around."""

from dataclasses import dataclass
from functools import partial

import numba as nb
import numpy as np
from numpy.typing import NDArray

from splap_editor.core.progress import Progress, Runner, in_turn, no_progress
from splap_editor.core.splats.main_subject import MainSubject
from splap_editor.core.splats.occupancy import Ellipses
from splap_editor.core.splats.rotations import quats_to_matrices
from splap_editor.core.splats.splats import Splats

_SIDES = (128, 512)
"""Least and largest width of the pictures in pixels; between, it grows with the root of the number of splats, so that
a splat has about as many pixels in every scene and the time is linear in their number."""

_WIDTH_PER_ROOT = 0.4

_MANY = 200_000
"""More splats than these are looked at from the corners of a cube alone: each is small and seen well from some."""

_CUBE = 4
"""So many of the directions are a cube's."""

_BLUR = 0.3
"""Variance in squared pixels added to every projected splat, so that none falls between the pixels. It is dimmed by as
much as it is widened [1]_.

.. [1] Yu et al., "Mip-Splatting: Alias-free 3D Gaussian Splatting", CVPR 2024, Eq. 12.
"""

_TRAINED_WIDTH = 800
"""About so many pixels had the subject in training. There, a needle thinner than a pixel was as wide as the blur."""

_ROOM = 0.25
"""Splats farther beyond the subject's box than this share of its size are in no picture: they would stand before it."""

_REACH = 8.0
"""Kernels end at so many squared standard deviations, or at their cut-off: what is beyond is 2 % of them."""

_DARK = 1.0 / 255.0
"""What is left of the light where nothing farther back is looked at any more."""


@dataclass(frozen=True, eq=False)
class Contributions:
    """What the active splats contribute to pictures of the scene.

    Parameters
    ----------
    weights : (n,) float64
        Blending weight, summed over the pixels of all pictures: the mean area that a splat fills in a picture, in
        units of the scene's size squared.
    peaks : (n,) float64
        Largest blending weight in any pixel, in [0, 1], if the picture were fine enough for the splat.
    """

    weights: NDArray[np.float64]
    peaks: NDArray[np.float64]


def contributions(
    splats: Splats,
    ellipses: Ellipses,
    *,
    subject: MainSubject | None = None,
    progress: Progress = no_progress,
    run: Runner = in_turn,
) -> Contributions:
    """Sum up what each active splat contributes to pictures of the scene from all around.

    The twenty corners of a dodecahedron in the frame of the main subject's box give the directions; of very many
    splats, the eight corners of a cube. Each picture is a parallel projection, alpha-composited from front to back
    [1]_ [2]_, of the splats in and about that box.

    Parameters
    ----------
    splats : Splats
        The scene.
    ellipses : Ellipses
        Its n active splats.
    subject : MainSubject, optional
        What the pictures are of; without, the subject of the ellipses. Its size is positive.
    progress : Progress
        Called with the share done.
    run : Runner
        Runs the pictures of each direction; what comes out does not depend on how.

    Returns
    -------
    Contributions
        Zero for splats in the interior of something opaque, and for those far beyond the subject. Turning, moving,
        scaling or shuffling the splats changes nothing but pixels at their rims.

    References
    ----------
    .. [1] Zwicker et al., "EWA Splatting", TVCG 2002.
    .. [2] Kerbl et al., "3D Gaussian Splatting for Real-Time Radiance Field Rendering", SIGGRAPH 2023.
    """
    n = ellipses.n_nodes
    weights, peaks = np.zeros(n), np.zeros(n)
    subject = subject or ellipses.subject
    shown = np.flatnonzero(subject.holds(ellipses.centers, room=_ROOM * subject.size))
    if not len(shown):
        return Contributions(weights, peaks)
    rows = ellipses.rows[shown]
    points = ellipses.centers[shown] - subject.center
    axes = quats_to_matrices(np.asarray(splats.quats[rows], np.float64))[:, :, : splats.n_scales]
    axes = np.ascontiguousarray((axes * splats.scales[rows][:, None, :]).swapaxes(1, 2))
    opacities, squares = np.ascontiguousarray(splats.opacities[rows]), np.minimum(ellipses.cutoffs[shown] ** 2, _REACH)
    views, extents = _views(subject)
    if len(shown) > _MANY:
        views, extents = views[:_CUBE], extents[:_CUBE]
    width = float(np.clip(_WIDTH_PER_ROOT * np.sqrt(len(shown)), *_SIDES))
    pixel = 2.0 * float(extents.max()) / width
    trained_blur = _BLUR * min(1.0, subject.size / _TRAINED_WIDTH / pixel) ** 2

    def pictures(
        view: NDArray[np.float64], extent: NDArray[np.float64], progress: Progress
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        found, highest = np.zeros(len(shown)), np.zeros(len(shown))
        order = np.argsort(points @ view[2], kind="stable").astype(np.int32)
        columns, lines = np.ceil(2.0 * extent / pixel).astype(int)
        # From behind, the same pixels are filled in the opposite order.
        for places in (order, order[::-1].copy()):
            progress(0.0 if places is order else 0.5)
            light = np.ones((lines, columns))
            _composite(places, view / pixel, points, axes, opacities, squares, trained_blur, light, found, highest)
        return found, highest

    parts = [partial(pictures, view, extent) for view, extent in zip(views, extents, strict=True)]
    pairs = run(parts, lambda shares: progress(sum(shares) / len(parts)))
    progress(1.0)
    found, highest = sum(pair[0] for pair in pairs), np.maximum.reduce([pair[1] for pair in pairs])
    weights[shown] = found * (pixel / subject.size) ** 2 / (2 * len(views))
    peaks[shown] = highest
    return Contributions(weights, peaks)


def _views(subject: MainSubject) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Cameras that look at a subject from the corners of a dodecahedron, one of each opposite pair.

    Returns
    -------
    views : (10, 3, 3) float64
        Rows: across, up and away.
    extents : (10, 2) float64
        How far the subject's box, with some room, reaches across and up from its middle.
    """
    golden = 0.5 * (1.0 + np.sqrt(5.0))
    a, b = 1.0 / golden, golden
    cube = [[1, 1, 1], [1, 1, -1], [1, -1, 1], [1, -1, -1]]
    rest = [[0, a, b], [0, a, -b], [a, b, 0], [a, -b, 0], [b, 0, a], [b, 0, -a]]
    away = np.array([*cube, *rest], np.float64) / np.sqrt(3.0)
    helper = np.eye(3)[np.argmin(np.abs(away), axis=1)]
    across = np.cross(helper, away)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    frame = _frame(subject)
    views = np.stack([across, np.cross(away, across), away], axis=1) @ frame
    extents = np.abs(views[:, :2] @ subject.half_axes.T).sum(axis=2)
    return views, np.maximum(extents, 0.05 * subject.size) * 1.05


def _frame(subject: MainSubject) -> NDArray[np.float64]:
    """(3, 3) unit axes of the subject's box as rows, the longest first; right-handed, also where the box is flat."""
    first = subject.half_axes[0] / np.linalg.norm(subject.half_axes[0])
    second = subject.half_axes[1]
    if not np.linalg.norm(second) > 1e-9 * subject.size:
        second = np.cross(first, np.eye(3)[np.argmin(np.abs(first))])
    second = second / np.linalg.norm(second)
    return np.stack([first, second, np.cross(first, second)])


@nb.njit(nogil=True, cache=True, error_model="numpy")
def _composite(order, view, points, axes, opacities, squares, trained_blur, light, weights, peaks):
    """Draw splats from front to back; each takes its share of the light that is left in the pixels it covers."""
    lines, columns = light.shape
    n_axes = axes.shape[1]
    p, q = np.empty(n_axes), np.empty(n_axes)
    for i in order:
        x, y = 0.5 * columns, 0.5 * lines
        for a in range(3):
            x += view[0, a] * points[i, a]
            y += view[1, a] * points[i, a]
        xx = xy = yy = area = 0.0
        for c in range(n_axes):
            p[c] = view[0, 0] * axes[i, c, 0] + view[0, 1] * axes[i, c, 1] + view[0, 2] * axes[i, c, 2]
            q[c] = view[1, 0] * axes[i, c, 0] + view[1, 1] * axes[i, c, 1] + view[1, 2] * axes[i, c, 2]
            xx, xy, yy = xx + p[c] * p[c], xy + p[c] * q[c], yy + q[c] * q[c]
            # The determinant as a sum of squares, which keeps a needle's width.
            for d in range(c):
                area += (p[c] * q[d] - p[d] * q[c]) ** 2
        determinant = area + _BLUR * (xx + yy) + _BLUR * _BLUR
        if not determinant < 1e300:
            continue
        sharp = area + trained_blur * (xx + yy) + trained_blur * trained_blur
        dimming = np.sqrt(sharp / determinant)
        opacity = opacities[i] * dimming
        xx, yy = xx + _BLUR, yy + _BLUR
        step, per_yy, slope = yy / determinant, 1.0 / yy, xy / yy
        growth = np.exp(-step)
        total, peak = 0.0, 0.0
        tall = np.sqrt(squares[i] * yy)
        for line in range(max(0, int(np.ceil(y - tall - 0.5))), min(lines, int(np.floor(y + tall + 0.5)))):
            dy = line + 0.5 - y
            inside = squares[i] - dy * dy * per_yy
            if inside < 0.0:
                continue
            # The chord of the ellipse along this line, and the kernel's values on it by their ratios.
            middle, wide = x + slope * dy, np.sqrt(inside / step)
            first = max(0, int(np.ceil(middle - wide - 0.5)))
            last = min(columns, int(np.floor(middle + wide + 0.5)))
            dx = first + 0.5 - middle
            alpha = opacity * np.exp(-0.5 * (step * dx * dx + dy * dy * per_yy))
            ratio = np.exp(-step * (dx + 0.5))
            for column in range(first, last):
                left = light[line, column]
                if left > _DARK:
                    weight = min(0.99, alpha) * left
                    total += weight
                    peak = max(peak, alpha * left)
                    light[line, column] = left - weight
                alpha, ratio = alpha * ratio, ratio * growth
        weights[i] += total
        # What is dimmed here for want of pixels is bright where there are more.
        peaks[i] = max(peaks[i], peak / dimming)
