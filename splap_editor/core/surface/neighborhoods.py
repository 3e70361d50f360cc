"""The neighbourhoods that a surface can be made of, each as a function of the same arguments."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from splap_editor.core.graph.splat_graph import SplatGraph
from splap_editor.core.index_spaces import Node, Nodes
from splap_editor.core.progress import Progress
from splap_editor.core.splats.occupancy import Ellipses
from splap_editor.core.surface.geodesics import Neighborhoods, geodesic_neighbors

NORMAL_SHARE = 0.1
"""Standard deviation across the surface in units of the smaller one within it, for Mahalanobis distances."""

_CHUNK = 4096

_GUESSED = 8
"""So many times k of the nearest in space hold, for most nodes, all that a stretched measure can bring near."""


def nearest_along_surface(ellipses: Ellipses, graph: SplatGraph, k: int, progress: Progress) -> Neighborhoods:
    """Find the k nearest nodes by shortest path on the graph, see `geodesic_neighbors`."""
    return geodesic_neighbors(graph, k, progress=progress)


def joined_by_edges(ellipses: Ellipses, graph: SplatGraph, k: int, progress: Progress) -> Neighborhoods:
    """Take the nodes that an edge of the graph leads to, however many: the raw splat graph of [1]_.

    References
    ----------
    .. [1] SpLap, 3DV 2026, Table 1.
    """
    starts = np.repeat(np.arange(graph.n_nodes), np.diff(graph.indptr))
    order = np.lexsort((graph.indices, graph.lengths, starts))
    return Neighborhoods(
        np.asarray(graph.indptr, np.int32), graph.indices[order].astype(np.int32), graph.lengths[order]
    )


def nearest_in_space(ellipses: Ellipses, graph: SplatGraph, k: int, progress: Progress) -> Neighborhoods:
    """Find the k nearest centres, whatever lies between: the point-cloud Laplacian of [1]_.

    References
    ----------
    .. [1] Sharp and Crane, "A Laplacian for Nonmanifold Triangle Meshes", SGP 2020.
    """
    n = ellipses.n_nodes
    wanted = min(k, n - 1)
    tree = cKDTree(ellipses.centers)
    near, far = [np.empty((0, wanted), np.int64)], [np.empty((0, wanted))]
    for lo in range(0, n if wanted else 0, _CHUNK):
        progress(lo / n)
        nodes = np.arange(lo, min(lo + _CHUNK, n))
        distances, found = (each.reshape(len(nodes), -1) for each in tree.query(ellipses.centers[nodes], wanted + 1))
        # Of many in one place, the node itself may not be among those found: then the last one is left out.
        is_self = found == nodes[:, None]
        is_self[~is_self.any(axis=1), -1] = True
        near.append(found[~is_self].reshape(-1, wanted))
        far.append(distances[~is_self].reshape(-1, wanted))
    return _in_rows(np.concatenate(near), np.concatenate(far), n)


def nearest_by_mahalanobis(ellipses: Ellipses, graph: SplatGraph, k: int, progress: Progress) -> Neighborhoods:
    """Find the k nearest by Mahalanobis distance, as [1]_ compares with: each splat measures by its own covariance.

    Distances are in units of the splat's ellipse, so they compare within a node's own neighbours only.

    References
    ----------
    .. [1] SpLap, 3DV 2026, supplement.
    """
    n = ellipses.n_nodes
    wanted = min(k, n - 1)
    tree = cKDTree(ellipses.centers)
    near, far = np.empty((n, wanted), np.int64), np.empty((n, wanted))
    for start in range(0, n if wanted else 0, _CHUNK):
        progress(start / n)
        nodes = np.arange(start, min(start + _CHUNK, n))
        lengths, guesses = tree.query(ellipses.centers[nodes], min(_GUESSED * wanted, n - 1) + 1)
        distances = _mahalanobis(ellipses, nodes, guesses)
        distances[guesses == nodes[:, None]] = np.inf
        # Whoever is farther than the k-th of the guess times the longest axis is farther by this measure as well.
        reaches = np.partition(distances, wanted - 1, axis=1)[:, wanted - 1] * ellipses.reaches[nodes] * (1.0 + 1e-9)
        best = np.lexsort((guesses, distances), axis=1)[:, :wanted]
        near[nodes], far[nodes] = np.take_along_axis(guesses, best, 1), np.take_along_axis(distances, best, 1)
        for i, reach in zip(nodes[reaches > lengths[:, -1]], reaches[reaches > lengths[:, -1]], strict=True):
            found = np.array(tree.query_ball_point(ellipses.centers[i], reach))
            found = found[found != i]
            apart = _mahalanobis(ellipses, np.array([i]), found[None])[0]
            best = np.lexsort((found, apart))[:wanted]
            near[i], far[i] = found[best], apart[best]
    return _in_rows(near, far, n)


def mahalanobis_frame(ellipses: Ellipses, node: Node) -> NDArray[np.float64]:
    """(3, 3) matrix that takes a step in world units to one in units of a node's ellipse, its thickness a tenth."""
    major, minor = ellipses.semi_axes[node]
    length = np.linalg.norm(minor)
    return np.stack([major / (major @ major), minor / length**2, ellipses.normals[node] / (NORMAL_SHARE * length)])


def _mahalanobis(ellipses: Ellipses, nodes: Nodes, others: NDArray[np.int64]) -> NDArray[np.float64]:
    """(m, c) distances of (m, c) other nodes from (m,) nodes, each by its own ellipse."""
    major, minor = ellipses.semi_axes[nodes, 0], ellipses.semi_axes[nodes, 1]
    lengths = np.linalg.norm(minor, axis=1)[:, None]
    axes = (major / np.square(major).sum(1)[:, None], minor / lengths**2)
    frames = np.stack([*axes, ellipses.normals[nodes] / (NORMAL_SHARE * lengths)], axis=1)
    steps = ellipses.centers[others] - ellipses.centers[nodes, None]
    return np.linalg.norm(steps @ frames.swapaxes(1, 2), axis=2)


def _in_rows(near: NDArray[np.int64], far: NDArray[np.float64], n: int) -> Neighborhoods:
    """Equally many neighbours a node as compressed rows, equal distances by rising node."""
    order = np.lexsort((near, far), axis=1)
    near, far = np.take_along_axis(near, order, axis=1), np.take_along_axis(far, order, axis=1)
    width = near.shape[1]
    return Neighborhoods(
        np.arange(0, n * width + 1, width, dtype=np.int32) if width else np.zeros(n + 1, np.int32),
        near.astype(np.int32).ravel(),
        far.ravel(),
    )
