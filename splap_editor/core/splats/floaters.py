"""What floats about the subject of a capture: haze, clumps and far specks, told by several evidences together."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from splap_editor.core.splats.contributions import Contributions
from splap_editor.core.splats.occupancy import Ellipses
from splap_editor.core.splats.splats import Splats

_K = 8
"""Neighbours that the spacing about a splat is measured by."""

_BODY = 0.02
"""Share of the splats from which what hangs together belongs to the body."""

_FAINT, _SPARSE = 0.25, 2.5
"""A splat ties nothing together if its opacity is below this share of the usual one, or its neighbours lie so many
times farther off: else haze would join clumps to the body."""

EVIDENCE = (
    "component",
    "shown component",
    "gap",
    "spacing",
    "opacity",
    "contribution",
    "beyond",
    "size",
    "peak",
    "own gap",
    "own spacing",
)
"""What is known of each splat, in this order:

- how many splats hang together with it along the graph, and how much of the pictures they carry (logarithms of shares);
- how far the nearest splat of the body is, and its eighth neighbour (logarithms, in units of the usual spacing);
- its opacity (logit), and what it contributes to pictures from all around (logarithm, in units of the mean);
- how far it lies beyond the subject's box, in units of the subject's size;
- its size (logarithm, in units of the usual one), and its largest share in any pixel;
- the gap and the spacing once more, in units of its own size: parts of a capture are of different density.
"""


@dataclass(frozen=True, eq=False)
class Floaters:
    """How likely each active splat floats.

    Parameters
    ----------
    evidence : (n, 11) float64
        `EVIDENCE` of each node.
    likelihoods : (n,) float64
        In (0, 1).
    """

    evidence: NDArray[np.float64]
    likelihoods: NDArray[np.float64]

    def at(self, strength: float) -> NDArray[np.bool_]:
        """(n,) what floats at a strength in [0, 1): at 0 nothing, at ½ what rather does than not."""
        return self.likelihoods > 1.0 - strength


def floaters(splats: Splats, ellipses: Ellipses, touching: sparse.csr_array, contributions: Contributions) -> Floaters:
    """Weigh the evidence that splats float.

    Parameters
    ----------
    splats : Splats
        The scene, in file order.
    ellipses : Ellipses
        Its n active splats.
    touching : (n, n) csr_array
        The splat graph: an entry for each pair of nodes that touch, both ways.
    contributions : Contributions
        Of the nodes.

    Returns
    -------
    Floaters
        By a logistic model of the evidences, their squares and products. Turning, moving, scaling or shuffling the
        scene changes it no more than it changes the contributions.
    """
    found = _evidence(splats, ellipses, touching, contributions)
    terms = model_terms(found)
    with np.errstate(over="ignore"):
        return Floaters(found, 1.0 / (1.0 + np.exp(-(terms @ np.array(WEIGHTS)))))


def model_terms(evidence: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, 78) what the model weighs: 1, each evidence, and the product of every two."""
    standard = (evidence - np.array(CENTERS)) / np.array(SPREADS)
    i, j = np.triu_indices(standard.shape[1])
    return np.column_stack([np.ones(len(standard)), standard, standard[:, i] * standard[:, j]])


