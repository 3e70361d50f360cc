"""Polygon, ball and likeness: gestures to the selection they make, each one step of the history."""

from dataclasses import replace

import numpy as np

from splap_editor.session.likeness import LikenessOptions, alike

DOWN = np.array([0, 1])
SQUARE = np.array([[-40, -40], [40, -40], [40, 40], [-40, 40]])


def clicked(hand, corners):
    for corner in corners:
        hand.click(corner)


def test_a_polygon_of_clicks_selects_what_a_lasso_of_its_corners_does(hand):
    corners = hand.surface() + SQUARE
    hand.tools.choose("lasso")
    hand.drag(*corners, corners[0])
    by_lasso = hand.scene.selection.copy()
    hand.session.history.undo()
    hand.tools.choose("polygon")
    clicked(hand, corners)
    assert len(hand.context.hud.outline) == 4
    assert hand.key("Return")
    assert by_lasso.any()
    np.testing.assert_array_equal(hand.scene.selection, by_lasso)
    assert not hand.context.hud.outline
    hand.session.history.undo()
    assert not hand.scene.selection.any()


def test_a_polygon_adds_goes_back_and_is_forgotten(hand):
    hand.tools.choose("polygon")
    middle, tool = hand.surface(), hand.tools.chosen
    clicked(hand, middle + SQUARE / 4)
    hand.key("Return")
    small = hand.scene.selection.copy()
    clicked(hand, middle + SQUARE)
    hand.key("Ctrl+Return")
    assert not hand.scene.selection.any()
    hand.session.history.undo()
    clicked(hand, middle + SQUARE)
    hand.key("Backspace")
    assert len(tool.corners) == 3
    hand.key("Shift+Return")
    assert (hand.scene.selection >= small).all() and hand.scene.selection.sum() > small.sum()
    clicked(hand, middle + SQUARE[:2])
    assert hand.key("Return") and len(tool.corners) == 2
    assert hand.key("Esc") and not tool.corners and not hand.key("Esc")


def test_a_ball_selects_by_distance_from_the_splat_under_the_press(hand):
    hand.tools.choose("ball")
    at = hand.surface()
    hit, projection = hand.viewport.pick(*at), hand.viewport.projection
    center = np.asarray(hand.scene.positions[hit.row], float)
    radius = 60 * projection.world_per_pixel(center)
    hand.drag(at, at + DOWN * 30, at + DOWN * 60)
    distances = np.linalg.norm(np.asarray(hand.scene.positions, float) - center, axis=1)
    np.testing.assert_array_equal(hand.scene.selection, distances <= radius)
    assert 1 < hand.scene.selection.sum() < len(distances)
    before = hand.scene.selection
    hand.drag(at, at + DOWN * 15, at + DOWN * 30, held="Ctrl")
    assert 0 < hand.scene.selection.sum() < before.sum()


def test_a_click_selects_the_like_and_floods(hand):
    hand.tools.choose("similar")
    held, scene = hand.context.held(LikenessOptions), hand.scene
    at = hand.surface()
    row = hand.viewport.pick(*at).row
    for options in (LikenessOptions(color=0.05), LikenessOptions(color=0.2, angle=15.0, floods=True)):
        held.set(options)
        hand.click(at)
        expected = alike(scene.splats, scene.ellipses, scene.surface.graph, row, options)
        hand.main.run_until(lambda expected=expected: np.array_equal(scene.selection, expected))
        hand.session.history.undo()
    held.set(replace(held.value, color=1.0, angle=90.0, floods=False))
    hand.click(at)
    hand.main.run_until(lambda: scene.selection.all())
