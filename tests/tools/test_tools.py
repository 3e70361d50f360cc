"""Each tool does what its table says, off screen."""

import numpy as np
import pytest

from splap_editor.tools.brush_tool import BrushOptions
from splap_editor.tools.handle_tool import HandleOptions
from splap_editor.tools.select_tool import SelectOptions
from splap_editor.tools.tool_table import TOOLS
from splap_editor.viewport.gizmo_parts import DOT


def beside(xy, dx, dy):
    return xy + np.array((dx, dy))


def frame(center, size):
    return center - size, center + size


def test_a_click_places_and_a_drag_orbits(hand):
    at = hand.surface()
    before = hand.viewport.camera.view
    hand.tools.choose("handle")
    hand.drag(at, at + 20, at + 60)
    assert not hand.scene.edit.handles
    assert not hand.viewport.camera.view.is_near(before)
    assert not hand.viewport.is_moving
    assert hand.placed().pose.is_identity


def test_a_click_pins(hand):
    hand.tools.choose("pin")
    hand.click(hand.surface())
    assert len(hand.scene.edit.pins) == 1 and not hand.scene.edit.handles


def test_the_gizmo_of_the_last_handle_leaves_the_click_to_the_pin_tool(hand):
    handle = hand.placed()
    viewport = hand.viewport
    middle = viewport.projection.pixel(viewport.gizmo.frame[:3, 3])
    # On a part of the gizmo, with surface behind it, and beside the handle's mark.
    ring = [middle + r * np.array((np.cos(a), np.sin(a))) for r in (20, 30, 40, 60, 80) for a in np.linspace(0, 6, 60)]
    at = next(xy for xy in ring if viewport.gizmo_part(*xy) is not None and viewport.pick(*xy) is not None)
    hand.tools.choose("pin")
    hand.click(at)
    assert len(hand.scene.edit.pins) == 1 and hand.scene.edit.handle(handle.handle_id).pose.is_identity
    assert hand.key("G") and viewport.gizmo.dragged == DOT, "keys still move the handle"
    hand.key("Esc")
    hand.tools.choose("handle")
    assert viewport.gizmo_part(*at) is not None
    hand.settle()


@pytest.mark.parametrize(("how", "factor"), [("]", 1.15), ("[", 1 / 1.15), ("wheel", 1.15)])
def test_the_reach_follows_keys_and_the_wheel_with_ctrl(hand, how, factor):
    held = hand.context.held(HandleOptions)
    before, distance = held.value.reach, hand.viewport.camera.view.distance
    if how == "wheel":
        hand.tell("wheel", hand.surface(), held="Ctrl", steps=1.0)
    else:
        hand.key(how)
    assert held.value.reach == pytest.approx(before * factor)
    assert hand.viewport.camera.view.distance == distance


def test_the_wheel_zooms_in_every_tool(hand):
    at = hand.surface()
    for entry in TOOLS:
        hand.tools.choose(entry.name)
        distance = hand.viewport.camera.view.distance
        hand.tell("wheel", at, steps=1.0)
        assert hand.viewport.camera.view.distance < distance, entry.name


def test_middle_drags_orbit_pan_and_zoom_in_every_tool(hand):
    at = hand.surface()
    for entry in TOOLS:
        hand.tools.choose(entry.name)
        for held in ("", "Shift", "Ctrl"):
            before = hand.viewport.camera.view
            hand.drag(at, beside(at, 10, 30), held=held, button="middle")
            assert not hand.viewport.camera.view.is_near(before), (entry.name, held)
    assert not hand.session.history.can_undo


@pytest.mark.parametrize("name", ["rectangle", "lasso", "brush", "click"])
def test_modifiers_add_remove_and_intersect(hand, name):
    hand.context.held(SelectOptions).set(SelectOptions(through=True))
    hand.tools.choose(name)
    at = hand.surface()

    def pick(size, held=""):
        if name == "click":
            hand.click(at if size < 20 else beside(at, 0, 3), held)
        elif name == "brush":
            hand.context.held(BrushOptions).set(BrushOptions(radius_px=float(size)))
            hand.drag(at, at + 1, held=held)
        else:
            (x0, y0), (x1, y1) = frame(at, size)
            corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)] if name == "lasso" else [(x0, y0), (x1, y1)]
            hand.drag(*corners, held=held)
        return hand.scene.selection.copy()

    small = pick(12)
    large = pick(30)
    assert small.any() and large.any()
    assert (pick(12, "Ctrl") == (large & ~small)).all()
    assert (pick(12, "Shift") == (large | small)).all()
    assert (pick(12, "Shift+Ctrl") == small).all()


