"""The stages from a file to a pose, and what is kept of them."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from time import perf_counter

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from splap_editor.core.adaptation.kernel_adaptation import AdaptedKernels, KernelBinding, adapt_kernels
from splap_editor.core.arap.arap import ArapDeformer, ArapOptions
from splap_editor.core.arap.scene import ArapScene
from splap_editor.core.deformer import Deformation, Deformer, Handles
from splap_editor.core.graph.splat_graph import GraphOptions, SplatGraph, require_mendable
from splap_editor.core.handle_nodes import handle_nodes
from splap_editor.core.progress import Progress
from splap_editor.core.splats.occupancy import Ellipses, occupancy_ellipses
from splap_editor.core.splats.splats import Splats
from splap_editor.core.surface.geodesics import Neighborhoods
from splap_editor.engine.cache import StageCache, content_key
from splap_editor.engine.edit import Edit
from splap_editor.engine.surface_stages import (
    SurfaceStages,
    mended_stages,
    packed_stages,
    plain_stages,
    unmended,
    unpacked_stages,
)

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
    stages : SurfaceStages
        Graph, geodesics, Laplacian.
    binding : KernelBinding
        Carriers of every splat's ellipse.
    key : str
        Hash of everything the above was made from.
    timings_s : dict
        Seconds of each stage made, not loaded.
    """

    ellipses: Ellipses
    stages: SurfaceStages
    binding: KernelBinding
    key: str
    timings_s: dict[str, float] = field(default_factory=dict)

    @property
    def options(self) -> GraphOptions:
        """What the graph was made with."""
        return self.stages.options

    @property
    def graph(self) -> SplatGraph:
        """The splat graph, mended."""
        return self.stages.graph

    @property
    def neighborhoods(self) -> Neighborhoods:
        """Geodesic neighbours."""
        return self.stages.neighborhoods

    @property
    def triangles(self) -> NDArray[np.int32]:
        """(T, 3) local Delaunay stars."""
        return self.stages.triangles

    @property
    def L(self) -> sp.csr_array:
        """(n, n) positive semidefinite Laplacian."""
        return self.stages.L

    @property
    def M(self) -> NDArray[np.float64]:
        """(n,) lumped areas."""
        return self.stages.M

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
    near: Surface | None = None,
) -> Surface:
    """Build the splat graph, geodesics, Laplacian and kernel carriers of a scene.

    The stages are made without mends and kept so; mends are made to them,
    which searches again only where they reach. The result is the same to the
    bit whichever way it came about.

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
    near : Surface, optional
        One of the same ellipses; if it differs in mends only, it is gone on from.

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
    require_mendable(ellipses, options)
    plain = unmended(options)
    key = content_key((STAGE_VERSION, ellipses.centers, ellipses.semi_axes, ellipses.rows, plain))
    if near is not None and near.ellipses is ellipses and unmended(near.options) == plain:
        made = near.stages
    else:
        kept = None
        if cache is not None:
            kept = cache.load(key, lambda arrays: unpacked_stages(arrays, options, ellipses.n_nodes))
        made = kept or plain_stages(ellipses, options, timed, stages)
        if cache is not None and kept is None:
            cache.store(key, packed_stages(made))
    if made.options != options:
        made = mended_stages(ellipses, made, options, timed, stages)
    if options != plain:
        key = content_key((key, options))
    with timed("kernels"):
        binding = KernelBinding(splats, ellipses, made.neighborhoods, graph=made.graph, progress=stages("kernels"))
    return Surface(ellipses, made, binding, key, timings)


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
        from splap_editor.engine.bbw_binding import bbw_deformer

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
