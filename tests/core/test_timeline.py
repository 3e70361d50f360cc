"""Laws of keyframes."""

from dataclasses import replace

import numpy as np
import pytest

from splap_editor.core.bbw.rigid_curves import rigid_exp
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
