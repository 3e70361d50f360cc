"""What each splat contributes to pictures of the scene from all around."""

from dataclasses import dataclass
from functools import partial

import numba as nb
import numpy as np
from numpy.typing import NDArray

from splap_editor.core.index_spaces import Nodes, Places
from splap_editor.core.progress import Progress, Runner, in_parts, in_turn, no_progress
from splap_editor.core.splats.main_subject import MainSubject
from splap_editor.core.splats.occupancy import Ellipses
from splap_editor.core.splats.splats import Splats

_SIDES = (128, 512)
"""Least and largest width of the pictures in pixels; between, it grows with the root of the number of splats, so that
a splat has about as many pixels in every scene and the time is linear in their number."""

_WIDTH_PER_ROOT = 0.4

MANY = 200_000
"""Of more splats than these, each is in the pictures of some directions only, and grown to stand for those left out."""

_SHARED_BY = 5
"""Then so many share a place: each is seen along two axes, at 70.5 degrees to each other."""

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

_PER_SQUARE = 512.0
_BELL = np.exp(-0.5 * np.arange(int(_REACH * _PER_SQUARE) + 3) / _PER_SQUARE)
"""A kernel's values at so many places per squared standard deviation; what lies between is off by less than 1e-6."""

_BLOCK_NODES = 1 << 14

_KEYS = 2.0**32 - 1.0
_N_SCENE, _N_KERNEL = 14, 8

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


def shared_by(n: int) -> int:
    """Into how many parts n splats are divided where each needs to be looked at in some directions only."""
    return _SHARED_BY if n > MANY else 1


def contributions(
    splats: Splats,
    ellipses: Ellipses,
    *,
    subject: MainSubject | None = None,
    progress: Progress = no_progress,
    run: Runner = in_turn,
) -> Contributions:
    """Sum up what each active splat contributes to pictures of the scene from all around.

    The twenty corners of a dodecahedron in the frame of the main subject's box give the directions. Each picture is a
    parallel projection, alpha-composited from front to back [1]_ [2]_, of the splats in and about that box; of very
    many splats, every fifth is in a picture, with five times its area, and each is in four of the pictures.

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
    n_shared = shared_by(len(shown))
    scene = _scene(splats, ellipses, subject, shown, np.sqrt(n_shared), run)
    views, extents = _views(subject)
    width = float(np.clip(_WIDTH_PER_ROOT * np.sqrt(len(shown) / n_shared), *_SIDES))
    pixel = 2.0 * float(extents.max()) / width
    trained_blur = _BLUR * min(1.0, subject.size / _TRAINED_WIDTH / pixel) ** 2

    def pictures(number: int, progress: Progress) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Weights and peaks, (n_seen,) each, of the splats that the two pictures along one direction show."""
        columns, lines = np.ceil(2.0 * extents[number] / pixel).astype(int)
        first = number % n_shared
        n_seen = -(-(len(scene) - first) // n_shared)
        kernels, depths = np.empty((n_seen, _N_KERNEL)), np.empty(n_seen)
        _project(views[number] / pixel, scene, first, n_shared, lines, columns, trained_blur, kernels, depths)
        order = _in_depth(depths)
        found, highest = np.zeros((2, len(kernels)))
        # From behind, the same pixels are filled in the opposite order.
        for places in (order, order[::-1].copy()):
            progress(0.0 if places is order else 0.5)
            _composite(places, kernels, np.ones((lines, columns)), _BELL, found, highest)
        return found, highest

    parts = [partial(pictures, number) for number in range(len(views))]
    pairs = run(parts, lambda shares: progress(sum(shares) / len(parts)))
    progress(1.0)
    for number, (found, highest) in enumerate(pairs):
        some = shown[number % n_shared :: n_shared]
        weights[some] += found
        peaks[some] = np.maximum(peaks[some], highest)
    weights *= (pixel / subject.size) ** 2 / (2 * len(views))
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
    # Those that are five apart in this order are at 70.5 degrees to each other, not at 41.8.
    cube = [[1, 1, 1], [1, 1, -1], [1, -1, 1], [1, -1, -1]]
    rest = [[0, a, b], [0, a, -b], [a, -b, 0], [a, b, 0], [b, 0, a], [b, 0, -a]]
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


def _scene(
    splats: Splats, ellipses: Ellipses, subject: MainSubject, nodes: Nodes, growth: float, run: Runner
) -> NDArray[np.float32]:
    """(m, 14) of some nodes: centre from the subject's middle, three scaled axes, opacity, square of where it ends.

    The axes are grown by a factor; a splat of two scales has none along its normal.
    """
    scene, middle = np.zeros((len(nodes), _N_SCENE), np.float32), np.array(subject.center)

    def fill(first: int, end: int, progress: Progress) -> None:
        """Fill in the nodes first to end - 1, so many at a time that what is copied of them stays in the cache."""
        for lo in range(first, end, _BLOCK_NODES):
            some = nodes[lo : min(lo + _BLOCK_NODES, end)]
            rows = ellipses.rows[some]
            # Of one type in every file: another would be another loop.
            quats, scales = (np.asarray(held[rows], np.float64) for held in (splats.quats, splats.scales))
            opacities = np.asarray(splats.opacities[rows], np.float64)
            scales *= growth
            centers, cutoffs = ellipses.centers[some], ellipses.cutoffs[some]
            _fill_scene(middle, centers, cutoffs, quats, scales, opacities, scene[lo : lo + len(some)])

    in_parts(fill, len(nodes), no_progress, run)
    return scene


@nb.njit(nogil=True, cache=True, error_model="numpy")
def _fill_scene(middle, centers, cutoffs, quats, scales, opacities, scene):
    """Fill in `_scene` (m, 14) of splats that have a rotation."""
    for k in range(len(scene)):
        for a in range(3):
            scene[k, a] = centers[k, a] - middle[a]
        # Dividing by the largest entry first keeps the squared length in range.
        largest = max(abs(quats[k, 0]), abs(quats[k, 1]), abs(quats[k, 2]), abs(quats[k, 3]))
        w, x, y, z = quats[k, 0] / largest, quats[k, 1] / largest, quats[k, 2] / largest, quats[k, 3] / largest
        length = np.sqrt(w * w + x * x + y * y + z * z)
        w, x, y, z = w / length, x / length, y / length, z / length
        turned = (
            (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)),
            (2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)),
            (2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)),
        )
        for axis in range(scales.shape[1]):
            for a in range(3):
                scene[k, 3 + 3 * axis + a] = turned[axis][a] * scales[k, axis]
        scene[k, 12] = opacities[k]
        scene[k, 13] = min(cutoffs[k] ** 2, _REACH)


