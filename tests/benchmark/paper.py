"""The paper's comparison on our own ground: every method on the same splats, handles and keypoints, by one command.

Ten categories of procedural objects (`paper_objects`), made anew by seed; splats are laid on them at densities given
by how many splat spacings wide the gap between neighbouring parts is. Handles sit at ambiguous places and are pulled
0.2 s away from what they nearly touch. ARAP is the paper's ten plain iterations with everything beyond 0.5 s fixed, or
settled by the editor's own solver, on splats and mesh alike; BBW has a cage of 0.3 s and linear blending. A hundred
keypoints of the deformed mesh are compared with their splats: 3DPCK at .05, .075 and .1::

    python -m tests.benchmark.paper --quick --out FOLDER
    python -m tests.benchmark.paper --jobs 2 --captures ../shared/data --out resources/evidence

``--out`` keeps every row as it is made (``rows.jsonl``), goes on from those that are there, and writes tables and plots
of them all; ``--minutes`` ends a run early between two scenes. Whatever is done first is of all categories, densities
and regimes alike. Without ``--out`` rows are printed.
"""

import argparse
import multiprocessing
import os
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from splap_editor.core.arap.binding import arap_deformer
from splap_editor.core.arap.options import ArapOptions
from splap_editor.core.bbw.bbw import BbwDeformer
from splap_editor.core.bbw.options import BbwOptions
from splap_editor.core.deformer import PIN, Deformation, Handles
from splap_editor.io.sample_maker import STYLES
from tests.benchmark.fidelity import RADII, Scene
from tests.benchmark.ground_truth import GroundTruth, Pull
from tests.benchmark.paper_methods import METHODS, Bound, NoProxyError
from tests.benchmark.paper_objects import CATEGORIES
from tests.benchmark.paper_rows import RowFile, commit
from tests.benchmark.paper_scenes import Case, Subject, captured_cases, made_cases, scene_of
from tests.benchmark.peers import machine, note, report

SOLVERS = ("arap", "settled", "bbw")
FREE_RADIUS, CAGE_RADIUS = 0.5, 0.3

Row = dict[str, object]


def mesh_bound(truth: GroundTruth) -> Bound:
    """Bind the true mesh, whose vertices carry nothing but themselves."""
    masses = np.bincount(
        truth.surface.faces.ravel(), np.repeat(truth.surface.areas / 3.0, 3), minlength=len(truth.vertices)
    )
    return Bound(truth.vertices, truth.laplacian(), masses, lambda deformation, rows: deformation.positions[rows])


