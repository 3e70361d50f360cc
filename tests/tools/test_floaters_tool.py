"""Floaters: found in the background, tinted by strength, framed by group, removed in a step that keeps the strength."""

import threading

import numpy as np

from splap_editor.core.progress import Cancelled
from splap_editor.core.removal import PickedFloaters, RemovalStep
from splap_editor.core.splats.floater_evidence import REASONS
from splap_editor.engine.floaters import floating_rows
from splap_editor.engine.removal import Removal, removal_of
from splap_editor.resources import resource
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
    sizes = [len(found.rows_of(group)) for group in range(found.n_groups)]
    assert sizes == sorted(sizes, reverse=True) == list(found.sizes) and sum(sizes) == len(found.rows)
    assert found.group_of(int(found.rows[0])) == found.labels[0]
    assert all(found.reason(group) in REASONS for group in range(found.n_groups))
    removed = search.removal(found)
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
    assert painted[-1] is None and tool.found is None
    hand.session.history.undo()
    assert hand.scene.edit.removed is None


def test_strength_changes_the_preview_and_brackets_frame_each_group(hand):
    tool = looked_for(hand, some_strength(hand))
    views, n = [], tool.found.n_groups
    hand.context.fly_to = views.append
    assert hand.key("]") and tool.looked_at == 0
    assert hand.key("[") and tool.looked_at == n - 1
    assert len(views) == 2
    search = tool.preview.search
    hand.context.held(FloaterOptions).set(FloaterOptions(0.0))
    hand.main.run_until(lambda: not len(tool.found.rows))
    assert tool.preview.search is search
    assert "Nothing floats" in hand.context.hud.text and not hand.key("]")


def test_a_click_on_a_floater_or_beside_it_frames_and_rings_its_group_with_room_about_it(hand):
    tool = looked_for(hand, some_strength(hand))
    views, rings = [], hand.viewport.rings
    hand.context.fly_to = views.append
    screen, found = hand.viewport.screen_points()[:, :2], tool.found
    hand.click((3, 3))
    assert tool.looked_at is None and not views and "floaters" not in rings.names
    middle = np.nanmean(screen, axis=0)
    # One at the rim of the object: beside it there is nothing to be picked.
    place = np.nanargmax(np.linalg.norm(screen[found.rows] - middle, axis=1))
    at = screen[found.rows[place]]
    hand.click(tuple(at + 8.0 * (at - middle) / np.linalg.norm(at - middle)))
    assert tool.looked_at is not None and "floaters" in rings.names
    rows = found.rows_of(tool.looked_at)
    assert np.linalg.norm(screen[rows] - at, axis=1).min() < 20.0
    view, scene = views[-1], hand.scene
    away = np.linalg.norm(view.position - np.asarray(scene.splats.means, np.float64)[rows].mean(axis=0))
    assert 0.1 * scene.ellipses.scene_scale < away < 2.0 * scene.ellipses.scene_scale
    hand.key("Esc")
    assert "floaters" not in rings.names


def test_a_group_that_is_kept_stays_and_the_recipe_says_so(hand):
    painted = []
    hand.context.paint = painted.append
    strength = some_strength(hand)
    tool = looked_for(hand, strength)
    found, rows = tool.found, tool.found.rows_of(0)
    tool.preview.keep(0, True)
    assert tool.preview.keeps(0) and (found.n_groups == 1 or not tool.preview.keeps(1))
    assert not painted[-1][rows, 3].any()
    expected = found.mask
    expected[rows] = False
    assert hand.key("Return")
    np.testing.assert_array_equal(hand.scene.removed, expected)
    removal = hand.scene.edit.removal
    np.testing.assert_array_equal(removal_of(removal.steps, hand.scene.splats).mask, expected)
    assert [step.restores for step in removal.steps] == [False, True]


def test_a_group_can_go_after_all_and_what_stays_stays_at_other_strengths(hand):
    tool = looked_for(hand, some_strength(hand))
    kept, found = tool.found.rows_of(0), tool.found
    tool.preview.keep(0, True)
    hand.context.held(FloaterOptions).set(FloaterOptions(0.9999999))
    hand.main.run_until(lambda: tool.found is not found)
    assert tool.found.mask[kept].all() and not tool.preview.goes[kept].any()
    group = tool.found.group_of(int(kept[0]))
    tool.preview.keep(group, False)
    assert tool.preview.goes[kept].all()


def test_escape_leaves_everything_as_it_is_until_the_next_click(hand):
    painted = []
    hand.context.paint = painted.append
    tool = looked_for(hand, some_strength(hand))
    edit = hand.scene.edit
    assert hand.key("Esc")
    assert painted[-1] is None and not hand.context.hud.text and tool.found is None
    assert hand.scene.edit is edit and not hand.session.history.can_undo
    hand.hover((8, 8))
    assert not tool.preview.is_shown
    hand.click((8, 8))
    hand.main.run_until(lambda: tool.found is not None)


def test_a_large_scene_is_looked_through_ahead_and_the_search_outlives_the_tool(hand, monkeypatch):
    monkeypatch.setattr("splap_editor.session.floater_preview.AHEAD_SPLATS", 10)
    tool = hand.tools.tools["floaters"]
    hand.session.open(resource("samples", "tube.ply"))
    hand.main.run_until(lambda: tool.preview.search is not None)
    search = tool.preview.search
    assert tool.found is None and not hand.context.hud.text
    looked_for(hand, 0.5)
    hand.tools.choose("handle")
    assert tool.preview.search is search and tool.found is None


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

    def slow(splats, removal, ellipses, *, stages, run):
        begun.set()
        go_on.wait(60.0)
        try:
            stages("contributions")(0.5)
        except Cancelled:
            ended.append("cancelled")
            raise

    monkeypatch.setattr("splap_editor.session.floater_preview.floater_search", slow)
    hand.tools.choose("floaters")
    tool = hand.tools.chosen
    assert begun.wait(60.0)
    hand.tools.choose("handle")
    go_on.set()
    hand.main.run_until(lambda: not tool.preview.is_looking)
    assert ended == ["cancelled"] and tool.found is None
