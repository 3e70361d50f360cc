"""How faithfully splats deform: 3DPCK against the true surface, by graph rule and Laplacian, beside plain kNN.

On objects that nearly touch themselves, handles at such places are pulled 0.2 s away from what they nearly touch. A
hundred keypoints of the reference mesh, deformed by cotangent ARAP, are paired with their nearest splats: the score is
the share that ends within τ of its splat. Prints one JSON object a line::

    python -m tests.benchmark.fidelity --objects bench comb --regime thin trained
    python -m tests.benchmark.fidelity --graph-only
    python -m tests.benchmark.fidelity --trained resources/samples
"""

import argparse
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import robust_laplacian
import scipy.sparse as sp
from numpy.typing import NDArray

from splap_editor.core.graph.splat_graph import GraphOptions, SplatGraph, splat_graph
from splap_editor.core.splats.occupancy import Ellipses, occupancy_ellipses
from splap_editor.core.splats.splats import Splats
from splap_editor.io.sample_maker import STYLES, shape_sample
from splap_editor.io.sample_shapes import SHAPES
from tests.benchmark.ground_truth import GroundTruth, Pull, plain_arap
from tests.benchmark.peers import machine, note, report

OBJECTS = {"bench": 25_000, "comb": 20_000, "birdcage": 15_000, "cheese": 25_000, "coil": 20_000, "book": 25_000}
TRAINED = {"bench": "bench_2dgs.ply"}
"""Trained scenes whose mesh is a shape of the sample maker."""
RADII = (0.05, 0.075, 0.1)

Moved = Callable[[NDArray[np.float64], sp.csr_matrix, NDArray[np.int64], NDArray[np.float64]], NDArray[np.float64]]


@dataclass(frozen=True, eq=False)
class Scene:
    """Splats with the surface they stand for."""

    name: str
    regime: str
    splats: Splats
    truth: GroundTruth
    ellipses: Ellipses


def scenes(options: argparse.Namespace) -> Iterator[Scene]:
    """Yield the scenes asked for, the made ones first."""
    for name in options.objects:
        for regime in options.regime:
            n_splats = options.splats or OBJECTS[name]
            sample = shape_sample(name, n_splats, STYLES[regime], seed=options.seed)
            yield Scene(name, regime, sample.splats, GroundTruth(sample.surface), occupancy_ellipses(sample.splats))
    if options.trained is not None:
        from splap_editor.io.ply import read_ply

        for name, file in TRAINED.items():
            splats = read_ply(options.trained / file).splats
            yield Scene(name, "real", splats, GroundTruth(SHAPES[name]()), occupancy_ellipses(splats))


def graph_figures(scene: Scene, graph: SplatGraph) -> dict[str, object]:
    """Count what is wrong with a graph."""
    rng = np.random.default_rng(0)
    sizes = np.bincount(graph.components)
    return {
        "n_edges": graph.n_edges,
        "mean_degree": graph.degrees.mean(),
        "wrong_share": scene.truth.wrong_share(scene.ellipses.centers, graph.edges, rng),
        "n_components": len(sizes),
        "outside_largest": 1 - sizes[0] / sizes.sum(),
    }


def laplacians(scene: Scene, options: argparse.Namespace) -> Iterator[tuple[dict[str, object], sp.csr_matrix]]:
    """Yield each candidate's description and Laplacian."""
    from splap_editor.core.surface.geodesics import geodesic_neighbors
    from splap_editor.core.surface.laplacian import point_cloud_laplacian
    from splap_editor.core.surface.local_triangulation import local_triangulations

    for rule in options.rules:
        graph = splat_graph(scene.ellipses, GraphOptions(rule=rule))
        figures = graph_figures(scene, graph)
        triangles = local_triangulations(scene.ellipses, geodesic_neighbors(graph, 30))
        for method in options.laplacians:
            L, _ = point_cloud_laplacian(scene.ellipses.centers, triangles, graph=graph, method=method)
            yield {"candidate": rule, "laplacian": method, **figures}, L
    for k in options.knn:
        L, _ = robust_laplacian.point_cloud_laplacian(scene.ellipses.centers, n_neighbors=k)
        yield {"candidate": f"knn{k}", "laplacian": "robust"}, sp.csr_matrix(L)


