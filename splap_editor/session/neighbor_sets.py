"""Who counts as a splat's neighbour: the answers of the methods there are, and how two of them differ."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.graph.carriers import carrying
from splap_editor.core.graph.options import GraphOptions
from splap_editor.core.graph.splat_graph import SplatGraph, splat_graph
from splap_editor.core.index_spaces import Node, Nodes
from splap_editor.core.splats.occupancy import Ellipses
from splap_editor.core.surface.geodesics import Neighborhoods, geodesic_distances
from splap_editor.core.surface.neighborhoods import mahalanobis_frame

NEIGHBOR_KINDS = {
    "graph": "Splat graph",
    "geodesic": "Nearest along the surface",
    "paper-graph": "Paper's graph",
    "paper": "Nearest along the paper's graph",
    "euclidean": "Nearest in space",
    "mahalanobis": "Nearest by Mahalanobis",
}
"""Names of the answers, and words for them."""


@dataclass(frozen=True, eq=False)
class NeighborComparison:
    """Two sets of nodes, and where they differ; all by rising distance.

    Parameters
    ----------
    first, second : (K,) int64
    common, only_first, only_second : (M,) int64
    """

    first: Nodes
    second: Nodes
    common: Nodes
    only_first: Nodes
    only_second: Nodes


def compared(first: Nodes, second: Nodes) -> NeighborComparison:
    """Sort two sets of nodes into what they share and what only one has."""
    shared = np.isin(first, second)
    return NeighborComparison(first, second, first[shared], first[~shared], second[~np.isin(second, first)])


def neighbor_set(
    kind: str, node: Node, ellipses: Ellipses, graph: SplatGraph, neighborhoods: Neighborhoods, *, k: int = 10
) -> Nodes:
    """Neighbours of a node by one of the answers.

    Parameters
    ----------
    kind : str
        ``"graph"``: those joined to it by an edge, however many.
        ``"geodesic"``: the k nearest by shortest path on the graph; fewer in a small component.
        ``"paper-graph"``, ``"paper"``: the same two on the graph that the paper's rule makes with the tolerance of
        the graph at hand, without mends; of it only what lies about the node is made.
        ``"euclidean"``: the k nearest centres.
        ``"mahalanobis"``: the k least ``d² = (p_j - p_i)ᵀ Σ_i⁻¹ (p_j - p_i)`` with the splat's own covariance, its
        thickness set to a tenth of the smaller of its other standard deviations as the comparison in [1]_ does.
    node : Node
    ellipses : Ellipses
    graph : SplatGraph
    neighborhoods : Neighborhoods
        Geodesic neighbours at hand; asked where they reach.
    k : int

    Returns
    -------
    (K,) int64
        Nodes by rising distance, equal ones by rising node; never the node itself.

    Raises
    ------
    ValueError
        If ``kind`` is unknown, or there is no such node.

    References
    ----------
    .. [1] SpLap, 3DV 2026, supplement.
    """
    if not 0 <= node < ellipses.n_nodes:
        raise ValueError(f"node must be 0 to {ellipses.n_nodes - 1}, got {node}")
    if kind == "graph":
        entries = slice(graph.indptr[node], graph.indptr[node + 1])
        near = graph.indices[entries].astype(np.int64)
        return near[np.argsort(graph.lengths[entries], kind="stable")]
    if kind == "geodesic":
        settled = neighborhoods.indices[neighborhoods.indptr[node] : neighborhoods.indptr[node + 1]]
        if len(settled) >= k:
            return settled[:k].astype(np.int64)
        return _nearest(geodesic_distances(graph, np.array([node])), node, k)
    if kind == "paper-graph":
        return _paper_edges(node, ellipses, graph.epsilon)
    if kind == "paper":
        return _along_paper_graph(node, ellipses, graph.epsilon, k)
    steps = ellipses.centers - ellipses.centers[node]
    if kind == "euclidean":
        return _nearest(np.einsum("ij,ij->i", steps, steps), node, k)
    if kind == "mahalanobis":
        apart = steps @ mahalanobis_frame(ellipses, node).T
        return _nearest(np.einsum("ij,ij->i", apart, apart), node, k)
    raise ValueError(f"kind must be one of {', '.join(NEIGHBOR_KINDS)}, got {kind!r}")


def _paper_edges(node: Node, ellipses: Ellipses, epsilon: float) -> Nodes:
    """Nodes that the paper's rule joins to a node, by rising distance."""
    apart = np.linalg.norm(ellipses.centers - ellipses.centers[node], axis=1)
    near = np.flatnonzero(apart <= ellipses.reaches + ellipses.reaches[node] + epsilon)
    graph = _paper_graph(ellipses, near, epsilon)
    place = int(np.searchsorted(near, node))
    joined = near[graph.indices[graph.indptr[place] : graph.indptr[place + 1]]]
    return joined[np.lexsort((joined, apart[joined]))]


def _along_paper_graph(node: Node, ellipses: Ellipses, epsilon: float, k: int) -> Nodes:
    """The k nearest along the graph of the paper's rule; fewer in a small component."""
    apart = np.linalg.norm(ellipses.centers - ellipses.centers[node], axis=1)
    last = min(4 * k, len(apart) - 1)
    reach = float(np.partition(apart, last)[last])
    while True:
        # A way no longer than the reach stays within it.
        near = np.flatnonzero(apart <= reach)
        graph = _paper_graph(ellipses, near, epsilon)
        ways = geodesic_distances(graph, np.array([np.searchsorted(near, node)])).ravel()
        found = near[_nearest(ways, int(np.searchsorted(near, node)), k)]
        is_settled = len(found) == k and ways[np.searchsorted(near, found[-1])] <= reach
        if is_settled or len(near) == len(apart):
            return found
        reach = max(2.0 * reach, float(apart[apart > reach].min()))


def _paper_graph(ellipses: Ellipses, nodes: Nodes, epsilon: float) -> SplatGraph:
    """The graph of the paper's rule among some nodes, numbered as they are given; ascending."""
    among = np.zeros(ellipses.n_nodes, np.bool_)
    among[nodes] = True
    return splat_graph(
        carrying(ellipses, among), GraphOptions(rule="paper", epsilon=epsilon / ellipses.scene_scale)
    )  # fmt: skip


def _nearest(distances: NDArray[np.float64], node: Node, k: int) -> Nodes:
    """Indices of the k least finite distances but the node's own."""
    distances = distances.copy()
    distances[node] = np.inf
    k = min(k, int(np.isfinite(distances).sum()))
    if k == 0:
        return np.zeros(0, np.int64)
    # All that tie with the last, so that it does not depend on the search who of them gets in.
    near = np.flatnonzero(distances <= np.partition(distances, k - 1)[k - 1])
    return near[np.lexsort((near, distances[near]))][:k]
