"""The paper's comparison on our own ground: every method on the same splats, handles and keypoints, by one command.

Ten categories of procedural objects (`paper_objects`), made anew by seed; splats are laid on them at densities given
by how many splat spacings wide the gap between neighbouring parts is. Handles sit at ambiguous places and are pulled
0.2 s away from what they nearly touch. ARAP is the paper's ten plain iterations with everything beyond 0.5 s fixed, or
settled by the editor's own solver, on splats and mesh alike; BBW has a cage of 0.3 s and linear blending. A hundred
keypoints of the deformed mesh are compared with their splats: 3DPCK at .05, .075 and .1::

    python -m tests.benchmark.paper --quick
    python -m tests.benchmark.paper --out resources/evidence

Prints one JSON object for every scene and method; ``--out`` also writes tables as Markdown and everything as JSON.
"""

import argparse
import json
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from splap_editor.core.arap.binding import arap_deformer
from splap_editor.core.arap.options import ArapOptions
from splap_editor.core.bbw.bbw import BbwDeformer
from splap_editor.core.bbw.options import BbwOptions
from splap_editor.core.deformer import PIN, Deformation, Handles
from splap_editor.core.graph.splat_graph import SplatGraph
from splap_editor.core.splats.occupancy import occupancy_ellipses
from splap_editor.io.sample_maker import STYLES, surface_splats
from tests.benchmark.fidelity import RADII, Scene, capture, held
from tests.benchmark.ground_truth import GroundTruth, Pull
from tests.benchmark.paper_methods import METHODS, Bound
from tests.benchmark.paper_objects import CATEGORIES, made_object
from tests.benchmark.paper_tables import markdown
from tests.benchmark.peers import machine, note, report

SOLVERS = ("arap", "settled", "bbw")
FREE_RADIUS, CAGE_RADIUS = 0.5, 0.3
FEWEST, MOST = 3_000, 60_000
"""Splats of a scene: fewer do not show the object, more show nothing new."""


def made_scenes(options: argparse.Namespace) -> Iterator[Scene]:
    """Yield every object at every density; each seed has one regime, so that all take part."""
    regimes = sorted(STYLES)
    for category in options.categories:
        for seed in range(options.seeds):
            made = made_object(category, seed)
            truth = GroundTruth(made.surface)
            pulls = truth.pulls(options.pulls, seed)
            regime = options.regime or regimes[seed % len(regimes)]
            for spacings in options.spacings:
                n_splats = int(np.clip(made.n_splats(spacings), FEWEST, MOST))
                splats = surface_splats(made.surface, n_splats, STYLES[regime], seed=seed).splats
                yield Scene(category, f"{regime}, gap {spacings:g}", splats, truth, occupancy_ellipses(splats), pulls)


def captured_scenes(folder: Path) -> Iterator[Scene]:
    """Yield the trained captures of a folder that have their true mesh beside them; handles are chosen anew."""
    from splap_editor.io.ply import read_ply

    for path in sorted(folder.glob("*_truth.npz")):
        stem = path.name.removesuffix("_truth.npz")
        name, regime = stem.rsplit("_", 1)
        scene = capture(name, regime, read_ply(path.with_name(f"{stem}.ply")).splats, np.load(path))
        yield Scene(name, regime, scene.splats, scene.truth, scene.ellipses, scene.truth.pulls(len(scene.pulls)))


def mesh_bound(truth: GroundTruth) -> Bound:
    """Bind the true mesh, whose vertices carry nothing but themselves."""
    masses = np.bincount(
        truth.surface.faces.ravel(), np.repeat(truth.surface.areas / 3.0, 3), minlength=len(truth.vertices)
    )
    return Bound(truth.vertices, truth.laplacian(), masses, lambda deformation: deformation.positions)


def deformed(solver: str, bound: Bound, handle: NDArray[np.bool_], pull: Pull, s: float) -> Deformation:
    """Pull the nodes of a handle; s is the size of the object."""
    center = pull.center
    transform = np.eye(4)[None].copy()
    transform[0, :3, 3] = pull.move
    graph = _graph_of(bound)
    if solver == "bbw":
        indices = np.flatnonzero(handle)
        handles = Handles(indices, np.zeros(len(indices), np.int32), center[None], np.array([CAGE_RADIUS * s]))
        linear = BbwOptions(blending="linear")
        bbw = BbwDeformer(bound.rest, bound.L, bound.M, handles, scene_scale=s, graph=graph, options=linear)
        return bbw.solve(transform)
    far = (np.linalg.norm(bound.rest - center, axis=1) > FREE_RADIUS * s) & ~handle
    indices = np.flatnonzero(handle | far)
    labels = np.where(handle[indices], 0, PIN).astype(np.int32)
    handles = Handles(indices, labels, center[None], np.array([np.inf]))
    kind = ArapOptions(kind="local-global") if solver == "arap" else ArapOptions()
    arap = arap_deformer(bound.rest, bound.L, handles, scene_scale=s, M=bound.M, graph=graph, options=kind)
    return arap.solve(transform)


