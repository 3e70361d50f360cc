"""Distances between two splats: straight, and along the surface."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.graph.splat_graph import SplatGraph
from splap_editor.core.index_spaces import FileRow, Node
from splap_editor.core.place import Place
from splap_editor.core.splats.occupancy import Ellipses
from splap_editor.core.surface.geodesics import geodesic_distances

_LEAST = 1e-9
"""No edge is shorter than this share of the size, as in a `SplatGraph`."""


class Measured(NamedTuple):
    """Distances in the units that are written.

    Parameters
    ----------
    straight : float
        As the crow flies.
    along : float
        Length of the shortest path along the splat graph; inf where none leads.
    path : (k,) int64
        File rows along that path, from one end to the other; empty where none leads.
    """

    straight: float
    along: float
    path: NDArray[np.int64]


def measured(
    ellipses: Ellipses,
    graph: SplatGraph,
    a: FileRow,
    b: FileRow,
    place: Place = Place(),  # noqa: B008 - immutable
    positions: NDArray[np.floating] | None = None,
) -> Measured:
    """Measure from one splat to another.

    Parameters
    ----------
    ellipses : Ellipses
    graph : SplatGraph
    a, b : FileRow
    place : Place
        Says the units.
    positions : (N, 3) float, optional
        Centres by file row, as posed; without, at rest.

    Raises
    ------
    ValueError
        One of them is inert or removed.
    """
    nodes = ellipses.node_of_row[[a, b]]
    if (nodes < 0).any():
        raise ValueError(f"row {(a, b)[int(np.argmax(nodes < 0))]} takes no part in the surface: choose another splat")
    centers = ellipses.centers
    if positions is not None:
        centers = np.asarray(positions, np.float64)[ellipses.rows]
        starts = np.repeat(np.arange(graph.n_nodes), np.diff(graph.indptr))
        lengths = np.linalg.norm(centers[starts] - centers[graph.indices], axis=1)
        graph = replace(graph, lengths=np.maximum(lengths, _LEAST * ellipses.scene_scale))
    straight = float(np.linalg.norm(centers[nodes[1]] - centers[nodes[0]]))
    distances = geodesic_distances(graph, nodes[:1])
    path = ellipses.rows[_way_back(graph, distances, int(nodes[1]))[::-1]].astype(np.int64)
    return Measured(place.scale * straight, place.scale * float(distances[nodes[1]]), path)


def _way_back(graph: SplatGraph, distances: NDArray[np.float64], node: Node) -> list[Node]:
    """Nodes of a shortest path, from its end to where the distances are 0."""
    if not np.isfinite(distances[node]):
        return []
    path = [node]
    while distances[node] > 0.0:
        entries = slice(graph.indptr[node], graph.indptr[node + 1])
        before = graph.indices[entries]
        # Every edge has a length: each step comes nearer.
        node = int(before[np.argmin(distances[before] + graph.lengths[entries])])
        path.append(node)
    return path
