"""Splats that a deformation draws out, each split into several that follow the surface along its length.

An adapted ellipse is the best that one splat can do. Where it has become several times as long it stands off a bent
surface as a needle does. Split it is a row of ellipses along the direction of its stretch, each of them laid where the
splats around it have gone, and together as dense as it was.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.adaptation.kernel_adaptation import AdaptedKernels, node_motions
from splap_editor.core.index_spaces import FileRows, Nodes
from splap_editor.core.progress import Progress, no_progress
from splap_editor.core.splats.rotations import matrices_to_quats, quats_to_matrices
from splap_editor.core.splats.splats import Splats

MOST_CHILDREN = 11
"""Splats that one becomes at most, enough for a stretch of 4.6 times the limit. Numbers are odd: of an even one none
is in the middle, where an opaque splat is flat, and the fit is worse by half."""

_NEIGHBORS = 16
"""Nodes that lay a child: the one next to it and the nearest of that along the surface."""

_STEP_NEIGHBORS, _MOST_STEPS = 29, 64
"""Nodes looked at in each step from the middle of a splat to a child, and the most steps."""

_SPACING = 1.6
"""Distance of children along a row in their own standard deviations: the sum of a wide row ripples by 0.1 %."""

_WIDTH = 1.1
"""Of children, in units of the width at which the row's variance would be the parent's if all weighed the same."""

_CHUNK = 2048

_FAINTEST, _MOST_OPAQUE = 1e-3, 0.9995
"""Opacities between which children are fitted; fainter ones go with their parent's, denser ones cannot be told."""

_Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Repair:
    """Splats of a file after a repair: its own rows, then the new ones.

    Parameters
    ----------
    splats : Splats
        N + M of them; of a split splat its own row is the first child.
    copied : (M,) int64
        File row that each new one is a copy of but for place, shape and opacity.
    n_split : int
    """

    splats: Splats
    copied: FileRows
    n_split: int


def repaired(splats: Splats, kernels: AdaptedKernels, limit: float, progress: Progress = no_progress) -> Repair | None:
    """Split the splats that a deformation stretches more than so many times; None where there are none.

    Parameters
    ----------
    splats : Splats
        As they are adapted by ``kernels``, in the file's coordinates; colours and opacities may have been changed.
    kernels : AdaptedKernels
    limit : float
        Largest stretch, above 1, beyond what is magnification in all directions. No child is drawn out more, unless
        its parent would become more than `MOST_CHILDREN`.
    progress : Progress
        Told the share done; may cancel.

    Returns
    -------
    Repair or None
        Rows that are not split are the same numbers.
    """
    nodes, counts = _split_nodes(kernels, limit)
    if not len(nodes):
        return None
    order = np.argsort(counts, kind="stable")
    nodes, counts = nodes[order], counts[order]
    maps = _NodeMaps(kernels)
    parts, done = [], 0
    for count in np.unique(counts):
        of_count = nodes[counts == count]
        for lo in range(0, len(of_count), _CHUNK):
            chunk = of_count[lo : lo + _CHUNK]
            parts.append(_children(splats, maps, chunk, int(count)))
            done += len(chunk)
            progress(done / len(nodes))
    rows = np.concatenate([part.rows for part in parts])
    firsts = np.concatenate([part.is_first for part in parts])
    copied = rows[~firsts]
    grown = splats.at(np.concatenate([np.arange(splats.n_splats), copied]))
    # First children stand in the rows of their parents, the others after the file's.
    at = np.empty(len(rows), np.int64)
    at[firsts], at[~firsts] = rows[firsts], splats.n_splats + np.arange(len(copied))
    for name in ("means", "quats", "log_scales", "logit_opacities"):
        getattr(grown, name)[at] = np.concatenate([getattr(part, name) for part in parts])
    return Repair(grown, copied, len(nodes))


def child_width(count: int) -> float:
    """Standard deviation of each of so many children along their row, in units of their parent's."""
    return float(_WIDTH / np.hypot(1.0, 0.5 * (count - 1)))


def child_offsets(count: int) -> _Floats:
    """(count,) places of children along their row, in units of their parent's standard deviation."""
    return _SPACING * child_width(count) * (np.arange(count, dtype=np.float64) - 0.5 * (count - 1))


