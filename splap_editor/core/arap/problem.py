"""The part of an as-rigid-as-possible problem that can move: its rows, its factors, its state."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from splap_editor.core.arap.local_kernels import (
    energy_and_torques,
    fit_local_rotations,
    turn,
    write_global_rhs,
)
from splap_editor.core.arap.rotation_fit import nearest_rotations
from splap_editor.core.deformer import FREE
from splap_editor.core.index_spaces import Nodes, ProblemRows
from splap_editor.core.linear_solvers import SpdFactor


def edge_weights(L: sp.spmatrix | sp.sparray) -> sp.csr_matrix:
    """Edge weights ``w_ij = -L_ij``, the diagonal and zeros left out, as CSR with sorted indices."""
    W = sp.csr_matrix(-L, dtype=np.float64)
    W.setdiag(0.0)
    W.eliminate_zeros()
    W.sort_indices()
    return W


@dataclass(frozen=True, eq=False)
class Constraints:
    """Which nodes are held by which handle, and which of those have their rotation given too.

    Parameters
    ----------
    labels : (n,) int32
        Handle of each node; `PIN` for one that stays put, `FREE` for one that is not held.
    clamped : (n,) bool
        Held nodes whose rotation is given as well.
    component : (n,) int32
        Connected component of each node in the graph of edge weights, from 0.
    """

    labels: NDArray[np.int32]
    clamped: NDArray[np.bool_]
    component: NDArray[np.int32]

    @cached_property
    def held(self) -> NDArray[np.bool_]:
        """(n,) nodes whose position is given."""
        return self.labels != FREE

    @cached_property
    def loose(self) -> NDArray[np.bool_]:
        """(n,) nodes of components in which nothing is held."""
        return np.bincount(self.component, self.held)[self.component] == 0

    @cached_property
    def free(self) -> NDArray[np.bool_]:
        """(n,) nodes to be placed: neither held nor loose."""
        return ~self.held & ~self.loose

    def hold(self, pose: "Pose", rest: NDArray[np.float64], transforms: NDArray[np.float64]) -> None:
        """Move the handles' nodes of a pose of all nodes; pins are at rest already.

        Parameters
        ----------
        pose : Pose
            Of all nodes, changed in place.
        rest : (n, 3) float64
            Rest positions.
        transforms : (H, 4, 4) float64
            World transform of each handle; nodes turn by the rotation nearest to its linear part.
        """
        nodes, labels = self._moved
        linear = transforms[:, :3, :3]
        pose.positions[nodes] = (linear[labels] @ rest[nodes][:, :, None])[:, :, 0] + transforms[labels, :3, 3]
        pose.rotations[nodes] = nearest_rotations(linear)[labels]

    @cached_property
    def _moved(self) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
        nodes = np.flatnonzero(self.labels >= 0)
        return nodes, self.labels[nodes]


@dataclass(eq=False)
class Pose:
    """Positions (r, 3) and rotations (r, 3, 3) of a problem's rows, changed in place by its steps."""

    positions: NDArray[np.float64]
    rotations: NDArray[np.float64]

    @classmethod
    def of_rest(cls, rest: NDArray[np.float64]) -> "Pose":
        """The rest pose."""
        return cls(np.array(rest, np.float64, order="C"), np.tile(np.eye(3), (len(rest), 1, 1)))

    def copy(self) -> "Pose":
        """An independent pose with the same values."""
        return Pose(self.positions.copy(), self.rotations.copy())


