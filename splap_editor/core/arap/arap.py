"""As-rigid-as-possible deformation: which nodes are held goes to the constructor, where they are to `solve`."""

import time
from collections.abc import Callable
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from splap_editor.core.arap.coarse import CoarseArap
from splap_editor.core.arap.handle_motion import turns_left_open
from splap_editor.core.arap.minimiser import ArapMinimiser, approached
from splap_editor.core.arap.options import ArapOptions
from splap_editor.core.arap.problem import ArapProblem, Constraints, Pose
from splap_editor.core.arap.rigid_parts import LooseParts, RigidComponents
from splap_editor.core.arap.scene import ArapScene
from splap_editor.core.arap.settled_offset import SettledOffset
from splap_editor.core.deformer import FREE, Deformation, Handles, UnconstrainedComponentError
from splap_editor.core.graph.splat_graph import SplatGraph
from splap_editor.core.progress import Progress, no_progress

MAX_ITERATIONS = 1000
"""Accelerated iterations after which a solve gives what it has, with its honest residual."""

_COARSE_TOLERANCE = 1e-3
"""How well the coarse model is settled before the full one starts from it, in units of the scene scale."""

_DRAG_ITERATIONS = 8
_DRAG_TOLERANCE = 5e-4
"""A drag frame stops after so many iterations, or when one moves no node by more than this (units of s). What is left
is made up in the frames that follow."""

REPORT_SECONDS = 0.1


