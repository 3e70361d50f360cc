"""As-rigid-as-possible deformation solved to convergence: the settled shape, whatever the way to it."""

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.arap.arap import MAX_ITERATIONS, ArapDeformer, SolveReport
from splap_editor.core.arap.minimiser import ArapMinimiser
from splap_editor.core.arap.problem import Pose
from splap_editor.core.arap.settled_offset import SettledOffset
from splap_editor.core.deformer import Deformation, Shown
from splap_editor.core.progress import Progress, no_progress, part_of


class ConvergedArap(ArapDeformer):
    """The minimiser of the smooth-rotation energy, by an accelerated solver from a coarse model.

    A component in which all constraints move by one rigid motion makes exactly that motion.
    """

    def _smoothing(self, area: float) -> float:
        return 2.0 * self.options.smoothness * area

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
            Given intermediate results about ten times a second.

        Returns
        -------
        Deformation
            ``residual`` estimates the distance from the minimiser; it exceeds the tolerance if the solver ran out of
            iterations.

        Raises
        ------
        ValueError
            If the transforms are not (H, 4, 4) finite affine maps.
        """
        transforms = self._checked(transforms)
        pose = self._held_pose(transforms)
        if self._rigid.follow(transforms, pose):
            return self._settled(pose)
        dragged = self._approached(transforms, part_of(progress, 0.0, 0.3))
        start = self._held_pose(transforms)
        self._spread(dragged, transforms, start)
        problem = self.problem
        minimiser = ArapMinimiser(problem, Pose(start.positions[problem.nodes], start.rotations[problem.nodes]))

        def settled(residual: float) -> Deformation:
            """What the minimiser has come to, with what is held in its place."""
            whole = self._held_pose(transforms)
            problem.spread(minimiser.pose, whole)
            return self._finished(whole, transforms, residual, minimiser.n_iterations)

        tolerance = self.options.tolerance * self.scene_scale
        report = SolveReport(
            part_of(progress, 0.3, 1.0), minimiser, tolerance, shown and (lambda: shown(settled(np.inf)))
        )
        residual = minimiser.settle(tolerance, MAX_ITERATIONS, report)
        result = settled(residual / self.scene_scale)
        # The next drag goes on from here.
        if self._coarse is None:
            self._dragged = minimiser
        else:
            self._dragged = dragged
            end = Pose(result.positions, result.rotations)
            self._offset = SettledOffset(self.rest, np.flatnonzero(self._constraints.free), start, end, transforms)
        return result