def held(
    vertices: NDArray[np.int64], points: NDArray[np.float64], pull: Pull, s: float
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which points the handle moves, and which are too far away to be free; ``vertices`` of the mesh are theirs."""
    distances = np.linalg.norm(points - pull.center, axis=1)
    handle = np.isin(vertices, pull.handle)
    handle[np.argmin(distances)] = True
    return handle, (distances > FREE_RADIUS * s) & ~handle


def deformed(solver: str, bound: Bound, handle: NDArray[np.bool_], pull: Pull, s: float) -> Deformation:
    """Pull the nodes of a handle; s is the size of the object."""
    center = pull.center
    transform = np.eye(4)[None].copy()
    transform[0, :3, 3] = pull.move
    if solver == "bbw":
        indices = np.flatnonzero(handle)
        handles = Handles(indices, np.zeros(len(indices), np.int32), center[None], np.array([CAGE_RADIUS * s]))
        linear = BbwOptions(blending="linear")
        bbw = BbwDeformer(bound.rest, bound.L, bound.M, handles, scene_scale=s, graph=bound.graph, options=linear)
        return bbw.solve(transform)
    far = (np.linalg.norm(bound.rest - center, axis=1) > FREE_RADIUS * s) & ~handle
    indices = np.flatnonzero(handle | far)
    labels = np.where(handle[indices], 0, PIN).astype(np.int32)
    handles = Handles(indices, labels, center[None], np.array([np.inf]))
    kind = ArapOptions(kind="local-global") if solver == "arap" else ArapOptions()
    arap = arap_deformer(
        bound.rest, bound.L, handles, scene_scale=s, M=bound.M, graph=bound.graph, options=kind, scene=bound.arap_scene
    )
    return arap.solve(transform)


def references(subject: Subject, solver: str) -> list[NDArray[np.float64]]:
    """Where the mesh takes the keypoints of each pull; found once an object."""
    if solver not in subject.moved:
        truth, mesh = subject.truth, mesh_bound(subject.truth)
        subject.moved[solver] = []
        for pull in subject.pulls:
            handle = np.zeros(len(truth.vertices), bool)
            handle[pull.handle] = True
            positions = deformed(solver, mesh, handle, pull, truth.size).positions
            subject.moved[solver].append(positions[truth.tree.query(pull.keypoints)[1]])
    return subject.moved[solver]


def compared(case: Case, subject: Subject, scene: Scene, wanted: list[tuple[str, str]], n_pulls: int) -> Iterator[Row]:
    """Score the wanted methods and deformers on a scene."""
    points, s = scene.ellipses.centers, scene.truth.size
    vertices = scene.truth.vertices_of(points)
    # A keypoint is compared with the nearest splat that is free.
    rows = []
    for pull in scene.pulls:
        handle, far = held(vertices, points, pull, s)
        free = np.flatnonzero(~handle & ~far)
        rows.append(scene.ellipses.rows[free[cKDTree(points[free]).query(pull.keypoints)[1]]])
    spacings = subject.made.spacings(scene.splats.n_splats) if subject.made else 0.0
    for name in dict.fromkeys(name for name, _ in wanted):
        began = time.process_time()
        try:
            bound = METHODS[name].bind(scene)
        except NoProxyError as error:
            note(f"{scene.name}: {METHODS[name].title}: {error}; its splats stay where they are")
            bound = None
        of_nodes = vertices
        if bound is not None and bound.rest is not points:
            of_nodes = scene.truth.vertices_of(bound.rest)
        for solver in (solver for other, solver in wanted if other == name):
            scores = []
            for pull, row, reference in zip(scene.pulls, rows, references(subject, solver), strict=True):
                if bound is None:
                    centers = np.asarray(scene.splats.means, np.float64)[row]
                else:
                    handle, _ = held(of_nodes, bound.rest, pull, s)
                    centers = bound.carried(deformed(solver, bound, handle, pull, s), row)
                distances = np.linalg.norm(centers - reference, axis=1)
                scores.append([*(float(np.mean(distances <= radius)) for radius in RADII), float(distances.mean())])
            yield {
                **asdict(case),
                "n_pulls": n_pulls,
                "candidate": name,
                "solver": solver,
                "n_splats": scene.splats.n_splats,
                "gap": round(spacings, 2),
                "pulls": np.round(scores, 4).tolist(),
                "cpu_s": round(time.process_time() - began, 1),
                "commit": commit(),
            }
            began = time.process_time()


def wanted_of(case: Case, options: argparse.Namespace) -> list[tuple[str, str]]:
    """Methods and deformers to be run on a scene; unless asked for, what is dear or an ablation on one a category."""
    first = not options.quick and case == next(one for one in options.cases if one.category == case.category)
    names = options.candidates or [name for name, method in METHODS.items() if first or not method.is_ablation]
    solvers = options.method or [solver for solver in SOLVERS if first or solver != "settled"]
    return [
        (name, solver)
        for name in names
        if not METHODS[name].is_missing
        for solver in solvers
        if solver != "settled" or options.method or not METHODS[name].is_ablation
    ]


def run(options: argparse.Namespace, part: int, taken: Callable[[Row], None], known: set[tuple[object, ...]]) -> None:
    """Run every ``jobs``-th object from ``part`` on, and hand on rows that are not known."""
    ends = time.monotonic() + 60.0 * options.minutes
    objects = list(dict.fromkeys((case.category, case.seed) for case in options.cases))
    mine = set(objects[part :: options.jobs])
    for case in options.cases:
        if (case.category, case.seed) not in mine:
            continue
        wanted = [
            (name, solver)
            for name, solver in wanted_of(case, options)
            if RowFile.key({**asdict(case), "n_pulls": options.pulls, "candidate": name, "solver": solver}) not in known
        ]
        if not wanted:
            continue
        if time.monotonic() > ends:
            note("the time is over")
            return
        subject, scene = scene_of(case, options.pulls, options.captures)
        note(f"{case.category} {case.seed}, {case.regime}, gap {case.spacings:g}: {scene.ellipses.n_nodes} nodes")
        for row in compared(case, subject, scene, wanted, options.pulls):
            taken(row)


def _run_part(options: argparse.Namespace, part: int) -> None:
    rows = RowFile(options.out / "rows.jsonl")
    run(options, part, rows.add, rows.known())


def arguments(given: list[str] | None = None) -> argparse.Namespace:
    """What the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--quick", action="store_true", help="one scene a category, two pulls, gaps of 2 and 1, what every scene has"
    )
    parser.add_argument("--categories", nargs="*", choices=list(CATEGORIES), default=list(CATEGORIES))
    parser.add_argument("--seeds", type=int, default=3, help="objects a category (3)")
    parser.add_argument("--spacings", nargs="+", type=float, help="gap in splat spacings (4 2 1)")
    parser.add_argument("--regime", choices=sorted(STYLES), help="one regime for all objects")
    parser.add_argument("--cells", type=int, default=4, metavar="N", help="pairs of regime and density an object (4)")
    parser.add_argument("--pulls", type=int, default=3, help="handles an object (3)")
    parser.add_argument(
        "--method", default="", help="deformers: arap (ten plain iterations), settled, bbw (all, settled more seldom)"
    )
    parser.add_argument("--candidates", nargs="*", choices=list(METHODS), help="methods (all)")
    parser.add_argument("--captures", type=Path, metavar="FOLDER", help="trained captures whose true mesh is known")
    parser.add_argument("--jobs", type=int, default=1, help="processes; more than one need --out")
    parser.add_argument("--minutes", type=float, default=np.inf, help="begin no scene after so long")
    parser.add_argument("--out", type=Path, metavar="FOLDER", help="where rows are kept and tables and plots written")
    options = parser.parse_args(given)
    options.method = [solver for solver in options.method.split(",") if solver]
    unknown = sorted(set(options.method) - set(SOLVERS))
    if unknown:
        parser.error(f"--method must be of {', '.join(SOLVERS)}, got {', '.join(unknown)}")
    if options.jobs > 1 and options.out is None:
        parser.error("--jobs needs --out, where the rows of all of them are kept")
    options.spacings = options.spacings or ([2.0, 1.0] if options.quick else [4.0, 2.0, 1.0])
    if options.quick:
        options.seeds, options.cells, options.pulls = 1, 1, min(options.pulls, 2)
    options.cases = made_cases(options)
    if options.captures is not None:
        options.cases += captured_cases(options.captures)
    return options


