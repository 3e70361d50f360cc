"""Laws of keyframes."""

from dataclasses import replace

import numpy as np
import pytest

from splap_editor.core.bbw.rigid_curves import rigid_exp
from splap_editor.core.camera_path import CameraPose
from splap_editor.core.handle_nodes import Region
from splap_editor.core.timeline import Key, Timeline
from splap_editor.engine.edit import Edit, Handle, Pose
from splap_editor.engine.keyframes import auto_keyed_edit, edit_at_frame, keyed_edit

CENTERS = {1: np.array([1.0, 0.0, 0.0]), 2: np.array([-1.0, 0.5, 2.0])}
BENT = {1: Pose((0.3, 0.0, 0.1), (0.6, 0.0, 0.8, 0.0), 1.5), 2: Pose((0.0, 0.2, 0.0))}
REST = {1: Pose(), 2: Pose()}


def edit_of_two() -> Edit:
    return Edit(handles=tuple(Handle(i, f"h{i}", "#ffffff", Region(c, 0.1)) for i, c in CENTERS.items()))


def rigid_poses(motion):
    """Poses of all handles under one rigid world motion."""
    return {h: Pose().moved(motion, center) for h, center in CENTERS.items()}


@pytest.mark.parametrize("is_smooth", [True, False])
def test_a_key_is_hit_exactly_and_outside_the_keys_nothing_moves(is_smooth):
    timeline = Timeline(is_smooth=is_smooth).with_key(10, BENT).with_key(3, REST).with_key(20, REST)
    assert timeline.key_frames == (3, 10, 20)
    assert timeline.poses_at(10, CENTERS) == BENT
    assert timeline.poses_at(1, CENTERS) == timeline.poses_at(3, CENTERS) == REST
    assert timeline.poses_at(99, CENTERS) == REST
    assert timeline.poses_at(6.5, CENTERS)[1] not in (BENT[1], REST[1])


@pytest.mark.parametrize("is_smooth", [True, False])
def test_between_equal_keys_a_handle_stands_still_while_another_moves(is_smooth):
    timeline = Timeline(is_smooth=is_smooth).with_key(1, REST).with_key(5, BENT)
    timeline = timeline.with_key(9, {1: BENT[1], 2: Pose((5.0, 0.0, 0.0))}).with_key(14, REST)
    for frame in np.linspace(5, 9, 17):
        assert timeline.poses_at(frame, CENTERS)[1] == BENT[1]


@pytest.mark.parametrize("is_smooth", [True, False])
def test_what_moves_as_one_at_the_keys_moves_as_one_between(is_smooth):
    rng = np.random.default_rng(4)
    timeline = Timeline(is_smooth=is_smooth)
    for frame in (1, 4, 11, 13):
        timeline = timeline.with_key(frame, rigid_poses(rigid_exp(rng.normal(size=6))))
    for frame in np.linspace(1, 13, 40):
        poses = timeline.poses_at(frame, CENTERS)
        first, second = (poses[h].matrix(CENTERS[h]) for h in (1, 2))
        np.testing.assert_allclose(first, second, atol=1e-9)


def test_a_handle_goes_by_the_keys_that_name_it():
    timeline = Timeline(is_smooth=False).with_key(1, {1: Pose()}).with_key(5, {2: BENT[2]}).with_key(9, {1: BENT[1]})
    assert timeline.poses_at(5, CENTERS)[2] == BENT[2]
    assert timeline.poses_at(5, CENTERS)[1].translate == pytest.approx(
        timeline.without_key(5).poses_at(5, CENTERS)[1].translate
    )
    assert 3 not in timeline.poses_at(5, {**CENTERS, 3: np.zeros(3)})


def test_keys_move_and_replace_each_other():
    timeline = Timeline().with_key(3, REST).with_key(8, BENT)
    assert timeline.with_key_moved(3, 12).key_frames == (8, 12)
    assert timeline.with_key_moved(3, 8).keys == (Key(8, REST),)
    assert timeline.without_key(5) == timeline
    with pytest.raises(KeyError):
        timeline.with_key_moved(5, 6)


@pytest.mark.parametrize(
    "values", [{"frame": 0}, {"n_frames": 0}, {"fps": 0.0}, {"keys": (Key(4, {}), Key(4, {}))}, {"keys": (Key(0, {}),)}]
)
def test_impossible_timelines_are_refused(values):
    with pytest.raises(ValueError, match="must be"):
        Timeline(**values)


