"""Bounded biharmonic weights against general solvers of the same quadratic program, in the same run.

python -m tests.benchmark.bbw [n_unknowns ...]
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import sys
import time
from concurrent.futures import ThreadPoolExecutor

import clarabel
import igl
import numpy as np
import piqp
import scipy.sparse as sp
from scipy.spatial import ConvexHull

from splap_editor.core.bbw.bbw import BbwDeformer
from splap_editor.core.bbw.box_qp import box_qp
from splap_editor.core.bbw.options import BbwOptions
from splap_editor.core.bbw.weights import BbwProblem, HandleWeight, bbw_problem, handle_weight
from splap_editor.core.deformer import Handles
from splap_editor.core.splats.morton import morton_order
from tests.benchmark.peers import note, report, timed
from tests.reference.bbw import rigid


def bench_bbw(
    unknowns: tuple[int, ...] = (5_000, 20_000, 60_000),
    *,
    peers_at: tuple[int, ...] = (5_000, 20_000),
    drag_nodes: int = 100_000,
) -> None:
    """Report weights of one handle and of four, peers on the same program, and a frame of a drag, as JSON lines.

    Parameters
    ----------
    unknowns : tuple of int
        Free nodes of the problem, one report each.
    peers_at : tuple of int
        Sizes at which clarabel and piqp solve the program too; they take minutes on large ones.
    drag_nodes : int
        Nodes of the scene that is dragged.
    """
    _one_handle(*_scene(2_000))  # fills the compilation cache
    for n in unknowns:
        note(f"bbw: {n} unknowns")
        points, L, M, handles = _scene(n)
        seconds, (problem, solved) = timed(
            lambda scene=(points, L, M, handles): _one_handle(*scene), repeats=3, warm_up=0
        )
        A, c = _program(problem)
        weight = _on_unknowns(problem, solved)
        began = time.perf_counter()
        active = np.where(weight <= 0, -1, np.where(weight >= 1, 1, 0)).astype(np.int8)
        bounds = np.zeros(len(c)), np.ones(len(c))
        exact = box_qp(A, c, *bounds, start=active, tolerance=1e-8, max_factorisations=80)
        report(
            benchmark="bbw one handle",
            n_nodes=len(points),
            n_unknowns=len(c),
            seconds=seconds,
            error=np.abs(weight - exact.w).max(),
            kkt_residual=solved.qp.kkt_residual,
            bound_violation=solved.qp.bound_violation,
            n_factorisations=solved.qp.n_factorisations,
            n_coarse_factorisations=solved.n_coarse_factorisations,
            fallback=solved.qp.fallback,
            seconds_to_exact=seconds + time.perf_counter() - began,
            exact_kkt_residual=exact.report.kkt_residual,
            exact_fallback=exact.report.fallback,
        )
        if n in peers_at:
            _bench_peers(A, c, weight, exact.w, seconds)
        four = Handles(
            handles.indices, handles.labels + 1, np.repeat(handles.centers, 4, 0), np.repeat(handles.cage_radii, 4)
        )
        four = Handles(four.indices, _split_pins(points, handles), four.centers, four.cage_radii)
        in_turn, _ = timed(lambda scene=(points, L, M, four): _all_handles(*scene, 1), repeats=1, warm_up=0)
        by_side, _ = timed(
            lambda scene=(points, L, M, four): _all_handles(*scene, os.cpu_count()), repeats=1, warm_up=0
        )
        report(
            benchmark="bbw four handles",
            n_unknowns=n,
            seconds_in_turn=in_turn,
            seconds_side_by_side=by_side,
            n_threads=os.cpu_count(),
            times_one_handle=by_side / seconds,
        )
    _bench_drag(drag_nodes)


def _bench_peers(A, c, weight, exact, seconds):
    """The same program by others, against our weight, found in so many seconds, and the exact one."""
    for name, peer in (("clarabel", _clarabel), ("piqp", _piqp)):
        note(f"bbw: {name} at {len(c)}")
        peer_seconds, w = timed(lambda peer=peer: peer(A, c), repeats=1, warm_up=0)
        report(
            benchmark="bbw peer",
            solver=name,
            n_unknowns=len(c),
            seconds=peer_seconds,
            times_ours=peer_seconds / seconds,
            difference_from_exact=np.abs(w - exact).max(),
            ours_minus_theirs=np.abs(w - weight).max(),
        )


def _bench_drag(n):
    """Blend of a whole scene in which every node follows several handles."""
    rng = np.random.default_rng(0)
    points = rng.normal(size=(n, 3))
    for n_handles in (1, 4, 8):
        weights = rng.uniform(size=(n, n_handles))
        weights /= weights.sum(axis=1, keepdims=True) * 1.2
        handles = Handles(np.zeros(0, np.int64), np.zeros(0, np.int32), np.zeros((n_handles, 3)), np.ones(n_handles))
        rigids = np.stack([rigid(rng.normal(size=3), 0.5, rng.normal(size=3)) for _ in range(n_handles)])
        affine = rigids.copy()
        affine[:, :3, :3] *= 1.5
        for blending, motion, transforms in (
            ("dual-quaternion", "rigid", rigids),
            ("dual-quaternion", "affine", affine),
            ("linear", "rigid", rigids),
        ):
            deformer = BbwDeformer.from_weights(points, handles, weights, options=BbwOptions(blending=blending))
            seconds, _ = timed(lambda d=deformer, t=transforms: d.drag(t), repeats=15, warm_up=2)
            report(
                benchmark="bbw drag frame, blend alone",
                n_nodes=n,
                n_handles=n_handles,
                blending=blending,
                motion=motion,
                ms=1e3 * seconds,
            )


def _scene(n_unknowns):
    """A bumpy sphere with a handle on top, three discs held at zero around it, and a cage with so many free nodes."""
    n = int(3.3 * n_unknowns)
    i = np.arange(n) + 0.5
    polar, turn = np.arccos(1 - 2 * i / n), np.pi * (1 + 5**0.5) * i
    d = np.stack([np.cos(turn) * np.sin(polar), np.sin(turn) * np.sin(polar), np.cos(polar)], axis=1)
    d += 0.25 * np.sqrt(4 * np.pi / n) * np.random.default_rng(0).standard_normal((n, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    d = d[morton_order(d)]
    triangles = ConvexHull(d).simplices.astype(np.int64)
    bumps = 1 + 0.15 * np.sin(8 * d[:, 0]) * np.sin(6 * d[:, 1]) + 0.1 * np.cos(10 * d[:, 2])
    points = d * bumps[:, None]
    scale = np.ptp(points, axis=0).max()
    top = points[np.argmax(points[:, 2])]
    labels = np.full(n, -2)
    for k in range(3):
        angle = 2 * np.pi * k / 3 + 0.3
        near = top + 0.3 * scale * np.array([np.cos(angle), np.sin(angle), -0.25])
        center = points[np.argmin(np.linalg.norm(points - near, axis=1))]
        labels[np.linalg.norm(points - center, axis=1) < 0.03 * scale] = -1
    labels[np.linalg.norm(points - top, axis=1) < 0.03 * scale] = 0
    own = points[labels == 0]
    distances = np.sort(_distances_to(own, points[labels == -2]))
    indices = np.flatnonzero(labels > -2)
    cage = np.array([0.5 * (distances[n_unknowns - 1] + distances[n_unknowns])])
    handles = Handles(indices, labels[indices].astype(np.int32), top[None], cage)
    return (
        points,
        sp.csr_array(-igl.cotmatrix(points, triangles)),
        igl.massmatrix(points, triangles).diagonal(),
        handles,
    )


def _distances_to(sources, points):
    from scipy.spatial import cKDTree

    return cKDTree(sources).query(points)[0]


def _split_pins(points, handles):
    """Labels with each of the three pinned discs a handle of its own."""
    labels = handles.labels.copy()
    pins = np.flatnonzero(labels == -1)
    angles = np.arctan2(*(points[handles.indices[pins]] - handles.centers[0])[:, 1::-1].T)
    labels[pins] = 1 + np.round((angles - 0.3) / (2 * np.pi / 3)).astype(np.int32) % 3
    return labels


def _one_handle(points, L, M, handles) -> tuple[BbwProblem, HandleWeight]:
    problem = bbw_problem(points, L, M, handles)
    return problem, handle_weight(problem, 0)


def _all_handles(points, L, M, handles, n_threads):
    problem = bbw_problem(points, L, M, handles)
    with ThreadPoolExecutor(n_threads) as pool:
        return list(pool.map(lambda h: handle_weight(problem, h), range(handles.n_handles)))


def _unknowns(problem):
    nodes = problem.levels[0].nodes
    return np.flatnonzero(problem.in_cages[0][nodes] & (problem.labels[nodes] == -2))


def _program(problem):
    """Quadratic program of handle 0 on the finest level, scaled to a mean diagonal of one."""
    free = _unknowns(problem)
    own = np.flatnonzero(problem.labels[problem.levels[0].nodes] == 0)
    rows = problem.energies[0][free]
    A, c = sp.csr_array(rows[:, free]), rows[:, own].sum(axis=1)
    scale = A.diagonal().mean()
    return A / scale, c / scale


def _on_unknowns(problem, solved):
    weight = np.zeros(len(problem.rest))
    weight[solved.nodes] = solved.values
    return weight[problem.levels[0].nodes[_unknowns(problem)]]


def _clarabel(A, c):
    n = len(c)
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    box = sp.csc_matrix(sp.vstack([-sp.eye_array(n), sp.eye_array(n)]))
    bounds = np.concatenate([np.zeros(n), np.ones(n)])
    cones = [clarabel.NonnegativeConeT(2 * n)]
    upper = sp.csc_matrix(sp.triu(A))
    return np.array(clarabel.DefaultSolver(upper, c, box, bounds, cones, settings).solve().x)


def _piqp(A, c):
    n = len(c)
    solver = piqp.SparseSolver()
    solver.setup(sp.csc_matrix(A), c, x_l=np.zeros(n), x_u=np.ones(n))
    solver.solve()
    return np.array(solver.result.x)


if __name__ == "__main__":
    bench_bbw(tuple(int(n) for n in sys.argv[1:]) or (5_000, 20_000, 60_000))
