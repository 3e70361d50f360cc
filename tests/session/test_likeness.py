"""Splats like one: against slow twins that look at one splat at a time."""

import numpy as np
import pytest

from splap_editor.core.graph.splat_graph import splat_graph
from splap_editor.core.splats.occupancy import occupancy_ellipses
from splap_editor.core.splats.spherical_harmonics import SH_C0
from splap_editor.io.ply import read_ply
from splap_editor.resources import resource
from splap_editor.session.likeness import LikenessOptions, alike, flooded
from splap_editor.session.selection import rim_selection, shrunk_selection

ANY = LikenessOptions(color=1.0)


@pytest.fixture(scope="module")
def tube():
    splats = read_ply(resource("samples", "tube.ply")).splats
    ellipses = occupancy_ellipses(splats)
    return splats, ellipses, splat_graph(ellipses)


def slow_flood(graph, may, start, goes):
    reached, waiting = {start}, [start]
    while waiting:
        node = waiting.pop()
        for other in graph.indices[graph.indptr[node] : graph.indptr[node + 1]]:
            if int(other) not in reached and may[node] and may[other] and goes(node, other):
                reached.add(int(other))
                waiting.append(int(other))
    return np.isin(np.arange(graph.n_nodes), list(reached))


def shown(splats, row):
    return np.clip(0.5 + SH_C0 * np.asarray(splats.sh0[row], np.float32), 0, 1)


def test_colour_equals_its_twin(tube):
    splats, ellipses, graph = tube
    row = int(ellipses.rows[10])
    found = alike(splats, ellipses, graph, row, LikenessOptions(color=0.05))
    twin = [np.abs(shown(splats, k) - shown(splats, row)).max() <= np.float32(0.05) for k in range(splats.n_splats)]
    np.testing.assert_array_equal(found, twin)
    assert 0 < found.sum() < splats.n_splats


@pytest.mark.parametrize(
    ("options", "fits"),
    [
        (LikenessOptions(color=1.0, angle=20.0), lambda e, a, b: abs(e.normals[a] @ e.normals[b]) >= np.cos(np.pi / 9)),
        (LikenessOptions(color=1.0, size=1.01), lambda e, a, b: 1 / 1.01 <= e.reaches[a] / e.reaches[b] <= 1.01),
    ],
)
def test_normal_and_size_equal_their_twins(tube, options, fits):
    splats, ellipses, graph = tube
    found = alike(splats, ellipses, graph, int(ellipses.rows[10]), options)
    twin = [bool(fits(ellipses, node, 10)) for node in range(ellipses.n_nodes)]
    np.testing.assert_array_equal(found[ellipses.rows], twin)
    assert 0 < found.sum() < splats.n_splats


def test_a_flood_equals_a_walk_from_neighbour_to_neighbour(tube):
    _, ellipses, graph = tube
    may = np.random.default_rng(3).random(graph.n_nodes) < 0.6
    start = int(np.flatnonzero(may)[7])
    np.testing.assert_array_equal(flooded(graph, may, start), slow_flood(graph, may, start, lambda a, b: True))
    least = np.cos(np.radians(8.0))
    smooth = slow_flood(graph, may, start, lambda a, b: abs(ellipses.normals[a] @ ellipses.normals[b]) >= least)
    np.testing.assert_array_equal(flooded(graph, may, start, ellipses.normals, 8.0), smooth)


def test_a_flood_goes_round_a_bend_that_likeness_does_not(tube):
    splats, ellipses, graph = tube
    row = int(ellipses.rows[10])
    facing = alike(splats, ellipses, graph, row, LikenessOptions(color=1.0, angle=40.0))
    flood = alike(splats, ellipses, graph, row, LikenessOptions(color=1.0, angle=40.0, floods=True))
    assert facing.sum() < flood.sum()


def test_everything_is_alike_when_all_tolerances_are_at_their_most(tube):
    splats, ellipses, graph = tube
    assert alike(splats, ellipses, graph, 0, ANY).all()


def test_a_flood_without_a_graph_is_refused(tube):
    splats, ellipses, _ = tube
    with pytest.raises(ValueError, match="wait until the scene is prepared"):
        alike(splats, ellipses, None, int(ellipses.rows[0]), LikenessOptions(floods=True))


def test_rim_and_what_shrinking_leaves_make_up_the_selection(tube):
    splats, ellipses, graph = tube
    selection = np.asarray(splats.means[:, 0]) > np.median(splats.means[:, 0])
    rim = rim_selection(selection, ellipses, graph)
    assert 0 < rim.sum() < selection.sum()
    active = np.zeros_like(selection)
    active[ellipses.rows] = True
    np.testing.assert_array_equal(rim | shrunk_selection(selection, ellipses, graph) & active, selection & active)
    assert not (rim & shrunk_selection(selection, ellipses, graph)).any()