def test_posing_sets_a_key_once_there_is_one():
    edit = edit_of_two()
    assert auto_keyed_edit(edit, edit.with_poses(BENT)).timeline.keys == ()
    keyed = keyed_edit(edit, 1)
    later = edit_at_frame(keyed, 8)
    posed = auto_keyed_edit(later, later.with_poses(BENT))
    assert posed.timeline.key_frames == (1, 8)
    assert edit_at_frame(edit_at_frame(posed, 1), 8).handle(1).pose == BENT[1]
    by_hand = replace(later, timeline=replace(later.timeline, is_auto=False))
    assert auto_keyed_edit(by_hand, by_hand.with_poses(BENT)).timeline.key_frames == (1,)


def test_going_to_a_frame_sets_no_key():
    edit = keyed_edit(edit_at_frame(keyed_edit(edit_of_two(), 1), 9).with_poses(BENT))
    assert auto_keyed_edit(edit, edit_at_frame(edit, 4)).timeline.keys == edit.timeline.keys


def test_an_id_of_a_deleted_handle_with_keys_is_not_given_again():
    edit = keyed_edit(edit_of_two(), 1).without_handles([2])
    assert edit.next_handle_id() == 3


STAND = CameraPose((0.0, -4.0, 1.0), (0.0, 0.0, 0.0))
SIDE = CameraPose((6.0, 0.0, 1.0), (0.0, 0.0, 0.5), (0.0, 0.0, 1.0), 50.0)


@pytest.mark.parametrize("is_smooth", [True, False])
def test_a_camera_key_is_hit_exactly_and_outside_the_keys_the_camera_stands(is_smooth):
    timeline = Timeline(is_smooth=is_smooth).with_camera_key(9, SIDE).with_camera_key(3, STAND)
    assert Timeline().camera_at(4) is None
    assert timeline.camera_key_frames == (3, 9) and not timeline.is_empty and timeline.key_frames == ()
    assert timeline.camera_at(1) == timeline.camera_at(3) == STAND
    assert timeline.camera_at(9) == timeline.camera_at(50) == SIDE
    assert timeline.with_camera_key_moved(3, 12).camera_key_frames == (9, 12)
    assert timeline.without_camera_key(3).camera_at(3) == SIDE
    with pytest.raises(KeyError):
        timeline.with_camera_key_moved(5, 6)


def test_between_keys_the_camera_goes_past_neither_and_turns_without_a_jump():
    third = CameraPose((0.0, 3.0, 4.0), (0.0, 0.0, 0.5), angle=20.0)
    timeline = Timeline().with_camera_key(1, STAND).with_camera_key(5, SIDE).with_camera_key(12, third)
    keys = timeline.camera_keys
    before = None
    for frame in np.linspace(1, 12, 221):
        pose = timeline.camera_at(frame)
        left, right = (keys[0].pose, keys[1].pose) if frame < 5 else (keys[1].pose, keys[2].pose)
        for name in ("distance", "angle"):
            low, high = sorted((getattr(left, name), getattr(right, name)))
            assert low - 1e-9 <= getattr(pose, name) <= high + 1e-9
        ends = np.sort([left.target, right.target], axis=0)
        assert (ends[0] - 1e-9 <= pose.target).all() and (pose.target <= ends[1] + 1e-9).all()
        R = pose.matrix[:3, :3]
        np.testing.assert_allclose(R.T @ R, np.eye(3), atol=1e-9)
        if before is not None:
            assert np.abs(pose.matrix - before).max() < 0.2
        before = pose.matrix


def test_keys_that_look_at_one_target_make_an_orbit_about_it():
    timeline = Timeline().with_camera_key(1, STAND).with_camera_key(11, CameraPose((4.0, 0.0, 1.0), STAND.target))
    for frame in np.linspace(1, 11, 30):
        pose = timeline.camera_at(frame)
        np.testing.assert_allclose(pose.target, STAND.target, atol=1e-12)
        assert pose.distance == pytest.approx(STAND.distance, rel=1e-9)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (((0, 0, 0), (0, 0, 0)), "away from"),
        (((0, 0, 0), (0, 0, 1)), "across the line of sight"),
        (((0, 0, 0), (0, 1, 0), (0, 0, 1), 180.0), "above 0 and below 180"),
    ],
)
def test_a_camera_that_shows_nothing_is_refused(values, message):
    with pytest.raises(ValueError, match=message):
        CameraPose(*values)
