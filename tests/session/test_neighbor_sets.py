"""Neighbour sets against plain search, and how they differ."""

import numpy as np
import pytest

from splap_editor.core.graph.carriers import carrying
from splap_editor.core.graph.splat_graph import GraphOptions, SplatGraph, splat_graph
from splap_editor.core.surface.geodesics import geodesic_distances
from splap_editor.core.surface.neighborhoods import NORMAL_SHARE
from splap_editor.engine.surface import Surface, surface_of
from splap_editor.io.ply import read_ply
from splap_editor.resources import resource
from splap_editor.session.neighbor_sets import NEIGHBOR_KINDS, compared, neighbor_set


@pytest.fixture(scope="module")
def surface() -> Surface:
    return surface_of(read_ply(resource("samples", "tube.ply")).splats, GraphOptions())


def neighbors(surface, kind, node, k=10):
    return neighbor_set(kind, node, surface.ellipses, surface.graph, surface.neighborhoods, k=k)


def slow_neighbors(surface, kind, node, k):
    """One distance at a time."""
    ellipses = surface.ellipses
    found = []
    axes = ellipses.semi_axes[node] / ellipses.cutoffs[node]
    sigmas = np.array([*np.linalg.norm(axes, axis=1), NORMAL_SHARE * np.linalg.norm(axes[1])])
    frame = np.array([*(axes / sigmas[:2, None]), ellipses.normals[node]])
    precision = frame.T @ np.diag(sigmas**-2.0) @ frame
    for j in range(ellipses.n_nodes):
        step = ellipses.centers[j] - ellipses.centers[node]
        distance = step @ step if kind == "euclidean" else step @ precision @ step
        if j != node:
            found.append((distance, j))
    return [j for _, j in sorted(found)[:k]]


@pytest.mark.parametrize("kind", ["euclidean", "mahalanobis"])
@pytest.mark.parametrize("node", [0, 777, 2000])
def test_nearest_agree_with_one_distance_at_a_time(surface, kind, node):
    np.testing.assert_array_equal(neighbors(surface, kind, node, 12), slow_neighbors(surface, kind, node, 12))


def test_graph_neighbours_are_the_row_of_the_matrix(surface):
    row = surface.graph.matrix()[[55]].indices
    near = neighbors(surface, "graph", 55)
    np.testing.assert_array_equal(np.sort(near), row)
    lengths = np.linalg.norm(surface.ellipses.centers[near] - surface.ellipses.centers[55], axis=1)
    assert (np.diff(lengths) >= 0).all()


@pytest.fixture(scope="module")
def paper(surface) -> SplatGraph:
    return splat_graph(surface.ellipses, GraphOptions(rule="paper"))


@pytest.mark.parametrize("node", [0, 777, 2000])
@pytest.mark.parametrize("k", [6, 40])
def test_what_is_made_of_the_papers_graph_about_a_node_answers_as_the_whole_graph(surface, paper, node, k):
    joined, near = neighbors(surface, "paper-graph", node), neighbors(surface, "paper", node, k)
    np.testing.assert_array_equal(np.sort(joined), paper.matrix()[[node]].indices)
    ways = geodesic_distances(paper, np.array([node])).ravel()
    np.testing.assert_allclose(ways[near], np.sort(np.delete(ways, node))[:k], rtol=1e-12)
    assert len(set(near.tolist())) == k


def test_a_small_part_by_the_papers_rule_has_fewer_neighbours_than_asked_for(surface):
    ends = np.flatnonzero(surface.ellipses.centers[:, 0] > np.quantile(surface.ellipses.centers[:, 0], 0.98))
    among = np.zeros(surface.ellipses.n_nodes, bool)
    among[ends] = True
    part = carrying(surface.ellipses, among)
    near = neighbor_set("paper", 0, part, surface.graph, surface.neighborhoods, k=1000)
    assert 0 < len(near) < part.n_nodes and 0 not in near


def test_geodesic_ones_at_hand_and_searched_for_are_the_same(surface):
    few, many = neighbors(surface, "geodesic", 99, 30), neighbors(surface, "geodesic", 99, 80)
    np.testing.assert_array_equal(few, many[:30])
    assert len(many) == 80


@pytest.mark.parametrize("kind", NEIGHBOR_KINDS)
def test_nobody_is_its_own_neighbour_or_twice_one(surface, kind):
    near = neighbors(surface, kind, 300, 20)
    assert 300 not in near and len(set(near.tolist())) == len(near)


def test_more_neighbours_than_there_are_gives_all_of_them(surface):
    n = surface.ellipses.n_nodes
    assert len(neighbors(surface, "euclidean", 0, 10 * n)) == n - 1


def test_a_comparison_parts_both_sets(surface):
    first, second = neighbors(surface, "graph", 10), neighbors(surface, "euclidean", 10, 14)
    both = compared(first, second)
    assert set(both.common) | set(both.only_first) == set(first)
    assert set(both.common) | set(both.only_second) == set(second)
    assert not set(both.only_first) & set(second) and not set(both.only_second) & set(first)


def test_unknown_kinds_and_nodes_are_rejected(surface):
    with pytest.raises(ValueError, match="kind must be one of graph, geodesic"):
        neighbors(surface, "magic", 0)
    with pytest.raises(ValueError, match="node must be 0 to"):
        neighbors(surface, "graph", -1)
