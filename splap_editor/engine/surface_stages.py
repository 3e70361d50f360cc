"""The slow stages of a scene: made in full, loaded, or brought up to date after a mend."""

from collections.abc import Iterable
from contextlib import AbstractContextManager
from dataclasses import replace
from typing import NamedTuple, Protocol

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from splap_editor.core.graph.options import LAPLACIANS, NEIGHBORHOODS, GraphOptions
from splap_editor.core.graph.splat_graph import SplatGraph, mended_graph, splat_graph
from splap_editor.core.index_spaces import Nodes, RowPair
from splap_editor.core.kept_arrays import Arrays, require_array, require_rows
from splap_editor.core.options import loaded
from splap_editor.core.progress import Guard, StageProgress, unguarded
from splap_editor.core.splats.occupancy import Ellipses
from splap_editor.core.surface.geodesics import Neighborhoods
from splap_editor.core.surface.laplacian import point_cloud_laplacian
from splap_editor.core.surface.local_triangulation import local_triangulations, mended_triangulations
from splap_editor.engine.strokes import stroke_mends


class Timed(Protocol):
    """``with timed("graph"):`` keeps the block's seconds."""

    def __call__(self, stage: str) -> AbstractContextManager:
        """Begin a block."""
        ...


class SurfaceStages(NamedTuple):
    """Graph, and what is made from it.

    Parameters
    ----------
    options : GraphOptions
        What it was made with.
    unmended : SplatGraph
        The graph without cut or added edges.
    graph : SplatGraph
    neighborhoods : Neighborhoods
    triangles : (T, 3) int32
    L : (n, n) csr_array
    M : (n,) float64
    mends : GraphOptions
        The options with each stroke as the edges that it cut or added.
    """

    options: GraphOptions
    unmended: SplatGraph
    graph: SplatGraph
    neighborhoods: Neighborhoods
    triangles: NDArray[np.int32]
    L: sp.csr_array
    M: NDArray[np.float64]
    mends: GraphOptions


def unmended(options: GraphOptions) -> GraphOptions:
    """Leave out the cut and added edges, and strokes."""
    return replace(options, cut=(), add=(), separate=(), join=())


def plain_stages(
    ellipses: Ellipses, options: GraphOptions, timed: Timed, stages: StageProgress, alone: Guard = unguarded
) -> SurfaceStages:
    """Make everything, without cut and added edges."""
    options = unmended(options)
    with timed("graph"), alone(stages("graph")):
        graph = splat_graph(ellipses, options, progress=stages("graph"))
    with timed("geodesics"), alone(stages("geodesics")):
        neighbors = NEIGHBORHOODS[options.neighborhood].load()
        neighborhoods = neighbors(ellipses, graph, options.k, stages("geodesics"))
    with timed("laplacian"):
        triangles = local_triangulations(ellipses, neighborhoods, progress=stages("laplacian"))
        L, M = point_cloud_laplacian(ellipses.centers, triangles, graph=graph, method=options.laplacian)
    return SurfaceStages(options, graph, graph, neighborhoods, triangles, L, M, options)


def mended_stages(
    ellipses: Ellipses,
    before: SurfaceStages,
    options: GraphOptions,
    timed: Timed,
    stages: StageProgress,
    alone: Guard = unguarded,
) -> tuple[SurfaceStages, Nodes | None]:
    """Go on from stages that differ in cut and added edges and strokes only: to the bit what all stages would give.

    The graph is not searched again, geodesics and stars only where a changed edge reaches: at the nodes given beside
    the stages; None if everywhere.
    """
    with timed("mends"):
        progress = stages("mends")
        mends = stroke_mends(ellipses, before.unmended, options, near=(before.options, before.mends, before.graph))
        is_plain = not mends.cut and not mends.add
        graph = before.unmended if is_plain else mended_graph(ellipses, before.unmended, mends)
        progress(0.2)
        ends = _changed_ends(ellipses, before.mends, mends)
        stale: Nodes | None = None
        with alone(progress):
            row = NEIGHBORHOODS[options.neighborhood]
            if row.mended:
                neighborhoods, stale = loaded(row.mended)(graph, before.neighborhoods, ends, options.k)
                triangles = mended_triangulations(ellipses, neighborhoods, before.triangles, stale)
            else:
                neighborhoods = row.load()(ellipses, graph, options.k, progress)
                triangles = local_triangulations(ellipses, neighborhoods)
        progress(0.5)
    with timed("laplacian"):
        mended = LAPLACIANS[options.laplacian].mended
        if mended and stale is not None:
            were = before.triangles, before.L, before.M
            L, M = loaded(mended)(ellipses.centers, triangles, graph, stale, *were)
        else:
            L, M = point_cloud_laplacian(ellipses.centers, triangles, graph=graph, method=options.laplacian)
    return SurfaceStages(options, before.unmended, graph, neighborhoods, triangles, L, M, mends), stale


