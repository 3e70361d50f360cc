import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from splap_editor.core.graph import touch_rule as module
from splap_editor.core.graph.ellipse_offset import normal_offsets, touch_scales
from splap_editor.core.graph.splat_graph import GraphOptions, SplatGraph, splat_graph
from splap_editor.core.progress import Cancelled
from splap_editor.core.splats.occupancy import occupancy_ellipses
from splap_editor.core.splats.splats import Splats
from splap_editor.io.sample_maker import TRAINED, SplatStyle, shape_sample, surface_splats
from splap_editor.io.sample_shapes import slats
from tests.core.splat_scenes import ball, cloud, joined, moved, row_edges, sheet, shuffled, splats_of
from tests.reference.graph import all_pairs, touch_rule

RULES = ["touch", "paper"]


def graph_of(splats: Splats, rule: str = "touch", **options) -> tuple[NDArray, SplatGraph]:
    ellipses = occupancy_ellipses(splats)
    return ellipses.rows, splat_graph(ellipses, GraphOptions(rule=rule, **options))


TWIN_SCENES = [
    cloud(70, size=0.3),
    cloud(40, size=0.12),
    ball(150, cover=1.5),
    joined(cloud(60, size=0.3), cloud(60, size=0.05)),
]


@pytest.mark.parametrize("scene", TWIN_SCENES)
def test_the_touch_rule_is_its_twin(scene):
    ellipses = occupancy_ellipses(scene)
    graph = splat_graph(ellipses)
    n = ellipses.n_nodes
    pairs = all_pairs(n)
    touch = np.full((n, n), np.inf)
    touch[pairs[:, 0], pairs[:, 1]] = touch[pairs[:, 1], pairs[:, 0]] = touch_scales(ellipses, pairs, graph.epsilon)
    twin = touch_rule(
        touch,
        ellipses.reaches,
        short_list=module.SHORT_LIST,
        n_partners=module.N_PARTNERS,
        redundancy=module.REDUNDANCY,
        n_near=module.N_NEAR,
        peer_ratio=module.PEER_RATIO,
        fragment_size=module.FRAGMENT_SIZE,
        fragment_reach=module.FRAGMENT_REACH,
    )
    assert {(i, j) for i, j in graph.edges.tolist()} == twin
    starts = np.repeat(np.arange(n), graph.degrees)
    # rtol: both ends of a pair may be compared in another order.
    np.testing.assert_allclose(graph.touch, touch[starts, graph.indices], rtol=1e-13)


def test_the_papers_rule_is_its_twin():
    ellipses = occupancy_ellipses(cloud(80, size=0.3))
    graph = splat_graph(ellipses, GraphOptions(rule="paper"))
    pairs = all_pairs(80)
    twin = pairs[normal_offsets(ellipses, pairs).min(axis=1) <= graph.epsilon]
    assert np.array_equal(graph.edges, twin)
    assert graph.touch is None


@pytest.mark.parametrize("rule", RULES)
def test_the_graph_is_symmetric_with_sorted_rows_and_true_lengths(rule):
    ellipses = occupancy_ellipses(ball(300))
    graph = splat_graph(ellipses, GraphOptions(rule=rule))
    assert graph.indptr.dtype == graph.indices.dtype == np.int32
    matrix = graph.matrix()
    assert abs(matrix - matrix.T).max() == 0.0
    starts = np.repeat(np.arange(graph.n_nodes), graph.degrees)
    assert (np.diff(starts * graph.n_nodes + graph.indices) > 0).all()
    assert (starts != graph.indices).all()
    np.testing.assert_allclose(
        graph.lengths, np.linalg.norm(ellipses.centers[starts] - ellipses.centers[graph.indices], axis=1)
    )
    assert len(graph.edges) == graph.n_edges == graph.degrees.sum() // 2


@pytest.mark.parametrize("rule", RULES)
def test_shuffling_the_file_leaves_the_graph(rule):
    scene = ball(250)
    order = np.random.default_rng(5).permutation(250)
    (rows, graph), (other_rows, other) = graph_of(scene, rule), graph_of(shuffled(scene, order), rule)
    assert row_edges(order[other_rows], other.edges) == row_edges(rows, graph.edges)