def child_opacities(count: int, opacities: NDArray[np.floating]) -> _Floats:
    """Opacities of children that blend to what their parent does.

    Parameters
    ----------
    count : int
        Children of each parent.
    opacities : (n,) float
        Of the parents, in [0, 1].

    Returns
    -------
    (n, count) float64
        Symmetric. ``1 - Π (1 - a_i g_i(x) h)`` is nearest to ``α g(x) h`` in the mean square over the parent's whole
        face, with ``h`` falling off across the row.
    """
    logits, fitted = _fitted_opacities(count)
    held = np.clip(opacities, _FAINTEST, _MOST_OPAQUE)
    at = np.log(held / (1.0 - held))
    found = np.column_stack([np.interp(at, logits, np.log(column / (1.0 - column))) for column in fitted.T])
    # What is fainter than the first of the fit blends as a sum.
    share: _Floats = np.minimum(np.asarray(opacities, np.float64) / _FAINTEST, 1.0)
    return share[:, None] / (1.0 + np.exp(-found))


@lru_cache
def _fitted_opacities(count: int) -> tuple[_Floats, _Floats]:
    """Logits of parents' opacities (k,), rising, and fitted opacities of their children (k, count).

    Gauss-Newton steps in the children's logits, each opacity going on from the fainter one before, which is nearly so.
    """
    half = (count + 1) // 2
    mirror = np.minimum(np.arange(count), count - 1 - np.arange(count))
    along, across = np.arange(0.0, 3.6, 0.15), np.exp(-0.5 * np.arange(0.0, 2.6, 0.25) ** 2)
    shapes = np.exp(-0.5 * ((along[:, None] - child_offsets(count)) / child_width(count)) ** 2)
    shapes = (across[:, None, None] * shapes).reshape(-1, count)
    parent = (across[:, None] * np.exp(-0.5 * along**2)).ravel()
    lowest, highest = np.log(_FAINTEST / (1.0 - _FAINTEST)), np.log(_MOST_OPAQUE / (1.0 - _MOST_OPAQUE))
    logits = np.linspace(lowest, highest, 24)
    gathered = np.zeros((count, half))
    gathered[np.arange(count), mirror] = 1.0
    # Faint children add up: this first fit is linear.
    sums = np.linalg.lstsq(shapes @ gathered, parent, rcond=None)[0]
    a = np.clip(_FAINTEST * sums, 1e-6, None)
    t = np.log(a / (1.0 - a))
    found = np.empty((len(logits), count))
    for k, logit in enumerate(logits):
        alpha = 1.0 / (1.0 + np.exp(-logit))
        for _ in range(12):
            a = 1.0 / (1.0 + np.exp(-t))
            left = 1.0 - a[mirror] * shapes
            through = left.prod(axis=1)
            residual = (1.0 - through) - alpha * parent
            slopes = (through[:, None] / left * shapes) @ gathered * (a * (1.0 - a))
            square = slopes.T @ slopes
            square[np.diag_indices(half)] += 1e-6 * np.trace(square) + 1e-300
            t = np.clip(t - np.clip(np.linalg.solve(square, slopes.T @ residual), -1.0, 1.0), -14.0, 9.0)
        found[k] = 1.0 / (1.0 + np.exp(-t[mirror]))
    return logits, found


def _split_nodes(kernels: AdaptedKernels, limit: float) -> tuple[Nodes, NDArray[np.int64]]:
    """Nodes whose stretch exceeds the limit, and into how many each is split."""
    nodes = np.flatnonzero(kernels.arrays.changed[: kernels.binding.ellipses.n_nodes])
    stretches = _draws(_plane_stretches(kernels, nodes))[0]
    beyond = stretches > limit
    # The least odd number whose children are no wider than the limit lets them be.
    on_each_side = np.ceil(np.sqrt((_WIDTH * stretches[beyond] / limit) ** 2 - 1.0) - 1e-9)
    return nodes[beyond], np.clip(1 + 2 * on_each_side, 3, MOST_CHILDREN).astype(np.int64)


def _plane_stretches(kernels: AdaptedKernels, nodes: Nodes) -> _Floats:
    """(k, 2, 2) stretch of each node's plane, symmetric, along the rest axes of its ellipse.

    The one whose image of the rest ellipse has the adapted axes: ``S L² S = B`` with rest lengths ``L`` and adapted
    second moments ``B`` gives ``S = L⁻¹ (L B L)^½ L⁻¹``.
    """
    lengths = np.linalg.norm(kernels.binding.ellipses.semi_axes[nodes], axis=2)
    cosines, sines = kernels.arrays.twists[nodes].T
    first, second = (kernels.arrays.growths[nodes] * lengths).T
    axes = np.empty((len(nodes), 2, 2))
    axes[:, 0, 0], axes[:, 1, 0] = first * cosines, first * sines
    axes[:, 0, 1], axes[:, 1, 1] = -second * sines, second * cosines
    scaled = lengths[:, :, None] * (axes @ axes.swapaxes(1, 2)) * lengths[:, None, :]
    # Of a product of positive lengths the root of the determinant is known without a difference.
    root = (first * second * lengths.prod(axis=1))[:, None, None]
    trace = (scaled[:, 0, 0] + scaled[:, 1, 1])[:, None, None]
    half = (scaled + root * np.eye(2)) / np.sqrt(trace + 2.0 * root)
    return half / (lengths[:, :, None] * lengths[:, None, :])