def _graph_of(bound: Bound) -> SplatGraph:
    """Graph of what the Laplacian couples."""
    weights = sp.csr_matrix(sp.diags(bound.L.diagonal()) - bound.L)
    weights.data[weights.data <= 0.0] = 0.0
    weights.eliminate_zeros()
    weights.sort_indices()
    starts = np.repeat(np.arange(len(bound.rest)), np.diff(weights.indptr))
    lengths = np.linalg.norm(bound.rest[starts] - bound.rest[weights.indices], axis=1)
    return SplatGraph(weights.indptr.astype(np.int32), weights.indices.astype(np.int32), lengths, None, 0.0)


def references(scene: Scene, solver: str) -> list[NDArray[np.float64]]:
    """Where the mesh takes the keypoints of each pull."""
    truth, mesh = scene.truth, mesh_bound(scene.truth)
    moved = []
    for pull in scene.pulls:
        handle = np.zeros(len(truth.vertices), bool)
        handle[pull.handle] = True
        positions = deformed(solver, mesh, handle, pull, truth.size).positions
        moved.append(positions[truth.tree.query(pull.keypoints)[1]])
    return moved


def keypoint_rows(scene: Scene, pull: Pull) -> NDArray[np.int64]:
    """File row of the splat that each keypoint is compared with: the nearest one that is free."""
    points = scene.ellipses.centers
    handle, far = held(scene, pull, points)
    free = np.flatnonzero(~handle & ~far)
    return scene.ellipses.rows[free[cKDTree(points[free]).query(pull.keypoints)[1]]]


def compared(scene: Scene, options: argparse.Namespace) -> Iterator[dict[str, object]]:
    """Score every method on a scene."""
    rows = [keypoint_rows(scene, pull) for pull in scene.pulls]
    placed = {solver: references(scene, solver) for solver in options.method}
    for name in options.candidates:
        method = METHODS[name]
        if method.is_missing:
            note(f"{method.title} needs {method.extra}: pip install '.[benchmark]'")
            continue
        began = time.perf_counter()
        bound = method.bind(scene)
        for solver in options.method:
            scores = []
            for pull, row, reference in zip(scene.pulls, rows, placed[solver], strict=True):
                handle, _ = held(scene, pull, bound.rest)
                deformation = deformed(solver, bound, handle, pull, scene.truth.size)
                distances = np.linalg.norm(bound.carried(deformation)[row] - reference, axis=1)
                scores.append([*(np.mean(distances <= radius) for radius in RADII), distances.mean()])
            means = np.mean(scores, axis=0)
            result = {
                "category": scene.name,
                "scene": scene.regime,
                "n_splats": scene.splats.n_splats,
                "candidate": name,
                "solver": solver,
                "pck": means[:3].tolist(),
                "mean_distance": float(means[3]),
                "pulls": [score[1] for score in scores],
            }
            report(**result, seconds=time.perf_counter() - began)
            yield result


def arguments(given: list[str] | None = None) -> argparse.Namespace:
    """What the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="one object a category, one density, two pulls")
    parser.add_argument("--categories", nargs="*", choices=list(CATEGORIES), default=list(CATEGORIES))
    parser.add_argument("--seeds", type=int, default=3, help="objects a category (3)")
    parser.add_argument("--spacings", nargs="+", type=float, default=[4.0, 2.0, 1.0], help="gap in splat spacings")
    parser.add_argument("--regime", choices=sorted(STYLES), help="one regime for all objects")
    parser.add_argument("--pulls", type=int, default=3, help="handles an object (3)")
    parser.add_argument(
        "--method", default="arap,bbw", help="deformers: arap (ten plain iterations), settled, bbw (arap,bbw)"
    )
    parser.add_argument("--candidates", nargs="*", choices=list(METHODS), default=list(METHODS))
    parser.add_argument("--captures", type=Path, metavar="FOLDER", help="captures NAME.ply with NAME_truth.npz")
    parser.add_argument("--out", type=Path, metavar="FOLDER", help="where to write paper.md and paper.json")
    options = parser.parse_args(given)
    options.method = [solver for solver in options.method.split(",") if solver]
    unknown = sorted(set(options.method) - set(SOLVERS))
    if unknown:
        parser.error(f"--method must be of {', '.join(SOLVERS)}, got {', '.join(unknown)}")
    if options.quick:
        options.seeds, options.spacings, options.pulls = 1, [2.0], min(options.pulls, 2)
    return options


def main(given: list[str] | None = None) -> list[dict[str, object]]:
    """Run the comparison that the command line asks for."""
    options = arguments(given)
    report(benchmark="paper", **machine())
    results = []
    scenes = [made_scenes(options)]
    if options.captures is not None:
        scenes.append(captured_scenes(options.captures))
    for scene in (scene for group in scenes for scene in group):
        note(f"{scene.name}, {scene.regime}: {scene.ellipses.n_nodes} nodes")
        results.extend(compared(scene, options))
    tables = markdown(results)
    note(tables)
    if options.out is not None:
        options.out.mkdir(parents=True, exist_ok=True)
        (options.out / "paper.md").write_text(tables, encoding="utf-8")
        (options.out / "paper.json").write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    return results


if __name__ == "__main__":
    main()
