"""Moving the whole object, levelling it, measuring it."""

import numpy as np
import pytest

from splap_editor.core.place import Place, placed_points
from splap_editor.viewport.gizmo_parts import Act


def taken_up(hand, name):
    hand.tools.choose(name)
    hand.hover((5, 5))
    return hand.tools.chosen


def turned(hand):
    """The object leaning, as a step."""
    quat = (np.array([0.95, 0.2, 0.1, 0.0]) / np.linalg.norm([0.95, 0.2, 0.1, 0.0])).tolist()
    hand.session.steps.change_place(Place((0.1, 0.0, 0.0), (0.2, -0.1, 0.3), tuple(quat), 1.7), "Lean")


@pytest.mark.parametrize("leans", [False, True])
def test_g_x_and_a_number_move_all_of_it_along_the_axes_in_the_corner(hand, leans):
    if leans:
        turned(hand)
    taken_up(hand, "place")
    points = np.asarray(hand.scene.splats.means, np.float64)
    before, steps = placed_points(points, hand.scene.edit.place), hand.scene.edit.place
    hand.key("G", "X", "2", "Return")
    after = placed_points(points, hand.scene.edit.place)
    np.testing.assert_allclose(after - before, np.broadcast_to([2.0, 0.0, 0.0], after.shape), atol=1e-9)
    assert hand.session.history.undo_label == "Move object"
    hand.session.history.undo()
    assert hand.scene.edit.place == steps


