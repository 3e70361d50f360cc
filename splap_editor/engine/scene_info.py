"""Facts about a scene, as ``splap-editor info`` and the scene panel show them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from splap_editor.core.splats.occupancy import Ellipses, occupancy_ellipses
from splap_editor.core.splats.splats import Splats
from splap_editor.io.ply import SplatFile

if TYPE_CHECKING:
    # The graph brings the compiler with it, which `splap-editor info` shall not wait for.
    from splap_editor.core.graph.splat_graph import SplatGraph


def scene_info(file: SplatFile) -> tuple[dict, Ellipses]:
    """Describe a file; also returns the ellipses it had to make for that."""
    splats = file.splats
    ellipses = occupancy_ellipses(splats)
    info = {
        "n_splats": splats.n_splats,
        "format": file.format_name,
        "layout": file.layout.name,
        "layout_reason": file.layout.reason,
        "sh_degree": splats.sh_degree,
        "n_scales": splats.n_scales,
        "n_inert": int(np.count_nonzero(ellipses.inert)),
        "scene_scale": float(ellipses.scene_scale),
        "flatness": flatness(splats),
        "warnings": list(file.warnings),
    }
    return info, ellipses


def flatness(splats: Splats) -> dict[str, float]:
    """Percentiles of smallest by middle scale; 0 is a disc, 1 a ball. Two-scale splats are discs."""
    ratios = splats.thinness[np.isfinite(splats.thinness)]
    if not ratios.size:
        return {"p5": 0.0, "p50": 0.0, "p95": 0.0}
    p5, p50, p95 = np.percentile(ratios, (5, 50, 95))
    return {"p5": float(p5), "p50": float(p50), "p95": float(p95)}


def graph_info(graph: SplatGraph) -> dict[str, float]:
    """Count a graph's edges and components."""
    sizes = np.bincount(graph.components) if graph.n_nodes else np.zeros(0, int)
    return {
        "n_edges": int(graph.n_edges),
        "mean_degree": round(2 * graph.n_edges / max(graph.n_nodes, 1), 3),
        "n_components": len(sizes),
        "largest_component": int(sizes.max(initial=0)),
    }
