"""As-rigid-as-possible deformation by the published iterations, for comparison: our own, and libigl's."""

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.arap.arap import ArapDeformer, SolveReport
from splap_editor.core.arap.libigl_arap import libigl_arap, triangle_components
from splap_editor.core.arap.problem import Pose
from splap_editor.core.deformer import Deformation, Shown
from splap_editor.core.progress import Progress, no_progress


class LocalGlobalArap(ArapDeformer):
    """Exactly ``iterations`` plain local/global iterations of the spokes energy."""

    def solve(
        self, transforms: NDArray[np.float64], *, progress: Progress = no_progress, shown: Shown | None = None
    ) -> Deformation:
        """Iterate from rest with the held nodes moved; ``residual`` is unknown, inf, and nothing is shown meanwhile."""
        transforms = self._checked(transforms)
        pose = self._held_pose(transforms)
        problem = self.problem
        rows = Pose.of_rest(problem.rest)
        problem.hold(rows, transforms)
        report = SolveReport(progress)
        for iteration in range(self.options.iterations):
            report.tell(iteration / self.options.iterations)
            problem.fit_rotations(rows)
            problem.place(rows)
        problem.fit_rotations(rows)
        problem.spread(rows, pose)
        return self._settled(pose, np.inf, self.options.iterations)


class LibiglArap(ArapDeformer):
    """The same number of iterations by libigl, on the triangles, without which there is a ValueError."""

    def _components(self) -> NDArray[np.int32]:
        if self._triangles is None:
            raise ValueError("libigl needs triangles")
        return triangle_components(self._triangles, len(self.rest))

    def solve(
        self, transforms: NDArray[np.float64], *, progress: Progress = no_progress, shown: Shown | None = None
    ) -> Deformation:
        """The reference's positions, with rotations fitted to them; it reports nothing on the way."""
        transforms = self._checked(transforms)
        pose = self._held_pose(transforms)
        if self._triangles is None:
            raise ValueError("libigl needs triangles")
        placed = self._constraints.free
        moved = libigl_arap(self.rest, self._triangles, self._constraints, pose.positions, self.options.iterations)
        pose.positions[placed] = moved[placed]
        problem = self.problem
        rows = Pose(pose.positions[problem.nodes], pose.rotations[problem.nodes])
        problem.fit_rotations(rows)
        problem.spread(rows, pose)
        return self._settled(pose, np.inf, self.options.iterations)
