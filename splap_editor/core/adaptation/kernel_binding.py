"""What carries each splat's ellipse when the surface moves: found once per scene."""

from copy import copy
from functools import cached_property
from typing import NamedTuple

import numba as nb
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from splap_editor.core.graph.splat_graph import SplatGraph
from splap_editor.core.index_spaces import Nodes, RowsByPlace
from splap_editor.core.progress import Progress, no_progress
from splap_editor.core.splats.occupancy import Ellipses, InertReason
from splap_editor.core.splats.rotations import quats_to_matrices
from splap_editor.core.splats.splats import Splats
from splap_editor.core.surface.geodesics import Neighborhoods, node_runs

STENCIL_SIZE = 6
"""Geodesic neighbours from which a node's stretch is read."""

STRETCH_DAMPING = 0.02
"""How far a stretch is drawn to a mere scaling, in units of the mean square neighbour distance."""

HALF_ROOT_3 = 0.5 * np.sqrt(3.0)
"""Height of an equilateral triangle of side 1: how far across the minor axis two corners of the inscribed one lie."""

INERT_CARRIERS = 4
"""Active splats that carry a splat outside the graph."""

_CHUNK = 20_000


class RestArrays(NamedTuple):
    """Splats at rest, as compiled loops read them.

    Parameters
    ----------
    means : (N, 3) float64
        Centres in carried order: the nodes, then the inert splats.
    axes_f32 : (N, 2, 3) float32
        In-plane axes of one standard deviation, in carried order; zero where undefined.
    order : (N,) int64
        File row of each place in carried order.
    ellipses : (n, 12) float64
        Centre, both semi-axes, the inverses of their lengths and of the cut-off: side by side, since the loop over
        nodes waits for memory.
    """

    means: NDArray[np.float64]
    axes_f32: NDArray[np.float32]
    order: RowsByPlace
    ellipses: NDArray[np.float64]