def main(given: list[str] | None = None) -> list[Row]:
    """Run the comparison that the command line asks for, and return its rows."""
    options = arguments(given)
    for name in options.candidates or METHODS:
        if METHODS[name].is_missing:
            note(f"{METHODS[name].title} needs {METHODS[name].extra}: pip install '.[benchmark]'")
    if options.out is None:
        results: list[Row] = []

        def taken(row: Row) -> None:
            report(**row)
            results.append(row)

        run(options, 0, taken, set())
        return results
    from tests.benchmark.paper_tables import write_evidence

    options.out.mkdir(parents=True, exist_ok=True)
    note(str(machine()))
    if options.jobs == 1:
        _run_part(options, 0)
    else:
        # Each process has a core of its own.
        for library in ("OMP", "OPENBLAS", "NUMBA"):
            os.environ[f"{library}_NUM_THREADS"] = "1"
        context = multiprocessing.get_context("spawn")
        parts = [context.Process(target=_run_part, args=(options, part)) for part in range(options.jobs)]
        for process in parts:
            process.start()
        for process in parts:
            process.join()
        if any(process.exitcode for process in parts):
            sys.exit("a part of the run failed: what it had done is kept")
    rows = RowFile(options.out / "rows.jsonl").rows()
    write_evidence(rows, options.out)
    return rows


if __name__ == "__main__":
    main()