class ArapProblem:
    """Spokes energy with smooth rotations, restricted to what can move.

    ``E = ½ Σ_i Σ_j w_ij |x_i - x_j - R_i e_ij|² + ¼ β Σ_i Σ_j w_ij |R_i - R_j|²`` [1]_ [2]_ over the free nodes and the
    held nodes that share an edge with one. Loose components are left out. Rows are nodes in ascending order, so that
    memory order follows the scene's.

    Parameters
    ----------
    rest : (n, 3) float64
        Rest positions of all nodes.
    W : (n, n) csr
        Symmetric edge weights, see `edge_weights`.
    constraints : Constraints
        What is held.
    beta : float
        Weight of the smooth-rotation term in world units squared; 0 for plain spokes.

    References
    ----------
    .. [1] Sorkine and Alexa, "As-Rigid-As-Possible Surface Modeling", SGP 2007.
    .. [2] Levi and Gotsman, "Smooth Rotation Enhanced As-Rigid-As-Possible Mesh Animation", TVCG 2015.
    """

    def __init__(self, rest: NDArray[np.float64], W: sp.csr_matrix, constraints: Constraints, beta: float) -> None:
        clamped = constraints.clamped
        free = constraints.free
        inner = free.copy()
        inner[W[free].indices] = True
        outer = inner.copy()
        # A held row whose rotation is fitted needs all its spokes, those to other held nodes included.
        outer[W[inner & ~clamped].indices] = True
        self.nodes: Nodes = np.flatnonzero(outer)
        self.rest = np.ascontiguousarray(rest[self.nodes])
        self.beta = float(beta)
        has_energy = inner[self.nodes]
        local = W[self.nodes][:, self.nodes].tocoo()
        # Between two clamped nodes, and on the far spokes of the outermost ring, nothing can change.
        fixed = clamped[self.nodes]
        keep = has_energy[local.row] & ~(fixed[local.row] & fixed[local.col])
        W = sp.csr_matrix((local.data[keep], (local.row[keep], local.col[keep])), shape=local.shape)
        W.sort_indices()
        self._indptr, self._indices = W.indptr.astype(np.int32), W.indices.astype(np.int32)
        self._weights = W.data
        self.is_free = np.ascontiguousarray(free[self.nodes]).view(np.uint8)
        self.free_rows: ProblemRows = np.flatnonzero(free[self.nodes])
        self.turn_rows = np.flatnonzero(has_energy & ~fixed)
        self._turn_index = np.full(len(self.nodes), -1, np.int32)
        self._turn_index[self.turn_rows] = np.arange(len(self.turn_rows), dtype=np.int32)
        self._constraints = Constraints(
            constraints.labels[self.nodes], clamped[self.nodes], constraints.component[self.nodes]
        )
        self._rhs = np.empty((len(self.free_rows), 3))

    @property
    def n_free(self) -> int:
        """Number of free nodes that some constraint holds on to."""
        return len(self.free_rows)

    @cached_property
    def _laplacian(self) -> sp.csr_matrix:
        r = len(self.nodes)
        W = sp.csr_matrix((self._weights, self._indices, self._indptr), shape=(r, r))
        return sp.csr_matrix(sp.diags(np.asarray(W.sum(axis=1)).ravel()) - W)

    @cached_property
    def position_factor(self) -> SpdFactor:
        """Factor of the Laplacian among free rows, made on first use."""
        return SpdFactor(self._laplacian[self.free_rows][:, self.free_rows])

    @cached_property
    def turn_factor(self) -> SpdFactor:
        """Factor of ``2 β L + diag(⅔ Σ_j w_ij |e_ij|²)`` among turning rows: what turning one node costs, nearly."""
        lengths = np.square(self.rest[self._sources] - self.rest[self._indices]).sum(axis=1)
        inertia = np.bincount(self._sources, np.abs(self._weights) * lengths, minlength=len(self.nodes))
        inertia = np.maximum(inertia, 1e-12 * inertia.mean())
        if self.beta == 0.0:
            return SpdFactor(sp.diags(2.0 / 3.0 * inertia[self.turn_rows]))
        A = 2.0 * self.beta * self._laplacian + sp.diags(2.0 / 3.0 * inertia)
        return SpdFactor(sp.csr_matrix(A)[self.turn_rows][:, self.turn_rows])

    @cached_property
    def _sources(self) -> NDArray[np.int64]:
        return np.repeat(np.arange(len(self.nodes)), np.diff(self._indptr))

    def hold(self, pose: Pose, transforms: NDArray[np.float64]) -> None:
        """Move the held rows by their handles' ``transforms``, (H, 4, 4), and turn them by the polar factors."""
        self._constraints.hold(pose, self.rest, transforms)

    def spread(self, pose: Pose, whole: Pose) -> None:
        """Write the free rows' positions and the turning rows' rotations to a pose of all nodes."""
        whole.positions[self.nodes[self.free_rows]] = pose.positions[self.free_rows]
        whole.rotations[self.nodes[self.turn_rows]] = pose.rotations[self.turn_rows]

    def fit_rotations(self, pose: Pose) -> None:
        """Local step: turn every row that may turn to its best rotation, one after the other."""
        fit_local_rotations(
            self._indptr,
            self._indices,
            self._weights,
            self.rest,
            pose.positions,
            self.turn_rows,
            self.beta,
            pose.rotations,
        )

    def place(self, pose: Pose) -> None:
        """Global step: move the free rows to the exact minimiser for the pose's rotations and held positions."""
        write_global_rhs(
            self._indptr, self._indices, self._weights, self.rest, pose.positions, pose.rotations,
            self.free_rows, self.is_free, self._rhs,
        )  # fmt: skip
        pose.positions[self.free_rows] = self.position_factor.solve(self._rhs)

    def energy(self, pose: Pose, torques: NDArray[np.float64] | None = None) -> float:
        """Energy of a pose; ``torques``, (len(turn_rows), 3), takes its derivative by small rotation vectors."""
        if torques is None:
            torques = np.empty((len(self.turn_rows), 3))
        return energy_and_torques(
            self._indptr, self._indices, self._weights, self.rest, pose.positions, pose.rotations,
            self._turn_index, self.beta, torques,
        )  # fmt: skip

    def turned(self, pose: Pose, vectors: NDArray[np.float64], step: float, out: Pose) -> None:
        """Write the pose turned by ``step · vectors`` (rotation vectors of the turning rows) to ``out``'s rotations."""
        turn(pose.rotations, self.turn_rows, vectors, step, out.rotations)