class ArapDeformer:
    """As-rigid-as-possible deformation of one scene by one handle set: what all its solvers share, and the drag.

    Only free nodes and the held ones beside them are touched. With a smooth-rotation term a handle gives its nodes a
    rotation as well as a position, and so does a pin with another constrained node beside it; a single pinned node is
    a pivot. Without it rotations are free as in the paper, except where a handle's node positions do not say how it is
    turned. A component in which nothing is held follows the held ones nearest to it in space, as one rigid body.

    Solvers are classes of their own, see `ARAP_SOLVERS`.

    Parameters
    ----------
    rest : (n, 3) float64
        Rest positions of the nodes.
    L : (n, n) scipy csr, float64
        Symmetric positive semidefinite Laplacian with zero row sums; ``w_ij = -L_ij``.
    handles : Handles
        What is held; at least one node.
    scene_scale : float
        Scene scale s in world units.
    M : (n,) float64
        Area of each node in world units squared; only the sum counts.
    graph : SplatGraph
        Along which the coarse model for dragging is sampled.
    triangles : (T, 3) int, optional
        Needed by `LibiglArap` alone.
    options : ArapOptions
        How to solve; its ``kind`` does not matter here.
    scene : ArapScene, optional
        What all handle sets of a scene share; made here if not given.
    progress : Progress
        Told about the binding.

    Raises
    ------
    ValueError
        If the shapes do not fit.
    UnconstrainedComponentError
        If no node is held.
    """

    def __init__(
        self,
        rest: NDArray[np.float64],
        L: sp.csr_matrix,
        handles: Handles,
        *,
        scene_scale: float,
        M: NDArray[np.float64],
        graph: SplatGraph,
        triangles: NDArray[np.integer] | None = None,
        options: ArapOptions = ArapOptions(),
        scene: ArapScene | None = None,
        progress: Progress = no_progress,
    ) -> None:
        n = len(rest)
        if L.shape != (n, n) or np.shape(M) != (n,):
            raise ValueError(f"L and M must have shapes ({n}, {n}) and ({n},), got {L.shape} and {np.shape(M)}")
        if len(handles.indices) == 0:
            raise UnconstrainedComponentError("nothing is held: add a handle or a pin")
        self.options = options
        self.handles = handles
        self.scene_scale = float(scene_scale)
        self.scene = ArapScene(rest, L, graph) if scene is None else scene
        self.rest = self.scene.rest
        self._triangles = triangles
        self._beta = self._smoothing(float(np.sum(M)))
        self._constraints = self._bound()
        self._rigid = RigidComponents(self.rest, self._constraints, self.scene_scale)
        self._loose = LooseParts(self.rest, self._constraints)
        self._dragged: ArapMinimiser | None = None
        self._offset: SettledOffset | None = None
        progress(1.0)

    def _smoothing(self, area: float) -> float:
        """Weight of the smooth-rotation term between two nodes; 0 for the plain spokes energy."""
        return 0.0

    def _components(self) -> NDArray[np.int32]:
        """(n,) component of each node."""
        return self.scene.component

    def _bound(self) -> Constraints:
        """Which nodes are held, and which of them have their rotation given."""
        handles = self.handles
        labels = np.full(len(self.rest), FREE, np.int32)
        labels[handles.indices] = handles.labels
        # A pin by itself is a pivot, about which its splat turns.
        resting = handles.resting(len(labels))
        pins = np.flatnonzero(resting)
        resting[pins] = self.scene.W[pins] @ (labels != FREE).astype(np.float64) != 0.0
        self._resting = resting
        clamped = np.zeros(len(labels), bool)
        if self._beta > 0.0:
            clamped[labels >= 0] = True
            clamped |= resting
        else:
            moving = labels >= 0
            clamped[moving] = turns_left_open(handles, self.rest)[labels[moving]]
        return Constraints(labels, clamped, self._components())

    @cached_property
    def problem(self) -> ArapProblem:
        """The minimisation over all nodes that have to be known."""
        return ArapProblem(self.rest, self.scene.W, self._constraints, self._beta)

    @cached_property
    def _coarse(self) -> CoarseArap | None:
        model = self.scene.coarse
        return None if model is None else CoarseArap(model, self._constraints, self.scene.graph, self._beta)

    @cached_property
    def _rest_pose(self) -> Pose:
        return Pose.of_rest(self.rest)

    def drag(self, transforms: NDArray[np.float64]) -> Deformation:
        """Deform quickly for the frame of a drag, continuing from the frame before.

        Parameters
        ----------
        transforms : (H, 4, 4) float64
            World transform of each handle, rest → moved.

        Returns
        -------
        Deformation
            Constrained nodes exactly in place, the others close to the settled result; ``residual`` is unknown, inf,
            unless everything moves rigidly.

        Raises
        ------
        ValueError
            If the transforms are not (H, 4, 4) finite affine maps.
        """
        transforms = self._checked(transforms)
        pose = self._held_pose(transforms)
        if self._rigid.follow(transforms, pose):
            return self._settled(pose)
        if self._dragged is None:
            self._dragged = self._approached(transforms, no_progress)
        else:
            self._dragged.problem.hold(self._dragged.pose, transforms)
            self._dragged.restart()
        before = self._dragged.n_iterations
        for _ in range(_DRAG_ITERATIONS):
            if not self._dragged.iterate() or self._dragged.last_move <= _DRAG_TOLERANCE * self.scene_scale:
                break
        self._spread(self._dragged, transforms, pose)
        if self._offset is not None:
            self._offset.add(transforms, pose)
        return self._finished(pose, transforms, np.inf, self._dragged.n_iterations - before)

    def _approached(self, transforms: NDArray[np.float64], progress: Progress) -> ArapMinimiser:
        """The drag's minimiser, brought from rest to ``transforms``; the coarse one where there is one."""
        report = SolveReport(progress)
        problem = self.problem if self._coarse is None else self._coarse.problem
        minimiser = approached(problem, self.handles, transforms, self.scene_scale, report)
        if self._coarse is not None:
            minimiser.settle(_COARSE_TOLERANCE * self.scene_scale, MAX_ITERATIONS, report)
        return minimiser

    def _spread(self, dragged: ArapMinimiser, transforms: NDArray[np.float64], whole: Pose) -> None:
        """Bring a drag's minimiser's pose to all free nodes."""
        if self._coarse is None:
            self.problem.spread(dragged.pose, whole)
        else:
            self._coarse.spread(dragged.pose, transforms, self.rest, whole)

    def _checked(self, transforms: NDArray[np.float64]) -> NDArray[np.float64]:
        transforms = np.asarray(transforms, np.float64)
        shape = (self.handles.n_handles, 4, 4)
        if transforms.shape != shape or not np.isfinite(transforms).all():
            raise ValueError(f"transforms must be finite and have shape {shape}, got {transforms.shape}")
        return transforms

    def _held_pose(self, transforms: NDArray[np.float64]) -> Pose:
        """Every node at rest but the handles' own, which are in place."""
        pose = self._rest_pose.copy()
        self._constraints.hold(pose, self.rest, transforms)
        return pose

    def _finished(self, pose: Pose, transforms: NDArray[np.float64], residual: float, n_iterations: int) -> Deformation:
        self._rigid.follow(transforms, pose)
        return self._settled(pose, residual, n_iterations)

    def _settled(self, pose: Pose, residual: float = 0.0, n_iterations: int = 0) -> Deformation:
        """What a pose of all that is held together is; loose parts follow it."""
        self._loose.follow(pose)
        return Deformation(pose.positions, pose.rotations, residual, n_iterations, self._resting)


class SolveReport:
    """Tells progress and shows intermediate results, at most ten times a second."""

    def __init__(
        self,
        progress: Progress,
        minimiser: ArapMinimiser | None = None,
        tolerance: float = 0.0,
        show: Callable[[], None] | None = None,
    ) -> None:
        self._progress = progress
        self._minimiser = minimiser
        self._tolerance = tolerance
        self._show = show
        self._first: float | None = None
        self._share = 0.0
        self._last = time.monotonic()

    def __call__(self) -> None:
        """Report on the minimiser, by how many of the digits still missing at first have been found."""
        share = self._share
        if self._minimiser is not None:
            distance = self._minimiser.distance
            if self._first is None and np.isfinite(distance):
                self._first = distance
            if self._first is not None and self._first > self._tolerance and distance > 0.0:
                share = np.log(self._first / distance) / np.log(self._first / self._tolerance)
        if self.tell(min(max(float(share), self._share), 1.0)) and self._show is not None:
            self._show()

    def tell(self, share: float) -> bool:
        """Report a share; False if the last report was too recent."""
        self._share = share
        if time.monotonic() - self._last < REPORT_SECONDS:
            return False
        self._progress(share)
        self._last = time.monotonic()
        return True
