"""The Laplacian and mass matrix of a splat scene."""

import numpy as np
import robust_laplacian
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components, minimum_spanning_tree

from splap_editor.core.compressed_rows import gathered, run_places, with_rows
from splap_editor.core.graph.options import LAPLACIANS
from splap_editor.core.graph.splat_graph import SplatGraph
from splap_editor.core.index_spaces import Nodes
from splap_editor.core.surface.local_triangulation import stars_of

BRIDGE_WEIGHT = 0.5
"""Weight of a graph edge that stands in for triangles; about the cotangent weight 0.58 of an equilateral mesh."""

MASS_FLOOR = 1e-2
"""Least mass in units of the median."""


def point_cloud_laplacian(
    centers: NDArray[np.float64],
    triangles: NDArray[np.integer],
    *,
    graph: SplatGraph | None = None,
    method: str = "stars",
) -> tuple[sp.csr_array, NDArray[np.float64]]:
    """Cotangent Laplacian and lumped mass from the union of local Delaunay stars.

    A triangle that its corners agree on is found by each of them, so both are
    divided by 3 [1]_. ``stars`` sums the cotangents as they are and sets the few
    negative weights, which disagreeing or obtuse triangles leave, to zero;
    ``robust`` hands the union to the intrinsic Delaunay Laplacian for
    non-manifold meshes [2]_, whose weights are not negative by construction.

    Triangles do not reach everything the graph connects: splats in a line have
    none, and two patches may meet in one edge. The shortest graph edges that
    join such parts get a fixed weight, so L connects just what the graph does.

    Parameters
    ----------
    centers : (n, 3) float64
        Node positions in world units.
    triangles : (T, 3) int
        Union of all stars, see `local_triangulations`.
    graph : SplatGraph, optional
        The graph the stars come from; without it parts stay apart.
    method : str
        One of `LAPLACIANS`.
        How the union becomes a Laplacian.

    Returns
    -------
    L : (n, n) csr_array of float64
        Symmetric, positive semidefinite, with zero row sums; ``-L[i, j]`` is
        the weight of edge ij, positive, dimensionless. int32 indices, sorted, with every diagonal entry.
    M : (n,) float64
        Diagonal of the mass matrix: a third of the triangles' areas, in
        squared world units, at least 1 % of the median. Without any triangle,
        the mean squared length of the graph's edges; 1 if it has none.

    Raises
    ------
    ValueError
        If an array has another shape or ``method`` is unknown.

    References
    ----------
    .. [1] SpLap, 3DV 2026, Sec. 4.2.
    .. [2] Sharp and Crane, "A Laplacian for Nonmanifold Triangle Meshes", SGP 2020.
    """
    if centers.ndim != 2 or centers.shape[1] != 3:
        raise ValueError(f"centers must have shape (n, 3), got {centers.shape}")
    if triangles.ndim != 2 or triangles.shape[1] != 3:
        raise ValueError(f"triangles must have shape (T, 3), got {triangles.shape}")
    if method not in LAPLACIANS:
        raise ValueError(f"method must be one of {', '.join(LAPLACIANS)}, got {method!r}")
    if graph is not None and graph.n_nodes != len(centers):
        raise ValueError(f"graph must have {len(centers)} nodes, got {graph.n_nodes}")
    weights, masses = LAPLACIANS[method].load()(centers, triangles)
    if graph is not None:
        weights = weights + _bridges(weights, graph)
    return _laplacian_of(weights), _floored(masses, graph)


