"""How each splat lies among its nearest, and which of them it hangs together with.

Everything is measured in the splat's own spacing and size, or its neighbours': captures are not equally dense.
"""

from dataclasses import dataclass

import numba as nb
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from splap_editor.core.index_spaces import NodeMask
from splap_editor.core.progress import Progress, Runner, in_parts, in_turn, no_progress, part_of
from splap_editor.core.splats.occupancy import Ellipses

N_NEAREST = 8
"""Neighbours in space that a splat is compared with."""

_BLOCK_NODES = 1 << 16

THICKNESS = 0.1
"""How far a splat reaches out of its plane, in units of its larger semi-axis."""

STRAY = (1.0, 2.5)
"""Neighbours hang together if they lie no farther apart than so many times the spacing about either: a narrow measure
that haze over a surface does not meet, and a wide one for where the density of a surface changes."""

LOCAL = ("spacing", "own spacing", "mutual", "out of plane", "own plane", "aligned", "size", "opacity", "contacts")
"""Of a splat among its nearest, in this order:

- the distance of the farthest: against theirs, and against the splat's own size (logarithms);
- the share of them that count the splat among their own nearest;
- how far the splat lies out of their planes, and they out of its plane (mean sines);
- how far normals agree (mean cosine);
- its size and its opacity against theirs (differences of logarithms, and of logits);
- the share of them that the splat touches.
"""


@dataclass(frozen=True, eq=False)
class Ties:
    """Which splats hang together, solid or not: some of the nearest of each.

    Parameters
    ----------
    neighbors : (n, k) int32
        Nearest nodes of each.
    tied : (n, k) bool
        Whether it hangs together with them; not symmetric.
    """

    neighbors: NDArray[np.int32]
    tied: NDArray[np.bool_]

    def pieces(self, nodes: NodeMask) -> NDArray[np.int32]:
        """(n,) piece of each node, numbered in the order of their first nodes.

        A node outside of the mask is a piece of its own: nothing hangs together through it.
        """
        return _pieces(self.neighbors, self.tied, nodes)