@pytest.mark.parametrize("rule", RULES)
def test_turning_and_scaling_the_scene_leaves_the_graph(rule):
    scene = ball(250)
    rows, graph = graph_of(scene, rule)
    turned = moved(scene, Rotation.from_rotvec([0.4, 1.0, -2.0]), 30.0, np.array([7.0, 8.0, 9.0]))
    other_rows, other = graph_of(turned, rule)
    assert row_edges(other_rows, other.edges) == row_edges(rows, graph.edges)


@pytest.mark.parametrize("tilt", [0.0, 0.05])
def test_two_sheets_three_tolerances_apart_stay_apart(tilt):
    lower = sheet(900)
    gap = 3.0 * 0.005 * occupancy_ellipses(lower).scene_scale
    scene = joined(sheet(900, tilt=tilt), sheet(900, height=gap, tilt=tilt, seed=1))
    rows, graph = graph_of(scene)
    upper = rows >= 900
    if tilt == 0.0:
        assert graph.components.max() == 1
        assert not (upper[graph.edges[:, 0]] != upper[graph.edges[:, 1]]).any()
    else:
        # Tilted splats reach the other sheet with their rims, which rank last: one in a hundred edges at most.
        assert (upper[graph.edges[:, 0]] != upper[graph.edges[:, 1]]).mean() < 0.01


def test_a_folded_sheet_connects_only_along_the_fold():
    sample = shape_sample("folded_sheet", 4000, SplatStyle(tilt=0.0))
    ellipses = occupancy_ellipses(sample.splats)
    graph = splat_graph(ellipses)
    assert graph.components.max() == 0
    ends = ellipses.centers[graph.edges]
    across = (ends[:, 0, 2] > 0.02) & (ends[:, 1, 2] < -0.02) | (ends[:, 0, 2] < -0.02) & (ends[:, 1, 2] > 0.02)
    assert (ends[across, :, 0] > 0.7).all()


def test_five_slats_have_a_fifth_of_the_papers_wrong_edges_at_most():
    reach = float(np.median(occupancy_ellipses(surface_splats(slats(), 6000).splats).reaches))
    # A third of a splat, whose length is twice its reach.
    gap = 2.0 * reach / 3.0
    for style in (SplatStyle(overhang=0.6), TRAINED):
        sample = surface_splats(slats(gap=gap), 6000, style)
        corners = sample.surface.vertices[sample.surface.faces[sample.faces]]
        slat_of_row = np.round(corners[:, :, 1].mean(axis=1) / (0.16 + gap))
        counts = {}
        for rule in RULES:
            rows, graph = graph_of(sample.splats, rule)
            ends = slat_of_row[rows][graph.edges]
            counts[rule] = (ends[:, 0] != ends[:, 1]).sum()
        assert counts["paper"] > 100
        assert counts["touch"] < 0.2 * counts["paper"]


def test_whatever_touches_is_connected():
    ellipses = occupancy_ellipses(cloud(300, size=0.15))
    touching = splat_graph(ellipses)
    pairs = all_pairs(300)
    pairs = pairs[touch_scales(ellipses, pairs, touching.epsilon) <= 1.0]
    assert (touching.components[pairs[:, 0]] == touching.components[pairs[:, 1]]).all()


@pytest.mark.parametrize(("n", "n_components"), [(25, 1), (100, 2)])
def test_a_small_fragment_is_joined_by_its_best_contact_and_a_large_one_is_not(n, n_components):
    size = 0.05 * np.sqrt(n)
    large, part = sheet(400, cover=2.0), sheet(n, size=size, cover=2.0, seed=1)
    # Beside it, with a gap wider than the ellipses reach and narrower than they do grown to the double.
    part = replace(part, means=part.means + np.array([1.08, 0.2, 0.0]))
    rows, graph = graph_of(joined(large, part))
    assert graph.components.max() + 1 == n_components
    joints = (rows[graph.edges] < 400).sum(axis=1) == 1
    assert joints.sum() == 2 - n_components
    upper = np.repeat(np.arange(graph.n_nodes), graph.degrees) < graph.indices
    assert (graph.touch[upper][joints] > 1.0).all()