def _evidence(
    splats: Splats, ellipses: Ellipses, touching: sparse.csr_array, contributions: Contributions
) -> NDArray[np.float64]:
    n = ellipses.n_nodes
    if n == 0:
        return np.zeros((0, len(EVIDENCE)))
    weights = contributions.weights / max(contributions.weights.sum(), 1e-300)
    centers = ellipses.centers
    opacities = np.clip(splats.opacities[ellipses.rows], 1e-3, 1.0 - 1e-3)
    distances = cKDTree(centers).query(centers, min(_K, n - 1) + 1)[0].reshape(n, -1)[:, -1]
    is_solid = (opacities >= _FAINT * np.median(opacities)) & (distances <= _SPARSE * np.median(distances))
    sizes, shown = _shares(touching, is_solid, weights)
    is_body = is_solid & (sizes >= _BODY)
    if not is_body.any():
        is_body = sizes == sizes.max()
    usual = max(float(np.median(distances[is_body])), 1e-12 * ellipses.scene_scale)
    gaps = cKDTree(centers[is_body]).query(centers, 1)[0]
    subject = ellipses.subject
    beyond = np.zeros(n)
    for half_axis in subject.half_axes:
        length = float(np.linalg.norm(half_axis))
        if length > 0.0:
            along = np.abs((centers - subject.center) @ (half_axis / length))
            beyond = np.maximum(beyond, along - length)
    usual_size = float(np.median(ellipses.reaches[is_body]))
    return np.column_stack(
        [
            np.log10(np.clip(sizes, 1e-4, _BODY)),
            np.log10(np.clip(shown, 1e-5, _BODY)),
            np.log(np.clip(gaps / usual, 0.3, 30.0)),
            np.log(np.clip(distances / usual, 0.1, 30.0)),
            np.log(opacities / (1.0 - opacities)),
            np.log(np.clip(weights * n, 1e-3, 30.0)),
            np.clip(beyond / subject.size, 0.0, 0.5),
            np.log(np.clip(ellipses.reaches / usual_size, 0.1, 30.0)),
            contributions.peaks,
            np.log(np.clip(gaps / np.maximum(ellipses.reaches, 1e-3 * usual), 0.03, 30.0)),
            np.log(np.clip(distances / np.maximum(ellipses.reaches, 1e-3 * usual), 0.03, 30.0)),
        ]
    )


def _shares(
    touching: sparse.csr_array, is_solid: NDArray[np.bool_], weights: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Share of the splats, and of what the pictures show, that hang together with each; the larger of what it touches.

    Only solid splats tie others together.
    """
    n = len(is_solid)
    where = np.flatnonzero(is_solid)
    _, labels = connected_components(touching[where][:, where], directed=False)
    sizes, shown = np.full(n, 1.0 / n), weights.copy()
    sizes[where] = (np.bincount(labels, minlength=1) / n)[labels]
    shown[where] = np.bincount(labels, weights[where], minlength=1)[labels]
    edges = touching.tocoo()
    ties = is_solid[edges.col] & ~is_solid[edges.row]
    rows, columns = edges.row[ties], edges.col[ties]
    for share in (sizes, shown):
        np.maximum.at(share, rows, share[columns])
    return sizes, shown


# Fitted by `python -m tests.benchmark.floaters --fit` on half of its scenes; the other half measures.
CENTERS = (-1.95, -2.0, -0.9, 0.0, 1.0, -1.5, 0.02, 0.0, 0.4, 0.0, 0.0)
SPREADS = (0.6, 0.9, 1.0, 0.6, 2.5, 2.0, 0.1, 0.8, 0.35, 1.0, 0.7)
# fmt: off
WEIGHTS = (
    -1.260, 0.296, -0.030, -0.040, -1.035, -0.826, 0.440, 1.435, 0.888, -0.069, 1.793, 1.035, 0.703,
    -0.422, 0.668, -0.189, -0.339, 0.213, -0.164, 0.119, -0.344, 0.256, 0.015, -0.371, -0.695, -0.348,
    0.311, 0.054, -0.104, 0.018, 0.310, -0.471, 0.290, -0.187, -0.177, -0.233, 0.467, 1.043, -0.231,
    -0.481, 0.059, -0.129, 0.543, -0.122, 0.121, 0.016, -0.255, 0.234, 0.271, -0.451, -0.604, -0.558,
    0.541, -1.072, -0.050, 0.641, -0.878, 0.745, -0.137, -0.195, -0.088, -0.069, 0.084, 0.716, -0.266,
    -0.336, -1.713, -0.141, 0.345, -0.182, -0.877, 0.705, 0.022, -0.035, -0.489, 0.187, -0.577, 0.373,
)
# fmt: on