def score(
    scene: Scene, pull: Pull, L: sp.csr_matrix, moved_mesh: NDArray[np.float64], moved: Moved
) -> NDArray[np.float64]:
    """Share of keypoints that end within each of `RADII` of their splat."""
    from scipy.spatial import cKDTree

    centers = scene.ellipses.centers
    nearest_vertex = scene.truth.tree.query(centers)[1]
    handle = np.isin(nearest_vertex, pull.handle)
    handle[cKDTree(centers).query(pull.center)[1]] = True
    far = (np.linalg.norm(centers - pull.center, axis=1) > 0.5 * scene.truth.size) & ~handle
    constrained = np.flatnonzero(handle | far)
    targets = centers[constrained] + np.where(handle[constrained, None], pull.move, 0.0)
    result = moved(centers, L, constrained, targets)
    # A keypoint tells about the free region alone.
    free = np.flatnonzero(~handle & ~far)
    partners = free[cKDTree(centers[free]).query(scene.truth.vertices[pull.keypoints])[1]]
    # What lies between keypoint and splat before the pull is no fault of the deformation.
    drift = moved_mesh[pull.keypoints] - scene.truth.vertices[pull.keypoints] - (result - centers)[partners]
    distance = np.linalg.norm(moved_mesh[pull.keypoints] - result[partners], axis=1)
    shares = [np.mean(distance <= radius) for radius in RADII]
    return np.array([*shares, np.linalg.norm(drift, axis=1).mean()])


def fidelity(scene: Scene, options: argparse.Namespace) -> None:
    """Report every candidate's mean score over the scene's pulls."""
    truth = scene.truth
    reference = truth.laplacian()
    pulls = truth.pulls(options.pulls, options.seed)
    moved = settled if options.solver == "converged" else plain_arap
    moved_meshes = []
    for pull in pulls:
        constrained = np.concatenate([pull.handle, pull.fixed])
        targets = truth.vertices[constrained].copy()
        targets[: len(pull.handle)] += pull.move
        order = np.argsort(constrained)
        moved_meshes.append(moved(truth.vertices, reference, constrained[order], targets[order]))
    for description, L in laplacians(scene, options):
        start = time.perf_counter()
        scores = np.array([score(scene, pull, L, mesh, moved) for pull, mesh in zip(pulls, moved_meshes, strict=True)])
        report(
            object=scene.name,
            regime=scene.regime,
            solver=options.solver,
            n_splats=scene.splats.n_splats,
            **description,
            **{f"pck_{radius}": mean for radius, mean in zip(RADII, scores.mean(0), strict=False)},
            mean_drift=scores[:, -1].mean(),
            pulls=scores[:, 1],
            seconds=time.perf_counter() - start,
        )


def settled(
    rest: NDArray[np.float64], L: sp.csr_matrix, constrained: NDArray[np.int64], targets: NDArray[np.float64]
) -> NDArray[np.float64]:
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
    return deformer.solve(transform).positions


def main() -> None:
    """Run the scenes and candidates the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--objects", nargs="*", choices=sorted(OBJECTS), default=list(OBJECTS))
    parser.add_argument("--regime", nargs="+", choices=sorted(STYLES), default=["thin"])
    parser.add_argument("--trained", type=Path, metavar="FOLDER", help="folder of the trained sample scenes")
    parser.add_argument("--splats", type=int, help="number of splats of every made object")
    parser.add_argument("--pulls", type=int, default=6, help="handles per object (6)")
    parser.add_argument("--rules", nargs="*", choices=["touch", "paper"], default=["paper", "touch"])
    parser.add_argument("--laplacians", nargs="+", choices=["stars", "robust"], default=["stars"])
    parser.add_argument("--knn", nargs="*", type=int, default=[10, 30])
    parser.add_argument("--solver", choices=["plain", "converged"], default="plain", help="ten plain steps, or settled")
    parser.add_argument("--graph-only", action="store_true", help="wrong edges, degree and components alone")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    report(benchmark="fidelity", **machine())
    for scene in scenes(options):
        note(f"{scene.name}, {scene.regime}: {scene.ellipses.n_nodes} nodes")
        if not options.graph_only:
            fidelity(scene, options)
            continue
        for rule in options.rules:
            graph = splat_graph(scene.ellipses, GraphOptions(rule=rule))
            report(object=scene.name, regime=scene.regime, candidate=rule, **graph_figures(scene, graph))


if __name__ == "__main__":
    main()