def test_components_are_numbered_by_falling_size():
    parts = [sheet(n, size=0.1 * np.sqrt(n), height=10.0 * n) for n in (25, 100, 49)]
    rows, graph = graph_of(joined(*parts))
    assert np.bincount(graph.components).tolist() == [100, 49, 25]
    assert set(rows[graph.components == 0]) == set(range(25, 125))


def test_one_splat_in_a_hundred_of_a_hundredfold_size_costs_no_memory_to_speak_of():
    scene = ball(4000, cover=3.0)
    scales = scene.log_scales.copy()
    giants = np.random.default_rng(0).choice(4000, 40, replace=False)
    scales[giants] += np.log(100.0)
    ellipses = occupancy_ellipses(replace(scene, log_scales=scales))
    splat_graph(occupancy_ellipses(ball(50)))
    tracemalloc.start()
    graph = splat_graph(ellipses)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # Every giant lies within reach of every splat: 160,000 pairs, of which only the best are ever held.
    assert peak < 4000 * 1500
    assert graph.degrees.max() <= 3 * module.N_PARTNERS
    plain = splat_graph(occupancy_ellipses(scene))
    # The others hold on to each other as without them.
    assert graph.n_edges > 0.9 * plain.n_edges


def test_mended_edges_are_pairs_of_file_rows():
    scene = joined(sheet(100), sheet(100, height=1.0, seed=1))
    rows, graph = graph_of(scene)
    cut = tuple(map(tuple, rows[graph.edges[::60]].tolist()))
    add = ((3, 150), (7, 180))
    new_rows, mended = graph_of(scene, cut=(*cut, (0, 199)), add=add)
    expected = row_edges(rows, graph.edges) - {frozenset(pair) for pair in cut} | {frozenset(pair) for pair in add}
    assert row_edges(new_rows, mended.edges) == expected
    assert mended.components.max() == 0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"cut": ((0, 25),)}, "cut: rows 25 are not in the file, which has 25 splats"),
        ({"add": ((0, -1),)}, "add: rows -1 are not in the file"),
        ({"add": ((0, 7), (7, 2))}, "add: rows 7 are inert"),
        ({"cut": ((4, 4),)}, "cut: row 4 is paired with itself"),
        ({"rule": "no such rule"}, 'rule must be "touch" or "paper"'),
        ({"epsilon": -1.0}, "epsilon must be a finite number"),
        ({"k": 2}, "k must be a whole number, 3 to 1000"),
    ],
)
def test_wrong_options_are_rejected(options, message):
    scene = sheet(25)
    opacities = scene.logit_opacities.copy()
    opacities[7] = -30.0
    with pytest.raises(ValueError, match=message):
        splat_graph(occupancy_ellipses(replace(scene, logit_opacities=opacities)), GraphOptions(**options))


@pytest.mark.parametrize("rule", RULES)
def test_degenerate_scenes_have_a_graph(rule):
    nothing = splats_of(np.empty((0, 3)), np.empty((0, 2)))
    assert graph_of(nothing, rule)[1].n_edges == 0
    one = splats_of(np.zeros((1, 3)), np.array([0.1, 0.1]))
    assert graph_of(one, rule)[1].n_edges == 0
    two = splats_of(np.array([[0.0, 0, 0], [0.15, 0, 0]]), np.array([0.1, 0.1]))
    assert graph_of(two, rule)[1].edges.tolist() == [[0, 1]]
    heap = splats_of(np.zeros((30, 3)), np.array([0.1, 0.1]))
    graph = graph_of(heap, rule)[1]
    assert graph.components.max() == 0
    assert (graph.lengths > 0.0).all()
    line = splats_of(np.linspace(0.0, 1.0, 50)[:, None] * [1.0, 0, 0], np.array([0.015, 0.015]))
    assert np.array_equal(graph_of(line, rule)[1].degrees[1:-1], np.full(48, 2))


@pytest.mark.parametrize("rule", RULES)
def test_progress_rises_to_1_and_cancels(rule):
    ellipses = occupancy_ellipses(ball(300))
    shares = []
    splat_graph(ellipses, GraphOptions(rule=rule), progress=shares.append)
    assert shares == sorted(shares) and shares[-1] == 1.0

    def cancel(share: float) -> None:
        raise Cancelled

    with pytest.raises(Cancelled):
        splat_graph(ellipses, GraphOptions(rule=rule), progress=cancel)
