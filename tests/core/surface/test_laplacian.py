from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components
from scipy.spatial.transform import Rotation

from splap_editor.core.graph.splat_graph import GraphOptions, SplatGraph, mended_graph, splat_graph
from splap_editor.core.splats.occupancy import occupancy_ellipses
from splap_editor.core.splats.splats import Splats
from splap_editor.core.surface.geodesics import geodesic_neighbors, mended_neighborhoods
from splap_editor.core.surface.laplacian import BRIDGE_WEIGHT, MASS_FLOOR, mended_star_laplacian, point_cloud_laplacian
from splap_editor.core.surface.local_triangulation import local_triangulations, mended_triangulations
from tests.core.splat_scenes import ball, cloud, joined, moved, sheet, shuffled, splats_of
from tests.reference.graph import cotangent_laplacian, is_positive_semidefinite

METHODS = ["stars", "robust"]
SCENES = {
    "ball": ball(200),
    "sheet": sheet(144),
    "cloud": cloud(120, size=0.2),
    "line": splats_of(np.linspace(0.0, 1.0, 30)[:, None] * [1.0, 0.0, 0.0], np.array([0.06, 0.06])),
    "heap": splats_of(np.zeros((20, 3)), np.array([0.1, 0.1])),
    "two": splats_of(np.array([[0.0, 0, 0], [0.1, 0, 0]]), np.array([0.1, 0.1])),
    "one": splats_of(np.zeros((1, 3)), np.array([0.1, 0.1])),
    "twice": shuffled(sheet(64), np.repeat(np.arange(64), 2)),
}


def stages(splats: Splats, method: str, epsilon: float = 0.005):
    ellipses = occupancy_ellipses(splats)
    graph = splat_graph(ellipses, GraphOptions(epsilon=epsilon))
    triangles = local_triangulations(ellipses, geodesic_neighbors(graph))
    L, M = point_cloud_laplacian(ellipses.centers, triangles, graph=graph, method=method)
    return ellipses, graph, triangles, L, M


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("scene", SCENES)
def test_constants_are_in_the_null_space_of_a_symmetric_semidefinite_matrix(scene, method):
    ellipses, _, _, L, M = stages(SCENES[scene], method)
    n = ellipses.n_nodes
    assert L.shape == (n, n) and L.indices.dtype == L.indptr.dtype == np.int32
    size = max(1.0, np.abs(L.diagonal()).max())
    assert np.abs(L @ np.ones(n)).max() < 1e-12 * size
    assert abs(L - L.T).max() == 0.0
    off = L - sp.diags_array(L.diagonal())
    assert off.max() <= 0.0
    assert is_positive_semidefinite(L)
    assert (M > 0.0).all() and np.isfinite(M).all() and np.isfinite(L.data).all()
    starts = np.repeat(np.arange(n), np.diff(L.indptr))
    assert (np.diff(starts * n + L.indices) > 0).all()
    assert (np.bincount(starts[starts == L.indices], minlength=n) == 1).all()


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("scene", SCENES)
def test_the_laplacian_connects_just_what_the_graph_does(scene, method):
    _, graph, _, L, _ = stages(SCENES[scene], method)
    n_parts, parts = connected_components(L, directed=False)
    assert n_parts == graph.components.max() + 1
    assert len(set(zip(parts.tolist(), graph.components.tolist(), strict=True))) == n_parts


