"""The stages from a file to a pose, and what is kept of them."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from time import perf_counter

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from splap_editor.core.arap import ArapDeformer, ArapOptions
from splap_editor.core.arap_scene import ArapScene
from splap_editor.core.deformer import Deformation, Deformer, Handles
from splap_editor.core.geodesics import Neighborhoods, geodesic_neighbors
from splap_editor.core.handle_nodes import handle_nodes
from splap_editor.core.kernel_adaptation import AdaptedKernels, KernelBinding, adapt_kernels
from splap_editor.core.laplacian import point_cloud_laplacian
from splap_editor.core.local_triangulation import local_triangulations
from splap_editor.core.occupancy import Ellipses, occupancy_ellipses
from splap_editor.core.progress import Progress
from splap_editor.core.splat_graph import GraphOptions, SplatGraph, splat_graph
from splap_editor.core.splats import Splats
from splap_editor.session.cache import Arrays, StageCache, content_key
from splap_editor.session.edit import Edit

STAGE_VERSION = 1
"""Raised whenever a cached stage gives other numbers than before."""

StageProgress = Callable[[str], Progress]
"""Gives the progress callback of a named stage."""


def silent(stage: str) -> Progress:
    """Report no stage."""
    return lambda share: None


@dataclass(frozen=True, eq=False)
class Surface:
    """Everything the deformers need of a scene; made once per scene and graph options, cached on disk.

    Parameters
    ----------
    ellipses : Ellipses
    graph : SplatGraph
    neighborhoods : Neighborhoods
    triangles : (T, 3) int32
        Local Delaunay stars.
    L : (n, n) csr_array
        Positive semidefinite Laplacian.
    M : (n,) float64
        Lumped areas.
    binding : KernelBinding
        Carriers of every splat's ellipse.
    options : GraphOptions
        What the graph was made with.
    key : str
        Hash of everything the above was made from.
    timings_s : dict
        Seconds of each stage made, not loaded.
    """

    ellipses: Ellipses
    graph: SplatGraph
    neighborhoods: Neighborhoods
    triangles: NDArray[np.int32]
    L: sp.csr_array
    M: NDArray[np.float64]
    binding: KernelBinding
    options: GraphOptions
    key: str
    timings_s: dict[str, float] = field(default_factory=dict)

    @cached_property
    def arap_scene(self) -> ArapScene:
        """What all as-rigid-as-possible handle sets of the scene share; its coarse model is made when first dragged."""
        return ArapScene(self.ellipses.centers, self.L, self.graph)


def surface_of(
    splats: Splats,
    options: GraphOptions,
    *,
    ellipses: Ellipses | None = None,
    cache: StageCache | None = None,
    stages: StageProgress = silent,
) -> Surface:
    """Build the splat graph, geodesics, Laplacian and kernel carriers of a scene.

    Parameters
    ----------
    splats : Splats
    options : GraphOptions
    ellipses : Ellipses, optional
        The scene's occupancy ellipses where they are at hand.
    cache : StageCache, optional
        Asked before the slow stages are run, and given their results.
    stages : callable
        ``stages(name)`` gives the progress callback of a stage.

    Raises
    ------
    ValueError
        No splat of the scene is active, or a mended edge names a splat that is not.
    """
    timings: dict[str, float] = {}
    timed = _Timed(timings)
    if ellipses is None:
        with timed("occupancy"):
            ellipses = occupancy_ellipses(splats)
    if ellipses.n_nodes == 0:
        raise ValueError(
            "no splat of this file is visible (opacity above 1/255 and a finite size), so there is no surface to "
            "deform; check the layout it was read with"
        )
    key = content_key((STAGE_VERSION, ellipses.centers, ellipses.semi_axes, ellipses.rows, options))
    kept = cache.load(key) if cache is not None else None
    if kept is None:
        with timed("graph"):
            graph = splat_graph(ellipses, options, progress=stages("graph"))
        with timed("geodesics"):
            neighborhoods = geodesic_neighbors(graph, options.k, progress=stages("geodesics"))
        with timed("laplacian"):
            triangles = local_triangulations(ellipses, neighborhoods, progress=stages("laplacian"))
            L, M = point_cloud_laplacian(ellipses.centers, triangles, graph=graph)
        if cache is not None:
            cache.store(key, _packed(graph, neighborhoods, triangles, L, M))
    else:
        graph, neighborhoods, triangles, L, M = _unpacked(kept)
    with timed("kernels"):
        binding = KernelBinding(splats, ellipses, neighborhoods, graph=graph, progress=stages("kernels"))
    return Surface(ellipses, graph, neighborhoods, triangles, L, M, binding, options, key, timings)


def handles_of(surface: Surface, edit: Edit) -> Handles:
    """Resolve an edit's regions to nodes of the scene; defaults in units of the scene scale are filled in."""
    s = surface.ellipses.scene_scale
    free = edit.free_radius
    if free is not None and np.isnan(free):
        free = 0.5 * s
    if edit.method == "bbw":
        free = None
    cages = [np.inf if h.cage_radius is None else h.cage_radius for h in edit.active_handles]
    cages = [0.3 * s if np.isnan(radius) else radius for radius in cages]
    return handle_nodes(
        surface.ellipses,
        [h.region for h in edit.active_handles],
        list(edit.pins),
        free_radius=free,
        cage_radii=cages,
    )


