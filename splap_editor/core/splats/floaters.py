"""What floats about the subject of a capture: haze, clumps and far specks, told by several evidences together."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from splap_editor.core.progress import Progress, no_progress
from splap_editor.core.splats.contributions import Contributions
from splap_editor.core.splats.floater_evidence import floater_evidence
from splap_editor.core.splats.floater_weights import CENTERS, SPREADS, WEIGHTS
from splap_editor.core.splats.occupancy import Ellipses

_FARTHEST = 3.0
"""Evidence counts no more than this many spreads from its usual value, so that nothing unheard of decides alone."""

_BLOCK_NODES = 1 << 14


@dataclass(frozen=True, eq=False)
class Floaters:
    """How likely each active splat floats.

    Parameters
    ----------
    evidence : (n, 27) float64
        `splap_editor.core.splats.floater_evidence.EVIDENCE` of each node.
    likelihoods : (n,) float64
        In (0, 1).
    touching : (n, n) csr_array of bool
        Which of its nearest a splat hangs together with; not symmetric.
    """

    evidence: NDArray[np.float64]
    likelihoods: NDArray[np.float64]
    touching: sparse.csr_array

    def at(self, strength: float) -> NDArray[np.bool_]:
        """(n,) what floats at a strength in [0, 1): at 0 nothing, at ½ what rather does than not."""
        return self.likelihoods > 1.0 - strength


def floaters(ellipses: Ellipses, contributions: Contributions, *, progress: Progress = no_progress) -> Floaters:
    """Weigh the evidence that splats float.

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
    Floaters
        By a logistic model of the evidences, their squares and products. Turning, moving, scaling or shuffling the
        scene changes it no more than it changes the contributions.
    """
    found, touching = floater_evidence(ellipses, contributions, progress=progress)
    weights, margins = np.array(WEIGHTS), np.empty(len(found))
    # Block by block: all products of all splats at once would be gigabytes.
    for lo in range(0, len(found), _BLOCK_NODES):
        some = slice(lo, lo + _BLOCK_NODES)
        margins[some] = model_terms(found[some]) @ weights
    with np.errstate(over="ignore"):
        return Floaters(found, 1.0 / (1.0 + np.exp(-margins)), touching)


def model_terms(evidence: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, 406) what the model weighs: 1, each evidence, and the product of every two."""
    standard = np.clip((evidence - np.array(CENTERS)) / np.array(SPREADS), -_FARTHEST, _FARTHEST)
    i, j = np.triu_indices(standard.shape[1])
    return np.column_stack([np.ones(len(standard)), standard, standard[:, i] * standard[:, j]])