def test_turns_and_scales_are_about_the_middle_of_the_subject(hand):
    turned(hand)
    taken_up(hand, "place")
    middle = hand.scene.ellipses.subject.center[None]
    before, place = placed_points(middle, hand.scene.edit.place), hand.scene.edit.place
    hand.key("R", "Z", "9", "0", "Return")
    np.testing.assert_allclose(placed_points(middle, hand.scene.edit.place), before, atol=1e-9)
    turn = hand.scene.edit.place.rotation @ place.rotation.T
    np.testing.assert_allclose(turn, [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-9)
    hand.key("S", "3", "Return")
    assert hand.scene.edit.place.scale == pytest.approx(3.0 * place.scale)
    np.testing.assert_allclose(placed_points(middle, hand.scene.edit.place), before, atol=1e-9)


def test_a_drag_of_the_gizmo_moves_the_object_under_the_pointer_and_escape_puts_it_back(hand):
    taken_up(hand, "place")
    gizmo, middle = hand.viewport.gizmo, hand.scene.ellipses.subject.center
    at = hand.viewport.projection.pixel(middle)
    hand.tell("press", at, "left")
    assert gizmo.dragged is not None
    hand.tell("move", at + np.array([40, 15]), buttons={"left"})
    np.testing.assert_allclose(hand.viewport.projection.pixel(middle), at + np.array([40, 15]), atol=1e-3)
    hand.key("Esc")
    assert hand.scene.preview is None and hand.scene.edit.place.is_identity
    hand.tell("release", at, "left")
    np.testing.assert_allclose(hand.viewport.projection.pixel(middle), at, atol=1e-3)
    hand.drag(at, at + np.array([20, 0]), at + np.array([40, 15]))
    assert hand.session.history.undo_label == "Move object"
    np.testing.assert_allclose(hand.viewport.projection.pixel(middle), at + np.array([40, 15]), atol=1e-3)


def test_handles_keep_their_gizmo_with_other_tools_and_their_poses_with_any_place(hand):
    handle = hand.placed()
    hand.key("G", "Z", ".", "1", "Return")
    hand.settle()
    bound, kernels = hand.session.bound, hand.scene.kernels
    taken_up(hand, "place")
    np.testing.assert_allclose(hand.viewport.gizmo.frame[:3, 3], hand.scene.ellipses.subject.center)
    hand.key("R", "Y", "3", "0", "Return")
    hand.settle()
    assert hand.session.bound is bound and hand.scene.kernels is kernels
    hand.tools.choose("handle")
    pose = hand.scene.edit.handle(handle.handle_id).pose
    np.testing.assert_allclose(hand.viewport.gizmo.frame[:3, 3], np.add(handle.region.center, pose.translate))
    hand.key("G", "X", ".", "2", "Return")
    moved = np.subtract(hand.scene.edit.handle(handle.handle_id).pose.translate, pose.translate)
    np.testing.assert_allclose(hand.scene.edit.place.rotation @ moved, [0.2, 0.0, 0.0], atol=1e-9)


def find_floor(hand):
    hand.click(hand.surface())
    assert "Looking for the floor" in hand.context.hud.text and hand.scene.preview is None
    hand.main.run_until(lambda: hand.scene.preview is not None)


def test_a_floor_that_was_left_before_it_was_found_is_not_shown(hand):
    turned(hand)
    tool = taken_up(hand, "level")
    hand.click(hand.surface())
    assert hand.key("Esc") and not hand.context.hud.text
    hand.main.run_until(lambda: not tool.is_looking)
    assert hand.scene.preview is None and not hand.key("Return")


def test_a_click_levels_by_what_is_about_it_and_return_keeps_it(hand):
    turned(hand)
    before, tool = hand.scene.edit.place, taken_up(hand, "level")
    find_floor(hand)
    shown = hand.scene.preview.place
    assert shown != before and "off level" in hand.context.hud.text
    hand.key("Esc")
    assert hand.scene.preview is None and hand.scene.edit.place == before and not hand.context.hud.text
    find_floor(hand)
    # The turn may take the object out of a picture of a few splats.
    hand.viewport.camera.view = hand.viewport.frame(hand.scene.ellipses.rows[:3])
    assert hand.key("Return")
    np.testing.assert_allclose(hand.scene.edit.place.matrix, shown.matrix, atol=1e-12)
    size = [hand.viewport.projection.width, hand.viewport.projection.height]
    screen = hand.viewport.screen_points()[:, :2]
    assert ((screen >= 0) & (screen <= size)).all(axis=1).mean() > 0.95
    assert hand.session.history.undo_label == "Level object" and not tool.points
    hand.session.history.undo()
    assert hand.scene.edit.place == before


def test_three_points_lie_level_afterwards(hand):
    turned(hand)
    tool = taken_up(hand, "level")
    screen, scene = hand.viewport.screen_points()[:, :2], hand.scene
    order = np.random.default_rng(0).permutation(len(screen))
    size = [hand.viewport.projection.width, hand.viewport.projection.height]
    for xy in screen[order]:
        if len(tool.points) < 3 and (xy > 0).all() and (xy < size).all():
            hand.click(xy, held="Shift")
    points = np.array(tool.points)
    hand.key("Return")
    heights = placed_points(points, scene.edit.place) @ np.array(scene.up)
    assert len(points) == 3 and np.ptp(heights) < 1e-9 < np.ptp(points @ np.array(scene.up))


def two_ends(hand):
    tool = taken_up(hand, "measure")
    rows = hand.scene.ellipses.rows
    x = hand.scene.ellipses.centers[:, 2]
    for node in (np.argmin(x), np.argmax(x)):
        tool.put(len(tool.rows), int(rows[node]))
    hand.main.run_until(lambda: tool.found is not None)
    return tool


def test_a_measure_is_told_straight_and_along_the_surface_in_placed_units(hand):
    tool = two_ends(hand)
    means = np.asarray(hand.scene.splats.means, np.float64)[tool.rows]
    straight, along = np.linalg.norm(means[1] - means[0]), tool.found.along
    assert straight <= along < 10.0 * straight
    assert f"Straight {straight:.5g}" in hand.context.hud.text and f"surface {along:.5g}" in hand.context.hud.text
    steps = np.asarray(hand.scene.splats.means, np.float64)[tool.found.path]
    assert np.linalg.norm(np.diff(steps, axis=0), axis=1).sum() == pytest.approx(along)
    turned(hand)
    assert f"Straight {1.7 * straight:.5g}" in hand.context.hud.text
    hand.key("Esc")
    assert not tool.rows and not hand.context.hud.text


def test_the_numbers_follow_a_handle_that_is_moved(hand):
    hand.placed()
    tool = two_ends(hand)
    before = tool.straight
    hand.key("G", "Z", ".", "5", "Return")
    hand.settle()
    hand.main.run_until(lambda: tool.found is not None)
    positions = np.asarray(hand.scene.positions, np.float64)[tool.rows]
    assert tool.straight == pytest.approx(np.linalg.norm(positions[1] - positions[0]))
    assert tool.straight != before and tool.found.straight == pytest.approx(tool.straight)


def test_a_typed_length_becomes_the_true_one(hand):
    tool = two_ends(hand)
    hand.key("2", ".", "5", "Return")
    assert tool.straight == pytest.approx(2.5) and hand.session.history.undo_label == "Set true size"
    hand.key("0", "Return")
    assert "size stays" in hand.context.hud.text and tool.straight == pytest.approx(2.5)
    hand.session.history.undo()
    assert hand.scene.edit.place.is_identity


def test_a_number_typed_too_early_and_a_backspace_too_many_stay_with_the_measure(hand):
    hand.placed()
    tool = taken_up(hand, "measure")
    assert hand.key("3") and hand.key("Backspace")
    assert hand.context.hud.text == "Click both ends, then type the true length"
    hand.key("Esc")
    assert not hand.context.hud.text
    hand.click(hand.surface())
    assert hand.key("3") and "Click both ends" in hand.context.hud.text
    two_ends(hand)
    assert hand.key("3") and "[3]" in hand.context.hud.text
    for _ in range(3):
        assert hand.key("Backspace")
    assert tool.rows and "type the true length" in hand.context.hud.text


def test_an_end_is_dragged_from_splat_to_splat(hand):
    tool = taken_up(hand, "measure")
    hand.click(hand.surface())
    first = tool.rows[0]
    at = hand.viewport.projection.pixel(tool.ends[0])
    goal = next(xy for xy in at + np.array([[30, 0], [-30, 0], [0, 30], [0, -30]]) if hand.viewport.pick(*xy))
    hand.drag(at, 0.5 * (at + goal), goal)
    assert tool.rows == [hand.viewport.pick(*goal).row] != [first]


def test_the_gizmo_of_the_crop_moves_and_turns_its_shape(hand):
    tool = taken_up(hand, "crop")
    before = tool.shape
    assert hand.viewport.gizmo.acts == {Act.TRANSLATE, Act.ROTATE}
    hand.key("G", "X", "1", "Return")
    np.testing.assert_allclose(tool.shape.center - before.center, [1.0, 0.0, 0.0], atol=1e-9)
    hand.key("R", "Z", "9", "0", "Return")
    np.testing.assert_allclose(tool.shape.axes[0], [0.0, 1.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(tool.shape.halves, before.halves)
    hand.key("R", "Z", "4", "5", "Esc")
    np.testing.assert_allclose(tool.shape.axes[0], [0.0, 1.0, 0.0], atol=1e-9)
    hand.key("Esc")
    assert tool.shape is None and not hand.viewport.gizmo.is_shown
    assert hand.scene.preview is None


def test_a_crop_of_a_placed_object_stands_along_the_axes_in_the_corner(hand):
    turned(hand)
    tool = taken_up(hand, "crop")
    place = hand.scene.edit.place
    np.testing.assert_allclose(tool.shape.axes, place.rotation, atol=1e-12)
    numbers = hand.context.held(tool.option_kinds[1]).value
    center = placed_points(tool.shape.center[None], place)[0]
    np.testing.assert_allclose([numbers.x, numbers.y, numbers.z], center, rtol=1e-5, atol=1e-6)
    assert numbers.width == pytest.approx(2.0 * place.scale * tool.shape.halves[0], rel=1e-6)
    assert not tool.goes().all()
    along = (hand.viewport.splats.subject_points() - tool.shape.center) @ tool.shape.axes.T
    np.testing.assert_allclose(tool.shape.halves, 1.05 * np.abs(along).max(axis=0), rtol=1e-6)