def test_a_lasso_keeps_every_corner(hand):
    hand.tools.choose("lasso")
    at = hand.surface()
    corners = [at + offset for offset in ((0, 0), (1, 0), (2, 1), (40, 1), (40, 40), (0, 40))]
    hand.tell("press", corners[0], "left")
    for corner in corners[1:]:
        hand.tell("move", corner, buttons={"left"})
    np.testing.assert_array_equal(hand.context.hud.outline, corners)
    hand.tell("release", corners[-1], "left")
    assert hand.context.hud.outline == ()


@pytest.mark.parametrize("name", ["rectangle", "lasso", "brush"])
def test_escape_puts_the_selection_back(hand, name):
    hand.tools.choose(name)
    at = hand.surface()
    hand.tell("press", at, "left")
    hand.tell("move", at + 30, buttons={"left"})
    assert hand.key("Esc")
    hand.tell("release", at + 30, "left")
    assert not hand.scene.selection.any() and not hand.session.history.can_undo
    assert hand.context.hud.outline == () and hand.context.hud.circle is None


def test_a_preference_lets_a_left_drag_orbit_with_the_rectangle(hand):
    hand.tools.choose("rectangle")
    hand.context.left_orbits = True
    before = hand.viewport.camera.view
    at = hand.surface()
    hand.drag(at, at + 40)
    assert not hand.viewport.camera.view.is_near(before) and not hand.scene.selection.any()
    at = hand.surface()
    hand.drag(at - 20, at + 20, held="Shift")
    assert hand.scene.selection.any()


def test_keys_move_the_handle_by_a_number_along_an_axis(hand):
    hand.placed()
    assert hand.key("G") and hand.key("X", ".", "2")
    assert hand.tools.hint.startswith("Return")
    hand.key("Return")
    hand.settle()
    np.testing.assert_allclose(hand.scene.edit.handles[0].pose.translate, (0.2, 0.0, 0.0), atol=1e-12)
    assert hand.tools.hint == hand.tools.chosen.hint


def test_the_gizmo_is_dragged_at_once_and_dropped_by_the_right_button(hand):
    hand.placed()
    at = hand.viewport.projection.pixel(hand.viewport.gizmo.frame[:3, 3])
    hand.hover(at)
    assert hand.viewport.gizmo.hovered == DOT
    hand.tell("press", at, "left")
    hand.tell("move", at + 2, buttons={"left"})
    assert hand.scene.preview is not None, "no slack: the gizmo follows from the first pixel"
    hand.tell("press", at + 2, "right", buttons={"left", "right"})
    assert hand.scene.preview is None and hand.scene.edit.is_identity


def test_what_was_under_the_pointer_is_forgotten_when_it_leaves(hand):
    hand.placed()
    at = hand.viewport.projection.pixel(hand.viewport.gizmo.frame[:3, 3])
    hand.hover(at)
    assert hand.viewport.gizmo.hovered is not None
    hand.tell("leave", (-1, -1))
    assert hand.viewport.gizmo.hovered is None


def test_the_hint_follows_the_tool_and_what_is_under_the_pointer(hand):
    told = []
    hand.tools.hint_changed.connect(lambda: told.append(hand.tools.hint))
    for entry in TOOLS:
        hand.tools.choose(entry.name)
        assert hand.tools.hint == hand.tools.chosen.hint
    assert len(told) == len(TOOLS)
    hand.placed()
    hand.hover(hand.viewport.projection.pixel(hand.viewport.gizmo.frame[:3, 3]))
    assert "gizmo" in hand.tools.hint
    hand.hover((3, 3))
    assert hand.tools.hint == hand.tools.chosen.hint


def test_inspecting_looks_and_lets_go(hand):
    hand.tools.choose("inspect")
    hand.context.inspected.is_on = True
    hand.click(hand.surface())
    assert hand.scene.picked is not None
    assert hand.key("Esc") and hand.scene.picked is None
    assert not hand.key("Esc"), "nothing is left to let go of"
