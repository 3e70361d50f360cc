"""A drag as an artist makes it, frame by frame: solve, blend, kernels, settling, as JSON lines.

    python tests/benchmark/live.py --splats 100000 300000 1000000

The top of a ball above a rippled floor (`big_scene`) is pulled aside and turned over sixty frames; half of the scene is
free. For each size: making the surface, what the first drag waits for, a second handle with its first frame, a frame
with and without the splats' kernels (median, 95th percentile), settling after release, how far the last frame was from
that, and the peak of memory. With ``--peer``: libigl's ARAP on the same triangles, going on from frame to frame with
ten iterations each.
"""

import argparse
import os
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import igl
import numpy as np

from splap_editor.core.deformer import Deformation
from splap_editor.core.graph.options import GraphOptions
from splap_editor.core.handle_nodes import Region
from splap_editor.core.options import OptionSet
from splap_editor.core.pose import Pose
from splap_editor.core.reach_options import ReachOptions
from splap_editor.engine.bound_edit import BoundEdit, bind, kernels_of, ready_for_drags
from splap_editor.engine.edit import Edit, Handle
from splap_editor.engine.surface import Surface, surface_of
from splap_editor.io.sample_maker import big_scene
from tests.benchmark.peers import machine, note, peak_gib, report

N_FRAMES = 60
PEER_FRAMES = 3
PEER_ITERATIONS = 10


def pose_at(share: float) -> Pose:
    """Pose of the handle after a share of the drag: aside by 0.4 and turned by 40 degrees."""
    half = 0.5 * np.deg2rad(40.0) * share
    return Pose((0.4 * share, 0.1 * share, 0.05 * share), (float(np.cos(half)), 0.0, float(np.sin(half)), 0.0))


def edit_of_drag(surface: Surface) -> Edit:
    """One handle on top of the ball, and a free radius within which half of the nodes lie."""
    centers = surface.ellipses.centers
    top = centers[np.argmax(centers[:, 2])]
    free = float(np.median(np.linalg.norm(centers - top, axis=1)))
    handle = Handle(1, "top", "#f2a93b", Region(top, 0.1))
    return Edit(handles=(handle,), options=OptionSet(ReachOptions(free)))


def seconds(work: Callable[[], object]) -> float:
    """Wall-clock time of one call."""
    began = time.perf_counter()
    work()
    return time.perf_counter() - began


def milliseconds(frames: list[float]) -> dict[str, float]:
    """Median and 95th percentile."""
    return {"median_ms": 1e3 * float(np.median(frames)), "p95_ms": 1e3 * float(np.quantile(frames, 0.95))}


def dragged(surface: Surface, bound: BoundEdit, edit: Edit) -> Deformation:
    """Time the frames of the drag, and what settles after it."""
    solved, whole = [], []
    for share in np.linspace(0.0, 1.0, N_FRAMES + 1)[1:]:
        edit = edit.with_poses({1: pose_at(float(share))})
        began = time.perf_counter()
        deformation = bound.deformer.drag(edit.transforms)
        solved.append(time.perf_counter() - began)
        kernels_of(surface, edit, deformation)
        whole.append(time.perf_counter() - began)
    report(benchmark="drag", part="solve and blend", **milliseconds(solved))
    report(benchmark="drag", part="with kernels", **milliseconds(whole))
    settled: list[Deformation] = []
    took = seconds(lambda: settled.append(bound.deformer.solve(edit.transforms)))
    apart = np.linalg.norm(deformation.positions - settled[0].positions, axis=1) / surface.scene_scale
    report(benchmark="settle", seconds=took, drag_mean=float(apart.mean()), drag_largest=float(apart.max()))
    return settled[0]


def peer(surface: Surface, bound: BoundEdit, edit: Edit, settled: Deformation) -> None:
    """Time libigl on the same triangles, going on from frame to frame."""
    handles, rest = bound.handles, surface.rest
    data = igl.ARAPData()
    data.max_iter = PEER_ITERATIONS
    data.energy = igl.ARAP_ENERGY_TYPE_SPOKES
    held = handles.indices.astype(np.int32)
    bound_in = seconds(lambda: igl.arap_precomputation(rest, surface.triangles.astype(np.int64), 3, held, data))
    positions, frames = rest, []
    for share in np.linspace(0.0, 1.0, PEER_FRAMES + 1)[1:]:
        targets = handles.targets(rest, edit.with_poses({1: pose_at(float(share))}).transforms)
        began = time.perf_counter()
        positions = igl.arap_solve(targets, data, positions)
        frames.append(time.perf_counter() - began)
    apart = np.linalg.norm(positions - settled.positions, axis=1) / surface.scene_scale
    report(
        benchmark="peer", what="libigl, ten iterations", bind_seconds=bound_in, **milliseconds(frames),
        settled_mean=float(apart.mean()), settled_largest=float(apart.max()),
    )  # fmt: skip


def live(n_splats: int, with_peer: bool) -> None:
    """Run one size."""
    splats = big_scene(n_splats)
    surfaces: list[Surface] = []
    took = seconds(lambda: surfaces.append(surface_of(splats, GraphOptions())))
    surface = surfaces[0]
    report(benchmark="surface", n_splats=n_splats, n_nodes=surface.ellipses.n_nodes, seconds=took)
    report(benchmark="coarse model", seconds=seconds(lambda: ready_for_drags(surface)))
    edit = edit_of_drag(surface)
    bounds: list[BoundEdit] = []

    def first_frame() -> None:
        bounds.append(bind(surface, edit))
        bounds[-1].drag(edit.with_poses({1: pose_at(0.02)}))

    first = seconds(first_frame)
    bottom = surface.ellipses.centers[np.argmin(surface.ellipses.centers[:, 0])]
    edit = replace(edit, handles=(*edit.handles, Handle(2, "side", "#4fb3ff", Region(bottom, 0.1))))
    report(benchmark="bind and first frame", first_ms=1e3 * first, second_handle_ms=1e3 * seconds(first_frame))
    settled = dragged(surface, bounds[-1], edit)
    report(benchmark="memory", peak_gib=peak_gib())
    if with_peer:
        peer(surface, bounds[-1], edit.with_poses({1: pose_at(1.0)}), settled)


def main() -> None:
    """Run the sizes that the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--splats", type=int, nargs="+", default=[100_000])
    parser.add_argument("--peer", action="store_true", help="libigl's ARAP beside it, some frames of it")
    options = parser.parse_args()
    report(**machine())
    note("compiling")
    small = surface_of(big_scene(8_000), GraphOptions())
    ready_for_drags(small)
    edit = edit_of_drag(small)
    bound = bind(small, edit)
    bound.drag(edit.with_poses({1: pose_at(0.1)}))
    bound.pose(edit.with_poses({1: pose_at(0.1)}))
    for n_splats in options.splats:
        note(f"{n_splats} splats")
        live(n_splats, options.peer)


if __name__ == "__main__":
    main()
