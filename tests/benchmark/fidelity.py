"""How faithfully splats deform: 3DPCK against the true surface, beside plain kNN and beside perfect neighbours.

On objects that nearly touch themselves, handles at such places are pulled 0.2 s away from what they nearly touch. A
hundred keypoints of the reference mesh, deformed by the same energy on the mesh, are paired with their nearest splats:
the score is the share that ends within τ of its splat. ``oracle`` takes its neighbours from the true surface and is the
ceiling; the share of it that a candidate reaches is what counts. Prints one JSON object a line, the means last::

    python -m tests.benchmark.fidelity --objects bench comb --regime thin trained
    python -m tests.benchmark.fidelity --graph-only
    python -m tests.benchmark.fidelity --objects --trained resources/samples
    python -m tests.benchmark.fidelity --objects --captures FOLDER --solvers plain converged
"""

import argparse
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import robust_laplacian
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from splap_editor.core.adaptation.kernel_adaptation import adapt_kernels
from splap_editor.core.adaptation.kernel_binding import KernelBinding
from splap_editor.core.deformer import Deformation
from splap_editor.core.graph.splat_graph import GraphOptions, SplatGraph
from splap_editor.core.splats.occupancy import Ellipses, occupancy_ellipses
from splap_editor.core.splats.splats import Splats
from splap_editor.core.surface.geodesics import Neighborhoods
from splap_editor.core.surface.laplacian import point_cloud_laplacian
from splap_editor.core.surface.local_triangulation import local_triangulations
from splap_editor.engine.surface import surface_of
from splap_editor.io.sample_maker import STYLES, shape_sample
from splap_editor.io.sample_shapes import SHAPES, Surface
from tests.benchmark.ground_truth import GroundTruth, Pull, plain_arap
from tests.benchmark.peers import machine, note, report

OBJECTS = {
    "bench": 25_000,
    "comb": 20_000,
    "birdcage": 15_000,
    "cheese": 25_000,
    "coil": 20_000,
    "book": 25_000,
    "figure": 12_000,
    "strap": 8_000,
}
TRAINED = {"bench": "bench_2dgs.ply"}
"""Trained scenes whose mesh is a shape of the sample maker."""
RULES = {
    "paper": GraphOptions(rule="paper", carriers="all"),
    "default": GraphOptions(),
    "touch": GraphOptions(carriers="all"),
    "solid": GraphOptions(carriers="solid"),
}
RADII = (0.05, 0.075, 0.1)

Solver = Callable[[NDArray[np.float64], sp.csr_matrix, NDArray[np.int64], NDArray[np.float64]], Deformation]


@dataclass(frozen=True, eq=False)
class Scene:
    """Splats with the surface they stand for.

    Parameters
    ----------
    name, regime : str
    splats : Splats
    truth : GroundTruth
    ellipses : Ellipses
        Of all splats that are visible at all.
    pulls : list of Pull
    """

    name: str
    regime: str
    splats: Splats
    truth: GroundTruth
    ellipses: Ellipses
    pulls: list[Pull]


@dataclass(frozen=True, eq=False)
class Candidate:
    """A Laplacian on some of a scene's splats, and what carries the rest.

    Parameters
    ----------
    name : str
    binding : KernelBinding
        Of the splats that L is of, and of those that follow them.
    L : (n, n) sparse
    figures : dict
        What is to be reported of its graph.
    """

    name: str
    binding: KernelBinding
    L: sp.csr_matrix
    figures: dict[str, object]


def scenes(options: argparse.Namespace) -> Iterator[Scene]:
    """Yield the scenes asked for, the made ones first."""
    from splap_editor.io.ply import read_ply

    for name in options.objects:
        for regime in options.regime:
            n_splats = options.splats or OBJECTS[name]
            sample = shape_sample(name, n_splats, STYLES[regime], seed=options.seed)
            truth = GroundTruth(sample.surface)
            pulls = truth.pulls(options.pulls, options.seed)
            yield Scene(name, regime, sample.splats, truth, occupancy_ellipses(sample.splats), pulls)
    if options.trained is not None:
        for name, file in TRAINED.items():
            splats, truth = read_ply(options.trained / file).splats, GroundTruth(SHAPES[name]())
            pulls = truth.pulls(options.pulls, options.seed)
            yield Scene(name, "2dgs", splats, truth, occupancy_ellipses(splats), pulls)
    if options.captures is not None:
        for path in sorted(options.captures.glob("*_truth.npz")):
            stem = path.name.removesuffix("_truth.npz")
            splats = read_ply(path.with_name(f"{stem}.ply")).splats
            name, regime = stem.rsplit("_", 1)
            yield capture(name, regime, splats, np.load(path))


