"""Floaters: found in the background, tinted by strength, framed by group, removed in a step that keeps the strength."""

import threading

import numpy as np

from splap_editor.core.progress import Cancelled
from splap_editor.core.removal import PickedFloaters, RemovalStep
from splap_editor.engine.floaters import floating_rows
from splap_editor.engine.removal import Removal
from splap_editor.session.floater_search import floater_search
from splap_editor.tools.floaters_tool import FloaterOptions


def looked_for(hand, strength):
    hand.context.held(FloaterOptions).set(FloaterOptions(strength))
    hand.tools.choose("floaters")
    tool = hand.tools.chosen
    hand.main.run_until(lambda: tool.found is not None)
    return tool


def some_strength(hand):
    """A strength at which some of the splats float, but not all."""
    scene = hand.scene
    search = floater_search(scene.splats, scene.edit.removal)
    likelihoods = np.sort(search.floaters.likelihoods)[::-1]
    return float(np.clip(1.0 - likelihoods[len(likelihoods) // 20], 0.01, 0.99999))


def test_the_window_finds_what_a_recipe_finds(hand):
    scene, strength = hand.scene, some_strength(hand)
    search = floater_search(scene.splats, Removal())
    found = search.found(strength)
    np.testing.assert_array_equal(found.mask, floating_rows(scene.splats, None, strength))
    assert 0 < len(found.rows) < scene.splats.n_splats
    sizes = [len(found.rows_of(label)) for label in found.groups]
    assert sizes == sorted(sizes, reverse=True) and sum(sizes) == len(found.rows)
    assert found.group_of(int(found.rows[0])) == found.labels[0]
    removed = search.removal(strength)
    again = floater_search(scene.splats, removed)
    assert not again.found(0.0).mask.any()
    assert again.ellipses.n_nodes == scene.ellipses.n_nodes - len(found.rows)


def test_what_floats_is_tinted_and_return_takes_it_in_one_step(hand):
    painted = []
    strength = some_strength(hand)
    hand.context.paint = painted.append
    tool = looked_for(hand, strength)
    mask = tool.found.mask
    np.testing.assert_array_equal(painted[-1][:, 3] > 0, mask)
    assert f"{mask.sum():,} splats float" in hand.context.hud.text
    assert hand.key("Return")
    np.testing.assert_array_equal(hand.scene.removed, mask)
    assert hand.scene.edit.removal.steps == (RemovalStep(PickedFloaters(strength)),)
    assert painted[-1] is None and tool.search is None
    hand.session.history.undo()
    assert hand.scene.edit.removed is None


def test_strength_changes_the_preview_at_once_and_brackets_frame_each_group(hand):
    tool = looked_for(hand, some_strength(hand))
    views = []
    hand.context.fly_to = views.append
    assert hand.key("]") and hand.key("[")
    assert len(views) == 2
    search = tool.search
    hand.context.held(FloaterOptions).set(FloaterOptions(0.0))
    assert tool.search is search and not len(tool.found.rows)
    assert "Nothing floats" in hand.context.hud.text and not hand.key("]")


def test_another_tool_takes_the_tint_away(hand):
    painted = []
    hand.context.paint = painted.append
    looked_for(hand, some_strength(hand))
    hand.tools.choose("handle")
    assert painted[-1] is None and not hand.context.hud.text


def test_it_says_how_far_it_is(hand):
    told = []
    hand.context.hud.changed.connect(lambda: told.append(hand.context.hud.text))
    looked_for(hand, 0.5)
    assert any("seeing which splats make the picture, 100%" in text for text in told)


def test_another_tool_stops_the_looking(hand, monkeypatch):
    begun, go_on, ended = threading.Event(), threading.Event(), []

    def slow(splats, removal, *, stages):
        begun.set()
        go_on.wait(60.0)
        try:
            stages("contributions")(0.5)
        except Cancelled:
            ended.append("cancelled")
            raise

    monkeypatch.setattr("splap_editor.tools.floaters_tool.floater_search", slow)
    hand.tools.choose("floaters")
    tool = hand.tools.chosen
    assert begun.wait(60.0)
    hand.tools.choose("handle")
    go_on.set()
    hand.main.run_until(lambda: not tool._job.is_busy)
    assert ended == ["cancelled"] and tool.search is None
