"""Cards say what the engine knows."""

from dataclasses import replace

import numpy as np
import pytest

from splap_editor.core.graph.ellipse_offset import normal_offsets, touch_scales
from splap_editor.core.graph.splat_graph import GraphOptions, splat_graph
from splap_editor.engine.surface import surface_of
from splap_editor.io.ply import read_ply
from splap_editor.resources import resource
from splap_editor.session.cards import edge_card, has_edge, splat_card


@pytest.fixture(scope="module")
def splats():
    splats = read_ply(resource("samples", "tube.ply")).splats
    logits, quats = np.array(splats.logit_opacities), np.array(splats.quats)
    logits[7] = -20.0
    quats[8] = 0.0
    return replace(splats, logit_opacities=logits, quats=quats)


@pytest.fixture(scope="module")
def surface(splats):
    return surface_of(splats, GraphOptions())


def test_a_splats_card_has_its_place_in_the_graph(splats, surface):
    row = int(surface.ellipses.rows[100])
    card = splat_card(splats, surface.ellipses, surface.graph, row)
    assert (card.row, card.degree, card.inert) == (row, surface.graph.degrees[100], "")
    np.testing.assert_allclose(card.semi_axes, np.linalg.norm(surface.ellipses.semi_axes[100], axis=1))
    assert card.component_size == np.count_nonzero(surface.graph.components == card.component)
    assert splat_card(splats, surface.ellipses, None, row).degree is None


def test_an_inert_splats_card_says_why(splats, surface):
    assert splat_card(splats, surface.ellipses, surface.graph, 7).inert == "too faint to be seen"
    assert splat_card(splats, surface.ellipses, surface.graph, 8).inert == "its rotation is all zero"
    assert splat_card(splats, surface.ellipses, surface.graph, 8).semi_axes is None


def test_a_threshold_is_shown_where_there_is_one(splats, surface):
    with_thresholds = replace(splats, thresholds=np.full(splats.n_splats, 0.25))
    assert splat_card(with_thresholds, surface.ellipses, None, 0).threshold == 0.25
    assert splat_card(splats, surface.ellipses, None, 0).threshold is None


def test_an_edges_card_has_both_offsets_and_its_touch_scale(splats, surface):
    ellipses, pair = surface.ellipses, surface.graph.edges[50]
    rows = tuple(ellipses.rows[pair].tolist())
    card = edge_card(ellipses, rows, 0.005)
    assert card.offsets == tuple(normal_offsets(ellipses, pair[None])[0])
    assert card.touch == touch_scales(ellipses, pair[None], surface.graph.epsilon)[0]
    assert edge_card(ellipses, rows[::-1], 0.005).offsets == card.offsets[::-1]
    assert has_edge(ellipses, surface.graph, rows) and has_edge(ellipses, surface.graph, rows[::-1])


@pytest.mark.parametrize("epsilon", [0.0, 0.002, 0.02])
def test_within_is_what_the_papers_rule_joins(splats, surface, epsilon):
    ellipses = surface.ellipses
    graph = splat_graph(ellipses, GraphOptions(rule="paper", epsilon=epsilon))
    for pair in surface.graph.edges[::200]:
        rows = tuple(ellipses.rows[pair].tolist())
        assert edge_card(ellipses, rows, epsilon).is_within == has_edge(ellipses, graph, rows)


def test_an_edge_to_an_inert_splat_is_rejected(splats, surface):
    with pytest.raises(ValueError, match="rows 7 and 0 must be active"):
        edge_card(surface.ellipses, (7, 0), 0.005)
    assert not has_edge(surface.ellipses, surface.graph, (7, 0))