def _draws(stretches: _Floats) -> tuple[_Floats, _Floats]:
    """(k,) how far splats are drawn out, and (k, 2) along which unit direction of the rest plane.

    The larger principal stretch, less what is mere magnification: times which it has grown across too.
    """
    values, vectors = np.linalg.eigh(stretches)
    return values[:, 1] / np.maximum(values[:, 0], 1.0), vectors[:, :, 1]


class _NodeMaps:
    """How the surface around each node goes, and between nodes.

    Parameters
    ----------
    kernels : AdaptedKernels
    """

    def __init__(self, kernels: AdaptedKernels) -> None:
        self.kernels = kernels
        ellipses = kernels.binding.ellipses
        self.centers = ellipses.centers
        self.lengths = np.linalg.norm(ellipses.semi_axes, axis=2)
        self.axes = ellipses.semi_axes / self.lengths[:, :, None]
        motions = node_motions(kernels)
        self._maps = motions[:, :9].reshape(-1, 3, 3).swapaxes(1, 2)
        self._shifts = motions[:, 9:]

    def neighbors(self, nodes: Nodes, most: int) -> Nodes:
        """(…, 1 + most) nodes (…) and the nearest of each along the surface; missing ones are the node itself."""
        held = self.kernels.binding.neighborhoods
        counts = np.diff(held.indptr)[nodes][..., None]
        places = np.arange(most)
        at = held.indptr[nodes].astype(np.int64)[..., None] + np.minimum(places, np.maximum(counts - 1, 0))
        near = held.indices[np.minimum(at, max(len(held.indices) - 1, 0))] if len(held.indices) else nodes[..., None]
        near = np.where(places < counts, near, nodes[..., None])
        return np.concatenate([nodes[..., None], near], axis=-1).astype(np.int64)

    def nearest(self, nodes: Nodes, points: _Floats) -> Nodes:
        """(k, p) nodes next to points (k, p, 3), found by going from each of k nodes along the surface."""
        at = np.repeat(nodes[:, None], points.shape[1], axis=1)
        is_going = np.ones(at.shape, np.bool_)
        for _ in range(_MOST_STEPS):
            here = at[is_going]
            near = self.neighbors(here, _STEP_NEIGHBORS)
            distances = np.linalg.norm(self.centers[near] - points[is_going][:, None], axis=2)
            after = np.take_along_axis(near, distances.argmin(axis=1)[:, None], axis=1)[:, 0]
            at[is_going] = after
            is_going[is_going] = after != here
            if not is_going.any():
                break
        return at

    def blend(self, near: Nodes, points: _Floats) -> _Floats:
        """Carry points (k, p, 3) by nodes (k, m) around them; reproduces affine motions, and each node's at its centre.

        Franke and Nielson's weights ``((R - d) / (R d))²``, with ``R`` the distance of the farthest node.
        """
        distances = np.linalg.norm(points[:, :, None] - self.centers[near][:, None], axis=3)
        reach = 1.001 * distances.max(axis=2, keepdims=True)
        weights = np.square((reach - distances) / np.maximum(distances, np.maximum(1e-9 * reach, 1e-300)))
        # A node that stands in for missing ones counts once.
        weights[:, :, 1:] *= (near[:, 1:] != near[:, :1])[:, None]
        weights /= weights.sum(axis=2, keepdims=True)
        maps = np.einsum("kpn,knab->kpab", weights, self._maps[near])
        return np.einsum("kpab,kpb->kpa", maps, points) + np.einsum("kpn,kna->kpa", weights, self._shifts[near])


@dataclass(frozen=True, eq=False)
class _Children:
    """Children of splats of one number of them each, parent by parent; rows and arrays as of `Splats`."""

    rows: FileRows
    is_first: NDArray[np.bool_]
    means: _Floats
    quats: _Floats
    log_scales: _Floats
    logit_opacities: _Floats


