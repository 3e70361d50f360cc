"""Bounded biharmonic weights: how much of each handle's transform every node takes on."""

import time
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from splap_editor.core.bbw.box_qp import BoxQpReport, box_qp
from splap_editor.core.bbw.levels import Level, coarser_level, prolonged
from splap_editor.core.bbw.options import BbwOptions
from splap_editor.core.deformer import FREE, Handles
from splap_editor.core.index_spaces import Nodes
from splap_editor.core.progress import Progress, no_progress, part_of

CHEAP_UNKNOWNS = 10_000
"""So many take a few hundredths of a second to factorise."""


DEFAULT_OPTIONS = BbwOptions()


@dataclass(frozen=True, eq=False)
class BbwProblem:
    """What the weights of all handles have in common.

    Made by `bbw_problem`. Everything here is cropped to the union of the handles' cages with a margin.

    Parameters
    ----------
    handles : Handles
    levels : tuple of Level
        Finest first; ``levels[0].nodes`` are scene nodes, and so are the others'.
    energies : tuple of (n_l, n_l) sparse float64
        ``Lᵀ M⁻¹ L`` of each level.
    labels : (n,) int32
        Handle of each scene node, `PIN` and `FREE` for the others.
    in_cages : (H, n) bool
        Whether each scene node is no farther than the cage radius from the nearest node of each handle.
    components : (n,) int32
        Connected component of ``L`` of each scene node.
    rest : (n, 3) float64
        Rest positions in world units.
    options : BbwOptions
    """

    handles: Handles
    levels: tuple[Level, ...]
    energies: tuple[sp.csr_array, ...]
    labels: NDArray[np.int32]
    in_cages: NDArray[np.bool_]
    components: NDArray[np.int32]
    rest: NDArray[np.float64]
    options: BbwOptions


@dataclass(frozen=True, eq=False)
class HandleWeight:
    """The weight of one handle before the partition of unity.

    Parameters
    ----------
    nodes : (m,) int64
        Scene nodes with a weight above zero.
    values : (m,) float64
        Weights in 0..1.
    qp : BoxQpReport
        Of the finest level.
    n_unknowns : int
        Unknowns of the finest level.
    n_reached : int
        Unconstrained nodes with a weight that is not zero by construction.
    n_coarse_factorisations : int
        Factorisations on the coarser levels, all of them smaller.
    seconds : float
        Time spent.
    """

    nodes: Nodes
    values: NDArray[np.float64]
    qp: BoxQpReport
    n_unknowns: int
    n_reached: int
    n_coarse_factorisations: int
    seconds: float


def bbw_problem(
    rest: NDArray[np.float64],
    L: sp.csr_matrix,
    M: NDArray[np.float64],
    handles: Handles,
    *,
    options: BbwOptions = DEFAULT_OPTIONS,
    progress: Progress = no_progress,
) -> BbwProblem:
    """Prepare what the handles share: the cropped energy and its coarser levels.

    Parameters
    ----------
    rest : (n, 3) float64
        Rest positions in world units.
    L : (n, n) sparse float64
        Positive semidefinite Laplacian; zero rows for unconnected nodes are fine.
    M : (n,) float64
        Lumped masses; floored at ``options.mass_floor`` times the median of the positive ones.
    handles : Handles
    options : BbwOptions
    progress : Progress

    Returns
    -------
    BbwProblem

    Raises
    ------
    ValueError
        If shapes disagree or an index lies outside 0..n-1.
    """
    n = len(rest)
    _check_shapes(n, L, M, handles)
    L = sp.csr_array(L)
    labels = np.full(n, FREE, np.int32)
    labels[handles.indices] = handles.labels
    positive = M[M > 0]
    M = np.maximum(M, options.mass_floor * (np.median(positive) if len(positive) else 1.0))
    components = connected_components(L, directed=False)[1]
    progress(0.1)
    in_cages, inside = _cages(rest, handles, rim=10 * np.sqrt(M.mean()))
    inside &= np.isin(components, components[handles.indices[handles.labels >= 0]])
    # The energy of a node touches its neighbours' rows.
    crop = np.flatnonzero(inside | (abs(L) @ inside.astype(np.float64) > 0))
    finest = Level(rest[crop], L[crop][:, crop], M[crop], crop, np.zeros(0, np.int64))
    levels = [finest]
    progress(0.3)
    # Below a few thousand unknowns the factorisations are cheap enough to start cold.
    while levels[-1].n_nodes > 3000:
        level = coarser_level(levels[-1], labels[levels[-1].nodes] != FREE)
        if level.n_nodes > 0.6 * levels[-1].n_nodes:
            break
        levels.append(level)
        progress(0.6)
    energies = tuple(sp.csr_array(level.L.T @ sp.diags_array(1 / level.M) @ level.L) for level in levels)
    progress(1.0)
    return BbwProblem(handles, tuple(levels), energies, labels, in_cages, components, rest, options)