def capture(name: str, regime: str, splats: Splats, truth: np.lib.npyio.NpzFile) -> Scene:
    """Build the scene of a trained capture, whose mesh, handles and references travel with it.

    ``V`` and ``F`` are the true mesh of size 2.6, ``center`` and ``translate`` its handles, ``keypoints`` where they
    are looked at, ``row`` the splat each is paired with, ``ten`` and ``settled`` where the mesh takes it.
    """
    surface = Surface(truth["V"].astype(np.float64), truth["F"].astype(np.int64), closed=True)
    known = GroundTruth(surface)
    pulls = []
    for h, center in enumerate(truth["center"]):
        references = {"plain": truth["ten"][h], "converged": truth["settled"][h]}
        pulls.append(
            Pull(center, truth["translate"][h], None, None, truth["keypoints"][h], references, truth["row"][h])
        )
    return Scene(name, regime, splats, known, occupancy_ellipses(splats), pulls)


def graph_figures(scene: Scene, ellipses: Ellipses, graph: SplatGraph) -> dict[str, object]:
    """Count what is wrong with a graph."""
    sizes = np.bincount(graph.components)
    wrong = scene.truth.wrong_edges(ellipses.centers, graph.edges)
    return {
        "n_nodes": graph.n_nodes,
        "n_edges": graph.n_edges,
        "mean_degree": graph.degrees.mean(),
        "n_wrong": np.count_nonzero(wrong),
        "wrong_share": wrong.mean() if len(wrong) else 0.0,
        "n_components": len(sizes),
        "outside_largest": 1 - sizes[0] / sizes.sum(),
    }


def candidates(scene: Scene, options: argparse.Namespace) -> Iterator[Candidate]:
    """Yield the ceiling, the graph rules and plain nearest neighbours, one after the other."""
    if not options.no_oracle:
        yield oracle(scene)
    for rule in options.rules:
        surface = surface_of(scene.splats, RULES[rule], ellipses=scene.ellipses)
        figures = graph_figures(scene, surface.ellipses, surface.graph)
        for method in options.laplacians:
            L = surface.L
            if method != "stars":
                centers = surface.ellipses.centers
                L, _ = point_cloud_laplacian(centers, surface.triangles, graph=surface.graph, method=method)
            name = rule if method == "stars" else f"{rule}, {method}"
            yield Candidate(name, surface.binding, sp.csr_matrix(L), figures)
    for k in options.knn:
        L, _ = robust_laplacian.point_cloud_laplacian(scene.ellipses.centers, n_neighbors=k)
        yield Candidate(f"knn{k}", bare_binding(scene), sp.csr_matrix(L), {})


def oracle(scene: Scene) -> Candidate:
    """Take neighbours from the true surface; the Laplacian is made of them as of the graph's."""
    ellipses = scene.ellipses
    indptr, indices = scene.truth.neighbors(ellipses.centers)
    lengths = np.linalg.norm(ellipses.centers[np.repeat(np.arange(ellipses.n_nodes), np.diff(indptr))], axis=1)
    triangles = local_triangulations(ellipses, Neighborhoods(indptr, indices, lengths))
    both = sp.csr_array((np.ones(len(indices), bool), indices, indptr), shape=(ellipses.n_nodes, ellipses.n_nodes))
    both = sp.csr_array(both + both.T)
    both.sort_indices()
    starts = np.repeat(np.arange(ellipses.n_nodes), np.diff(both.indptr))
    lengths = np.linalg.norm(ellipses.centers[starts] - ellipses.centers[both.indices], axis=1)
    graph = SplatGraph(both.indptr, both.indices, np.maximum(lengths, 1e-9), None, 0.0)
    L, _ = point_cloud_laplacian(ellipses.centers, triangles, graph=graph)
    return Candidate("oracle", bare_binding(scene), sp.csr_matrix(L), {})


