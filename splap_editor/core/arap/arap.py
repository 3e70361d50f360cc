"""As-rigid-as-possible deformation: which nodes are held goes to the constructor, where they are to `solve`."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from splap_editor.core.arap.coarse import CoarseArap
from splap_editor.core.arap.handle_motion import turns_left_open
from splap_editor.core.arap.libigl_arap import libigl_arap, triangle_components
from splap_editor.core.arap.minimiser import ArapMinimiser, approached
from splap_editor.core.arap.problem import FREE, ArapProblem, Constraints, Pose
from splap_editor.core.arap.rigid_parts import LooseParts, RigidComponents
from splap_editor.core.arap.scene import ArapScene
from splap_editor.core.arap.settled_offset import SettledOffset
from splap_editor.core.deformer import Deformation, Handles, Shown, UnconstrainedComponentError
from splap_editor.core.graph.splat_graph import SplatGraph
from splap_editor.core.progress import Progress, no_progress, part_of

_MAX_ITERATIONS = 1000
"""Accelerated iterations after which a solve gives what it has, with its honest residual."""

_COARSE_TOLERANCE = 1e-3
"""How well the coarse model is settled before the full one starts from it, in units of the scene scale."""

_DRAG_ITERATIONS = 8
_DRAG_TOLERANCE = 5e-4
"""A drag frame stops after so many iterations, or when one moves no node by more than this (units of s). What is left
is made up in the frames that follow."""

_REPORT_SECONDS = 0.1


@dataclass(frozen=True)
class ArapOptions:
    """How as-rigid-as-possible deformation is solved.

    Parameters
    ----------
    kind : str
        "converged" runs an accelerated solver to the minimiser of the smooth-rotation energy; "local-global" exactly
        ``iterations`` plain iterations of the spokes energy from the rest pose with the handles moved; "libigl" the
        same by libigl, on the triangles.
    tolerance : float
        Largest distance of a node from the minimiser, in units of the scene scale. "converged" only.
    iterations : int
        Iterations of the two plain kinds.
    smoothness : float
        α of the smooth-rotation term ``α A Σ w_ij |R_i - R_j|²``, A the total area: it makes the result depend on the
        shape rather than on how densely it is sampled. 0 gives the plain spokes energy. "converged" only.
    """

    kind: Literal["converged", "local-global", "libigl"] = "converged"
    tolerance: float = 1e-4
    iterations: int = 10
    smoothness: float = 0.001

    def __post_init__(self) -> None:
        if self.kind not in ("converged", "local-global", "libigl"):
            raise ValueError(f"kind must be 'converged', 'local-global' or 'libigl', got {self.kind!r}")
        if not self.tolerance > 0:
            raise ValueError(f"tolerance must be positive, got {self.tolerance}")
        if self.iterations < 1:
            raise ValueError(f"iterations must be at least 1, got {self.iterations}")
        if not self.smoothness >= 0:
            raise ValueError(f"smoothness must not be negative, got {self.smoothness}")


class ArapDeformer:
    """As-rigid-as-possible deformation of one scene by one handle set.

    Only free nodes and the held ones beside them are touched. Under "converged" a handle gives its nodes a rotation
    as well as a position, and so does a pin with another constrained node beside it; a single pinned node is a pivot.
    Under the plain kinds rotations are free as in the paper, except where a handle's node positions do not say how it
    is turned. A component in which nothing is held follows the held ones nearest to it in space, as one rigid body.
    One in which all constraints move by one rigid motion makes exactly that motion ("converged" only).

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
        Needed by kind "libigl" alone.
    options : ArapOptions
        How to solve.
    scene : ArapScene, optional
        What all handle sets of a scene share; made here if not given.
    progress : Progress
        Told about the binding.

    Raises
    ------
    ValueError
        If the shapes do not fit, or kind "libigl" comes without triangles.
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
        if options.kind == "libigl" and triangles is None:
            raise ValueError("kind 'libigl' needs triangles")
        self.options = options
        self.handles = handles
        self.scene_scale = float(scene_scale)
        self.scene = ArapScene(rest, L, graph) if scene is None else scene
        self.rest = self.scene.rest
        self._beta = 2.0 * options.smoothness * float(np.sum(M)) if options.kind == "converged" else 0.0
        self._constraints = self._bound(triangles)
        self._rigid = RigidComponents(self.rest, self._constraints, self.scene_scale)
        self._loose = LooseParts(self.rest, self._constraints)
        self._triangles = triangles
        self._dragged: ArapMinimiser | None = None
        self._offset: SettledOffset | None = None
        progress(1.0)

    def _bound(self, triangles: NDArray[np.integer] | None) -> Constraints:
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
        if self.options.kind == "libigl":
            return Constraints(labels, clamped, triangle_components(triangles, len(labels)))
        return Constraints(labels, clamped, self.scene.component)

    @cached_property
    def _problem(self) -> ArapProblem:
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
            self._loose.follow(pose)
            return Deformation(pose.positions, pose.rotations, resting=self._resting)
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

    def solve(
        self, transforms: NDArray[np.float64], *, progress: Progress = no_progress, shown: Shown | None = None
    ) -> Deformation:
        """Deform to the settled result, which depends on ``transforms`` alone and not on earlier calls.

        Parameters
        ----------
        transforms : (H, 4, 4) float64
            World transform of each handle, rest → moved.
        progress : Progress
            Told about ten times a second; cancelling leaves the deformer as it was.
        shown : callable, optional
            Given intermediate results about ten times a second ("converged" only).

        Returns
        -------
        Deformation
            ``residual`` estimates the distance from the minimiser, unknown (inf) for the plain kinds; it exceeds the
            tolerance if the solver ran out of iterations.

        Raises
        ------
        ValueError
            If the transforms are not (H, 4, 4) finite affine maps.
        """
        transforms = self._checked(transforms)
        pose = self._held_pose(transforms)
        if self.options.kind == "libigl":
            return self._by_libigl(transforms, pose)
        if self.options.kind == "local-global":
            return self._by_alternation(transforms, pose, progress)
        if self._rigid.follow(transforms, pose):
            self._loose.follow(pose)
            return Deformation(pose.positions, pose.rotations, resting=self._resting)
        dragged = self._approached(transforms, part_of(progress, 0.0, 0.3))
        start = self._held_pose(transforms)
        self._spread(dragged, transforms, start)
        problem = self._problem
        minimiser = ArapMinimiser(problem, Pose(start.positions[problem.nodes], start.rotations[problem.nodes]))

        def settled(residual: float) -> Deformation:
            whole = self._held_pose(transforms)
            problem.spread(minimiser.pose, whole)
            return self._finished(whole, transforms, residual, minimiser.n_iterations)

        tolerance = self.options.tolerance * self.scene_scale
        report = _Report(part_of(progress, 0.3, 1.0), minimiser, tolerance, shown and (lambda: shown(settled(np.inf))))
        residual = minimiser.settle(tolerance, _MAX_ITERATIONS, report)
        result = settled(residual / self.scene_scale)
        # The next drag goes on from here.
        if self._coarse is None:
            self._dragged = minimiser
        else:
            self._dragged = dragged
            end = Pose(result.positions, result.rotations)
            self._offset = SettledOffset(self.rest, np.flatnonzero(self._constraints.free), start, end, transforms)
        return result

    def _approached(self, transforms: NDArray[np.float64], progress: Progress) -> ArapMinimiser:
        """The drag's minimiser, brought from rest to ``transforms``; the coarse one where there is one."""
        report = _Report(progress)
        problem = self._problem if self._coarse is None else self._coarse.problem
        minimiser = approached(problem, self.handles, transforms, self.scene_scale, report)
        if self._coarse is not None:
            minimiser.settle(_COARSE_TOLERANCE * self.scene_scale, _MAX_ITERATIONS, report)
        return minimiser

    def _spread(self, dragged: ArapMinimiser, transforms: NDArray[np.float64], whole: Pose) -> None:
        """Bring a drag's minimiser's pose to all free nodes."""
        if self._coarse is None:
            self._problem.spread(dragged.pose, whole)
        else:
            self._coarse.spread(dragged.pose, transforms, self.rest, whole)

    def _by_alternation(self, transforms: NDArray[np.float64], pose: Pose, progress: Progress) -> Deformation:
        """Plain local/global iterations from rest with the held nodes moved."""
        problem = self._problem
        rows = Pose.of_rest(problem.rest)
        problem.hold(rows, transforms)
        report = _Report(progress)
        for iteration in range(self.options.iterations):
            report.tell(iteration / self.options.iterations)
            problem.fit_rotations(rows)
            problem.place(rows)
        problem.fit_rotations(rows)
        problem.spread(rows, pose)
        self._loose.follow(pose)
        return Deformation(pose.positions, pose.rotations, np.inf, self.options.iterations, self._resting)

    def _by_libigl(self, transforms: NDArray[np.float64], pose: Pose) -> Deformation:
        """The reference implementation's positions, with rotations fitted to them."""
        placed = self._constraints.free
        moved = libigl_arap(self.rest, self._triangles, self._constraints, pose.positions, self.options.iterations)
        pose.positions[placed] = moved[placed]
        problem = self._problem
        rows = Pose(pose.positions[problem.nodes], pose.rotations[problem.nodes])
        problem.fit_rotations(rows)
        problem.spread(rows, pose)
        self._loose.follow(pose)
        return Deformation(pose.positions, pose.rotations, np.inf, self.options.iterations, self._resting)

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
        self._loose.follow(pose)
        return Deformation(pose.positions, pose.rotations, residual, n_iterations, self._resting)


class _Report:
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
        if time.monotonic() - self._last < _REPORT_SECONDS:
            return False
        self._progress(share)
        self._last = time.monotonic()
        return True
