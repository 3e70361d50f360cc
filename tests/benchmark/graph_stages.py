"""How long occupancy → Laplacian takes, stage by stage, beside the point-cloud Laplacian of robust_laplacian.

Prints one JSON object a line::

    python -m tests.benchmark.graph_stages --splats 25000 100000 400000
    python -m tests.benchmark.graph_stages --splats 1000000 --repeats 1 --no-peer
    python -m tests.benchmark.graph_stages --files resources/samples/bench_2dgs.ply
"""

import argparse
import time
from pathlib import Path
from statistics import median

import numpy as np
import robust_laplacian

from splap_editor.core.graph.splat_graph import GraphOptions, splat_graph
from splap_editor.core.splats.occupancy import occupancy_ellipses
from splap_editor.core.splats.splats import Splats
from splap_editor.core.surface.geodesics import geodesic_neighbors
from splap_editor.core.surface.laplacian import point_cloud_laplacian
from splap_editor.core.surface.local_triangulation import local_triangulations
from splap_editor.io.sample_maker import big_scene
from tests.benchmark.peers import machine, peak_gib, report, timed


def stage_seconds(splats: Splats, options: GraphOptions) -> tuple[dict[str, float], dict[str, object]]:
    """Seconds of each stage, run once, and figures of the result."""
    marks = [time.perf_counter()]

    def mark() -> None:
        marks.append(time.perf_counter())

    ellipses = occupancy_ellipses(splats)
    mark()
    graph = splat_graph(ellipses, options)
    mark()
    neighborhoods = geodesic_neighbors(graph, options.k)
    mark()
    triangles = local_triangulations(ellipses, neighborhoods)
    mark()
    L, _ = point_cloud_laplacian(ellipses.centers, triangles, graph=graph)
    mark()
    names = ("occupancy", "graph", "geodesics", "triangulation", "laplacian")
    seconds = dict(zip(names, np.diff(marks), strict=True))
    sizes = np.bincount(graph.components) if graph.n_nodes else np.zeros(1)
    figures = {
        "mean_degree": graph.degrees.mean(),
        "n_components": len(sizes),
        "outside_largest": graph.n_nodes - sizes[0],
        "triangles_per_node": len(triangles) / max(graph.n_nodes, 1),
        "entries_per_row": L.nnz / max(graph.n_nodes, 1),
    }
    return seconds, figures


def measure(name: str, splats: Splats, options: GraphOptions, *, repeats: int, peer: bool) -> dict[str, object]:
    """Median times of one scene, warm; with the peer's time on the same points in file order, and the ratio."""
    stage_seconds(big_scene(2000), options)
    runs = [stage_seconds(splats, options) for _ in range(repeats)]
    stages = {stage: median(seconds[stage] for seconds, _ in runs) for stage in runs[0][0]}
    result = {
        "benchmark": "occupancy_to_laplacian",
        "scene": name,
        "n_splats": splats.n_splats,
        "rule": options.rule,
        "seconds": median(sum(seconds.values()) for seconds, _ in runs),
        "stages": stages,
        **runs[0][1],
        "peak_gib": peak_gib(),
    }
    if peer:
        points = np.ascontiguousarray(splats.means, np.float64)
        seconds, _ = timed(
            lambda: robust_laplacian.point_cloud_laplacian(points, n_neighbors=30), repeats=min(repeats, 3), warm_up=0
        )
        result |= {"peer_seconds": seconds, "ratio": result["seconds"] / seconds}
    return result


def with_giants(splats: Splats, share: float = 0.01, factor: float = 100.0) -> Splats:
    """Let some splats grow far beyond the others."""
    scales = np.array(splats.log_scales, np.float64)
    giants = np.random.default_rng(0).choice(len(scales), round(share * len(scales)), replace=False)
    scales[giants] += np.log(factor)
    fields = {name: getattr(splats, name) for name in Splats.__dataclass_fields__}
    return Splats(**(fields | {"log_scales": scales}))


def main() -> None:
    """Measure the scenes asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--splats", type=int, nargs="*", default=[100_000])
    parser.add_argument("--giants", type=int, nargs="*", default=[], help="sizes of scenes with 1 %% of splats × 100")
    parser.add_argument("--files", type=Path, nargs="*", default=[])
    parser.add_argument("--rule", choices=["touch", "paper"], default="touch")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--no-peer", action="store_true")
    arguments = parser.parse_args()
    options = GraphOptions(rule=arguments.rule)
    report(**machine())
    scenes = [("big_scene", lambda n=n: big_scene(n, sh_degree=0)) for n in arguments.splats]
    scenes += [("giants", lambda n=n: with_giants(big_scene(n, sh_degree=0))) for n in arguments.giants]
    if arguments.files:
        from splap_editor.io.ply import read_ply

        scenes += [(path.name, lambda path=path: read_ply(path).splats) for path in arguments.files]
    for name, scene in scenes:
        report(**measure(name, scene(), options, repeats=arguments.repeats, peer=not arguments.no_peer))


if __name__ == "__main__":
    main()
