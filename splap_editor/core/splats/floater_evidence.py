"""What is known of each splat that may float: its neighbours, what hangs together with it, and what it shows."""

from collections.abc import Sequence
from functools import partial

import numba as nb
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from splap_editor.core.index_spaces import NodeMask
from splap_editor.core.progress import Progress, Runner, StageProgress, in_parts, in_turn, part_of, silent
from splap_editor.core.splats.contributions import Contributions, contributions, shared_by
from splap_editor.core.splats.main_subject import MainSubject
from splap_editor.core.splats.occupancy import Ellipses
from splap_editor.core.splats.smallest_box import smallest_box
from splap_editor.core.splats.splats import Splats
from splap_editor.core.splats.surroundings import (
    LOCAL,
    Surroundings,
    Ties,
    bounded_logits,
    log_opacities,
    surroundings,
)

_FAINT = 0.3
"""Share of its neighbours' usual opacity from which a splat is solid: haze ties nothing together."""

_BODY = 0.02
"""Share of the splats, or of what the pictures show, from which what hangs together belongs to the body."""

_NEAR = 1.0
"""The body is looked for no farther from the subject's box than so many times its size."""

_BLOCK_NODES = 1 << 14

_SAMPLE = 40_000
"""So many splats tell how far the body reaches."""

REASONS = {
    "few splats about it": ("spacing", "own spacing", "mutual", "piece mutual", "piece spacing"),
    "of no surface": ("out of plane", "own plane", "aligned", "piece aligned", "piece out of plane"),
    "of another size": ("size",),
    "faint": ("opacity", "logit", "piece logit"),
    "hardly seen": ("contribution", "shown share", "peak"),
    "a small piece": ("contacts", "narrow count", "narrow shown", "wide count", "wide shown"),
    "apart from the rest": ("beyond", "narrow gap", "narrow distance", "wide gap", "wide distance"),
}
"""In words what gives a floater away, and the `EVIDENCE` that says it."""

_BOUNDS = ((0, -2.0, 3.0), (1, -3.0, 3.5), (6, -3.0, 3.0), (7, -6.0, 6.0))
"""Columns of `LOCAL`, and between what each is kept."""

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
    splats: Splats, ellipses: Ellipses, *, stages: StageProgress = silent, run: Runner = in_turn
) -> tuple[NDArray[np.float32], Ties]:
    """Look at each splat, its neighbours and its piece; neither the scene's units nor the order of nodes matter.

    Parameters
    ----------
    splats : Splats
        The scene.
    ellipses : Ellipses
        Its n active splats.
    stages : callable
        ``stages(name)`` gives the progress callback of a stage.
    run : Runner
        Runs parts of the splats, and pictures.

    Returns
    -------
    evidence : (n, 27) float32
        The `EVIDENCE` of each node.
    ties : Ties
        What hangs together by the wide measure.
    """
    n = ellipses.n_nodes
    if n < 2:
        return np.zeros((n, len(EVIDENCE)), np.float32), Ties(np.empty((n, 0), np.int32), np.empty((n, 0), np.bool_))
    progress = stages("floaters")
    around = surroundings(ellipses, progress=part_of(progress, 0.0, 0.7), run=run)
    is_solid = log_opacities(ellipses) >= np.log(_FAINT) + around.near_log_opacities
    narrow, wide = run([partial(_pieces, ties, is_solid) for ties in (around.narrow, around.wide)], _unheard)
    pieces = [narrow, wide]
    subject = _whole_subject(ellipses, pieces[-1])
    shown = contributions(splats, ellipses, subject=subject, progress=stages("contributions"), run=run)
    progress(0.8)
    return _columns(ellipses, around, pieces, subject, shown, part_of(progress, 0.8, 0.9), run), around.wide


