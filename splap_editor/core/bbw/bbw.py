"""Deformation by bounded biharmonic weights: solve for the weights once, then a drag is one blend."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from splap_editor.core.bbw.blending import blended_dual_quaternion, blended_linear
from splap_editor.core.bbw.box_qp import BoxQpReport
from splap_editor.core.bbw.options import BbwOptions
from splap_editor.core.bbw.weights import (
    DEFAULT_OPTIONS,
    BbwProblem,
    HandleWeight,
    bbw_problem,
    handle_weight,
)
from splap_editor.core.deformer import FREE, PIN, Deformation, Deformer, Handles, Shown
from splap_editor.core.progress import Progress, no_progress, part_of

if TYPE_CHECKING:
    from splap_editor.core.graph.splat_graph import SplatGraph


@dataclass(frozen=True)
class BbwReport:
    """How the weights came about, for the read-outs.

    Parameters
    ----------
    handles : tuple of BoxQpReport
        One per handle.
    n_unknowns : tuple of int
        Free nodes each handle reaches.
    seconds : tuple of float
        Time for each handle's weight; ``shared_seconds`` comes on top, once.
    shared_seconds : float
    unreachable : tuple of int
        Handles that move nothing but their own nodes: no free node of their component lies in their cage.
    n_specks : int
        Nodes in unconstrained small components, which follow their nearest neighbours.
    n_resting : int
        Nodes in larger components without any constraint, which stay at rest.
    """

    handles: tuple[BoxQpReport, ...] = ()
    n_unknowns: tuple[int, ...] = ()
    seconds: tuple[float, ...] = ()
    shared_seconds: float = 0.0
    unreachable: tuple[int, ...] = ()
    n_specks: int = 0
    n_resting: int = 0


def bbw_weights(
    problem: BbwProblem, solved: Sequence[HandleWeight], graph: SplatGraph, *, shared_seconds: float = 0.0
) -> tuple[sp.csr_array, BbwReport]:
    """Join the handles' weights to a partition of unity with the resting complement.

    Each handle was solved by itself, so sums may exceed one where cages overlap: rows are divided by
    ``max(1, Σ w_h)``, which leaves the constrained nodes exact and the complement ``1 - Σ w_h`` ≥ 0. The complement is
    the weight of rest. In a component where nothing is held at rest (no pin, and no node outside all cages) rest
    has no claim, and rows are divided by ``Σ w_h`` itself.

    Components without any constraint: small ones (specks) take the weights of the nearest node that is not a speck,
    over a graph edge if there is one, else through space; larger ones stay at rest.

    Parameters
    ----------
    problem : BbwProblem
    solved : sequence of HandleWeight
        One per handle, in order.
    graph : SplatGraph
    shared_seconds : float
        What `bbw_problem` took, for the report.

    Returns
    -------
    weights : (n, H) sparse float64
        Weights ≥ 0 with row sums ≤ 1 and no stored zeros.
    report : BbwReport
    """
    n_handles = problem.handles.n_handles
    rows = np.concatenate([s.nodes for s in solved]) if solved else np.zeros(0, np.int64)
    columns = np.repeat(np.arange(n_handles), [len(s.nodes) for s in solved])
    values = np.concatenate([s.values for s in solved]) if solved else np.zeros(0)
    weights = sp.csr_array((values, (rows, columns)), shape=(len(problem.rest), n_handles))
    sums = weights.sum(axis=1)
    held = (problem.labels == PIN) | ((problem.labels < 0) & ~problem.in_cages.any(axis=0))
    rested = np.isin(problem.components, problem.components[held])
    divisors = np.where(rested | (sums == 0), np.maximum(sums, 1.0), sums)
    weights = sp.csr_array(sp.diags_array(1.0 / divisors) @ weights)

    constrained = np.unique(problem.components[problem.labels != FREE])
    unconstrained = ~np.isin(problem.components, constrained)
    sizes = np.bincount(problem.components, minlength=1)
    specks = unconstrained & (sizes[problem.components] < problem.options.speck_size)
    if specks.any() and not specks.all():
        weights = _with_followers(weights, _speck_sources(problem, graph, specks))
    weights.sort_indices()
    report = BbwReport(
        handles=tuple(s.qp for s in solved),
        n_unknowns=tuple(s.n_unknowns for s in solved),
        seconds=tuple(s.seconds for s in solved),
        shared_seconds=shared_seconds,
        unreachable=tuple(h for h, s in enumerate(solved) if s.n_reached == 0),
        n_specks=int(specks.sum()),
        n_resting=int((unconstrained & ~specks).sum()),
    )
    return weights, report


class WeightedDeformer(Deformer, Protocol):
    """A deformer with a weight for each handle: what a row that `has_weights` binds."""

    sparse_weights: sp.csr_array
    report: BbwReport

    @property
    def weights(self) -> NDArray[np.float64]:
        """(n, H) weight of every handle at every node."""
        ...


class BbwDeformer:
    """Bounded biharmonic weights bound to one scene and one handle set.

    Parameters
    ----------
    rest : (n, 3) float64
        Rest positions in world units.
    L : (n, n) sparse float64
        Positive semidefinite Laplacian.
    M : (n,) float64
        Lumped masses.
    handles : Handles
        Nodes, centres and cages of the handles; pins count as rest.
    scene_scale : float
        The scene's size ``s``, the unit of `Deformation.residual`; kept for the read-outs.
    graph : SplatGraph
        Tells unconnected specks whom to follow.
    options : BbwOptions
    progress : Progress
        Equal shares for the handles; may cancel.

    Attributes
    ----------
    report : BbwReport

    Raises
    ------
    ValueError
        If shapes disagree, an index is out of range or a cage radius is not positive.
    """

    def __init__(
        self,
        rest: NDArray[np.float64],
        L: sp.csr_array | sp.csr_matrix,
        M: NDArray[np.float64],
        handles: Handles,
        *,
        scene_scale: float,
        graph: SplatGraph,
        options: BbwOptions = DEFAULT_OPTIONS,
        progress: Progress = no_progress,
    ):
        began = time.perf_counter()
        problem = bbw_problem(rest, L, M, handles, options=options, progress=part_of(progress, 0.0, 0.1))
        shared = time.perf_counter() - began
        count = max(1, handles.n_handles)
        solved = [
            handle_weight(problem, h, part_of(progress, 0.1 + 0.9 * h / count, 0.1 + 0.9 * (h + 1) / count))
            for h in range(handles.n_handles)
        ]
        weights, report = bbw_weights(problem, solved, graph, shared_seconds=shared)
        self._bind(rest, handles, weights, options, report)

    @classmethod
    def from_weights(
        cls,
        rest: NDArray[np.float64],
        handles: Handles,
        weights: sp.csr_array | NDArray[np.float64],
        *,
        options: BbwOptions = DEFAULT_OPTIONS,
        report: BbwReport | None = None,
    ) -> BbwDeformer:
        """Bind weights found before, from a cache or from handles solved side by side.

        Parameters
        ----------
        rest : (n, 3) float64
        handles : Handles
        weights : (n, H) float64, sparse or dense
            As `sparse_weights` holds them.
        options : BbwOptions
            Only ``blending`` matters here.
        report : BbwReport, optional

        Returns
        -------
        BbwDeformer

        Raises
        ------
        ValueError
            If the weights do not fit the nodes and handles, or are no partition of unity.
        """
        weights = sp.csr_array(weights)
        if weights.shape != (len(rest), handles.n_handles):
            raise ValueError(f"weights must have shape ({len(rest)}, {handles.n_handles}), got {weights.shape}")
        if weights.nnz and (weights.data.min() < 0 or weights.sum(axis=1).max() > 1 + 1e-12):
            raise ValueError("weights must be at least 0 with row sums of at most 1")
        deformer = cls.__new__(cls)
        deformer._bind(rest, handles, weights, options, report or BbwReport())
        return deformer

    def _bind(
        self,
        rest: NDArray[np.float64],
        handles: Handles,
        weights: sp.csr_array,
        options: BbwOptions,
        report: BbwReport,
    ) -> None:
        self._rest = np.ascontiguousarray(rest, np.float64)
        self._handles = handles
        self._resting = handles.resting(len(self._rest))
        self._options = options
        self.sparse_weights = weights
        self.report = report

    @property
    def weights(self) -> NDArray[np.float64]:
        """Weight of every handle at every node, (n, H) float64; rows sum to at most 1, the rest of it is rest."""
        return self.sparse_weights.toarray()

    def drag(self, transforms: NDArray[np.float64]) -> Deformation:
        """Deform for a frame of a drag: the same single blend as `solve`.

        Parameters
        ----------
        transforms : (H, 4, 4) float64
            World transform of each handle, rest → moved; affine.

        Returns
        -------
        Deformation

        Raises
        ------
        ValueError
            If the transforms have the wrong shape or are not finite.
        """
        transforms = np.asarray(transforms, np.float64)
        if transforms.shape != (self._handles.n_handles, 4, 4) or not np.isfinite(transforms).all():
            raise ValueError(
                f"transforms must be finite with shape ({self._handles.n_handles}, 4, 4), got {transforms.shape}"
            )
        if self._options.blending == "linear":
            positions, rotations = blended_linear(self._rest, self.sparse_weights, transforms)
        else:
            positions, rotations = blended_dual_quaternion(
                self._rest, self.sparse_weights, transforms, self._handles.centers
            )
        return Deformation(positions, rotations, resting=self._resting)

    def solve(
        self,
        transforms: NDArray[np.float64],
        *,
        progress: Progress = no_progress,
        shown: Shown | None = None,
    ) -> Deformation:
        """Deform: one blend, exact at once.

        Parameters
        ----------
        transforms : (H, 4, 4) float64
        progress, shown
            There is nothing to report on the way.

        Returns
        -------
        Deformation
        """
        return self.drag(transforms)


def _speck_sources(problem, graph, specks):
    """Speck nodes and, for each, the node whose weights its component takes on."""
    nodes = np.flatnonzero(specks)
    others = np.flatnonzero(~specks)
    distances, nearest = cKDTree(problem.rest[others]).query(problem.rest[nodes])
    candidates = np.column_stack([nodes, others[nearest]])
    # Links over the graph come before links through space, whatever their lengths.
    edges = sp.coo_array(graph.matrix()[nodes])
    linked = ~specks[edges.col]
    over_graph = np.column_stack([nodes[edges.row[linked]], edges.col[linked]])
    links = np.vstack([over_graph, candidates])
    ranks = np.repeat([0, 1], [len(over_graph), len(candidates)])
    lengths = np.concatenate([edges.data[linked], distances])
    pieces = problem.components[links[:, 0]]
    order = np.lexsort([lengths, ranks, pieces])
    first = order[np.r_[True, np.diff(pieces[order]) > 0]]
    source_of_piece = dict(zip(pieces[first].tolist(), links[first, 1].tolist(), strict=True))
    return nodes, np.array([source_of_piece[piece] for piece in problem.components[nodes].tolist()])


def _with_followers(weights, sources):
    """Weights with the rows of some nodes replaced by those of others."""
    nodes, followed = sources
    row_of = np.arange(weights.shape[0])
    row_of[nodes] = followed
    return weights[row_of]
