"""Accelerated minimisation of the as-rigid-as-possible energy."""

from collections import deque
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.blas import daxpy, ddot

from splap_editor.core.arap.handle_motion import eased_transforms, n_easy_stops
from splap_editor.core.arap.problem import ArapProblem, Pose
from splap_editor.core.deformer import Handles

MEMORY = 8
"""Number of past steps the quasi-Newton direction learns from."""

_SPAN = 8
"""Iterations over which the contraction is measured; single steps are erratic."""

_CONTRACTIONS = (0.5, 0.97)
"""Contractions outside these are not believed: short runs of luck, or a plateau that may end."""

_SAFETY = 2.0
"""Factor on the extrapolated distance. With it, runs on thin strips, plates and closed surfaces stopped within 3.2
times the tolerance of the minimiser (median 0.35)."""

_LARGEST_TURN = 0.5
"""No iteration turns a row by more than this, in radians: beyond it the quadratic model means nothing."""

_STOP_TOLERANCE = 0.01
_STOP_ITERATIONS = 12
"""How well a pose on the way of a large motion is settled, in units of the scene scale, and the most it may cost."""


class ArapMinimiser:
    """Limited-memory quasi-Newton descent over rotations, positions eliminated.

    For given rotations the best positions are one linear solve away, so the energy is minimised over rotations
    alone, as a function on SO(3)^k. Its Hessian is close to the problem's turn factor for short waves; the step
    memory learns the long ones, for which plain local/global alternation takes thousands of iterations.

    Parameters
    ----------
    problem : ArapProblem
        The problem; its factors are made here unless they exist.
    pose : Pose
        Start; held positions and given rotations already in place. Changed in place.
    """

    def __init__(self, problem: ArapProblem, pose: Pose) -> None:
        self.problem = problem
        self.pose = pose
        self._steps: deque[NDArray[np.float64]] = deque(maxlen=MEMORY)
        self._changes: deque[NDArray[np.float64]] = deque(maxlen=MEMORY)
        self._torques = np.zeros((len(problem.turn_rows), 3))
        self._trial_torques = np.zeros_like(self._torques)
        self.n_iterations = 0
        self.restart()

    @property
    def last_move(self) -> float:
        """Largest distance that the last iteration moved a node, world units; inf before the first."""
        return self._moves[-1] if self._moves else np.inf

    @property
    def distance(self) -> float:
        """Estimated largest distance of a node from the minimiser, world units; inf before there is anything to tell.

        The last step alone is too optimistic: its geometric series is summed, with the contraction seen over the last
        iterations.
        """
        moves = self._moves
        if len(moves) < 4:
            return np.inf
        span = min(_SPAN, len(moves) - 1)
        last = max(moves[-3:])
        earlier = max(moves[max(0, len(moves) - span - 3) : len(moves) - span])
        contraction = (last / max(earlier, 1e-300)) ** (1.0 / span)
        contraction = min(max(contraction, _CONTRACTIONS[0]), _CONTRACTIONS[1])
        return _SAFETY * last * contraction / (1.0 - contraction)

    def restart(self) -> None:
        """Take up a pose whose held rows were moved from outside, keeping what was learned of the curvature."""
        self.problem.place(self.pose)
        self._trial = self.pose.copy()
        self.energy = self.problem.energy(self.pose, self._torques)
        self._moves: list[float] = []

    def settle(self, tolerance: float, max_iterations: int, report: Callable[[], None]) -> float:
        """Iterate until the estimated distance from the minimiser is within ``tolerance``, in world units.

        ``report`` is called after every iteration. Returns the estimated distance; 0 at a minimum within rounding.
        """
        was_within = False
        for _ in range(max_iterations):
            if not self.iterate():
                return 0.0
            report()
            is_within = self.distance <= tolerance
            if was_within and is_within:
                break
            was_within = is_within
        return self.distance

    def iterate(self) -> bool:
        """One accelerated iteration; the energy never rises. False if no step lowers it: a minimum within rounding."""
        direction = self._direction()
        slope = ddot(direction.ravel(), self._torques.ravel())
        if not slope < 0.0:
            self._forget()
            direction = -self.problem.turn_factor.solve(self._torques)
            slope = ddot(direction.ravel(), self._torques.ravel())
        step = min(1.0, _LARGEST_TURN / max(np.abs(direction).max(initial=0.0), 1e-300))
        for _ in range(12):
            self.problem.turned(self.pose, direction, step, self._trial)
            self.problem.place(self._trial)
            energy = self.problem.energy(self._trial, self._trial_torques)
            if energy <= self.energy + 1e-4 * step * slope:
                break
            step *= 0.4
        else:
            if not self._steps:
                return False
            self._forget()
            return self.iterate()
        self._remember(step * direction, self._trial_torques - self._torques)
        self._moves.append(float(np.sqrt(np.square(self._trial.positions - self.pose.positions).sum(axis=1).max())))
        self.pose.positions, self._trial.positions = self._trial.positions, self.pose.positions
        self.pose.rotations, self._trial.rotations = self._trial.rotations, self.pose.rotations
        self._torques, self._trial_torques = self._trial_torques, self._torques
        self.energy = energy
        self.n_iterations += 1
        return True

    def _direction(self) -> NDArray[np.float64]:
        """Descent direction by the two-loop recursion on the preconditioned memory."""
        q = self._torques.ravel().copy()
        shares = []
        for s, y in zip(reversed(self._steps), reversed(self._changes), strict=True):
            share = ddot(s, q) / ddot(s, y)
            daxpy(y, q, a=-share)
            shares.append(share)
        r = self.problem.turn_factor.solve(q.reshape(-1, 3)).ravel()
        for s, y, share in zip(self._steps, self._changes, reversed(shares), strict=True):
            daxpy(s, r, a=share - ddot(y, r) / ddot(s, y))
        return -r.reshape(-1, 3)

    def _remember(self, step: NDArray[np.float64], change: NDArray[np.float64]) -> None:
        s, y = step.ravel(), change.ravel()
        if ddot(s, y) > 1e-10 * np.sqrt(ddot(s, s) * ddot(y, y)):
            self._steps.append(s)
            self._changes.append(y)

    def _forget(self) -> None:
        self._steps.clear()
        self._changes.clear()


def approached(
    problem: ArapProblem,
    handles: Handles,
    transforms: NDArray[np.float64],
    scene_scale: float,
    report: Callable[[], None],
) -> ArapMinimiser:
    """Minimiser that has come from rest to ``transforms`` with a few stops on the way, ready to settle.

    Going there at one bound can end in another, more twisted minimum. The way depends on ``transforms`` alone.
    """
    pose = Pose.of_rest(problem.rest)
    n_stops = n_easy_stops(handles, transforms, scene_scale)
    problem.hold(pose, eased_transforms(handles, transforms, 1.0 / n_stops))
    minimiser = ArapMinimiser(problem, pose)
    for stop in range(2, n_stops + 1):
        minimiser.settle(_STOP_TOLERANCE * scene_scale, _STOP_ITERATIONS, report)
        problem.hold(minimiser.pose, eased_transforms(handles, transforms, stop / n_stops))
        minimiser.restart()
    return minimiser