def handle_weight(problem: BbwProblem, handle: int, progress: Progress = no_progress) -> HandleWeight:
    """Solve for the weight of one handle.

    ``min wᵀ(Lᵀ M⁻¹ L)w`` with ``0 ≤ w ≤ 1``, 1 on the handle, 0 on the other handles, on pins and outside the cage
    [1]_. Coarse levels are solved first, each giving the next its active set. Handles are independent of each other:
    several threads may call this for several handles.

    Parameters
    ----------
    problem : BbwProblem
    handle : int
        0 to H - 1.
    progress : Progress
        Share of this handle.

    Returns
    -------
    HandleWeight

    References
    ----------
    .. [1] Jacobson, Baran, Popović and Sorkine, "Bounded Biharmonic Weights for Real-Time Deformation", SIGGRAPH 2011,
       Eq. 4, each handle by itself as its Sec. 3 suggests for speed.
    """
    began = time.perf_counter()
    finest = problem.levels[0]
    in_cage = problem.in_cages[handle]
    start = None
    n_coarse = 0
    # A level has about a quarter of the next one's unknowns.
    shares = np.cumsum([0.0] + [0.25**k for k in reversed(range(len(problem.levels)))])
    shares /= shares[-1]
    for k, step in zip(reversed(range(len(problem.levels))), range(len(problem.levels)), strict=True):
        level = problem.levels[k]
        values, free, solution = _level_weight(
            problem,
            k,
            handle,
            in_cage[level.nodes],
            start,
            part_of(progress, shares[step], shares[step + 1]),
        )
        if k:
            n_coarse += solution.report.n_factorisations
            active = np.zeros(level.n_nodes)
            active[free] = solution.active
            # Hold only what the coarse solution is sure of: letting go of a wrongly held pocket takes one layer a
            # factorisation, taking hold of what should be is quick.
            start = np.trunc(prolonged(active, level, problem.levels[k - 1]) / 0.99).astype(np.int8)
    kept = np.flatnonzero(values > 0)
    nodes = finest.nodes[kept]
    return HandleWeight(
        nodes=nodes,
        values=values[kept],
        qp=solution.report,
        n_unknowns=len(free),
        n_reached=int(np.count_nonzero(problem.labels[nodes] == FREE)),
        n_coarse_factorisations=n_coarse,
        seconds=time.perf_counter() - began,
    )


def _level_weight(problem, k, handle, in_cage, start, progress):
    """Weight of a handle on one level: values on its nodes, the unknowns among them, and their solution."""
    options = problem.options
    level, energy = problem.levels[k], problem.energies[k]
    labels = problem.labels[level.nodes]
    own = np.flatnonzero(labels == handle)
    values = np.zeros(level.n_nodes)
    values[own] = 1.0
    # Where nothing asks for zero the optimum is one; the solver would find that from an ill-conditioned system.
    components = problem.components[level.nodes]
    reached = np.isin(components, components[own])
    free = in_cage & (labels == FREE) & reached
    zero = reached & ~free & (labels != handle)
    tethered = np.isin(components, components[zero])
    values[free & ~tethered] = 1.0
    unknowns = np.flatnonzero(free & tethered)
    rows = energy[unknowns]
    A = rows[:, unknowns]
    pull = rows[:, own]
    # Patches of the cage that no edge joins to the handle have nothing to lift them from zero.
    patches = connected_components(A, directed=False)[1]
    lifted = np.isin(patches, patches[np.diff(pull.indptr) > 0])
    if not lifted.all():
        unknowns, A, pull = unknowns[lifted], A[lifted][:, lifted], pull[lifted]
    n = len(unknowns)
    solution = box_qp(
        A,
        pull.sum(axis=1),
        np.zeros(n),
        np.ones(n),
        start=None if start is None else start[unknowns],
        tolerance=_tolerance(options.tolerance, k, n),
        max_factorisations=options.max_factorisations,
        progress=progress,
    )
    values[unknowns] = solution.w
    return values, unknowns, solution


def _tolerance(wanted, k, n_unknowns):
    """Coarse levels only give a start; where factorisations are cheap, fringes on weak links get the few more steps."""
    if k:
        return 3 * wanted
    return wanted if n_unknowns > CHEAP_UNKNOWNS else 0.1 * wanted


def _check_shapes(n, L, M, handles):
    if L.shape != (n, n) or M.shape != (n,):
        raise ValueError(f"L and M must have shapes ({n}, {n}) and ({n},), got {L.shape} and {M.shape}")
    if len(handles.indices) and (handles.indices.min() < 0 or handles.indices.max() >= n):
        raise ValueError(f"handle nodes must be 0 to {n - 1}, got {handles.indices.min()} to {handles.indices.max()}")
    if len(handles.cage_radii) != handles.n_handles or not np.all(handles.cage_radii > 0):
        raise ValueError(f"cage_radii must be {handles.n_handles} positive numbers, got {handles.cage_radii}")


def _cages(rest, handles, rim):
    """Nodes in the cage of each handle (H, n), and nodes in any cage or at most ``rim`` outside it (n,)."""
    in_cages = np.zeros((handles.n_handles, len(rest)), bool)
    near_any = np.zeros(len(rest), bool)
    for handle, radius in enumerate(handles.cage_radii):
        own = rest[handles.indices[handles.labels == handle]]
        if len(own) == 0:
            continue
        if np.isinf(radius):
            distances = np.zeros(len(rest))
        else:
            distances = cKDTree(own).query(rest, distance_upper_bound=radius + rim)[0]
        in_cages[handle] = distances <= radius
        near_any |= np.isfinite(distances)
    return in_cages, near_any
