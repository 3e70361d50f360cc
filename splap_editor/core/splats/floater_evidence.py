"""What is known of each splat that may float: its neighbours, what hangs together with it, and what it shows.

Everything is measured in the splat's own spacing and size, or its neighbours': captures are not equally dense.
"""

import numba as nb
import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from splap_editor.core.progress import Progress, no_progress, part_of
from splap_editor.core.splats.contributions import Contributions
from splap_editor.core.splats.main_subject import MainSubject
from splap_editor.core.splats.occupancy import Ellipses

N_NEAREST = 8
"""Neighbours in space that a splat is compared with."""

_BLOCK_NODES = 1 << 16

_FAINT = 0.3
"""Share of its neighbours' usual opacity from which a splat is solid: haze ties nothing together."""

_BODY = 0.02
"""Share of the splats, or of what the pictures show, from which what hangs together belongs to the body."""

_THICKNESS = 0.1
"""How far a splat reaches out of its plane, in units of its larger semi-axis."""

_STRAY = (1.0, 2.5)
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


def nearest(
    centers: NDArray[np.float64], progress: Progress = no_progress
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """(n, k) nearest nodes of each, itself left out, and (n, k) their distances, ascending; k is 8 or n − 1."""
    n = len(centers)
    k = min(N_NEAREST, n - 1)
    neighbors, distances = np.empty((n, k), np.int32), np.empty((n, k))
    tree = cKDTree(centers, balanced_tree=False)
    for lo in range(0, n, _BLOCK_NODES):
        some = slice(lo, lo + _BLOCK_NODES)
        found, at = tree.query(centers[some], k + 1)
        found, at = found.reshape(-1, k + 1), at.reshape(-1, k + 1)
        # Of centres that coincide, the splat itself need not be the first.
        own = at == np.arange(lo, lo + len(at))[:, None]
        own[~own.any(axis=1), -1] = True
        neighbors[some], distances[some] = at[~own].reshape(-1, k), found[~own].reshape(-1, k)
        progress(min(1.0, (lo + _BLOCK_NODES) / n))
    return neighbors, distances


@nb.njit(nogil=True, cache=True, error_model="numpy")
def _local(neighbors, distances, centers, semi_axes, normals, reaches, logits, stray, found, ties):
    """Fill `LOCAL` (n, 9), and for each measure of straying whether a neighbour is tied to the splat (n, k)."""
    n, k = neighbors.shape
    for i in range(n):
        spacing, own = distances[i, k - 1], reaches[i]
        spacings = mutual = out = flat = aligned = sizes = opacities = contacts = 0.0
        for c in range(k):
            j = neighbors[i, c]
            d = distances[i, c]
            other = distances[j, k - 1]
            spacings += np.log(max(other, 1e-6 * own))
            sizes += np.log(reaches[j])
            opacities += logits[j]
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
                reach = np.sqrt(along_i * along_i + across_i * across_i + (_THICKNESS * own * d) ** 2)
                reach += np.sqrt(along_j * along_j + across_j * across_j + (_THICKNESS * reaches[j] * d) ** 2)
                touches = d * d <= reach
            else:
                touches = True
            contacts += touches
            least = min(spacing, other)
            for m in range(2):
                ties[m, i, c] = touches and d <= stray[m] * least
        found[i, 0] = np.log(max(spacing, 1e-6 * own)) - spacings / k
        found[i, 1] = np.log(max(spacing, 1e-6 * own) / own)
        found[i, 2], found[i, 3], found[i, 4], found[i, 5] = mutual / k, out / k, flat / k, aligned / k
        found[i, 6], found[i, 7], found[i, 8] = np.log(own) - sizes / k, logits[i] - opacities / k, contacts / k


EVIDENCE = (
    *LOCAL,
    *("logit", "contribution", "shown share", "peak", "beyond"),
    *("narrow count", "narrow shown", "narrow gap", "narrow distance"),
    *("wide count", "wide shown", "wide gap", "wide distance"),
    *("piece mutual", "piece aligned", "piece out of plane", "piece logit", "piece spacing"),
)
"""What is known of each splat, in this order:

- `LOCAL`, how it lies among its nearest;
- its opacity (logit), what it contributes to pictures from all around (logarithm, in units of the mean), and that in
  units of what it would if nothing stood before it; its largest share in any pixel; how far it lies beyond the
  subject's box, in units of the subject's size;
- of what hangs together with it by the narrow measure, and by the wide one: its share of the splats and of what the
  pictures show, and how near it comes to the body, in units of the spacing there and of the subject (logarithms);
- of what hangs together with it by the wide measure, means of what is known of its splats.
"""


def floater_evidence(
    ellipses: Ellipses, contributions: Contributions, *, progress: Progress = no_progress
) -> tuple[NDArray[np.float64], sparse.csr_array]:
    """Look at each splat, its neighbours and its piece; neither the scene's units nor the order of nodes matter.

    Parameters
    ----------
    ellipses : Ellipses
        The n active splats of a scene.
    contributions : Contributions
        Of the nodes.
    progress : Progress
        Called with the share done.

    Returns
    -------
    evidence : (n, 27) float64
        The `EVIDENCE` of each node.
    touching : (n, n) csr_array of bool
        Which of its nearest a node hangs together with by the wide measure, solid or not; not symmetric.
    """
    n = ellipses.n_nodes
    if n < 2:
        return np.zeros((n, len(EVIDENCE))), sparse.csr_array((n, n), dtype=np.bool_)
    centers, subject = ellipses.centers, ellipses.subject
    neighbors, distances = nearest(centers, part_of(progress, 0.0, 0.6))
    opacities = np.clip(ellipses.opacities, 1e-3, 1.0 - 1e-3)
    logits = np.log(opacities / (1.0 - opacities))
    reaches = np.maximum(ellipses.reaches, 1e-12 * subject.size)
    local, ties = np.empty((n, len(LOCAL))), np.zeros((len(_STRAY), *neighbors.shape), np.bool_)
    args = (neighbors, distances, centers, ellipses.semi_axes, ellipses.normals, reaches, logits)
    _local(*args, np.array(_STRAY), local, ties)
    progress(0.7)
    weights = contributions.weights / max(contributions.weights.sum(), 1e-300)
    minor = np.sqrt(np.einsum("ij,ij->i", ellipses.semi_axes[:, 1], ellipses.semi_axes[:, 1]))
    areas = np.maximum(ellipses.reaches * minor / subject.size**2, 1e-30) * opacities
    of_pieces = []
    is_solid = np.log(opacities) >= np.log(_FAINT) + np.log(opacities)[neighbors].mean(axis=1)
    for tied in ties:
        pairs = tied & is_solid[:, None] & is_solid[neighbors]
        labels = connected_components(_ties(pairs, neighbors), directed=False)[1]
        of_pieces.append(_piece_evidence(labels, centers, distances[:, -1], weights, subject.size))
        progress(0.7 + 0.15 * len(of_pieces))
    counts = np.bincount(labels)
    means = [np.bincount(labels, column) / counts for column in (*local.T[[2, 5, 3]], logits, local[:, 1])]
    bounds = ((0, -2.0, 3.0), (1, -3.0, 3.5), (6, -3.0, 3.0), (7, -6.0, 6.0))
    for column, least, most in bounds:
        np.clip(local[:, column], least, most, out=local[:, column])
    alone = (
        logits,
        np.log(np.clip(weights * n, 1e-3, 30.0)),
        np.log(np.clip(contributions.weights / areas, 1e-3, 10.0)),
        contributions.peaks,
        np.clip(_beyond(subject, centers) / subject.size, 0.0, 0.5),
    )
    evidence = np.column_stack([local, *alone, *of_pieces, *(mean[labels] for mean in means)])
    return evidence, _ties(ties[-1], neighbors)


def _beyond(subject: MainSubject, centers: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n,) how far centres lie beyond the faces of the subject's box, in world units."""
    beyond = np.zeros(len(centers))
    for half_axis in subject.half_axes:
        length = float(np.linalg.norm(half_axis))
        if length > 0.0:
            beyond = np.maximum(beyond, np.abs((centers - subject.center) @ (half_axis / length)) - length)
    return beyond


def _ties(tied: NDArray[np.bool_], neighbors: NDArray[np.int32]) -> sparse.csr_array:
    """(n, n) where a splat is tied (n, k) to one of its neighbours."""
    n = len(neighbors)
    starts = np.concatenate([[0], np.cumsum(tied.sum(axis=1))])
    return sparse.csr_array((np.ones(starts[-1], np.bool_), neighbors[tied], starts), shape=(n, n))


def _piece_evidence(
    labels: NDArray[np.integer],
    centers: NDArray[np.float64],
    spacings: NDArray[np.float64],
    weights: NDArray[np.float64],
    size: float,
) -> NDArray[np.float64]:
    """(n, 4) count, shown, gap and distance of each splat's piece."""
    n = len(labels)
    counts, shown = np.bincount(labels), np.bincount(labels, weights)
    is_body = (counts >= _BODY * n) | (shown >= _BODY)
    if not is_body.any():
        is_body = counts == counts.max()
    body, rest = np.flatnonzero(is_body[labels]), np.flatnonzero(~is_body[labels])
    gaps, ways = np.zeros(len(counts)), np.zeros(len(counts))
    gaps[~is_body] = ways[~is_body] = np.inf
    if len(rest):
        found, at = cKDTree(centers[body], balanced_tree=False).query(centers[rest])
        unit = np.maximum(np.maximum(spacings[rest], spacings[body[at]]), 1e-12 * size)
        np.minimum.at(gaps, labels[rest], found / unit)
        np.minimum.at(ways, labels[rest], found)
    columns = (
        np.log10(np.clip(counts / n, 1e-4, _BODY)),
        np.log10(np.clip(shown, 1e-5, _BODY)),
        np.log(np.clip(gaps, 0.1, 30.0)),
        np.log(np.clip(ways / size, 1e-3, 1.0)),
    )
    return np.column_stack(columns)[labels]