def _children(splats: Splats, maps: _NodeMaps, nodes: Nodes, count: int) -> _Children:
    """Split nodes into so many children each."""
    kernels = maps.kernels
    ellipses = kernels.binding.ellipses
    rows = np.repeat(ellipses.rows[nodes], count)
    deviations = maps.lengths[nodes] / ellipses.cutoffs[nodes, None]
    direction = _draws(_plane_stretches(kernels, nodes))[1]
    # The semi-diameter along the stretch that is conjugate to the other: a Gaussian is a product along the two.
    reach = 1.0 / np.sqrt(np.square(direction / deviations).sum(axis=1))
    width = child_width(count)
    square = np.zeros((len(nodes), 2, 2))
    square[:, 0, 0], square[:, 1, 1] = (deviations**2).T
    shrunk = square - (1.0 - width**2) * np.square(reach)[:, None, None] * direction[:, :, None] * direction[:, None]
    values, vectors = np.linalg.eigh(shrunk)
    spokes = vectors * np.sqrt(np.maximum(values, 0.0))[:, None]
    plane = maps.axes[nodes]
    centers = ellipses.centers[nodes][:, None] + (child_offsets(count)[:, None] * reach[:, None, None]) * (
        direction[:, None] @ plane
    )
    first, second = (spokes[:, :, axis][:, None] @ plane for axis in (0, 1))
    points = np.stack([centers, centers + first, centers - first, centers + second, centers - second], axis=2)
    near = maps.neighbors(maps.nearest(nodes, centers), _NEIGHBORS - 1).reshape(-1, _NEIGHBORS)
    moved = maps.blend(near, points.reshape(-1, 5, 3))
    images = np.stack([0.5 * (moved[:, 1] - moved[:, 2]), 0.5 * (moved[:, 3] - moved[:, 4])], axis=-1)
    axes, sizes, _ = np.linalg.svd(images, full_matrices=False)
    axes, sizes = axes.astype(np.float64), np.maximum(sizes, 1e-6 * np.repeat(deviations.min(axis=1), count)[:, None])
    columns = np.repeat(ellipses.axes[nodes].astype(np.int64), count, axis=0)
    log_scales, shrinks = _stored_scales(splats, rows, columns, sizes)
    opacities = child_opacities(count, splats.opacities[rows[::count]]).ravel()
    stored = np.clip(opacities / shrinks, 1e-12, 1.0 - 1e-7)
    return _Children(
        rows,
        np.arange(len(rows)) % count == 0,
        moved[:, 0],
        _quats(splats, rows, columns, axes),
        log_scales,
        np.log(stored / (1.0 - stored)),
    )


def _stored_scales(
    splats: Splats, rows: FileRows, columns: NDArray[np.int64], sizes: _Floats
) -> tuple[_Floats, _Floats]:
    """Log-scales of children whose effective deviations within the plane are (k, 2), and what a 3-D filter dims."""
    log_scales = np.array(splats.log_scales[rows], np.float64)
    at = np.arange(len(rows))[:, None], columns[:, :2]
    if splats.filter_radii is None:
        log_scales[at] = np.log(sizes)
        return log_scales, np.ones(len(rows))
    filters = np.asarray(splats.filter_radii, np.float64)[rows, None] ** 2
    log_scales[at] = 0.5 * np.log(np.maximum(sizes**2 - filters, 1e-12 * sizes**2))
    with np.errstate(divide="ignore"):
        shrinks = np.exp(log_scales).prod(axis=1) / np.sqrt(np.exp(2.0 * log_scales) + filters).prod(axis=1)
    return log_scales, np.maximum(shrinks, 1e-12)


def _quats(splats: Splats, rows: FileRows, columns: NDArray[np.int64], axes: _Floats) -> _Floats:
    """(k, 4) rotations of children with principal axes (k, 3, 2) in their plane, turned as little as will do.

    Of the lengths that their parents' have.
    """
    parents = np.asarray(splats.quats, np.float64)[rows]
    before = np.take_along_axis(quats_to_matrices(parents), columns[:, None], axis=2)
    after = np.empty_like(before)
    after[:, :, 0] = axes[:, :, 0]
    after[:, :, 2] = np.cross(axes[:, :, 0], axes[:, :, 1])
    for axis in (0, 2):
        signs = np.einsum("ij,ij->i", after[:, :, axis], before[:, :, axis])
        after[:, :, axis] *= np.where(signs < 0.0, -1.0, 1.0)[:, None]
    after[:, :, 1] = np.cross(after[:, :, 2], after[:, :, 0])
    # Stored columns may be a mirrored order of these.
    stored = np.empty_like(after)
    np.put_along_axis(stored, columns[:, None].repeat(3, axis=1), after, axis=2)
    mirrored = np.linalg.det(stored) < 0.0
    after[mirrored, :, 1] *= -1.0
    np.put_along_axis(stored, columns[:, None].repeat(3, axis=1), after, axis=2)
    return matrices_to_quats(stored) * np.linalg.norm(parents, axis=1)[:, None]