def bare_binding(scene: Scene) -> KernelBinding:
    """Bind every visible splat to itself."""
    empty = Neighborhoods(np.zeros(scene.ellipses.n_nodes + 1, np.int32), np.empty(0, np.int32), np.empty(0))
    return KernelBinding(scene.splats, scene.ellipses, empty)


def held(scene: Scene, pull: Pull, points: NDArray[np.float64]) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which points the handle moves, and which are too far away to be free."""
    distances = np.linalg.norm(points - pull.center, axis=1)
    if pull.handle is None:
        handle = distances <= 0.02 * scene.truth.size
    else:
        handle = np.isin(scene.truth.vertices_of(points), pull.handle)
    handle[np.argmin(distances)] = True
    return handle, (distances > 0.5 * scene.truth.size) & ~handle


def score(
    scene: Scene, pull: Pull, candidate: Candidate, reference: NDArray[np.float64], solver: Solver
) -> list[float]:
    """Share of keypoints that end within each of `RADII` of their splat, and the mean distance."""
    centers = candidate.binding.ellipses.centers
    handle, far = held(scene, pull, centers)
    constrained = np.flatnonzero(handle | far)
    targets = centers[constrained] + np.where(handle[constrained, None], pull.move, 0.0)
    deformation = solver(centers, candidate.L, constrained, targets)
    moved = adapt_kernels(candidate.binding, deformation, method="none").means
    rows = pull.rows
    if rows is None:
        # A keypoint tells about the free region alone.
        points = scene.ellipses.centers
        handle, far = held(scene, pull, points)
        free = np.flatnonzero(~handle & ~far)
        rows = scene.ellipses.rows[free[cKDTree(points[free]).query(pull.keypoints)[1]]]
    distance = np.linalg.norm(reference - moved[rows], axis=1)
    return [*(np.mean(distance <= radius) for radius in RADII), distance.mean()]


def references(scene: Scene, solver: str) -> list[NDArray[np.float64]]:
    """Where the mesh takes the keypoints of each pull."""
    if all(pull.references for pull in scene.pulls):
        return [pull.references[solver] for pull in scene.pulls]
    truth, moved = scene.truth, []
    L = truth.laplacian()
    for pull in scene.pulls:
        constrained = np.concatenate([pull.handle, pull.fixed])
        targets = truth.vertices[constrained].copy()
        targets[: len(pull.handle)] += pull.move
        order = np.argsort(constrained)
        positions = SOLVERS[solver](truth.vertices, L, constrained[order], targets[order]).positions
        moved.append(positions[truth.tree.query(pull.keypoints)[1]])
    return moved


def fidelity(scene: Scene, options: argparse.Namespace) -> Iterator[dict[str, object]]:
    """Report every candidate's mean score over the scene's pulls, and what share of the ceiling that is."""
    placed = {solver: references(scene, solver) for solver in options.solvers}
    ceiling: dict[str, NDArray[np.float64]] = {}
    for candidate in candidates(scene, options):
        for solver in options.solvers:
            start = time.perf_counter()
            scores = np.array([
                score(scene, pull, candidate, reference, SOLVERS[solver])
                for pull, reference in zip(scene.pulls, placed[solver], strict=True)
            ])  # fmt: skip
            means = scores.mean(0)
            result = {
                "object": scene.name,
                "regime": scene.regime,
                "solver": solver,
                "candidate": candidate.name,
                "n_splats": scene.splats.n_splats,
                "pck": means[:3],
            }
            if candidate.name == "oracle":
                ceiling[solver] = means[:3]
            if solver in ceiling:
                result["share_of_ceiling"] = means[:3] / ceiling[solver]
            result |= {"mean_distance": means[3], "pulls": scores[:, 1], **candidate.figures}
            report(**result, seconds=time.perf_counter() - start)
            yield result


def plain(
    rest: NDArray[np.float64], L: sp.csr_matrix, constrained: NDArray[np.int64], targets: NDArray[np.float64]
) -> Deformation:
    """Ten plain local/global steps."""
    return Deformation(*plain_arap(rest, L, constrained, targets))


def settled(
    rest: NDArray[np.float64], L: sp.csr_matrix, constrained: NDArray[np.int64], targets: NDArray[np.float64]
) -> Deformation:
    """Settle ARAP with the editor's own solver, on splats and on the mesh alike."""
    from splap_editor.core.arap.binding import arap_deformer
    from splap_editor.core.deformer import Handles

    moves = targets - rest[constrained]
    moving = np.linalg.norm(moves, axis=1) > 0
    labels = np.where(moving, 0, -1).astype(np.int32)
    handles = Handles(constrained, labels, rest[constrained[moving]].mean(0)[None], np.array([np.inf]))
    size = float(np.ptp(rest, axis=0).max())
    W = sp.csr_matrix(sp.diags(L.diagonal()) - L)
    W.eliminate_zeros()
    coo = W.tocoo()
    lengths = np.linalg.norm(rest[coo.row] - rest[coo.col], axis=1)
    graph = SplatGraph(W.indptr.astype(np.int32), W.indices.astype(np.int32), lengths, None, 0.0)
    masses = np.full(len(rest), 1.0 / len(rest))
    deformer = arap_deformer(rest, sp.csr_matrix(L), handles, scene_scale=size, M=masses, graph=graph)
    transform = np.eye(4)[None].copy()
    transform[0, :3, 3] = moves[moving].mean(0)
    return deformer.solve(transform)


