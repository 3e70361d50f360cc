"""The surface of a scene: every stage from splats to what deformers are bound to, and what is kept of them."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import Any, TypeVar

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from splap_editor.core.adaptation.kernel_binding import KernelBinding
from splap_editor.core.graph.carriers import carriers_of, carrying
from splap_editor.core.graph.options import GRAPH_RULES, LAPLACIANS, NEIGHBORHOODS, GraphOptions
from splap_editor.core.graph.splat_graph import SplatGraph, require_mendable
from splap_editor.core.index_spaces import FileMask, Nodes, RowPair
from splap_editor.core.kept_arrays import Arrays
from splap_editor.core.progress import Guard, StageProgress, silent, unguarded
from splap_editor.core.splats.occupancy import Ellipses, occupancy_ellipses
from splap_editor.core.splats.splats import Splats
from splap_editor.core.surface.geodesics import Neighborhoods
from splap_editor.engine.cache import StageCache, content_key
from splap_editor.engine.sources import source_hash
from splap_editor.engine.surface_stages import (
    SurfaceStages,
    mended_stages,
    packed_stages,
    plain_stages,
    unmended,
    unpacked_stages,
)

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Surface:
    """Everything the deformers need of a scene; made once per scene and graph options, cached on disk.

    Parameters
    ----------
    ellipses : Ellipses
        Of the carriers, the nodes of everything below.
    visible : Ellipses
        Of all active splats.
    stages : SurfaceStages
        Graph, geodesics, Laplacian.
    binding : KernelBinding
        Carriers of every splat's ellipse.
    key : str
        Hash of everything the above was made from.
    options : GraphOptions
        What the graph was asked for with; its stages name no splat that is removed.
    plain_key : str
        Hash of what it would be made from without mends.
    timings_s : dict
        Seconds of each stage made, not loaded.
    """

    ellipses: Ellipses
    visible: Ellipses
    stages: SurfaceStages
    binding: KernelBinding
    key: str
    options: GraphOptions
    plain_key: str
    timings_s: dict[str, float] = field(default_factory=dict)
    _shared: dict[Callable[["Surface"], Any], Any] = field(default_factory=dict, repr=False)

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

    @property
    def rest(self) -> NDArray[np.float64]:
        """(n, 3) rest positions of the nodes."""
        return self.ellipses.centers

    @property
    def scene_scale(self) -> float:
        """Size s of the scene in world units."""
        return self.ellipses.scene_scale

    def shared(self, make: Callable[["Surface"], T]) -> T:
        """What all handle sets of the scene have in common, made by ``make(surface)`` when first asked for."""
        if make not in self._shared:
            self._shared[make] = make(self)
        made: T = self._shared[make]
        return made


def surface_of(
    splats: Splats,
    options: GraphOptions,
    *,
    ellipses: Ellipses | None = None,
    removed: FileMask | None = None,
    cache: StageCache | None = None,
    stages: StageProgress = silent,
    near: Surface | None = None,
    alone: Guard = unguarded,
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
        Those of all active splats of the scene, where they are at hand.
    removed : (N,) bool, optional
        Splats that are left out, where the ellipses are not at hand. Cut and added edges of theirs are passed over.
    cache : StageCache, optional
        Asked before the slow stages are run, and given their results.
    stages : callable
        ``stages(name)`` gives the progress callback of a stage.
    near : Surface, optional
        One of the same ellipses; if it differs in mends only, it is gone on from.
    alone : callable
        Who prepares scenes on several threads lets one at a time into the loops that run on several cores, see
        `splap_editor.session.side_by_side.alone`: where numba has to use its portable threading layer, two at once
        abort the process.

    Raises
    ------
    ValueError
        No splat of the scene is active, or a mended edge names a splat that is not.
    """
    timings: dict[str, float] = {}
    timed = _Timed(timings)
    if ellipses is None:
        with timed("occupancy"):
            ellipses = occupancy_ellipses(splats, removed=removed)
    _require_visible(ellipses)
    asked, options = options, _without_removed(options, ellipses)
    visible = ellipses
    plain = unmended(options)
    carries = carriers_of(visible, splats, options)
    if near is not None and near.visible is visible and np.array_equal(near.ellipses.rows, visible.rows[carries]):
        ellipses = near.ellipses
    else:
        ellipses = carrying(visible, carries)
    require_mendable(ellipses, options)
    # Tolerances are in units of the scene's size, which opacities have a say in too.
    binding: KernelBinding | None = None
    if near is not None and near.ellipses is ellipses and unmended(near.options) == plain:
        made, plain_key = near.stages, near.plain_key
        if near.binding.splats is splats:
            binding = near.binding
    else:
        made_from = (ellipses.centers, ellipses.semi_axes, ellipses.rows, ellipses.scene_scale)
        plain_key = content_key((_made_by(plain), *made_from, plain))

        def make() -> SurfaceStages:
            return plain_stages(ellipses, options, timed, stages, alone)

        def unpacked(arrays: Arrays) -> SurfaceStages:
            return unpacked_stages(arrays, options, ellipses.n_nodes)

        made = make() if cache is None else cache.kept(plain_key, make, packed_stages, unpacked)
    stale: Nodes | None = np.zeros(0, np.int64)
    if made.options != options:
        made, stale = mended_stages(ellipses, made, options, timed, stages, alone)
    key = plain_key if options == plain else content_key((plain_key, options))
    with timed("kernels"):
        if binding is None or stale is None:
            binding = KernelBinding(splats, ellipses, made.neighborhoods, graph=made.graph, progress=stages("kernels"))
        else:
            binding = binding.mended(made.neighborhoods, made.graph, stale)
    return Surface(ellipses, visible, made, binding, key, asked, plain_key, timings)


def _require_visible(ellipses: Ellipses) -> None:
    if ellipses.n_nodes:
        return
    if ellipses.removed is not None:
        raise ValueError("every visible splat is removed, so there is no surface to deform: restore some")
    raise ValueError(
        "no splat of this file is visible (opacity above 1/255 and a finite size), so there is no surface to "
        "deform; check the layout it was read with"
    )


def _without_removed(options: GraphOptions, ellipses: Ellipses) -> GraphOptions:
    """Leave out the cut and added edges that end at a splat which is removed."""
    removed = ellipses.removed
    if removed is None or not (options.cut or options.add):
        return options

    def kept(pairs: tuple[RowPair, ...]) -> tuple[RowPair, ...]:
        # A row beyond the file is refused where all of them are looked at.
        return tuple(pair for pair in pairs if not any(row < len(removed) and removed[row] for row in pair))

    return replace(options, cut=kept(options.cut), add=kept(options.add))


def _made_by(options: GraphOptions) -> str:
    """Hash of the source of everything that the cached stages are made by."""
    rows = GRAPH_RULES[options.rule], NEIGHBORHOODS[options.neighborhood], LAPLACIANS[options.laplacian]
    return source_hash("splap_editor.engine.surface_stages", *(row.module for row in rows))


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