class KernelBinding:
    """Carriers of the ellipse corners of every splat.

    The largest triangle inscribed in an occupancy ellipse stands for the
    ellipse [1]_. Each of its corners is carried by the three splats nearest to
    it among the splat itself and its geodesic neighbours, never by one that is
    merely near in space, with weights 1/distance. Graph neighbours alone
    (degree 4–6) would not reach the corners of large splats.

    Parameters
    ----------
    splats : Splats
        The scene, in file order.
    ellipses : Ellipses
        Its occupancy ellipses, the n nodes.
    neighborhoods : Neighborhoods
        Geodesic neighbours of the nodes, sorted by distance.
    graph : SplatGraph, optional
        Needed for affine adaptation only.
    progress : callable
        Told the share done; may raise `Cancelled`.

    Raises
    ------
    ValueError
        If splats, ellipses, neighbourhoods and graph are not of one scene.

    References
    ----------
    .. [1] SpLap, 3DV 2026, Eq. 9 and 10.
    """

    def __init__(
        self,
        splats: Splats,
        ellipses: Ellipses,
        neighborhoods: Neighborhoods,
        graph: SplatGraph | None = None,
        *,
        progress: Progress = no_progress,
    ):
        n = ellipses.n_nodes
        if ellipses.n_splats != splats.n_splats:
            raise ValueError(f"ellipses are of {ellipses.n_splats} splats, the scene has {splats.n_splats}")
        if len(neighborhoods.indptr) != n + 1:
            raise ValueError(f"neighborhoods are of {len(neighborhoods.indptr) - 1} nodes, the ellipses of {n}")
        if graph is not None and len(graph.indptr) != n + 1:
            raise ValueError(f"graph is of {len(graph.indptr) - 1} nodes, the ellipses of {n}")
        self.splats = splats
        self.ellipses = ellipses
        self.graph = graph
        # (n, 9) nodes, three per corner, and (n, 6) the weights of the first two; the third has what is left of 1.
        # Single precision, since a drag waits for them to come from memory; their sum is exact all the same.
        self.carriers = np.empty((n, 9), np.int32)
        self.weights = np.empty((n, 6), np.float32)
        # (n, 6) neighbours, padded with the node itself; (n, 6) upper triangle of the inverse of their damped
        # second moments; (n,) the damping in units of length², 0 where they hold no shape.
        self.stencils = np.empty((n, STENCIL_SIZE), np.int32)
        self.inverse_moments = np.empty((n, 6))
        self.dampings = np.empty(n)
        self.neighborhoods = neighborhoods
        for lo in range(0, n, _CHUNK):
            progress(lo / n)
            self._bind_nodes(lo, min(lo + _CHUNK, n))
        inert_rows = np.flatnonzero(ellipses.node_of_row < 0)
        self._bind_inert(np.asarray(splats.means, np.float64)[inert_rows])
        axes, self.thicknesses = _rest_axes(splats, ellipses, inert_rows)
        order = np.concatenate([ellipses.rows, inert_rows])
        self.rest = RestArrays(
            means=np.ascontiguousarray(splats.means, np.float64)[order],
            axes_f32=axes[order],
            order=order,
            ellipses=np.column_stack(
                [
                    ellipses.centers,
                    ellipses.semi_axes.reshape(-1, 6),
                    1.0 / np.linalg.norm(ellipses.semi_axes, axis=2),
                    1.0 / ellipses.cutoffs,
                ]
            ),
        )
        # Arrays of finished adaptations for the next ones: taking and giving back is atomic, so threads never share.
        self.spare_motions: list[NDArray[np.float64]] = []
        progress(1.0)

    def mended(self, neighborhoods: Neighborhoods, graph: SplatGraph | None, nodes: Nodes) -> "KernelBinding":
        """Bring it up to date after the neighbours of some nodes changed: to the bit what a new one would be.

        Parameters
        ----------
        neighborhoods : Neighborhoods
            After the change.
        graph : SplatGraph or None
            After it too.
        nodes : (m,) int
            Ascending; those whose neighbours may be others.
        """
        mended = copy(self)
        mended.neighborhoods, mended.graph, mended.spare_motions = neighborhoods, graph, []
        mended.__dict__.pop("published_carriers", None)
        names = ("carriers", "weights", "stencils", "inverse_moments", "dampings")
        for name in names:
            setattr(mended, name, getattr(self, name).copy())
        for lo, hi in node_runs(self.ellipses.n_nodes, nodes, _CHUNK):
            mended._bind_nodes(lo, hi)
        return mended

    def _bind_nodes(self, lo: int, hi: int) -> None:
        """Find what carries nodes lo to hi, and what each finds its stretch from."""
        centers, near = self.ellipses.centers, self.neighborhoods
        indptr, indices = (np.ascontiguousarray(each, np.int32) for each in (near.indptr, near.indices))
        _find_carriers(lo, hi, centers, self.ellipses.semi_axes, indptr, indices, self.carriers, self.weights)
        _find_stencils(lo, hi, centers, indptr, indices, self.stencils, self.inverse_moments, self.dampings)

    def _bind_inert(self, means: NDArray[np.float64]) -> None:
        """Find the nodes that carry the inert splats; without any, they stay."""
        k = min(INERT_CARRIERS, self.ellipses.n_nodes)
        self.inert_carriers = np.zeros((len(means), k), np.int32)
        self.inert_weights = np.zeros((len(means), k))
        # A centre that is nowhere is near nothing: its weights stay zero, which leaves it as it is.
        finite = np.isfinite(means).all(axis=1)
        # Nor is one that is left out carried anywhere.
        finite &= self.ellipses.inert[self.ellipses.node_of_row < 0] != InertReason.REMOVED
        if k and finite.any():
            distances, carriers = cKDTree(self.ellipses.centers).query(means[finite], k)
            self.inert_carriers[finite] = carriers.reshape(-1, k)
            distances = np.maximum(distances.reshape(-1, k), 1e-12 * self.ellipses.scene_scale)
            # Divided by the nearest first, so that the squares of far floaters' distances stay in range.
            weights = (distances[:, :1] / distances) ** 2
            self.inert_weights[finite] = weights / weights.sum(axis=1, keepdims=True)

    @cached_property
    def published_carriers(self) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
        """Carriers and weights as published [1]_: a splat and the two nearest to it, for each corner, by 1/distance.

        References
        ----------
        .. [1] SpLap, 3DV 2026, Eq. 10.
        """
        n = self.ellipses.n_nodes
        indptr, indices = self.neighborhoods.indptr, self.neighborhoods.indices
        nodes = np.arange(n)
        carriers = np.repeat(nodes[:, None], 3, axis=1)
        for place in (0, 1):
            reached = np.flatnonzero(indptr[:-1] + place < indptr[1:])
            carriers[reached, place + 1] = indices[indptr[reached] + place]
        along = np.array([[1.0, 0.0], [-0.5, HALF_ROOT_3], [-0.5, -HALF_ROOT_3]])
        corners = self.ellipses.centers[:, None] + along @ self.ellipses.semi_axes
        distances = np.linalg.norm(corners[:, :, None] - self.ellipses.centers[carriers][:, None], axis=3)
        closeness = 1.0 / np.maximum(distances, 1e-12 * self.ellipses.reaches[:, None, None])
        # Who has fewer neighbours carries itself more than once, which must not weigh more.
        closeness[:, :, 1:][np.broadcast_to((carriers[:, None, 1:] == nodes[:, None, None]), (n, 3, 2))] = 0.0
        weights = closeness / closeness.sum(axis=2, keepdims=True)
        return (
            np.tile(carriers, (1, 3)).astype(np.int32),
            weights[:, :, :2].reshape(n, 6).astype(np.float32),
        )

    @property
    def order(self) -> RowsByPlace:
        """(N,) file row of each place in carried order: the nodes, then the inert splats."""
        return self.rest.order


