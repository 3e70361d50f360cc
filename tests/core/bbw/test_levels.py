import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components, dijkstra

from splap_editor.core.bbw.levels import Level, coarser_level, prolonged
from tests.reference.bbw import operators, sheet


def finest(points, triangles):
    L, M = operators(points, triangles)
    return Level(points, L, M, np.arange(len(points)), np.zeros(0, np.int64))


def two_sheets(nx=30, ny=20, gap=0.01):
    points, triangles = sheet(nx, ny)
    return finest(np.vstack([points, points + np.array([0, 0, gap])]), np.vstack([triangles, triangles + len(points)]))


def test_each_node_joins_the_nearest_centre_along_the_edges():
    points, triangles = sheet(20, 15)
    fine = finest(points, triangles)
    kept = np.zeros(len(points), bool)
    kept[[3, 4, 150]] = True
    coarse = coarser_level(fine, kept)
    edges = sp.coo_array(fine.L)
    joined = (edges.row != edges.col) & (edges.data < 0)
    i, j = edges.row[joined], edges.col[joined]
    graph = sp.csr_array((np.linalg.norm(points[i] - points[j], axis=1), (i, j)), shape=fine.L.shape)
    distances = dijkstra(graph, indices=coarse.nodes)
    own = distances[coarse.cells, np.arange(len(points))]
    np.testing.assert_allclose(own, distances.min(axis=0), atol=1e-12)
    assert own.max() <= 2.0 * np.sqrt(fine.M.sum() / len(points))


def test_kept_nodes_stay_nodes_and_a_level_is_about_a_quarter():
    fine = two_sheets()
    kept = np.zeros(fine.n_nodes, bool)
    kept[100:140] = True
    coarse = coarser_level(fine, kept)
    assert np.isin(np.arange(100, 140), coarse.nodes).all()
    assert 0.1 < (coarse.n_nodes - 40) / fine.n_nodes < 0.35
    np.testing.assert_array_equal(coarse.nodes[coarse.cells[coarse.nodes]], coarse.nodes)


def test_unconnected_sheets_share_no_cell_and_no_edge_on_any_level():
    level = two_sheets()
    half = level.n_nodes // 2
    for _ in range(2):
        level = coarser_level(level, np.zeros(level.n_nodes, bool))
        n, labels = connected_components(level.L, directed=False)
        assert n == 2
        assert all(len(np.unique(level.nodes[labels == k] >= half)) == 1 for k in range(2))


def test_the_coarse_operator_is_a_laplacian_with_the_fine_mass():
    fine = two_sheets()
    coarse = coarser_level(fine, np.zeros(fine.n_nodes, bool))
    L = coarse.L.toarray()
    np.testing.assert_allclose(L, L.T, atol=1e-12)
    np.testing.assert_allclose(L.sum(axis=1), 0.0, atol=1e-12)
    assert np.all(L - np.diag(np.diag(L)) <= 0)
    np.testing.assert_allclose(coarse.M.sum(), fine.M.sum())


def test_the_coarse_operator_keeps_the_dirichlet_energy_of_a_linear_function():
    points, triangles = sheet(60, 60)
    fine = finest(points, triangles)
    coarse = coarser_level(fine, np.zeros(len(points), bool))
    for direction in ([1, 0, 0], [0, 1, 0], [0.6, 0.8, 0]):
        u, v = fine.points @ direction, coarse.points @ direction
        # Borders of grown cells are not square to the lines between centres, which costs a two-point flux some energy
        # in excess; a common factor does not matter, more than this would.
        np.testing.assert_allclose(v @ coarse.L @ v, u @ fine.L @ u, rtol=0.25)


def test_coinciding_nodes_do_not_stop_the_cells():
    points, triangles = sheet(12, 12)
    fine = finest(points, triangles)
    doubled = fine.points.copy()
    doubled[40] = doubled[41]
    coarse = coarser_level(Level(doubled, fine.L, fine.M, fine.nodes, fine.cells), np.zeros(144, bool))
    assert np.isfinite(coarse.L.data).all()


def test_prolonged_constants_stay_constant_and_values_stay_between_their_extremes():
    fine = two_sheets()
    coarse = coarser_level(fine, np.zeros(fine.n_nodes, bool))
    np.testing.assert_allclose(prolonged(np.full(coarse.n_nodes, 3.0), coarse, fine), 3.0)
    values = np.random.default_rng(0).integers(-1, 2, coarse.n_nodes).astype(np.float64)
    carried = prolonged(values, coarse, fine)
    # Jittered cotangents may be slightly negative, so the averages are not quite convex.
    assert np.abs(carried).max() <= 1.1