def mended_star_laplacian(
    centers: NDArray[np.float64],
    triangles: NDArray[np.integer],
    graph: SplatGraph,
    nodes: Nodes,
    triangles_before: NDArray[np.integer],
    L_before: sp.csr_array,
    M_before: NDArray[np.float64],
) -> tuple[sp.csr_array, NDArray[np.float64]]:
    """Bring Laplacian and masses up to date after some stars changed: to the bit what `point_cloud_laplacian` gives.

    The weight of an edge sums the triangles at it in their order, and stands
    where no triangle at one of its ends has changed. What stands in for
    triangles is chosen again; so is the floor of the masses.

    Parameters
    ----------
    centers : (n, 3) float64
    triangles : (T, 3) int
        All stars, after the change.
    graph : SplatGraph
        After the change.
    nodes : (m,) int
        Those whose stars were made again.
    triangles_before, L_before, M_before
        All of them from before the change, by the method ``stars``.
    """
    if not len(triangles) or not len(triangles_before):
        return point_cloud_laplacian(centers, triangles, graph=graph)
    n = len(centers)
    touched = np.zeros(n, bool)
    for each in (triangles_before, triangles):
        touched[each[run_places(*stars_of(each, nodes))[1]]] = True
    # A weight of just a bridge's may be one, or may come from triangles: then they say so again.
    in_doubt = np.flatnonzero(L_before.data == -BRIDGE_WEIGHT)
    doubted = np.searchsorted(L_before.indptr, in_doubt, side="right") - 1
    # Of nodes at the floor the mass beneath it is not known.
    exact = touched | (M_before == M_before.min())
    exact[doubted] = True
    keys, weights, masses = _star_weights_at(centers, triangles, exact)
    doubted_keys = doubted * n + L_before.indices[in_doubt]
    bridges = doubted_keys[~np.isin(doubted_keys, keys[weights >= 0.5 * BRIDGE_WEIGHT])]
    is_new = touched[keys // n] & touched[keys % n]
    concerned = touched.copy()
    concerned[bridges // n] = True
    nodes = np.flatnonzero(concerned)
    L = _with_weights(L_before, nodes, touched, bridges, keys[is_new], weights[is_new])
    # The weights are symmetric: of either way of counting parts this is the one that turns no matrix over.
    n_parts, parts = connected_components(L, connection="strong")
    edges = _bridge_edges(n_parts, parts, graph)
    if len(edges):
        keys = np.concatenate([edges @ np.array([n, 1]), edges @ np.array([1, n])])
        held = np.full(len(keys), BRIDGE_WEIGHT)
        L = _with_weights(L, np.unique(edges), np.zeros(n, bool), np.zeros(0, np.int64), keys, held)
    return L, _floored(np.where(exact, masses, M_before), graph)


def _star_weights_at(
    centers: NDArray[np.float64], triangles: NDArray[np.integer], asked: NDArray[np.bool_]
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Keys i · n + j and positive weights of the edges at some nodes and of others, and (n,) masses of these nodes."""
    n = len(centers)
    at_one = asked[triangles[:, 0]] | asked[triangles[:, 1]] | asked[triangles[:, 2]]
    used, corners = np.unique(triangles[at_one], return_inverse=True)
    weights, local_masses = star_weights(centers[used], corners.reshape(-1, 3))
    found = weights.tocoo()
    positive = found.data > 0.0
    masses = np.zeros(n)
    masses[used] = local_masses
    return used[found.row[positive]].astype(np.int64) * n + used[found.col[positive]], found.data[positive], masses


def _with_weights(
    L: sp.csr_array,
    nodes: Nodes,
    inner: NDArray[np.bool_],
    gone: NDArray[np.int64],
    keys: NDArray[np.int64],
    weights: NDArray[np.float64],
) -> sp.csr_array:
    """Put weights into a Laplacian, and sum those rows again.

    Parameters
    ----------
    L : (n, n) csr_array
    nodes : (m,) int
        Rows concerned, ascending.
    inner : (n,) bool
        Nodes between which no weight stays as it was.
    gone : (g,) int64
        Keys i · n + j of other weights that do not.
    keys, weights : (w,) int64, float64
        What comes; all of it in these rows.
    """
    n = L.shape[0]
    _, places, owners = gathered(L.indptr, nodes)
    columns = L.indices[places]
    were = owners.astype(np.int64) * n + columns
    stays = (owners != columns) & ~(inner[owners] & inner[columns]) & ~np.isin(were, gone)
    keys = np.concatenate([were[stays], keys])
    order = np.argsort(keys)
    keys, weights = keys[order], np.concatenate([-L.data[places[stays]], weights])[order]
    sums = np.bincount(np.searchsorted(nodes, keys // n), weights, len(nodes))
    keys, values = np.concatenate([keys, nodes * (n + 1)]), np.concatenate([-weights, sums])
    order = np.argsort(keys)
    keys = keys[order]
    starts = np.searchsorted(keys, np.append(nodes, n) * n)
    new = (keys % n).astype(np.int32), values[order]
    indptr, (indices, data) = with_rows(L.indptr, (L.indices, L.data), nodes, starts, new)
    return sp.csr_array((data, indices, indptr), shape=(n, n))


def star_weights(
    centers: NDArray[np.float64], triangles: NDArray[np.integer]
) -> tuple[sp.csr_array, NDArray[np.float64]]:
    """(n, n) symmetric weights, not negative, and (n,) masses by summing cotangents."""
    n = len(centers)
    corners = [centers[triangles[:, c]] for c in range(3)]
    # sides[c] is opposite to corner c.
    sides = [corners[2] - corners[1], corners[0] - corners[2], corners[1] - corners[0]]
    areas = 0.5 * np.linalg.norm(np.cross(sides[0], sides[1]), axis=1)
    squares = [np.einsum("ij,ij->i", side, side) for side in sides]
    # Collinear corners have no area: the floor keeps their cotangents, of both signs, finite.
    doubled = 2.0 * np.maximum(areas, 1e-9 * np.maximum(np.maximum(squares[0], squares[1]), squares[2]))
    upper = sp.csr_array((n, n))
    for c in range(3):
        a, b = triangles[:, (c + 1) % 3], triangles[:, (c + 2) % 3]
        cotangents = -np.einsum("ij,ij->i", sides[(c + 1) % 3], sides[(c + 2) % 3]) / doubled
        upper = upper + sp.coo_array((cotangents / 6.0, (np.minimum(a, b), np.maximum(a, b))), shape=(n, n)).tocsr()
    upper.data = np.maximum(upper.data, 0.0)
    masses = np.sum([np.bincount(triangles[:, c], areas / 9.0, n) for c in range(3)], axis=0)
    return (upper + upper.T).tocsr(), masses


def robust_weights(
    centers: NDArray[np.float64], triangles: NDArray[np.integer]
) -> tuple[sp.csr_array, NDArray[np.float64]]:
    """(n, n) symmetric weights, not negative, and (n,) masses by Sharp and Crane's method."""
    n = len(centers)
    # The library refuses corners that no triangle uses.
    used, faces = np.unique(triangles, return_inverse=True)
    if not len(used):
        return sp.csr_array((n, n)), np.zeros(n)
    L, M = robust_laplacian.mesh_laplacian(centers[used], faces.reshape(-1, 3))
    L = L.tocoo()
    off = L.row != L.col
    rows, columns = used[L.row[off]], used[L.col[off]]
    weights = sp.coo_array((np.maximum(-L.data[off], 0.0) / 3.0, (rows, columns)), shape=(n, n)).tocsr()
    masses = np.zeros(n)
    masses[used] = M.diagonal() / 3.0
    return 0.5 * (weights + weights.T), masses


def _bridges(weights: sp.csr_array, graph: SplatGraph) -> sp.csr_array:
    """Weights of the shortest graph edges that join what the triangles leave apart."""
    n = graph.n_nodes
    weights.eliminate_zeros()
    n_parts, parts = connected_components(weights, directed=False)
    chosen = _bridge_edges(n_parts, parts, graph)
    bridges = sp.csr_array((np.full(len(chosen), BRIDGE_WEIGHT), (chosen[:, 0], chosen[:, 1])), shape=(n, n))
    return bridges + bridges.T


def _bridge_edges(n_parts: int, parts: NDArray[np.int32], graph: SplatGraph) -> NDArray[np.int32]:
    """(B, 2) shortest graph edges i < j that join parts, as far as edges do; parts (n,) are numbered from 0."""
    starts = np.repeat(np.arange(graph.n_nodes, dtype=np.int32), graph.degrees if n_parts > 1 else 0)
    ends = graph.indices[: len(starts)]
    between = np.flatnonzero((parts[starts] != parts[ends]) & (starts < ends))
    edges, lengths = np.stack([starts[between], ends[between]], axis=1), graph.lengths[between]
    # One candidate per two parts: the shortest, of equal ones that of the lowest nodes.
    pairs = np.sort(parts[edges], axis=1)
    order = np.lexsort((edges[:, 1], edges[:, 0], lengths, pairs[:, 1], pairs[:, 0]))
    _, first = np.unique(pairs[order] @ np.array([n_parts, 1], np.int64), return_index=True)
    best = order[first]
    ranks = np.empty(len(best))
    # Ranks for weights: distinct, so that the forest is, and not zero, which would be no edge.
    ranks[np.lexsort((edges[best, 1], edges[best, 0], lengths[best]))] = np.arange(1, len(best) + 1)
    forest = minimum_spanning_tree(sp.csr_array((ranks, (pairs[best, 0], pairs[best, 1])), shape=(n_parts, n_parts)))
    return edges[best][np.isin(ranks, forest.data)]


def _laplacian_of(weights: sp.csr_array) -> sp.csr_array:
    """Diagonal minus weights, with zero row sums and a full diagonal."""
    weights.eliminate_zeros()
    n = weights.shape[0]
    everything = np.arange(n, dtype=np.int32)
    starts = np.repeat(everything, np.diff(weights.indptr))
    rows, columns = np.concatenate([starts, everything]), np.concatenate([weights.indices, everything])
    values = np.concatenate([-weights.data, np.bincount(starts, weights.data, n)])
    L = sp.coo_array((values, (rows, columns.astype(np.int32, copy=False))), shape=(n, n)).tocsr()
    L.sort_indices()
    return L


def _floored(masses: NDArray[np.float64], graph: SplatGraph | None) -> NDArray[np.float64]:
    """Masses with a floor, so that dividing by them is safe."""
    positive = masses[masses > 0.0]
    if len(positive):
        return np.maximum(masses, MASS_FLOOR * np.median(positive))
    area = 1.0 if graph is None or not graph.n_edges else float(np.mean(graph.lengths**2))
    return np.full(len(masses), area)
