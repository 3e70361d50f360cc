"""Poses carried from one handle to others: mirrored, or copied."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from splap_editor.core.handle_nodes import Region
from splap_editor.core.pose import Pose
from splap_editor.core.splats.occupancy import Ellipses
from splap_editor.core.splats.symmetry import Plane
from splap_editor.engine.edit import HANDLE_COLORS, Edit, Handle

_NEAR = 0.03
"""A handle with its centre this near to where a mirrored one belongs is its counterpart; units of the scene scale."""


class NoMirrorImageError(ValueError):
    """A handle that has no mirror image; the message says why and what to do."""


def mirrored_pose(pose: Pose, plane: Plane) -> Pose:
    """Pose that does behind the mirror what a pose does before it.

    With the mirror ``F``, the motion ``M`` becomes ``F M F``.

    Raises
    ------
    NoMirrorImageError
        The pose scales differently along the world axes, and the plane is not across one of them.
    """
    if isinstance(pose.scale, tuple) and len(set(pose.scale)) > 1 and np.abs(plane.normal).max() < 1.0 - 1e-12:
        raise NoMirrorImageError(
            "a handle that is scaled differently along X, Y and Z can only be mirrored about one of these axes; "
            "give it one scale"
        )
    w, *axis = pose.rotate
    # An axis of rotation is a pseudovector: behind a mirror it points the other way.
    turned = -plane.mirrored_vectors(np.array(axis))
    return Pose(tuple(plane.mirrored_vectors(np.array(pose.translate)).tolist()), (w, *turned.tolist()), pose.scale)


def mirrored_region(region: Region, plane: Plane, ellipses: Ellipses) -> Region:
    """Region of the splats behind the mirror.

    Rows become the active splats nearest to their mirror images, as far as
    these lie on the object.

    Raises
    ------
    NoMirrorImageError
        There is nothing of the object behind the mirror.
    """
    center = plane.mirrored(np.asarray(region.center, np.float64))
    if region.rows is None:
        return Region(center, region.radius)
    nodes = ellipses.node_of_row[np.asarray(region.rows)]
    nodes = nodes[nodes >= 0]
    tree = cKDTree(ellipses.centers)
    distances, matches = tree.query(plane.mirrored(ellipses.centers[nodes]))
    reach = np.maximum(ellipses.reaches[nodes], _NEAR * ellipses.scene_scale)
    found = np.unique(matches[distances <= reach])
    if not len(found):
        raise NoMirrorImageError("there is nothing of the object behind the mirror: choose another plane")
    return Region(center, 0.0, np.sort(ellipses.rows[found]))


def mirrored_handles(
    edit: Edit, handle_ids: Sequence[int], plane: Plane, ellipses: Ellipses
) -> tuple[Edit, tuple[int, ...]]:
    """Pose the counterparts of handles behind a mirror; a handle without one gets one.

    Parameters
    ----------
    edit : Edit
    handle_ids : sequence of int
        Handles to mirror. One that stands on the plane is its own counterpart.
    plane : Plane
    ellipses : Ellipses
        The scene's active splats.

    Returns
    -------
    Edit
    tuple of int
        Ids of the counterparts.

    Raises
    ------
    NoMirrorImageError
        A handle has no mirror image.
    """
    sources = [edit.handle(handle_id) for handle_id in handle_ids]
    counterparts = []
    for source in sources:
        pose = mirrored_pose(source.pose, plane)
        near = _nearest_handle(edit, plane.mirrored(np.asarray(source.region.center, np.float64)))
        if near is None or _distance(near, source, plane) > _NEAR * ellipses.scene_scale:
            near = _new_handle(edit, source, mirrored_region(source.region, plane, ellipses))
        edit = edit.with_handle(replace(near, pose=pose))
        counterparts.append(near.handle_id)
    return edit, tuple(counterparts)


def pasted_poses(edit: Edit, handle_ids: Sequence[int], poses: Sequence[Pose]) -> Edit:
    """Give handles copied poses: one pose to all, several in their order, over and over."""
    return edit.with_poses({handle_id: poses[i % len(poses)] for i, handle_id in enumerate(handle_ids)})


def _nearest_handle(edit: Edit, point: NDArray[np.float64]) -> Handle | None:
    return min(edit.handles, key=lambda handle: np.linalg.norm(handle.region.center - point), default=None)


def _distance(handle: Handle, source: Handle, plane: Plane) -> float:
    image = plane.mirrored(np.asarray(source.region.center, np.float64))
    return float(np.linalg.norm(np.asarray(handle.region.center) - image))


def _new_handle(edit: Edit, source: Handle, region: Region) -> Handle:
    handle_id = edit.next_handle_id()
    color = HANDLE_COLORS[(handle_id - 1) % len(HANDLE_COLORS)]
    return replace(source, handle_id=handle_id, name=f"{source.name} mirrored", color=color, region=region)
