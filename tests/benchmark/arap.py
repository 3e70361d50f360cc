"""As-rigid-as-possible deformation against libigl and against plain local/global alternation.

    python tests/benchmark/arap.py --splats 100000 [--plain 40] [--rounds 5]

Prints one JSON line per measurement. Points lie on a bumpy sphere; the lowest 35 % are pinned and the top 5 % are the
handle, which is moved by 0.2 s and turned by 25 degrees, so that 60 % are free.

- ``iteration``: one plain iteration, all but one node free, ours and libigl's on the same triangles.
- ``converged``: from a cold bind to 1e-3 s of the minimiser, factorisation included, and to the default tolerance.
- ``plain``: the same energy by plain alternation with the same factor. What it takes to come within 1e-3 s is
  extrapolated from a smaller number of iterations by the contraction they show, unless they get there; that is a lower
  bound, as the contraction of a plain iteration only ever worsens.
- ``drag``: binding a new handle, and a frame of a drag.
"""

import argparse
import json
import time
from collections.abc import Callable

import igl
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from splap_editor.core.arap.arap import ArapDeformer
from splap_editor.core.arap.binding import arap_deformer
from splap_editor.core.arap.options import ArapOptions
from splap_editor.core.arap.problem import ArapProblem, Constraints, Pose
from splap_editor.core.arap.scene import ArapScene
from splap_editor.core.deformer import FREE, PIN, Handles
from splap_editor.core.graph.splat_graph import SplatGraph
from splap_editor.core.splats.morton import morton_order

NEAR = 1e-3
"""How close to the minimiser counts as there, in units of the scene scale."""


