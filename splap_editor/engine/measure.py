"""Distances between two splats: straight, and along the surface."""

from typing import NamedTuple

import numpy as np

from splap_editor.core.graph.splat_graph import SplatGraph
from splap_editor.core.index_spaces import FileRow
from splap_editor.core.place import Place
from splap_editor.core.splats.occupancy import Ellipses
from splap_editor.core.surface.geodesics import geodesic_distances


class Measured(NamedTuple):
    """Distances in the units that are written.

    Parameters
    ----------
    straight : float
        As the crow flies.
    along : float
        Length of the shortest path along the splat graph; inf where none leads.
    """

    straight: float
    along: float


def measured(ellipses: Ellipses, graph: SplatGraph, a: FileRow, b: FileRow, place: Place = Place()) -> Measured:  # noqa: B008 - immutable
    """Measure from one splat to another, at rest.

    Raises
    ------
    ValueError
        One of them is inert or removed.
    """
    nodes = ellipses.node_of_row[[a, b]]
    if (nodes < 0).any():
        raise ValueError(f"row {(a, b)[int(np.argmax(nodes < 0))]} takes no part in the surface: choose another splat")
    straight = float(np.linalg.norm(ellipses.centers[nodes[1]] - ellipses.centers[nodes[0]]))
    along = float(geodesic_distances(graph, nodes[:1])[nodes[1]])
    return Measured(place.scale * straight, place.scale * along)