def _in_depth(depths: NDArray[np.float64]) -> Places:
    """(m,) int32 the nearest first, to one in 2³² of their range: two passes of a sort by 16 bits."""
    nearest, farthest = depths.min(), depths.max()
    keys = ((depths - nearest) / max(farthest - nearest, 1e-300) * _KEYS).astype(np.uint32)
    order = np.argsort((keys & np.uint32(0xFFFF)).astype(np.uint16), kind="stable")
    return order[np.argsort((keys >> np.uint32(16)).astype(np.uint16)[order], kind="stable")].astype(np.int32)


@nb.njit(nogil=True, cache=True, error_model="numpy")
def _project(view, scene, first, step, lines, columns, trained_blur, kernels, depths):
    """Fill in what a picture knows of every ``step``-th splat of a scene (m, 14), and how far away it is.

    Parameters
    ----------
    view : (3, 3) float64
        Rows: across, up and away, in pixels per world unit.
    kernels : (n, 8) float64
        Column and line of the centre; the coefficients of its square across and, at its best column, up; that column's
        slope; opacity, square of where it ends, and by how much it is dimmed for want of pixels, 0 of what is too
        large to be drawn.
    depths : (n,) float64
        In pixels.
    """
    p, q = np.empty(3), np.empty(3)
    for k in range(len(kernels)):
        i = first + k * step
        x, y, z = 0.5 * columns, 0.5 * lines, 0.0
        for a in range(3):
            x += view[0, a] * scene[i, a]
            y += view[1, a] * scene[i, a]
            z += view[2, a] * scene[i, a]
        depths[k] = z
        xx = xy = yy = area = 0.0
        for c in range(3):
            u, v, w = scene[i, 3 + 3 * c], scene[i, 4 + 3 * c], scene[i, 5 + 3 * c]
            p[c] = view[0, 0] * u + view[0, 1] * v + view[0, 2] * w
            q[c] = view[1, 0] * u + view[1, 1] * v + view[1, 2] * w
            xx, xy, yy = xx + p[c] * p[c], xy + p[c] * q[c], yy + q[c] * q[c]
            # The determinant as a sum of squares, which keeps a needle's width.
            for d in range(c):
                area += (p[c] * q[d] - p[d] * q[c]) ** 2
        determinant = area + _BLUR * (xx + yy) + _BLUR * _BLUR
        if not determinant < 1e300:
            kernels[k, 7] = 0.0
            continue
        sharp = area + trained_blur * (xx + yy) + trained_blur * trained_blur
        dimming = np.sqrt(sharp / determinant)
        xx, yy = xx + _BLUR, yy + _BLUR
        kernels[k, 0], kernels[k, 1] = x, y
        kernels[k, 2], kernels[k, 3], kernels[k, 4] = yy / determinant, 1.0 / yy, xy / yy
        kernels[k, 5], kernels[k, 6], kernels[k, 7] = scene[i, 12] * dimming, scene[i, 13], dimming


@nb.njit(nogil=True, cache=True, error_model="numpy")
def _composite(order, kernels, light, bell, weights, peaks):
    """Draw kernels (n, 8) from front to back; each takes its share of the light left in the pixels that it covers."""
    lines, columns = light.shape
    for i in order:
        dimming = kernels[i, 7]
        if dimming == 0.0:
            continue
        x, y, step, per_yy, slope = kernels[i, 0], kernels[i, 1], kernels[i, 2], kernels[i, 3], kernels[i, 4]
        opacity, square = kernels[i, 5], kernels[i, 6]
        total, peak, per_step = 0.0, 0.0, 1.0 / step
        tall = np.sqrt(square / per_yy)
        for line in range(max(0, int(np.ceil(y - tall - 0.5))), min(lines, int(np.floor(y + tall + 0.5)))):
            dy = line + 0.5 - y
            above = dy * dy * per_yy
            if square < above:
                continue
            # The chord of the ellipse along this line.
            middle, wide = x + slope * dy, np.sqrt((square - above) * per_step)
            first = max(0, int(np.ceil(middle - wide - 0.5)))
            for column in range(first, min(columns, int(np.floor(middle + wide + 0.5)))):
                left = light[line, column]
                if left > _DARK:
                    dx = column + 0.5 - middle
                    place = _PER_SQUARE * (above + step * dx * dx)
                    at = int(place)
                    alpha = opacity * (bell[at] + (place - at) * (bell[at + 1] - bell[at]))
                    weight = min(0.99, alpha) * left
                    total += weight
                    peak = max(peak, alpha * left)
                    light[line, column] = left - weight
        weights[i] += total
        # What is dimmed here for want of pixels is bright where there are more.
        peaks[i] = max(peaks[i], peak / dimming)
