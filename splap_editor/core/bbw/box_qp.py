"""Convex quadratic programs with bounds on every unknown, by an active set that changes its mind gradually."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from splap_editor.core.linear_solvers import SpdFactor
from splap_editor.core.progress import Progress, no_progress

# Only unknowns that violate their bound by more than this share of the worst violation are put on it. Putting all of
# them there at once, as the plain method does, overshoots on biharmonic energies: the set then swings between far too
# large and far too small for dozens of factorisations. One half makes the violation fall about twofold a step.
ACTIVATION_SHARE = 0.5

# A held pocket is let go one layer a factorisation, since only its rim feels a pull; layers that hang on by weak links
# move so little that the steps can fall below the tolerance before the pocket is open. Once so many factorisations in
# a row have done nothing but let go (violations this share of the tolerance or less), the start held too much, and
# it is cheaper and safer to begin again with everything free.
STALLED_FACTORISATIONS = 3
STALLED_SHARE = 0.05

# Deep inside a wrongly held pocket there is no pull at all. Before small steps are believed, all that is not clearly
# held (one coordinate step would not leave the box by so much) is let go once.
CLEARLY_HELD = 1e-9


@dataclass(frozen=True)
class BoxQpReport:
    """How good a bounded solution is, and what it took.

    Parameters
    ----------
    kkt_residual : float
        ``max |w - clip(w - g / diag(A), lower, upper)|`` with the gradient ``g = A w + c``: how far one
        coordinate step would still move an unknown, in the unit of ``w``. Zero at the optimum alone.
    bound_violation : float
        Largest violation of a bound before roundoff and what the tolerance allows were projected away.
    n_factorisations : int
        Sparse factorisations spent by the active set.
    fallback : bool
        Whether the active set did not settle and the interior-point solver gave the result.
    """

    kkt_residual: float
    bound_violation: float
    n_factorisations: int
    fallback: bool


@dataclass(frozen=True, eq=False)
class BoxQpSolution:
    """Minimiser of a bounded quadratic program.

    Parameters
    ----------
    w : (n,) float64
        The minimiser; never outside its bounds.
    multipliers : (n,) float64
        Gradient ``A w + c``: ≥ 0 at a lower bound, ≤ 0 at an upper one, 0 between, up to the residual.
    active : (n,) int8
        -1 at the lower bound, 1 at the upper, 0 between.
    report : BoxQpReport
    """

    w: NDArray[np.float64]
    multipliers: NDArray[np.float64]
    active: NDArray[np.int8]
    report: BoxQpReport


def box_qp(
    A: sp.csr_array | sp.csr_matrix,
    c: NDArray[np.float64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    *,
    start: NDArray[np.int8] | None = None,
    tolerance: float = 1e-9,
    max_factorisations: int = 60,
    progress: Progress = no_progress,
) -> BoxQpSolution:
    """Minimise ``½ wᵀA w + cᵀw`` over ``lower ≤ w ≤ upper``.

    A primal-dual active set [1]_: solve with the active unknowns held on their bounds, let go of those that
    their multiplier pulls inwards, hold those that left the box, repeat. It stops when the set repeats itself, or
    when both the last step and the bound violation are within ``tolerance`` (a small violation alone says nothing: a
    set that holds far too many unknowns violates no bound). A start that turns out to hold too much is dropped once,
    in favour of all free. Past ``max_factorisations`` the interior-point solver
    piqp takes over, and the report says so.

    Parameters
    ----------
    A : (n, n) sparse float64
        Symmetric positive definite, both triangles stored.
    c : (n,) float64
    lower, upper : (n,) float64
        Finite bounds, ``lower ≤ upper``.
    start : (n,) int8, optional
        Active set to begin with, as in `BoxQpSolution`; a good one saves most factorisations. All free if None.
    tolerance : float
        Largest change of ``w`` and largest violation at which to stop, in the unit of ``w``. What is left of the
        violation is projected away, so the bounds hold exactly.
    max_factorisations : int
        Factorisations before the fallback; 0 goes straight to it.
    progress : Progress
        Called once per factorisation; may cancel.

    Returns
    -------
    BoxQpSolution

    Raises
    ------
    ValueError
        If shapes disagree or a lower bound exceeds its upper bound.

    References
    ----------
    .. [1] Hintermüller, Ito and Kunisch, "The Primal-Dual Active Set Strategy as a Semismooth Newton Method",
       SIAM J. Optim. 13(3), 2002, Sec. 2.
    """
    n = len(c)
    if A.shape != (n, n) or len(lower) != n or len(upper) != n or (start is not None and len(start) != n):
        raise ValueError(f"A, c, lower, upper and start must agree, got {A.shape}, {n}, {len(lower)}, {len(upper)}")
    if not np.all(lower <= upper):
        raise ValueError("lower must not exceed upper")
    if n == 0:
        empty = np.zeros(0)
        return BoxQpSolution(empty, empty, np.zeros(0, np.int8), BoxQpReport(0.0, 0.0, 0, False))
    # Biharmonic energies scale with length⁻²; both solvers prefer a diagonal around one.
    scale = A.diagonal().mean()
    A, c = sp.csr_array(A) / scale, c / scale
    w, n_factorisations, settled = _active_set_minimiser(
        A, c, lower, upper, start, tolerance, max_factorisations, progress
    )
    if not settled:
        w = _interior_point_minimiser(A, c, lower, upper)
    violation = max(0.0, float(np.max(lower - w)), float(np.max(w - upper)))
    w = np.clip(w, lower, upper)
    gradient = A @ w + c
    residual = np.abs(w - np.clip(w - gradient / A.diagonal(), lower, upper)).max()
    active = np.where(w <= lower, -1, np.where(w >= upper, 1, 0)).astype(np.int8)
    report = BoxQpReport(float(residual), violation, n_factorisations, not settled)
    return BoxQpSolution(w, gradient * scale, active, report)


def _active_set_minimiser(A, c, lower, upper, start, tolerance, max_factorisations, progress):
    """Run the active set; returns the last iterate, the factorisations spent and whether it settled."""
    active = np.zeros(len(c), np.int8) if start is None else start.astype(np.int8)
    w = previous = None
    diagonal = A.diagonal()
    # All free is no guess that could hold too much.
    was_checked = not active.any()
    n_stalled = 0 if active.any() else -max_factorisations
    for k in range(max_factorisations):
        progress(1.0 - 0.8**k)
        held = np.where(active < 0, lower, np.where(active > 0, upper, 0.0))
        free = np.flatnonzero(active == 0)
        w = held
        if len(free):
            rows = A[free]
            w[free] = SpdFactor(rows[:, free]).solve(-(c[free] + rows @ held))
        step = np.inf if previous is None else np.abs(w - previous).max()
        previous = w
        outside = np.maximum(lower - w, w - upper)
        violation = max(0.0, outside.max())
        gradient = A @ w + c
        gradient[free] = 0.0
        settled = np.where(active * gradient > 0, 0, active)
        leaving = (outside > 0) & (outside >= ACTIVATION_SHARE * violation) & (active == 0)
        settled = np.where(leaving, np.where(w < lower, -1, 1), settled).astype(np.int8)
        if np.array_equal(settled, active):
            return w, k + 1, True
        if step <= tolerance and violation <= tolerance:
            clearly_held = np.where(active * gradient < -CLEARLY_HELD * diagonal, active, 0).astype(np.int8)
            if was_checked or np.array_equal(clearly_held, active):
                return w, k + 1, True
            was_checked = True
            active = clearly_held
            continue
        n_stalled = n_stalled + 1 if n_stalled < 0 or violation <= STALLED_SHARE * tolerance else 0
        if n_stalled == STALLED_FACTORISATIONS and k < max_factorisations // 3:
            settled = np.zeros_like(active)
            n_stalled = -max_factorisations
        active = settled
    return w, max_factorisations, False


def _interior_point_minimiser(A, c, lower, upper):
    """Minimiser by piqp, for sets that will not settle."""
    import piqp

    solver = piqp.SparseSolver()
    solver.settings.eps_abs = solver.settings.eps_rel = 1e-11
    solver.settings.max_iter = 200
    solver.setup(sp.csc_matrix(A), c, x_l=np.ascontiguousarray(lower), x_u=np.ascontiguousarray(upper))
    solver.solve()
    w = np.array(solver.result.x)
    if not np.isfinite(w).all():
        raise ArithmeticError("the bounded quadratic program has no finite minimiser: A is not positive definite")
    return w
