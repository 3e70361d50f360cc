"""A few thousand nodes that deform as the whole scene does, nearly: what a drag solves for."""

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from splap_editor.core.arap.local_kernels import blend_rigid
from splap_editor.core.arap.problem import ArapProblem, Constraints, Pose, edge_weights
from splap_editor.core.arap.rigid_parts import LooseParts
from splap_editor.core.deformer import FREE, PIN
from splap_editor.core.graph.splat_graph import SplatGraph
from splap_editor.core.kept_arrays import Arrays, require_array, require_rows
from splap_editor.core.splats.rotations import matrices_to_quats
from splap_editor.core.surface.node_sampling import farthest_nodes, nearest_samples

_N_NEAR = 4
"""Coarse nodes each node's motion is blended from."""

_BALANCING_SWEEPS = 12


class CoarseModel:
    """Samples of a scene, the edges between them, and each node's nearest ones. Independent of handles.

    Samples are spread by farthest points along the graph. Each stands for the cell of nodes nearest to it; two cells
    are joined by the sum of the edge weights across their border, balanced so that every cell keeps the moment
    ``Σ_i Σ_j w_ij |e_ij|²`` of its nodes: then stretching costs the same on both levels, however dense the splats.

    Parameters
    ----------
    rest : (n, 3) float64
        Rest positions.
    W : (n, n) csr
        Edge weights, see `edge_weights`.
    graph : SplatGraph
        The splat graph of the same nodes.
    n_samples : int
        At most so many samples.
    """

    def __init__(self, rest: NDArray[np.float64], W: sp.csr_matrix, graph: SplatGraph, n_samples: int) -> None:
        samples = farthest_nodes(graph, n_samples)
        near, distances = nearest_samples(graph, samples, _N_NEAR + 1)
        weights = _balanced_weights(rest, W, near[:, 0], samples)
        lost = np.flatnonzero(near[:, 0] < 0)
        if len(lost):
            # Dust that got no sample of its own borrows those nearest in space.
            k = min(_N_NEAR + 1, len(samples))
            distances[lost, :k], near[lost, :k] = cKDTree(rest[samples]).query(rest[lost], k=range(1, k + 1))
        apart = distances[samples, 1]
        apart = apart[np.isfinite(apart)]
        self._hold(
            rest, samples, weights, float(np.median(apart)) if len(apart) else 0.0, *_blend_shares(near, distances)
        )

    def _hold(
        self,
        rest: NDArray[np.float64],
        samples: NDArray[np.int64],
        weights: sp.csr_matrix,
        spacing: float,
        near: NDArray[np.int32],
        shares: NDArray[np.float64],
    ) -> None:
        self.samples, self.W, self.spacing, self.near, self.shares = samples, weights, spacing, near, shares
        self.rest: NDArray[np.float64] = np.ascontiguousarray(rest[samples])
        self.component: NDArray[np.int32] = connected_components(weights, directed=False)[1].astype(np.int32)

    def packed(self) -> Arrays:
        """Arrays that it can be made of again, by `unpacked`."""
        return {
            "samples": self.samples,
            "weights_indptr": self.W.indptr.astype(np.int32, copy=False),
            "weights_indices": self.W.indices.astype(np.int32, copy=False),
            "weights_data": self.W.data,
            "spacing": np.array(self.spacing),
            "near": self.near,
            "shares": self.shares,
        }

    @classmethod
    def unpacked(cls, kept: Arrays, rest: NDArray[np.float64]) -> "CoarseModel":
        """Make a model of packed arrays.

        Raises
        ------
        CacheEntryError, KeyError
            If they are not of these nodes, or an index is out of range.
        """
        n, m = len(rest), len(kept["samples"])
        require_array(kept["samples"], "samples", (m,), np.int64, (0, n))
        require_rows(kept, "weights", m, m)
        require_array(kept["weights_data"], "weights_data", kept["weights_indices"].shape, np.float64)
        require_array(kept["spacing"], "spacing", (), np.float64)
        require_array(kept["near"], "near", (n, _N_NEAR), np.int32, (0, m))
        require_array(kept["shares"], "shares", (n, _N_NEAR), np.float64)
        weights = sp.csr_matrix((kept["weights_data"], kept["weights_indices"], kept["weights_indptr"]), shape=(m, m))
        model = cls.__new__(cls)
        model._hold(rest, kept["samples"], weights, float(kept["spacing"]), kept["near"], kept["shares"])
        return model