SOLVERS: dict[str, Solver] = {"plain": plain, "converged": settled}


def report_means(results: list[dict[str, object]]) -> None:
    """Report each candidate's means over the objects of a regime, and over everything."""
    groups: dict[tuple[str, str, str], list[dict[str, object]]] = defaultdict(list)
    for result in results:
        for regime in (result["regime"], "all"):
            groups[regime, result["solver"], result["candidate"]].append(result)
    for (regime, solver, candidate), group in groups.items():
        means = {"pck": np.mean([result["pck"] for result in group], axis=0)}
        if all("share_of_ceiling" in result for result in group):
            means["share_of_ceiling"] = np.mean([result["share_of_ceiling"] for result in group], axis=0)
        wrong = [result["n_wrong"] for result in group if "n_wrong" in result]
        if wrong:
            means |= {"n_wrong": sum(wrong), "n_components": sum(r["n_components"] for r in group) / len(group)}
        report(mean_over=len(group), regime=regime, solver=solver, candidate=candidate, **means)


def arguments() -> argparse.Namespace:
    """What the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--objects", nargs="*", choices=sorted(OBJECTS), default=list(OBJECTS))
    parser.add_argument("--regime", nargs="+", choices=sorted(STYLES), default=["thin"])
    parser.add_argument("--trained", type=Path, metavar="FOLDER", help="folder of the trained sample scenes")
    parser.add_argument("--captures", type=Path, metavar="FOLDER", help="captures NAME.ply with NAME_truth.npz")
    parser.add_argument("--splats", type=int, help="number of splats of every made object")
    parser.add_argument("--pulls", type=int, default=6, help="handles per object (6)")
    parser.add_argument("--rules", nargs="*", choices=sorted(RULES), default=list(RULES))
    parser.add_argument("--laplacians", nargs="+", choices=["stars", "robust"], default=["stars"])
    parser.add_argument("--knn", nargs="*", type=int, default=[10])
    parser.add_argument("--no-oracle", action="store_true", help="leave out the ceiling")
    parser.add_argument(
        "--solvers", nargs="+", choices=sorted(SOLVERS), default=["plain"], help="ten plain steps, or settled"
    )
    parser.add_argument("--graph-only", action="store_true", help="wrong edges, degree and components alone")
    parser.add_argument("--seed", type=int, default=0)
    return parser.parse_args()


def main() -> None:
    """Run the scenes and candidates the command line asks for."""
    options = arguments()
    report(benchmark="fidelity", **machine())
    results = []
    for scene in scenes(options):
        note(f"{scene.name}, {scene.regime}: {scene.ellipses.n_nodes} nodes")
        if not options.graph_only:
            results.extend(fidelity(scene, options))
            continue
        for rule in options.rules:
            surface = surface_of(scene.splats, RULES[rule], ellipses=scene.ellipses)
            figures = graph_figures(scene, surface.ellipses, surface.graph)
            report(object=scene.name, regime=scene.regime, candidate=rule, **figures)
    report_means(results)


if __name__ == "__main__":
    main()
