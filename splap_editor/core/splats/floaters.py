"""What floats about the subject of a capture: haze, clumps and far specks, told by several evidences together."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.progress import Progress, Runner, StageProgress, in_parts, in_turn, part_of, silent
from splap_editor.core.splats.floater_evidence import EVIDENCE, REASONS, floater_evidence
from splap_editor.core.splats.floater_weights import CENTERS, SPREADS, WEIGHTS
from splap_editor.core.splats.occupancy import Ellipses
from splap_editor.core.splats.splats import Splats
from splap_editor.core.splats.surroundings import Ties

_FARTHEST = 3.0
"""Evidence counts no more than this many spreads from its usual value, so that nothing unheard of decides alone."""

_BLOCK_NODES = 1 << 14

_SAYS = np.array([[name in names for names in REASONS.values()] for name in EVIDENCE], np.float32)
"""(27, 7) which evidence says which reason."""

_CENTERS, _SPREADS, _WEIGHTS = (
    np.array(held, np.float32) for held in (CENTERS, SPREADS, WEIGHTS[1 : 1 + len(EVIDENCE)])
)


@dataclass(frozen=True, eq=False)
class Floaters:
    """How likely each active splat floats.

    Parameters
    ----------
    likelihoods : (n,) float64
        In (0, 1).
    reasons : (n,) int8
        Which of the `splap_editor.core.splats.floater_evidence.REASONS` says most that it floats.
    ties : Ties
        What hangs together.
    """

    likelihoods: NDArray[np.float64]
    reasons: NDArray[np.int8]
    ties: Ties

    def at(self, strength: float) -> NDArray[np.bool_]:
        """(n,) what floats at a strength in [0, 1): at 0 nothing, at ½ what rather does than not."""
        return self.likelihoods > 1.0 - strength


def floaters(splats: Splats, ellipses: Ellipses, *, stages: StageProgress = silent, run: Runner = in_turn) -> Floaters:
    """Weigh the evidence that splats float.

    Parameters
    ----------
    splats : Splats
        The scene.
    ellipses : Ellipses
        Its n active splats.
    stages : callable
        ``stages(name)`` gives the progress callback of a stage.
    run : Runner
        Runs parts of the splats, and pictures; what is found does not depend on how.

    Returns
    -------
    Floaters
        By a logistic model of the evidences, their squares and products. Turning, moving, scaling or shuffling the
        scene changes no more than pixels at the rims of splats.
    """
    evidence, ties = floater_evidence(splats, ellipses, stages=stages, run=run)
    margins, reasons = np.empty(len(evidence), np.float32), np.empty(len(evidence), np.int8)
    k = len(EVIDENCE)
    products = np.zeros((k, k), np.float32)
    products[np.triu_indices(k)] = WEIGHTS[1 + k :]
    products = 0.5 * (products + products.T)

    def weigh(first: int, end: int, progress: Progress) -> None:
        """Weigh the evidence of nodes first to end - 1."""
        # Block by block, so that what is worked on stays in the cache.
        for lo in range(first, end, _BLOCK_NODES):
            progress((lo - first) / (end - first))
            some = slice(lo, min(lo + _BLOCK_NODES, end))
            standard = np.clip((evidence[some] - _CENTERS) / _SPREADS, -_FARTHEST, _FARTHEST)
            # What each evidence adds to the logit of floating: its own weight, its square, half of each product.
            shares = standard * (_WEIGHTS + standard @ products)
            margins[some] = WEIGHTS[0] + shares.sum(axis=1)
            reasons[some] = np.argmax(shares @ _SAYS, axis=1)

    in_parts(weigh, len(evidence), part_of(stages("floaters"), 0.9, 1.0), run)
    with np.errstate(over="ignore"):
        return Floaters(1.0 / (1.0 + np.exp(-margins.astype(np.float64))), reasons, ties)