def _rest_axes(
    splats: Splats, ellipses: Ellipses, inert: NDArray[np.int64]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """(N, 2, 3) in-plane axes and (N,) thickness to draw at rest, one standard deviation long; zero where undefined."""
    N = splats.n_splats
    axes = np.zeros((N, 2, 3), np.float32)
    thicknesses = np.zeros(N, np.float32)
    axes[ellipses.rows] = ellipses.semi_axes / ellipses.cutoffs[:, None, None]
    if splats.n_scales == 3:
        thicknesses[ellipses.rows] = splats.scales[ellipses.rows, ellipses.axes[:, 2]]
    with np.errstate(all="ignore"):
        scales = splats.scales[inert]
        columns = quats_to_matrices(np.asarray(splats.quats)[inert]).swapaxes(1, 2)[:, : splats.n_scales]
        order = np.argsort(-scales, axis=1, kind="stable")
        lengths = np.take_along_axis(scales, order, axis=1).astype(np.float32)
        vectors = (np.take_along_axis(columns, order[:, :, None], axis=1) * lengths[:, :, None]).astype(np.float32)
    drawable = np.isfinite(vectors).all(axis=(1, 2))
    axes[inert[drawable]] = vectors[drawable, :2]
    if splats.n_scales == 3:
        thicknesses[inert[drawable]] = lengths[drawable, 2]
    return axes, thicknesses


@nb.njit(nogil=True, cache=True)
def _find_carriers(lo, hi, centers, semi_axes, indptr, indices, carriers, weights):
    """Write the three nodes that carry each corner of the triangles of nodes lo to hi, and their weights."""
    offset = np.empty(3)
    nearest = np.empty(3, np.int32)
    squares = np.empty(3)
    for i in range(lo, hi):
        for corner in range(3):
            for a in range(3):
                major, minor = semi_axes[i, 0, a], semi_axes[i, 1, a]
                offset[a] = major if corner == 0 else -0.5 * major + (3 - 2 * corner) * HALF_ROOT_3 * minor
            reach = offset[0] ** 2 + offset[1] ** 2 + offset[2] ** 2
            nearest[:] = i
            squares[:] = np.inf
            for e in range(indptr[i] - 1, indptr[i + 1]):
                j = indices[e] if e >= indptr[i] else i
                x = centers[i, 0] - centers[j, 0] + offset[0]
                y = centers[i, 1] - centers[j, 1] + offset[1]
                z = centers[i, 2] - centers[j, 2] + offset[2]
                square = x * x + y * y + z * z
                if square >= squares[2]:
                    continue
                slot = 2
                while slot > 0 and squares[slot - 1] > square:
                    squares[slot] = squares[slot - 1]
                    nearest[slot] = nearest[slot - 1]
                    slot -= 1
                squares[slot] = square
                nearest[slot] = j
            # A carrier on the corner itself carries it alone.
            alone = squares[0] <= 1e-24 * reach
            total = 1.0 if alone else 1.0 + np.sqrt(squares[0] / squares[1]) + np.sqrt(squares[0] / squares[2])
            for slot in range(3):
                carriers[i, 3 * corner + slot] = nearest[slot]
            weights[i, 2 * corner] = 1.0 / total
            weights[i, 2 * corner + 1] = 0.0 if alone else np.sqrt(squares[0] / squares[1]) / total


@nb.njit(nogil=True, cache=True)
def _find_stencils(lo, hi, centers, indptr, indices, stencils, inverse_moments, dampings):
    """Write the neighbours that nodes lo to hi find their affine maps from, with inverse moments and dampings."""
    for i in range(lo, hi):
        xx = xy = xz = yy = yz = zz = 0.0
        for k in range(stencils.shape[1]):
            e = indptr[i] + k
            j = indices[e] if e < indptr[i + 1] else i
            stencils[i, k] = j
            x = centers[j, 0] - centers[i, 0]
            y = centers[j, 1] - centers[i, 1]
            z = centers[j, 2] - centers[i, 2]
            xx += x * x
            xy += x * y
            xz += x * z
            yy += y * y
            yz += y * z
            zz += z * z
        damping = STRETCH_DAMPING * (xx + yy + zz)
        # Beyond these the determinant leaves float64's range; the node then only turns and grows as a whole.
        if not 1e-90 < damping < 1e90:
            dampings[i] = 0.0
            inverse_moments[i] = 0.0
            continue
        dampings[i] = damping
        xx, yy, zz = xx + damping, yy + damping, zz + damping
        cofactor_xx, cofactor_xy, cofactor_xz = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
        shrink = 1.0 / (xx * cofactor_xx + xy * cofactor_xy + xz * cofactor_xz)
        inverse_moments[i, 0] = shrink * cofactor_xx
        inverse_moments[i, 1] = shrink * cofactor_xy
        inverse_moments[i, 2] = shrink * cofactor_xz
        inverse_moments[i, 3] = shrink * (xx * zz - xz * xz)
        inverse_moments[i, 4] = shrink * (xy * xz - xx * yz)
        inverse_moments[i, 5] = shrink * (xx * yy - xy * xy)