def _blend_shares(
    near: NDArray[np.int32], distances: NDArray[np.float64]
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """Shares ``(1 - d / d_last)²`` of all but the last of each node's nearest samples: they fade before a swap."""
    reached = np.isfinite(distances)
    farthest = np.max(distances, axis=1, where=reached, initial=0.0, keepdims=True)
    last = np.where(reached[:, -1:], distances[:, -1:], 2.0 * farthest)
    with np.errstate(invalid="ignore"):
        shares = np.where(reached, 1.0 - distances / np.maximum(last, 1e-300), 0.0)[:, :_N_NEAR]
    shares = np.where(reached[:, :_N_NEAR], np.maximum(shares, 1e-6), 0.0) ** 2
    shares /= shares.sum(axis=1, keepdims=True)
    return np.ascontiguousarray(np.maximum(near[:, :_N_NEAR], 0)), np.ascontiguousarray(shares)


def _balanced_weights(
    rest: NDArray[np.float64], W: sp.csr_matrix, cell: NDArray[np.int32], samples: NDArray[np.int64]
) -> sp.csr_matrix:
    """Edge weights between cells: sums across borders, scaled so that each cell keeps its moment."""
    m = len(samples)
    fine = W.tocoo()
    weights = np.maximum(fine.data, 0.0)
    moments = np.bincount(
        np.maximum(cell[fine.row], 0),
        np.where(cell[fine.row] >= 0, weights * np.square(rest[fine.row] - rest[fine.col]).sum(axis=1), 0.0),
        minlength=m,
    )
    across = (cell[fine.row] >= 0) & (cell[fine.col] >= 0) & (cell[fine.row] != cell[fine.col])
    rows, columns = cell[fine.row[across]], cell[fine.col[across]]
    coarse = edge_weights(sp.csr_matrix((-weights[across], (rows, columns)), shape=(m, m))).tocoo()
    squares = np.square(rest[samples[coarse.row]] - rest[samples[coarse.col]]).sum(axis=1)
    scale = np.ones(m)
    for _ in range(_BALANCING_SWEEPS):
        held = np.bincount(coarse.row, coarse.data * scale[coarse.row] * scale[coarse.col] * squares, minlength=m)
        # A cell at the end of a chain can not always be balanced; bounds keep it from running away.
        scale = np.clip(scale * np.sqrt(moments / np.where(held > 0.0, held, np.inf).clip(1e-300)), 1e-2, 1e2)
    data = coarse.data * scale[coarse.row] * scale[coarse.col]
    balanced = sp.csr_matrix((data, (coarse.row, coarse.col)), shape=(m, m))
    balanced.sort_indices()
    return balanced


class CoarseArap:
    """The coarse problem of one handle set, and the way back to all nodes.

    A constrained node with no sample of its own label among its nearest ones takes its nearest sample, which then
    moves with it; handles come before pins.

    Parameters
    ----------
    model : CoarseModel
        The scene's.
    constraints : Constraints
        What is held among all nodes.
    graph : SplatGraph
        The splat graph.
    beta : float
        As in `ArapProblem`.
    """

    def __init__(self, model: CoarseModel, constraints: Constraints, graph: SplatGraph, beta: float) -> None:
        self._model = model
        self._constraints = _coarse_constraints(model, constraints)
        self.problem = ArapProblem(model.rest, model.W, self._constraints, beta)
        self._loose = LooseParts(model.rest, self._constraints)
        border = np.flatnonzero(constraints.held)
        border = border[(graph.matrix()[border] @ constraints.free.astype(np.float64)) > 0.0]
        reach = 2.0 * model.spacing
        near, distances = nearest_samples(graph, border, 1, limit=reach)
        eased = np.flatnonzero(constraints.free & (near[:, 0] >= 0))
        t = distances[eased, 0] / reach if reach > 0.0 else np.zeros(len(eased))
        self._border, self._eased, self._source = border, eased, near[eased, 0]
        self._ease = ((1.0 - t) ** 2 * (1.0 + 2.0 * t))[:, None]
        self._rows = np.concatenate([np.flatnonzero(constraints.free), border])

    def spread(self, pose: Pose, transforms: NDArray[np.float64], rest: NDArray[np.float64], whole: Pose) -> None:
        """Move all free nodes by the coarse nodes' rigid motions, blended; held nodes are in place already.

        The step that blending leaves between a held node and its neighbours is eased out over two sample spacings.

        Parameters
        ----------
        pose : Pose
            Of the coarse problem's rows.
        transforms : (H, 4, 4) float64
            The handles'.
        rest : (n, 3) float64
            Rest positions of all nodes.
        whole : Pose
            Of all nodes, changed in place.
        """
        model = self._model
        coarse = Pose.of_rest(model.rest)
        self._constraints.hold(coarse, model.rest, transforms)
        self.problem.spread(pose, coarse)
        self._loose.follow(coarse)
        held = whole.positions[self._border], whole.rotations[self._border]
        blend_rigid(
            self._rows, rest, model.near, model.shares, model.rest, coarse.positions,
            matrices_to_quats(coarse.rotations), whole.positions, whole.rotations,
        )  # fmt: skip
        steps = held[0] - whole.positions[self._border]
        whole.positions[self._border], whole.rotations[self._border] = held
        whole.positions[self._eased] += self._ease * steps[self._source]


def _coarse_constraints(model: CoarseModel, constraints: Constraints) -> Constraints:
    """What is held among the samples."""
    labels, clamped = constraints.labels[model.samples], constraints.clamped[model.samples]
    held = np.flatnonzero(constraints.held)
    same = (labels[model.near[held]] == constraints.labels[held][:, None]) & (model.shares[held] > 0.0)
    lacking = held[~same.any(axis=1)]
    # Handles in their order, pins last; a sample that is taken stays taken, but a handle may take a pin's.
    for node in lacking[np.argsort(constraints.labels[lacking].astype(np.uint32), kind="stable")]:
        sample = model.near[node, 0]
        if labels[sample] == FREE or (labels[sample] == PIN and constraints.labels[node] != PIN):
            labels[sample] = constraints.labels[node]
            clamped[sample] = constraints.clamped[node]
    return Constraints(labels, clamped, model.component)