@pytest.mark.parametrize("scene", ["ball", "sheet", "cloud"])
def test_stars_are_the_cotangent_twin(scene):
    ellipses, _, triangles, _, _ = stages(SCENES[scene], "stars")
    L, M = point_cloud_laplacian(ellipses.centers, triangles)
    twin, masses = cotangent_laplacian(ellipses.centers, triangles)
    np.testing.assert_allclose(L.toarray(), twin, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(M, np.maximum(masses, MASS_FLOOR * np.median(masses[masses > 0])), rtol=1e-9)


@pytest.mark.parametrize("method", METHODS)
def test_moving_the_scene_leaves_L_and_scales_M_with_the_area(method):
    ellipses, _, _, L, M = stages(ball(200), method)
    # The robust method sorts triangles around an edge by angle, and copies of one triangle by rounding: not turned,
    # and scaled by a power of two, they keep their order.
    turn = Rotation.from_rotvec([0.1, -2.0, 0.7] if method == "stars" else [0.0, 0.0, 0.0])
    turned = moved(ball(200), turn, 32.0, np.zeros(3))
    others, _, _, other_L, other_M = stages(turned, method)
    nodes = others.node_of_row[ellipses.rows]
    # The largest cotangents, of slivers, lose some digits to rounding.
    np.testing.assert_allclose(other_L.toarray()[np.ix_(nodes, nodes)], L.toarray(), rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(other_M[nodes], 1024.0 * M, rtol=1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_shuffling_the_file_leaves_the_laplacian(method):
    order = np.random.default_rng(4).permutation(200)
    ellipses, _, _, L, M = stages(ball(200), method)
    others, _, _, other_L, other_M = stages(shuffled(ball(200), order), method)
    assert np.array_equal(order[others.rows], ellipses.rows)
    np.testing.assert_allclose(other_L.toarray(), L.toarray(), rtol=1e-12)
    np.testing.assert_allclose(other_M, M, rtol=1e-12)


@pytest.mark.parametrize(("method", "nearly_all", "median"), [("stars", 0.03, 1e-11), ("robust", 1.0, 0.1)])
def test_linear_functions_on_a_plane_are_harmonic_inside(method, nearly_all, median):
    ellipses, _, _, L, _ = stages(sheet(900), method)
    inside = (np.abs(ellipses.centers[:, :2] - 0.5) < 0.4).all(axis=1)
    # In units of the splats' spacing of 1/30. Stars that disagree over an edge, at a few gaps of the graph, and the
    # robust method's mollified lengths bend the function a little.
    error = np.abs(L @ ellipses.centers)[inside].max(axis=1) * 30.0
    assert np.quantile(error, 0.95) < nearly_all
    assert np.median(error) < median


@pytest.mark.parametrize("method", METHODS)
def test_masses_add_up_to_the_area(method):
    *_, M = stages(sheet(2500), method)
    # The outermost centres lie about half a step inside the square's border.
    assert abs(M.sum() - (1.0 - 1.0 / 50.0) ** 2) < 0.02
    *_, M = stages(ball(3000), method)
    # Splats at random places leave holes that no star closes.
    assert abs(M.sum() / (4.0 * np.pi) - 1.0) < 0.12


@pytest.mark.parametrize("method", METHODS)
def test_a_chain_of_splats_has_one_weight_per_link(method):
    *_, L, M = stages(SCENES["line"], method)
    assert np.array_equal(np.sort(L.diagonal()), np.sort([BRIDGE_WEIGHT] * 2 + [2 * BRIDGE_WEIGHT] * 28))
    assert np.unique(M).size == 1


def test_parts_the_graph_joins_without_a_triangle_are_bridged_by_the_shortest_edge():
    pair = joined(sheet(100), sheet(100, height=1.0, seed=1))
    ellipses = occupancy_ellipses(pair)
    graph = splat_graph(ellipses)
    triangles = local_triangulations(ellipses, geodesic_neighbors(graph))
    mended = splat_graph(ellipses, GraphOptions(add=((0, 100), (44, 155), (9, 120))))
    L, _ = point_cloud_laplacian(ellipses.centers, triangles, graph=mended)
    difference = (L - point_cloud_laplacian(ellipses.centers, triangles)[0]).tocoo()
    changed = {(i, j) for i, j, v in zip(difference.row, difference.col, difference.data, strict=True) if v < 0}
    ends = ellipses.node_of_row[[[0, 100], [44, 155], [9, 120]]]
    lengths = np.linalg.norm(ellipses.centers[ends[:, 0]] - ellipses.centers[ends[:, 1]], axis=1)
    assert changed == {tuple(ends[lengths.argmin()]), tuple(ends[lengths.argmin()][::-1])}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"centers": np.zeros((4, 2))}, r"centers must have shape \(n, 3\), got \(4, 2\)"),
        ({"triangles": np.zeros((4, 2), int)}, r"triangles must have shape \(T, 3\), got \(4, 2\)"),
        ({"method": "mesh"}, "method must be one of stars, robust"),
        ({"graph": SplatGraph(np.zeros(3, np.int32), np.empty(0, np.int32), np.empty(0), None, 0.0)}, "4 nodes, got 2"),
    ],
)
def test_wrong_arguments_are_rejected(arguments, message):
    good = {"centers": np.random.default_rng(0).normal(size=(4, 3)), "triangles": np.array([[0, 1, 2]])}
    with pytest.raises(ValueError, match=message):
        point_cloud_laplacian(**(good | arguments))


MENDED = {
    "seam of a sheet": (sheet(400), lambda edges, x: edges[(x[edges] < 0.5).sum(axis=1) == 1]),
    "every seventh edge of a ball": (ball(300), lambda edges, x: edges[::7]),
    "a cloud's bridges": (cloud(300, size=0.12), lambda edges, x: edges[::11]),
    "one edge of two sheets": (joined(sheet(196), sheet(196, height=0.3)), lambda edges, x: edges[5:6]),
    "a chain": (SCENES["line"], lambda edges, x: edges[9:10]),
}
"""Splats, and which edges (E, 2) are cut, by the nodes' first coordinate."""


@pytest.mark.parametrize("scene", MENDED)
@pytest.mark.parametrize("way", ["cut", "put back"])
def test_a_mended_laplacian_is_the_full_sum_to_the_bit(scene, way):
    splats, chosen = MENDED[scene]
    ellipses = occupancy_ellipses(splats)
    options = GraphOptions()
    graph = splat_graph(ellipses, options)
    edges = chosen(graph.edges, ellipses.centers[:, 0])
    mended = mended_graph(ellipses, graph, replace(options, cut=tuple(map(tuple, ellipses.rows[edges].tolist()))))
    first, second = (graph, mended) if way == "cut" else (mended, graph)
    near = geodesic_neighbors(first)
    triangles = local_triangulations(ellipses, near)
    before = triangles, *point_cloud_laplacian(ellipses.centers, triangles, graph=first)
    near, nodes = mended_neighborhoods(second, near, np.unique(edges), GraphOptions().k)
    triangles = mended_triangulations(ellipses, near, triangles, nodes)
    found = mended_star_laplacian(ellipses.centers, triangles, second, nodes, *before)
    expected = point_cloud_laplacian(ellipses.centers, triangles, graph=second)
    for name in ("indptr", "indices", "data"):
        np.testing.assert_array_equal(getattr(found[0], name), getattr(expected[0], name))
    np.testing.assert_array_equal(found[1], expected[1])
    assert found[0].indices.dtype == np.int32 == found[0].indptr.dtype