def _whole_subject(ellipses: Ellipses, labels: NDArray[np.int32]) -> MainSubject:
    """A box about all of the body that lies in the subject's box or about it: sparse halves of an object too."""
    subject, counts = ellipses.subject, np.bincount(labels)
    is_body = (counts >= _BODY * len(labels))[labels]
    is_body &= subject.holds(ellipses.centers, room=_NEAR * subject.size)
    body = ellipses.centers[is_body]
    if not len(body):
        return subject
    # Every one of so many along the curve: the sample is as dense everywhere as the body is.
    center, half_axes = smallest_box(body[:: -(-len(body) // _SAMPLE)])
    size = 2.0 * float(np.linalg.norm(half_axes[0]))
    return MainSubject(size, center, half_axes) if size > 0.0 else subject


def _columns(
    ellipses: Ellipses,
    around: Surroundings,
    pieces: list[NDArray[np.int32]],
    subject: MainSubject,
    shown: Contributions,
    progress: Progress,
    run: Runner,
) -> NDArray[np.float32]:
    """(n, 27) the evidence, column by column in memory."""
    n, logits = ellipses.n_nodes, bounded_logits(ellipses)
    weights = shown.weights / max(shown.weights.sum(), 1e-300)
    known = around, ellipses.centers, weights, subject.size
    parts = [partial(_piece_evidence, labels, *known) for labels in pieces]
    of_pieces = run(parts, lambda shares: progress(0.5 * sum(shares) / len(parts)))
    counts = np.bincount(pieces[-1])
    means = [
        partial(_means, pieces[-1], counts, held) for held in (*around.local.T[[2, 5, 3]], logits, around.local[:, 1])
    ]
    of_pieces.append(tuple(run(means, _unheard)))
    evidence = np.empty((len(EVIDENCE), n), np.float32).T

    def fill(first: int, end: int, progress: Progress) -> None:
        """Fill in the evidence of nodes first to end - 1, so many at a time that they stay in the cache."""
        for lo in range(first, end, _BLOCK_NODES):
            progress((lo - first) / (end - first))
            some = slice(lo, min(lo + _BLOCK_NODES, end))
            own = _own_evidence(ellipses, subject, shown, weights[some] * n, logits[some], some)
            evidence[some, : len(LOCAL)] = around.local[some]
            for column, least, most in _BOUNDS:
                np.clip(evidence[some, column], least, most, out=evidence[some, column])
            labels = (pieces[0][some], pieces[1][some], pieces[1][some])
            shared = (held[of] for of, told in zip(labels, of_pieces, strict=True) for held in told)
            for column, values in enumerate((*own, *shared), start=len(LOCAL)):
                evidence[some, column] = values

    in_parts(fill, n, part_of(progress, 0.5, 1.0), run)
    return evidence


def _own_evidence(
    ellipses: Ellipses,
    subject: MainSubject,
    shown: Contributions,
    relative: NDArray[np.float64],
    logits: NDArray[np.float64],
    some: slice,
) -> tuple[NDArray[np.float64], ...]:
    """From the opacity to how far beyond the subject, (m,) each, of some nodes; ``relative`` is to mean weights."""
    minor = np.sqrt(np.einsum("ij,ij->i", ellipses.semi_axes[some, 1], ellipses.semi_axes[some, 1]))
    opacities = 1.0 / (1.0 + np.exp(-logits))
    areas = np.maximum(ellipses.reaches[some] * minor / subject.size**2, 1e-30) * opacities
    return (
        logits,
        np.log(np.clip(relative, 1e-3, 30.0)),
        np.log(np.clip(shown.weights[some] / areas, 1e-3, 10.0)),
        shown.peaks[some],
        np.clip(_beyond(subject, ellipses.centers[some]) / subject.size, 0.0, 0.5),
    )


def _pieces(ties: Ties, is_solid: NodeMask, progress: Progress) -> NDArray[np.int32]:
    """(n,) piece of each node, as a part of the work."""
    progress(0.0)
    return ties.pieces(is_solid)


def _means(
    labels: NDArray[np.int32], counts: NDArray[np.integer], values: NDArray[np.float64], progress: Progress
) -> NDArray[np.float64]:
    """(p,) mean over the nodes of each piece, as a part of the work."""
    progress(0.0)
    return np.bincount(labels, values) / counts


def _unheard(shares: Sequence[float]) -> None:
    """Report nothing of what is soon done."""


def _beyond(subject: MainSubject, centers: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n,) how far centres lie beyond the faces of the subject's box, in world units."""
    beyond = np.zeros(len(centers))
    for half_axis in subject.half_axes:
        length = float(np.linalg.norm(half_axis))
        if length > 0.0:
            axis = half_axis / length
            np.maximum(beyond, np.abs(centers @ axis - subject.center @ axis) - length, out=beyond)
    return beyond


def _piece_evidence(
    labels: NDArray[np.integer],
    around: Surroundings,
    centers: NDArray[np.float64],
    weights: NDArray[np.float64],
    size: float,
    progress: Progress,
) -> tuple[NDArray[np.float64], ...]:
    """Count, shown, gap and distance of each piece, (p,) each.

    How near a piece comes to the body is looked at where a splat of it has the body among its nearest, and nowhere but
    in a piece without such splats by a search.
    """
    progress(0.0)
    n, spacings = len(labels), around.distances[:, -1]
    counts, shown = np.bincount(labels), np.bincount(labels, weights)
    is_body = (counts >= _BODY * n) | (shown >= _BODY)
    if not is_body.any():
        is_body = counts == counts.max()
    gaps, ways = np.full((2, len(counts)), np.inf)
    gaps[is_body] = ways[is_body] = 0.0
    least = 1e-12 * size
    _near_body(labels, around.neighbors, around.distances, is_body, least, gaps, ways)
    rest = np.flatnonzero(np.isinf(ways)[labels])
    if len(rest):
        body = np.flatnonzero(is_body[labels])
        # Of very many, every fifth along the curve tells as well how far away they are.
        body = body[:: shared_by(n)]
        found, at = cKDTree(centers[body], balanced_tree=False).query(centers[rest])
        unit = np.maximum(np.maximum(spacings[rest], spacings[body[at]]), least)
        np.minimum.at(gaps, labels[rest], found / unit)
        np.minimum.at(ways, labels[rest], found)
    return (
        np.log10(np.clip(counts / n, 1e-4, _BODY)),
        np.log10(np.clip(shown, 1e-5, _BODY)),
        np.log(np.clip(gaps, 0.1, 30.0)),
        np.log(np.clip(ways / size, 1e-3, 1.0)),
    )


@nb.njit(nogil=True, cache=True, error_model="numpy")
def _near_body(labels, neighbors, distances, is_body, least, gaps, ways):
    """Lower each piece's gap and way to the body by what its splats have among their nearest."""
    n, k = neighbors.shape
    for i in range(n):
        piece = labels[i]
        if is_body[piece]:
            continue
        for c in range(k):
            j = neighbors[i, c]
            if is_body[labels[j]]:
                unit = max(distances[i, k - 1], distances[j, k - 1], least)
                gaps[piece] = min(gaps[piece], distances[i, c] / unit)
                ways[piece] = min(ways[piece], distances[i, c])
                break
