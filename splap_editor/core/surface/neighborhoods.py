"""The neighbourhoods that a surface can be made of, each as a function of the same arguments."""

from splap_editor.core.graph.splat_graph import SplatGraph
from splap_editor.core.progress import Progress
from splap_editor.core.splats.occupancy import Ellipses
from splap_editor.core.surface.geodesics import Neighborhoods, geodesic_neighbors


def nearest_along_surface(ellipses: Ellipses, graph: SplatGraph, k: int, progress: Progress) -> Neighborhoods:
    """Find the k nearest nodes by shortest path on the graph, see `geodesic_neighbors`."""
    return geodesic_neighbors(graph, k, progress=progress)