def _changed_ends(ellipses: Ellipses, before: GraphOptions, after: GraphOptions) -> Nodes:
    """Nodes at the ends of the edges that only one of two options names."""
    pairs = (_pairs(before.cut) ^ _pairs(after.cut)) | (_pairs(before.add) ^ _pairs(after.add))
    return ellipses.node_of_row[np.array(sorted({row for pair in pairs for row in pair}), np.int64)]


def _pairs(pairs: Iterable[RowPair]) -> set[RowPair]:
    return {(min(pair), max(pair)) for pair in pairs}


def packed_stages(made: SurfaceStages) -> Arrays:
    """Arrays of unmended stages, for the cache."""
    graph, neighborhoods, L = made.graph, made.neighborhoods, made.L
    arrays = {
        "graph_indptr": graph.indptr.astype(np.int32, copy=False),
        "graph_indices": graph.indices.astype(np.int32, copy=False),
        "graph_lengths": graph.lengths,
        "graph_epsilon": np.array(graph.epsilon),
        "near_indptr": neighborhoods.indptr.astype(np.int32, copy=False),
        "near_indices": neighborhoods.indices.astype(np.int32, copy=False),
        "near_distances": neighborhoods.distances,
        "triangles": made.triangles,
        "L_indptr": L.indptr.astype(np.int32, copy=False),
        "L_indices": L.indices.astype(np.int32, copy=False),
        "L_data": L.data,
        "M": made.M,
    }
    if graph.touch is not None:
        arrays["graph_touch"] = graph.touch
    return arrays


def unpacked_stages(kept: Arrays, options: GraphOptions, n_nodes: int) -> SurfaceStages:
    """Unmended stages from the cache.

    Raises
    ------
    CacheEntryError, KeyError
        If they are not of ``n_nodes`` nodes, or an index is out of range.
    """
    for name in ("graph", "near", "L"):
        require_rows(kept, name, n_nodes, n_nodes)
    for name, like in (("graph_lengths", "graph_indices"), ("near_distances", "near_indices"), ("L_data", "L_indices")):
        require_array(kept[name], name, kept[like].shape, np.float64)
    require_array(kept["graph_epsilon"], "graph_epsilon", (), np.float64)
    require_array(kept["triangles"], "triangles", (None, 3), np.int32, (0, n_nodes))
    require_array(kept["M"], "M", (n_nodes,), np.float64)
    touch = kept.get("graph_touch")
    if touch is not None:
        require_array(touch, "graph_touch", kept["graph_indices"].shape, np.float64)
    graph = SplatGraph(
        kept["graph_indptr"], kept["graph_indices"], kept["graph_lengths"], touch, float(kept["graph_epsilon"])
    )
    neighborhoods = Neighborhoods(kept["near_indptr"], kept["near_indices"], kept["near_distances"])
    L = sp.csr_array((kept["L_data"], kept["L_indices"], kept["L_indptr"]), shape=(n_nodes, n_nodes))
    options = unmended(options)
    return SurfaceStages(options, graph, graph, neighborhoods, kept["triangles"], L, kept["M"], options)
