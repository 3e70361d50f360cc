"""Laws of mirrored and copied poses."""

import numpy as np
import pytest

from splap_editor.core.handle_nodes import Region
from splap_editor.core.pose import Pose
from splap_editor.core.splats.occupancy import occupancy_ellipses
from splap_editor.core.splats.symmetry import Plane, object_center
from splap_editor.engine.edit import Edit, Handle
from splap_editor.io.ply import read_ply
from splap_editor.resources import resource
from splap_editor.session.pose_tools import (
    NoMirrorImageError,
    mirrored_handles,
    mirrored_pose,
    mirrored_region,
    pasted_poses,
)


@pytest.fixture(scope="module")
def ellipses():
    return occupancy_ellipses(read_ply(resource("samples", "tube.ply")).splats)


def some_plane(rng) -> Plane:
    normal = rng.normal(size=3)
    return Plane(rng.normal(size=3), normal / np.linalg.norm(normal))


def some_pose(rng, scale) -> Pose:
    quat = rng.normal(size=4)
    return Pose(tuple(rng.normal(size=3).tolist()), tuple((quat / np.linalg.norm(quat)).tolist()), scale)


def assert_mirrors(pose, plane, rng):
    """What the mirrored pose does to mirrored points is the mirror image of what the pose does."""
    center, points = rng.normal(size=3), rng.normal(size=(10, 3))
    before, after = pose.matrix(center), mirrored_pose(pose, plane).matrix(plane.mirrored(center))
    moved = plane.mirrored(points @ before[:3, :3].T + before[:3, 3])
    np.testing.assert_allclose(plane.mirrored(points) @ after[:3, :3].T + after[:3, 3], moved, atol=1e-12)


def test_a_mirrored_pose_moves_the_mirror_image():
    rng = np.random.default_rng(1)
    for _ in range(5):
        assert_mirrors(some_pose(rng, 1.3), some_plane(rng), rng)


def test_scales_along_the_axes_are_mirrored_about_the_axes_alone():
    rng = np.random.default_rng(2)
    pose = some_pose(rng, (1.0, 0.5, 2.0))
    for normal in np.eye(3):
        assert_mirrors(pose, Plane(rng.normal(size=3), normal), rng)
    with pytest.raises(NoMirrorImageError, match="one of these axes"):
        mirrored_pose(pose, some_plane(rng))


def test_mirroring_twice_gives_the_pose_back():
    rng = np.random.default_rng(3)
    pose, plane = some_pose(rng, 0.7), some_plane(rng)
    again = mirrored_pose(mirrored_pose(pose, plane), plane)
    np.testing.assert_allclose(again.matrix(np.zeros(3)), pose.matrix(np.zeros(3)), atol=1e-12)


def test_a_handle_without_a_counterpart_gets_one_and_then_poses_it(ellipses):
    plane = Plane(object_center(ellipses.centers), np.eye(3)[0])
    end = ellipses.centers[np.argmax(ellipses.centers[:, 0])]
    pose = Pose((0.1, 0.0, 0.2), (0.8, 0.0, 0.6, 0.0))
    edit = Edit(handles=(Handle(3, "end", "#ffffff", Region(end, 0.1), pose),))
    edit, (made,) = mirrored_handles(edit, [3], plane, ellipses)
    assert len(edit.handles) == 2 and edit.handle(made).name == "end mirrored"
    np.testing.assert_allclose(edit.handle(made).region.center, plane.mirrored(end))
    assert edit.handle(made).pose == mirrored_pose(pose, plane)
    other = Pose((0.0, 0.3, 0.0))
    edit, (again,) = mirrored_handles(edit.with_poses({3: other}), [3], plane, ellipses)
    assert again == made and len(edit.handles) == 2
    assert edit.handle(made).pose == mirrored_pose(other, plane)


def test_a_handle_on_the_plane_is_its_own_counterpart(ellipses):
    plane = Plane(ellipses.centers[0], np.eye(3)[0])
    edit = Edit(handles=(Handle(1, "middle", "#ffffff", Region(ellipses.centers[0], 0.1), Pose((0.5, 0.1, 0.0))),))
    edit, ids = mirrored_handles(edit, [1], plane, ellipses)
    assert ids == (1,) and edit.handles[0].pose.translate == (-0.5, 0.1, 0.0)


def test_rows_become_the_rows_at_their_mirror_images(ellipses):
    plane = Plane(object_center(ellipses.centers), np.eye(3)[0])
    near = np.argsort(ellipses.centers[:, 0])[-40:]
    region = Region(ellipses.centers[near].mean(axis=0), 0.0, np.sort(ellipses.rows[near]))
    image = mirrored_region(region, plane, ellipses)
    found = ellipses.centers[ellipses.node_of_row[image.rows]]
    assert len(image.rows) > 10
    assert found[:, 0].max() < plane.point[0] < ellipses.centers[near][:, 0].min()


def test_an_image_off_the_object_is_refused(ellipses):
    plane = Plane(ellipses.centers[:, 0].max() * np.eye(3)[0] + 5.0, np.eye(3)[0])
    region = Region(ellipses.centers[0], 0.0, ellipses.rows[:20])
    with pytest.raises(NoMirrorImageError, match="nothing of the object"):
        mirrored_region(region, plane, ellipses)


def test_one_pose_goes_to_all_and_several_in_their_order():
    edit = Edit(handles=tuple(Handle(i, str(i), "#ffffff", Region(np.zeros(3), 0.1)) for i in (1, 2, 3)))
    a, b = Pose((1.0, 0.0, 0.0)), Pose((2.0, 0.0, 0.0))
    assert [h.pose for h in pasted_poses(edit, (1, 3), (a,)).handles] == [a, Pose(), a]
    assert [h.pose for h in pasted_poses(edit, (1, 2, 3), (a, b)).handles] == [a, b, a]
