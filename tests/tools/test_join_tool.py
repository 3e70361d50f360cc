"""Strokes at a gap: contacts are shown, Return adds them in one step, Escape drops them."""

import numpy as np
import pytest

from splap_editor.core.graph.options import GraphOptions
from splap_editor.session.mends import edges_between, with_cut
from tests.tools.conftest import two_places


@pytest.fixture
def slit(hand):
    """The scene with every edge cut between its two halves along the longest side; which file rows are in the first."""
    hand.settle()
    means = np.asarray(hand.scene.splats.means)
    axis = int(np.argmax(np.ptp(means, axis=0)))
    first = means[:, axis] < np.median(means[:, axis])
    surface = hand.scene.surface
    cut = with_cut(GraphOptions(), edges_between(surface.ellipses, surface.graph, first, ~first))
    hand.session.steps.change_edit(hand.scene.edit.with_options(cut), "Cut")
    hand.main.run_until(lambda: hand.scene.surface is not None and hand.scene.surface.options == cut)
    hand.settle()
    hand.tools.choose("join")
    return first


def pieces(hand) -> int:
    return int(hand.scene.surface.graph.components.max()) + 1


def beside(hand, first) -> tuple[int, int]:
    """The two nearest rows on both sides of the slit."""
    rows, centers = hand.scene.ellipses.rows, hand.scene.ellipses.centers
    a, b = np.flatnonzero(first[rows]), np.flatnonzero(~first[rows])
    apart = np.linalg.norm(centers[a][:, None] - centers[b][None], axis=2)
    i, j = np.unravel_index(np.argmin(apart), apart.shape)
    return int(rows[a[i]]), int(rows[b[j]])


def taken(hand, *parts):
    tool = hand.tools.chosen
    for rows in parts:
        tool.take_rows(rows)
    hand.main.run_until(lambda: tool.found is not None)
    return tool


def test_a_place_on_each_rim_shows_contacts_and_return_adds_them_in_one_step(hand, slit):
    before = hand.scene.surface
    assert pieces(hand) == 2
    a, b = beside(hand, slit)
    tool = taken(hand, (a,), (b,))
    rows, stroke = tool.found.rows, tool.found.stroke
    assert {a, b} in [set(pair) for pair in rows.tolist()] and "Return joins" in hand.context.hud.text
    assert (slit[rows].sum(axis=1) == 1).all(), "what is joined already is not shown"
    hand.key("Return")
    assert hand.scene.edit.graph.join == (stroke,) and not tool.parts
    hand.main.run_until(lambda: hand.scene.surface is not None and hand.scene.surface.options.join)
    assert hand.scene.surface.graph.n_edges == before.graph.n_edges + len(rows) and pieces(hand) == 1
    hand.session.history.undo()
    assert not hand.scene.edit.graph.join


def test_brackets_change_the_reach_and_with_it_how_many_are_tied(hand, slit):
    a, b = beside(hand, slit)
    tool = taken(hand, (a,), (b,))
    n, reach = len(tool.found.rows), tool.found.stroke.reach
    for _ in range(6):
        hand.key("]")
    hand.main.run_until(lambda: tool.found is not None)
    assert tool.found.stroke.reach == pytest.approx(reach * 1.25**6) and len(tool.found.rows) > n
    for _ in range(10):
        hand.key("[")
    hand.main.run_until(lambda: tool.found is not None)
    assert len(tool.found.rows) == 0 and "reaches farther" in hand.context.hud.text
    hand.key("Return")
    assert not hand.scene.edit.graph.join and len(tool.parts) == 2, "nothing to add: the rims stay pointed at"


def test_one_stroke_across_the_gap_points_at_both_rims(hand, slit):
    a, b = beside(hand, slit)
    graph, ellipses = hand.scene.surface.graph, hand.scene.ellipses
    behind = [int(ellipses.rows[graph.indices[graph.indptr[ellipses.node_of_row[row]]]]) for row in (a, b)]
    tool = taken(hand, (behind[0], a, b, behind[1]))
    assert tool.rows == ((behind[0], a), (b, behind[1]))


def test_a_stroke_along_the_surface_is_one_rim(hand, slit):
    a, _ = beside(hand, slit)
    graph, ellipses = hand.scene.surface.graph, hand.scene.ellipses
    node = ellipses.node_of_row[a]
    near = ellipses.rows[graph.indices[graph.indptr[node] : graph.indptr[node + 1]]][:1].tolist()
    hand.tools.chosen.take_rows((a, *near))
    assert hand.tools.chosen.rows == ((a, *near),)


def test_return_shows_what_ties_the_selection_to_the_rest_and_again_adds_it(hand, slit):
    hand.scene.set_selection(slit)
    tool = hand.tools.chosen
    hand.key("Return")
    hand.main.run_until(lambda: tool.found is not None)
    assert slit[list(tool.rows[0])].all() and not slit[list(tool.rows[1])].any()
    assert len(tool.found.rows) and not hand.scene.edit.graph.join
    hand.key("Return")
    hand.main.run_until(lambda: hand.scene.surface is not None and hand.scene.surface.options.join)
    assert pieces(hand) == 1


def test_a_selection_of_everything_is_refused_in_a_sentence(hand, slit):
    hand.scene.set_selection(np.ones(len(slit), bool))
    hand.key("Return")
    hand.main.run_until(lambda: "on one side" in hand.context.hud.text)
    assert not hand.tools.chosen.parts


def test_escape_drops_the_contacts(hand, slit):
    for xy in two_places(hand):
        hand.click(xy)
    tool = hand.tools.chosen
    assert len(tool.parts) == 2
    hand.key("Esc")
    assert not tool.parts and tool.found is None and not hand.context.hud.text


def test_the_text_of_another_tool_stays_where_nothing_is_pointed_at(hand):
    hand.settle()
    hand.context.hud.show(text="said elsewhere")
    hand.scene.pose_changed.emit()
    assert hand.context.hud.text == "said elsewhere"
