"""Cropping: handles in the picture, what goes tinted, one step that keeps the shape."""

from dataclasses import replace

import numpy as np

from splap_editor.core.removal import PickedBall, PickedBox, picked_splats
from splap_editor.tools.crop_tool import GRAB_PX, CropNumbers, CropOptions


def shown(hand, kind="box"):
    hand.tools.choose("crop")
    tool = hand.tools.chosen
    hand.context.held(CropOptions).set(CropOptions(kind))
    assert tool.shape is not None
    return tool


def pull(hand, tool, handle, share):
    """Drag a face inwards by a share of the box's side, in the picture."""
    shape, projection = tool.shape, hand.viewport.projection
    at = shape.handles[handle]
    goal = at - share * 2.0 * shape.halves[handle % 3] * shape.normals[handle]
    start, end = projection.pixel(at), projection.pixel(goal)
    hand.drag(start, 0.5 * (start + end), end)
    return goal


def widest(hand, tool):
    """The handle whose normal is most across the view."""
    return int(np.argmin(np.abs(tool.shape.normals @ hand.viewport.projection.direction)))


def test_a_face_follows_the_pointer_and_return_crops_in_one_step(hand):
    tool = shown(hand)
    handle = widest(hand, tool)
    goal = pull(hand, tool, handle, 0.5)
    np.testing.assert_allclose(tool.shape.handles[handle], goal, atol=1e-3 * tool.shape.halves.max())
    goes = tool.goes()
    assert 0 < goes.sum() < len(goes) and f"{goes.sum():,} splats go" in hand.context.hud.text
    kept = tool.shape.picked
    assert hand.key("Return")
    np.testing.assert_array_equal(hand.scene.removed, goes)
    (step,) = hand.scene.edit.removal.steps
    assert step.picked == kept and isinstance(kept, PickedBox) and step.outside
    np.testing.assert_array_equal(picked_splats(kept, hand.scene.splats.means), ~goes)
    assert tool.shape is None and not hand.context.hud.text
    hand.session.history.undo()
    assert hand.scene.edit.removed is None


def test_a_handle_is_taken_anywhere_along_it(hand):
    tool = shown(hand)
    handle = widest(hand, tool)
    large = tool.shape.sized(tool.shape.center, 8.0 * tool.shape.halves)
    foot = large.handles[handle]
    tip = foot + 0.12 * large.halves.mean() * large.normals[handle]
    foot, tip = hand.viewport.projection.pixels(np.stack([foot, tip]))
    assert np.linalg.norm(tip - foot) > 3.0 * GRAB_PX
    for share in (0.0, 0.25, 0.5, 0.75, 1.0):
        tool.show(large)
        start = foot + share * (tip - foot)
        hand.drag(start, start + 20.0, start + 40.0)
        assert (tool.shape.handles[handle] != large.handles[handle]).any(), share


def test_what_goes_is_tinted_and_escape_takes_shape_and_tint_away(hand):
    painted = []
    hand.context.paint = painted.append
    tool = shown(hand, "ball")
    pull(hand, tool, widest(hand, tool), 0.4)
    np.testing.assert_array_equal(painted[-1][:, 3] > 0, tool.goes())
    assert tool.goes().any()
    assert hand.key("Esc") and tool.shape is None and painted[-1] is None
    hand.hover((8, 8))
    assert tool.shape is None and hand.scene.edit.removed is None
    hand.click((8, 8))
    assert tool.shape is not None


def test_inside_takes_the_other_side(hand):
    tool = shown(hand, "plane")
    outside = tool.goes()
    held = hand.context.held(CropOptions)
    held.set(replace(held.value, inside=True))
    np.testing.assert_array_equal(tool.goes(), ~outside)
    hand.key("Return")
    np.testing.assert_array_equal(hand.scene.removed, ~outside)


def test_numbers_place_the_shape_and_follow_it(hand):
    tool = shown(hand, "ball")
    numbers = hand.context.held(CropNumbers)
    x, y, z = (float(value) for value in hand.scene.splats.means[0])
    numbers.set(CropNumbers(x, y, z, 0.5 * float(tool.shape.halves[0]), 1.0, 1.0))
    expected = PickedBall((x, y, z), 0.5 * numbers.value.width)
    np.testing.assert_allclose(tool.shape.center, expected.center)
    np.testing.assert_allclose(tool.shape.halves, expected.radius)
    before = numbers.value
    middle = hand.viewport.projection.pixel(tool.shape.center)
    hand.drag(middle, middle + np.array([20, 0]))
    after = numbers.value
    assert after.width == before.width and (after.x, after.y, after.z) != (before.x, before.y, before.z)


def test_brackets_turn_it_about_the_line_of_sight(hand):
    tool = shown(hand)
    before, sight = tool.shape, hand.viewport.projection.direction
    hand.key("]")
    np.testing.assert_allclose(tool.shape.axes @ sight, before.axes @ sight, atol=1e-12)
    assert np.abs(tool.shape.axes - before.axes).max() > 0.01
    hand.key("[")
    np.testing.assert_allclose(tool.shape.axes, before.axes, atol=1e-12)


def test_nothing_is_removed_where_all_would_be(hand):
    tool = shown(hand)
    held = hand.context.held(CropOptions)
    held.set(replace(held.value, inside=True))
    tool.show(tool.shape.sized(tool.shape.center, 100.0 * tool.shape.halves))
    assert hand.key("Return") and "keep at least one" in hand.context.hud.text
    assert hand.scene.edit.removed is None