def bumpy_sphere(n: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Jittered points in Morton order and a triangulation: a manifold, which libigl needs."""
    rng = np.random.default_rng(0)
    i = np.arange(n) + 0.5
    polar, turn = np.arccos(1 - 2 * i / n), np.pi * (1 + 5**0.5) * i
    d = np.stack([np.cos(turn) * np.sin(polar), np.sin(turn) * np.sin(polar), np.cos(polar)], axis=1)
    d += 0.25 * np.sqrt(4 * np.pi / n) * rng.standard_normal((n, 3))
    d /= np.linalg.norm(d, axis=1)[:, None]
    d = d[morton_order(d)]
    bump = 1 + 0.15 * np.sin(8 * d[:, 0]) * np.sin(6 * d[:, 1]) + 0.1 * np.cos(5 * d[:, 2])
    triangles = ConvexHull(d).simplices.astype(np.int64)
    corners = d[triangles]
    outward = np.einsum(
        "ti,ti->t", np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), corners[:, 0]
    )
    triangles[outward < 0] = triangles[outward < 0][:, ::-1]
    return d * bump[:, None], triangles


class Case:
    """The scene, its Laplacian, and the handle set of the benchmark."""

    def __init__(self, n: int) -> None:
        self.rest, self.triangles = bumpy_sphere(n)
        self.L = sp.csr_matrix(-igl.intrinsic_delaunay_cotmatrix(self.rest, self.triangles)[0])
        areas = np.repeat(igl.doublearea(self.rest, self.triangles) / 6.0, 3)
        self.M = np.bincount(self.triangles.ravel(), areas, minlength=n)
        self.scale = float(np.ptp(self.rest, axis=0).max())
        ends = np.concatenate([self.triangles[:, [0, 1]], self.triangles[:, [1, 2]], self.triangles[:, [2, 0]]])
        lengths = np.linalg.norm(self.rest[ends[:, 0]] - self.rest[ends[:, 1]], axis=1)
        # Each edge is listed once in either direction on a closed surface.
        G = sp.csr_matrix((lengths, (ends[:, 0], ends[:, 1])), shape=(n, n))
        G.sort_indices()
        self.graph = SplatGraph(G.indptr.astype(np.int32), G.indices.astype(np.int32), G.data, None, 0.0)
        self.scene = ArapScene(self.rest, self.L, self.graph)
        height = self.rest[:, 2]
        self.labels = np.full(n, FREE, np.int32)
        self.labels[height < np.quantile(height, 0.35)] = PIN
        self.labels[height > np.quantile(height, 0.95)] = 0
        self.center = self.rest[self.labels == 0].mean(axis=0)

    def handles(self) -> Handles:
        """The handle set."""
        held = np.flatnonzero(self.labels != FREE)
        return Handles(held, self.labels[held], self.center[None], np.full(1, np.inf))

    def transforms(self, share: float = 1.0) -> NDArray[np.float64]:
        """The handle's motion, or a share of it."""
        angle = np.deg2rad(25.0) * share
        T = np.eye(4)
        T[:3, :3] = [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]
        direction = np.array([1.0, 0.3, 0.3]) / np.linalg.norm([1.0, 0.3, 0.3])
        T[:3, 3] = self.center - T[:3, :3] @ self.center + 0.2 * self.scale * share * direction
        return T[None]

    def deformer(self, scene: ArapScene | None = None, **options: float) -> ArapDeformer:
        """A deformer bound to the handle set."""
        return arap_deformer(
            self.rest, self.L, self.handles(), scene_scale=self.scale, M=self.M, graph=self.graph,
            scene=self.scene if scene is None else scene, options=ArapOptions(**options),
        )  # fmt: skip


def seconds(run: Callable[[], object]) -> float:
    """Wall time of one run."""
    start = time.perf_counter()
    run()
    return time.perf_counter() - start


def say(what: str, **numbers: object) -> None:
    """One JSON line."""
    rounded = {k: float(f"{v:.3g}") if isinstance(v, float) else v for k, v in numbers.items()}
    print(json.dumps({"what": what} | rounded), flush=True)


def iteration(case: Case, rounds: int) -> None:
    """One plain iteration of either, all but one node free; rounds interleaved, the best of each."""
    labels = np.full(len(case.rest), FREE, np.int32)
    labels[0] = PIN
    constraints = Constraints(labels, np.zeros(len(labels), bool), case.scene.component)
    problem = ArapProblem(case.rest, case.scene.W, constraints, 0.0)
    pose = Pose.of_rest(problem.rest)
    pose.positions += 0.001 * case.scale * np.sin(9.0 / case.scale * pose.positions[:, ::-1])
    problem.fit_rotations(pose)
    problem.place(pose)
    data = igl.ARAPData()
    data.energy = igl.ARAP_ENERGY_TYPE_SPOKES
    igl.arap_precomputation(case.rest, case.triangles, 3, np.zeros(1, np.int32), data)
    ours: list[float] = []
    theirs: dict[int, list[float]] = {1: [], 3: []}
    for _ in range(rounds):
        ours.append(seconds(lambda: (problem.fit_rotations(pose), problem.place(pose))))
        start = pose.positions.copy()
        for count, runs in theirs.items():
            data.max_iter = count
            runs.append(seconds(lambda start=start: igl.arap_solve(case.rest[:1], data, start)))
    # The difference leaves out what a call costs besides its iterations.
    own, peer = min(ours), (min(theirs[3]) - min(theirs[1])) / 2.0
    say("iteration", splats=len(labels), ours_ms=1e3 * own, libigl_ms=1e3 * peer, ratio=own / peer)


def converged(case: Case) -> tuple[float, NDArray[np.float64]]:
    """Seconds from a cold bind to `NEAR`, and the minimiser."""
    exact = case.deformer(tolerance=1e-8).solve(case.transforms())
    took = 0.0
    for tolerance in (NEAR, 1e-4):
        deformer = None

        def run(tolerance: float = tolerance) -> None:
            nonlocal deformer, result
            deformer = case.deformer(tolerance=tolerance)
            result = deformer.solve(case.transforms())

        result = exact
        cold = seconds(run)
        warm = seconds(lambda bound=deformer: bound.solve(case.transforms()))
        error = np.linalg.norm(result.positions - exact.positions, axis=1).max() / case.scale
        say(
            "converged", splats=len(case.rest), tolerance=tolerance, cold_s=cold, warm_s=warm,
            iterations=result.n_iterations, error=float(error), estimate=float(result.residual),
        )  # fmt: skip
        took = took or cold
    return took, exact.positions


def plain(case: Case, exact: NDArray[np.float64], n_iterations: int, ours: float) -> None:
    """Plain alternation on the same energy."""
    problem = case.deformer().problem
    pose = Pose.of_rest(problem.rest)
    problem.hold(pose, case.transforms())
    factoring = seconds(lambda: problem.position_factor)
    target = exact[problem.nodes]
    errors, took = [], 0.0
    for _ in range(n_iterations):
        took += seconds(lambda: (problem.fit_rotations(pose), problem.place(pose)))
        errors.append(float(np.linalg.norm(pose.positions - target, axis=1).max() / case.scale))
        if errors[-1] <= NEAR:
            break
    needed = float(len(errors))
    if errors[-1] > NEAR:
        half = len(errors) // 2
        contraction = (errors[-1] / errors[half - 1]) ** (1.0 / (len(errors) - half))
        needed += np.log(NEAR / errors[-1]) / np.log(contraction)
    total = factoring + needed * took / len(errors)
    say(
        "plain", splats=len(case.rest), iterations_run=len(errors), error_then=errors[-1],
        iterations_needed=round(needed), extrapolated=errors[-1] > NEAR, ms_per_iteration=1e3 * took / len(errors),
        seconds=total, converged_over_plain=ours / total,
    )  # fmt: skip


def drag(case: Case) -> None:
    """A new handle, then thirty frames."""
    scene = ArapScene(case.rest, case.L, case.graph)
    sampling = seconds(lambda: scene.coarse)
    deformer = None

    def bind() -> None:
        nonlocal deformer
        deformer = case.deformer(scene)
        deformer.drag(case.transforms(1e-3))

    binding = [seconds(bind) for _ in range(3)]
    frames = [seconds(lambda share=share: deformer.drag(case.transforms(share))) for share in np.linspace(0, 1, 31)[1:]]
    last = deformer.drag(case.transforms())
    apart = np.linalg.norm(last.positions - deformer.solve(case.transforms()).positions, axis=1) / case.scale
    say(
        "drag", splats=len(case.rest), scene_s=sampling, bind_to_first_frame_ms=1e3 * min(binding),
        frame_ms=1e3 * float(np.median(frames)), slowest_ms=1e3 * max(frames),
        from_settled_max=float(apart.max()), from_settled_mean=float(apart.mean()),
    )  # fmt: skip


def main() -> None:
    """Run all measurements at one size."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--splats", type=int, default=100_000)
    parser.add_argument("--plain", type=int, default=40, help="plain iterations to run")
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    # Compile before the clock runs.
    small = Case(8000)
    small.deformer().solve(small.transforms())
    small.deformer().drag(small.transforms())
    small.deformer(kind="local-global", iterations=1).solve(small.transforms())
    case = Case(options.splats)
    iteration(case, options.rounds)
    drag(case)
    took, exact = converged(case)
    plain(case, exact, options.plain, took)


if __name__ == "__main__":
    main()