def deformer_of(
    surface: Surface,
    edit: Edit,
    handles: Handles,
    *,
    cache: StageCache | None = None,
    progress: Progress,
    stages: StageProgress | None = None,
    n_threads: int = 4,
) -> Deformer:
    """Bind the deformer that an edit names; the one place where deformers are chosen.

    ``stages`` is told, instead of ``progress``, where a deformer has more to say than a share; ``n_threads`` is for
    those that have independent parts.
    """
    if edit.method == "bbw":
        # The quadratic-program solvers are imported only by those who want them.
        from splap_editor.session.bbw_binding import bbw_deformer

        return bbw_deformer(
            surface,
            handles,
            blending=edit.blending,
            cache=cache,
            progress=progress,
            stages=stages,
            n_threads=n_threads,
        )
    return ArapDeformer(
        surface.ellipses.centers,
        surface.L,
        handles,
        scene_scale=surface.ellipses.scene_scale,
        M=surface.M,
        graph=surface.graph,
        triangles=surface.triangles,
        options=ArapOptions(
            kind=edit.solver.kind,
            tolerance=edit.solver.tolerance,
            iterations=edit.solver.iterations,
            smoothness=edit.solver.smoothness,
        ),
        scene=surface.arap_scene,
        progress=progress,
    )


def kernels_of(surface: Surface, edit: Edit, deformation: Deformation) -> AdaptedKernels:
    """Adapt every splat of the file to a deformation."""
    return adapt_kernels(surface.binding, deformation, method=edit.adaptation, hops=edit.hops)


class _Timed:
    """``with timed("graph"):`` adds the block's seconds to a dictionary."""

    def __init__(self, timings: dict[str, float]) -> None:
        self._timings = timings

    def __call__(self, stage: str) -> "_Timed":
        self._stage = stage
        return self

    def __enter__(self) -> None:
        self._start = perf_counter()

    def __exit__(self, *_: object) -> None:
        self._timings[self._stage] = perf_counter() - self._start


def _packed(graph, neighborhoods, triangles, L, M) -> Arrays:
    arrays = {
        "graph_indptr": graph.indptr,
        "graph_indices": graph.indices,
        "graph_lengths": graph.lengths,
        "graph_epsilon": np.array(graph.epsilon),
        "near_indptr": neighborhoods.indptr,
        "near_indices": neighborhoods.indices,
        "near_distances": neighborhoods.distances,
        "triangles": triangles,
        "L_indptr": L.indptr,
        "L_indices": L.indices,
        "L_data": L.data,
        "M": M,
    }
    if graph.touch is not None:
        arrays["graph_touch"] = graph.touch
    return arrays


def _unpacked(kept: Arrays):
    graph = SplatGraph(
        kept["graph_indptr"],
        kept["graph_indices"],
        kept["graph_lengths"],
        kept.get("graph_touch"),
        float(kept["graph_epsilon"]),
    )
    neighborhoods = Neighborhoods(kept["near_indptr"], kept["near_indices"], kept["near_distances"])
    n = len(kept["M"])
    L = sp.csr_array((kept["L_data"], kept["L_indices"], kept["L_indptr"]), shape=(n, n))
    return graph, neighborhoods, kept["triangles"], L, kept["M"]