@nb.njit(nogil=True, cache=True)
def _pieces(neighbors, tied, nodes):
    """Pieces by union of the trees that ties make of them; the first node of a piece is its root."""
    n, k = neighbors.shape
    roots = np.arange(n).astype(np.int32)
    for i in range(n):
        if not nodes[i]:
            continue
        for c in range(k):
            if tied[i, c] and nodes[neighbors[i, c]]:
                a, b = i, neighbors[i, c]
                while roots[a] != a:
                    roots[a] = roots[roots[a]]
                    a = roots[a]
                while roots[b] != b:
                    roots[b] = roots[roots[b]]
                    b = roots[b]
                if a < b:
                    roots[b] = a
                else:
                    roots[a] = b
    n_pieces = 0
    # A root comes before all that it holds, and has its number already.
    for i in range(n):
        if roots[i] == i:
            roots[i] = n_pieces
            n_pieces += 1
        else:
            roots[i] = roots[roots[i]]
    return roots


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What lies about each of n splats.

    Parameters
    ----------
    distances : (n, k) float64
        Of the nearest nodes, ascending, in world units.
    local : (n, 9) float64
        `LOCAL` of each.
    near_log_opacities : (n,) float64
        Mean logarithm of the nearest nodes' opacities; those below 0.001 count as such.
    narrow, wide : Ties
        By either measure.
    """

    distances: NDArray[np.float64]
    local: NDArray[np.float64]
    near_log_opacities: NDArray[np.float64]
    narrow: Ties
    wide: Ties

    @property
    def neighbors(self) -> NDArray[np.int32]:
        """(n, k) nearest nodes of each."""
        return self.wide.neighbors


def surroundings(ellipses: Ellipses, *, progress: Progress = no_progress, run: Runner = in_turn) -> Surroundings:
    """Look at the nearest of each of n splats, two at least.

    Parameters
    ----------
    ellipses : Ellipses
    progress : Progress
        Called with the share done.
    run : Runner
        Runs parts of the splats.
    """
    n, centers = ellipses.n_nodes, ellipses.centers
    neighbors, distances = nearest(centers, part_of(progress, 0.0, 0.75), run)
    # Column by column: they are looked at one at a time.
    local, ties = np.empty((len(LOCAL) + 1, n)), np.empty((len(STRAY), *neighbors.shape), np.bool_)
    reaches = np.maximum(ellipses.reaches, 1e-12 * ellipses.scene_scale)
    with np.errstate(divide="ignore"):
        logs = np.stack([np.log(distances[:, -1]), np.log(reaches), log_opacities(ellipses), bounded_logits(ellipses)])
    known = neighbors, distances, centers, ellipses.semi_axes, ellipses.normals, reaches, logs.T.copy()

    def look(first: int, end: int, progress: Progress) -> None:
        """Take what is told by the surroundings of nodes first to end - 1."""
        _local(first, end, *known, np.array(STRAY), local, ties)

    in_parts(look, n, part_of(progress, 0.75, 1.0), run)
    return Surroundings(distances, local[:-1].T, local[-1], Ties(neighbors, ties[0]), Ties(neighbors, ties[1]))


def log_opacities(ellipses: Ellipses) -> NDArray[np.float64]:
    """(n,) logarithms of opacities, those of hardly visible splats a little within."""
    return np.log(np.maximum(ellipses.opacities, 1e-3))


def bounded_logits(ellipses: Ellipses) -> NDArray[np.float64]:
    """(n,) opacities as logits, those at the ends of the range a little within."""
    opacities = np.clip(ellipses.opacities, 1e-3, 1.0 - 1e-3)
    return np.log(opacities / (1.0 - opacities))


def nearest(
    centers: NDArray[np.float64], progress: Progress = no_progress, run: Runner = in_turn
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """(n, k) nearest nodes of each, itself left out, and (n, k) their distances, ascending; k is 8 or n − 1."""
    n = len(centers)
    k = min(N_NEAREST, n - 1)
    neighbors, distances = np.empty((n, k), np.int32), np.empty((n, k))
    tree = cKDTree(centers, balanced_tree=False)

    def search(first: int, end: int, progress: Progress) -> None:
        """Find the neighbours of nodes first to end - 1."""
        for lo in range(first, end, _BLOCK_NODES):
            some = slice(lo, min(lo + _BLOCK_NODES, end))
            found, at = tree.query(centers[some], k + 1)
            found, at = found.reshape(-1, k + 1), at.reshape(-1, k + 1)
            neighbors[some], distances[some] = at[:, 1:], found[:, 1:]
            # Of centres that coincide, the splat itself need not be the first.
            odd = np.flatnonzero(at[:, 0] != np.arange(lo, lo + len(at)))
            if len(odd):
                own = at[odd] == (lo + odd)[:, None]
                own[~own.any(axis=1), -1] = True
                neighbors[lo + odd], distances[lo + odd] = (held[odd][~own].reshape(-1, k) for held in (at, found))
            progress((some.stop - first) / (end - first))

    in_parts(search, n, progress, run)
    return neighbors, distances


@nb.njit(nogil=True, cache=True, error_model="numpy")
def _local(first, end, neighbors, distances, centers, semi_axes, normals, reaches, logs, stray, found, ties):
    """Fill `LOCAL` and the mean log-opacity of the nearest (10, n), and who is tied to it by each measure (n, k).

    For the nodes from ``first`` to ``end``. ``logs`` (n, 4) are the logarithms of spacing, reach and opacity, and the
    opacity's logit.
    """
    k = neighbors.shape[1]
    for i in range(first, end):
        spacing, own = distances[i, k - 1], reaches[i]
        least_log = logs[i, 1] + np.log(1e-6)
        spacings = mutual = out = flat = aligned = sizes = log_opacities = opacities = contacts = 0.0
        for c in range(k):
            j = neighbors[i, c]
            d = distances[i, c]
            other = distances[j, k - 1]
            spacings += max(logs[j, 0], least_log)
            sizes += logs[j, 1]
            log_opacities += logs[j, 2]
            opacities += logs[j, 3]
            mutual += d <= other
            along_i = along_j = across_i = across_j = over_i = over_j = agree = 0.0
            for a in range(3):
                step = centers[j, a] - centers[i, a]
                along_i += semi_axes[i, 0, a] * step
                across_i += semi_axes[i, 1, a] * step
                over_i += normals[i, a] * step
                along_j += semi_axes[j, 0, a] * step
                across_j += semi_axes[j, 1, a] * step
                over_j += normals[j, a] * step
                agree += normals[i, a] * normals[j, a]
            aligned += abs(agree)
            if d > 0.0:
                out += abs(over_j) / d
                flat += abs(over_i) / d
                reach = np.sqrt(along_i * along_i + across_i * across_i + (THICKNESS * own * d) ** 2)
                reach += np.sqrt(along_j * along_j + across_j * across_j + (THICKNESS * reaches[j] * d) ** 2)
                touches = d * d <= reach
            else:
                touches = True
            contacts += touches
            least = min(spacing, other)
            for m in range(2):
                ties[m, i, c] = touches and d <= stray[m] * least
        log_spacing = max(logs[i, 0], least_log)
        found[0, i], found[1, i] = log_spacing - spacings / k, log_spacing - logs[i, 1]
        found[2, i], found[3, i], found[4, i], found[5, i] = mutual / k, out / k, flat / k, aligned / k
        found[6, i], found[7, i], found[8, i] = logs[i, 1] - sizes / k, logs[i, 3] - opacities / k, contacts / k
        found[9, i] = log_opacities / k
