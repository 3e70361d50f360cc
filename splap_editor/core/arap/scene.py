"""What as-rigid-as-possible deformation of a scene needs before any handle is placed."""

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from splap_editor.core.arap.coarse import CoarseModel
from splap_editor.core.arap.problem import edge_weights
from splap_editor.core.binding import Keep, made_anew
from splap_editor.core.graph.splat_graph import SplatGraph

SMALL = 6000
"""Scenes of at most so many nodes are dragged in full."""

N_SAMPLES = 4000
"""Coarse nodes of larger ones: a drag frame costs a few milliseconds, and settling shifts nothing far."""


class ArapScene:
    """Shared by all handle sets of a scene; make it once.

    The coarse model takes about a second at 100,000 nodes. It is made when it is first needed; `ready` has it made in
    the background, or taken from where it is kept.

    Parameters
    ----------
    rest : (n, 3) float64
        Rest positions of the nodes.
    L : (n, n) scipy csr, float64
        Laplacian, see `ArapDeformer`.
    graph : SplatGraph
        The splat graph of the same nodes.
    small : int
        A scene of at most so many nodes does without a coarse model.
    n_samples : int
        Nodes of the coarse model.

    Raises
    ------
    ValueError
        If the shapes do not fit.
    """

    def __init__(
        self,
        rest: NDArray[np.float64],
        L: sp.csr_matrix,
        graph: SplatGraph,
        *,
        small: int = SMALL,
        n_samples: int = N_SAMPLES,
    ) -> None:
        rest = np.ascontiguousarray(rest, np.float64)
        if rest.ndim != 2 or rest.shape[1] != 3 or L.shape != (len(rest), len(rest)):
            raise ValueError(f"rest and L must have shapes (n, 3) and (n, n), got {rest.shape} and {L.shape}")
        self.rest: NDArray[np.float64] = rest
        self.graph = graph
        self._small, self._n_samples = small, n_samples
        self._coarse: CoarseModel | None = None
        self.W: sp.csr_matrix = edge_weights(L)
        _, component = connected_components(self.W, directed=False)
        self.component: NDArray[np.int32] = component.astype(np.int32)

    @property
    def coarse(self) -> CoarseModel | None:
        """The coarse model for dragging; None for a scene small enough to do without."""
        return self.ready(made_anew)

    def ready(self, keep: Keep) -> CoarseModel | None:
        """Have the coarse model at hand, the one that is kept if there is one."""
        if len(self.rest) <= self._small:
            return None
        if self._coarse is None:
            self._coarse = keep(
                ("coarse model", self._n_samples),
                lambda: CoarseModel(self.rest, self.W, self.graph, self._n_samples),
                CoarseModel.packed,
                lambda kept: CoarseModel.unpacked(kept, self.rest),
            )
        return self._coarse
