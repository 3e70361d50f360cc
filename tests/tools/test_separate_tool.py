"""Strokes over two parts: a seam is shown, Return cuts it in one step, Escape drops it."""

import numpy as np

from tests.tools.conftest import two_places


def pointed(hand):
    """The tool, with a seam between two places shown."""
    hand.settle()
    hand.tools.choose("separate")
    for xy in two_places(hand):
        hand.click(xy)
    tool = hand.tools.chosen
    hand.main.run_until(lambda: tool.found is not None)
    return tool


def test_two_clicks_show_a_seam_and_return_cuts_it_in_one_step(hand):
    tool = pointed(hand)
    assert len(tool.found.rows) and "Seam" in hand.context.hud.text
    seam, before = tool.found, hand.scene.surface.graph.n_edges
    hand.key("Return")
    assert hand.scene.edit.graph.separate == (seam.stroke,) and not tool.parts
    hand.settle()
    hand.main.run_until(lambda: hand.scene.surface is not None and hand.scene.surface.options.separate)
    assert hand.scene.surface.graph.n_edges == before - len(seam.rows)
    hand.session.history.undo()
    assert not hand.scene.edit.graph.separate


def test_escape_drops_the_seam(hand):
    tool = pointed(hand)
    hand.key("Esc")
    assert not tool.parts and tool.found is None and not hand.context.hud.text
    assert not hand.scene.edit.graph.separate


def test_a_bracket_asks_for_a_wider_seam(hand):
    tool = pointed(hand)
    hand.key("]")
    hand.main.run_until(lambda: tool.found is not None)
    assert tool.found.stroke.wider == 1


def test_a_stroke_keeps_places_at_rest(hand):
    hand.settle()
    hand.tools.choose("separate")
    at = hand.surface()
    hand.drag(at, at + 8, at + 16)
    tool = hand.tools.chosen
    means = np.asarray(hand.scene.splats.means, np.float64)[list(tool.rows[0])]
    np.testing.assert_array_equal(np.array(tool.parts[0]), means)


def test_return_takes_the_selection_apart_from_the_rest(hand):
    hand.settle()
    hand.tools.choose("separate")
    chosen = np.zeros(hand.scene.splats.n_splats, bool)
    chosen[hand.scene.ellipses.rows[:40]] = True
    hand.scene.set_selection(chosen)
    hand.key("Return")
    rows = np.array(hand.scene.edit.graph.cut)
    assert len(rows) and (chosen[rows].sum(axis=1) == 1).all()
