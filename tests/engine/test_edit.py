"""Laws of poses and edits."""

from dataclasses import fields, replace

import numpy as np
import pytest

from splap_editor.core.arap.options import ArapOptions
from splap_editor.core.base_edit import BaseEdit
from splap_editor.core.bbw.options import BbwOptions
from splap_editor.core.handle_nodes import Region
from splap_editor.core.pose import Pose
from splap_editor.core.reach_options import ReachOptions
from splap_editor.core.splats.rotations import quats_to_matrices
from splap_editor.engine.edit import Edit, Handle, Pin, binds_like, poses_like
from splap_editor.engine.recipe_edit import edit_of, recipe_of
from splap_editor.io import plain_edit as plain
from tests.core.splat_scenes import sheet


def similarity(rng):
    quat = rng.normal(size=4)
    quat /= np.linalg.norm(quat)
    transform = np.eye(4)
    transform[:3, :3] = rng.uniform(0.5, 2.0) * quats_to_matrices(quat[None])[0]
    transform[:3, 3] = rng.normal(size=3)
    return transform


def handle(handle_id=1, center=(1.0, 2.0, 3.0), pose=None):
    return Handle(handle_id, "h", "#ffffff", Region(np.array(center), 0.1), pose or Pose())


def test_the_rest_pose_moves_nothing():
    np.testing.assert_array_equal(Pose().matrix(np.array([1.0, 2.0, 3.0])), np.eye(4))
    assert Pose().is_identity


@pytest.mark.parametrize("kind", [Edit, plain.Edit])
def test_an_unknown_method_is_refused_with_those_known_however_an_edit_is_made(kind):
    with pytest.raises(ValueError, match="method must be one of arap, bbw, got 'lbs'"):
        kind(method="lbs")
    with pytest.raises(ValueError, match="method must be one of arap, bbw, got 'lbs'"):
        replace(kind(), method="lbs")


def test_no_field_of_an_edit_is_declared_twice():
    own = [set(kind.__annotations__) for kind in (BaseEdit, Edit, plain.Edit)]
    assert not (own[0] & own[1] or own[0] & own[2] or own[1] & own[2])
    assert {each.name for each in fields(Edit)} == own[0] | own[1]
    assert {each.name for each in fields(plain.Edit)} == own[0] | own[2]


def test_moving_a_pose_composes_world_transforms():
    rng = np.random.default_rng(1)
    center = rng.normal(size=3)
    pose = Pose()
    expected = np.eye(4)
    for _ in range(5):
        delta = similarity(rng)
        pose = pose.moved(delta, center)
        expected = delta @ expected
        np.testing.assert_allclose(pose.matrix(center), expected, atol=1e-12 * np.abs(expected).max())


def test_an_edit_never_changes():
    edit = Edit().with_handle(handle())
    posed = edit.with_poses({1: Pose((1.0, 0.0, 0.0))})
    assert edit.is_identity and not posed.is_identity
    assert posed.handle(1).region is edit.handle(1).region
    assert posed.without_handles([1]).handles == ()
    assert edit.next_handle_id() == 2


def test_an_edit_equals_itself_alone():
    # What tells that something has changed goes by it, and a key or a removal is no field of the base.
    edit = Edit()
    assert edit == edit
    assert replace(edit, timeline=replace(edit.timeline, frame=7)) != edit
    assert len({edit, replace(edit)}) == 2


def test_pins_are_found_changed_and_dropped_one_by_one():
    first, second = (Pin(i, f"Pin {i}", Region(np.zeros(3), 0.1)) for i in (1, 2))
    edit = Edit().with_pin(first).with_pin(second)
    renamed = edit.with_pin(replace(first, name="foot"))
    assert [pin.name for pin in renamed.pins] == ["foot", "Pin 2"] and edit.pin(1) is first
    assert binds_like(edit, renamed), "a name holds nothing"
    assert not binds_like(edit, edit.with_pin(replace(first, region=Region(np.zeros(3), 0.2))))
    assert renamed.without_pins([1]).pins == (second,) and renamed.next_pin_id() == 3


def test_only_names_that_were_given_are_in_the_recipe():
    pins = (Pin(1, "Pin 1", Region(np.zeros(3), 0.1)), Pin(5, "foot", Region(np.ones(3), 0.2)))
    recipe = recipe_of(Edit(pins=pins))
    assert [spec.name for spec in recipe.pins] == ["", "foot"]
    again = edit_of(recipe, sheet(9))
    assert [(pin.pin_id, pin.name, pin.reach) for pin in again.pins] == [(1, "Pin 1", 0.1), (2, "foot", 0.2)]


def test_a_pose_change_needs_no_new_binding():
    edit = Edit().with_handle(handle())
    posed = edit.with_poses({1: Pose((1.0, 0.0, 0.0))})
    assert binds_like(edit, posed) and not poses_like(edit, posed)
    assert not binds_like(edit, edit.with_handle(handle(2)))


def test_a_disabled_handle_neither_binds_nor_poses():
    edit = Edit().with_handle(handle())
    both = edit.with_handle(replace(handle(2, pose=Pose((5.0, 0.0, 0.0))), enabled=False))
    assert binds_like(edit, both) and poses_like(edit, both)
    assert both.transforms.shape == (1, 4, 4)


def test_only_what_the_method_uses_asks_for_a_new_binding():
    arap = Edit().with_handle(handle())
    bbw = replace(arap, method="bbw")
    for options, needed_by in (
        (ReachOptions(2.0), "arap"),
        (ArapOptions(iterations=3), "arap"),
        (BbwOptions(blending="linear"), "bbw"),
    ):
        assert binds_like(arap, arap.with_options(options)) == (needed_by != "arap"), options
        assert binds_like(bbw, bbw.with_options(options)) == (needed_by != "bbw"), options
    wider = replace(arap.handles[0], cage_radius=None)
    assert binds_like(arap, arap.with_handle(wider))
    assert not binds_like(bbw, bbw.with_handle(wider))
