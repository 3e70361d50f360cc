"""An edit's timeline as a skin, for programs that play one: handles become joints, splats weigh on them."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from splap_editor.core.camera_path import CameraTrack, camera_track
from splap_editor.core.progress import Progress, no_progress, part_of
from splap_editor.engine.bound_edit import BoundEdit
from splap_editor.engine.edit import Edit
from splap_editor.engine.keyframes import edit_at_frame
from splap_editor.io.formats.gltf_skin import Skin
from splap_editor.io.splat_files import FormatError, SplatFile, write_skinned


def write_skin(
    path: Path,
    file: SplatFile,
    bound: BoundEdit | None,
    frames: range,
    *,
    pose: Callable[[int, Progress], NDArray[np.floating] | None],
    progress: Progress = no_progress,
) -> float:
    """Write splats at rest with a skin that plays the frames.

    Parameters
    ----------
    path : Path
        A ``.glb``.
    file : SplatFile
    bound : BoundEdit
        Bound with bounded biharmonic weights.
    frames : range
    pose : callable (frame, progress) → (N, 3) or None
        Centres of the splats as the deformer has them, to compare with.
    progress : Progress
        Told several times a frame, and while the file is written; may cancel.

    Returns
    -------
    float
        How far the played skin puts a centre from where the deformer has it, at most, in world units: a skin blends
        linearly and carries centres, not kernels.

    Raises
    ------
    FormatError
        The deformer has no weights, or the file cannot be written.
    """
    if bound is None or bound.weights is None:
        raise FormatError(
            f"{path.name} holds an animation as a skin, which needs a weight of each splat for each handle: choose "
            "bounded biharmonic weights as the method, or write the frames as a .usdz."
        )
    skin = skin_of(file, bound, frames)
    farthest, n_parts = 0.0, len(frames) + 1
    for number, frame in enumerate(frames):
        means = pose(frame, part_of(progress, number / n_parts, (number + 0.7) / n_parts))
        if means is not None:
            told = part_of(progress, (number + 0.7) / n_parts, (number + 1) / n_parts)
            played = skin.blended(file.splats.means, number, told)
            farthest = max(farthest, float(np.linalg.norm(played - means, axis=1).max()))
    last = part_of(progress, 1 - 1 / n_parts, 1.0)
    graded = bound.edit.grading.graded(file.splats, bound.surface, part_of(last, 0.0, 0.3))
    write_skinned(path, file, skin, splats=graded, removed=bound.edit.removed, progress=part_of(last, 0.3, 1.0))
    return farthest


def skin_of(file: SplatFile, bound: BoundEdit, frames: range) -> Skin:
    """The joints of a bound edit, posed as at frames of its timeline."""
    edit, weights, ellipses = bound.edit, bound.weights, bound.surface.ellipses
    assert weights is not None
    of_splats = np.zeros((file.splats.n_splats, weights.shape[1]))
    of_splats[ellipses.rows] = weights
    inert = np.ones(len(of_splats), bool)
    inert[ellipses.rows] = False
    if inert.any():
        means = np.asarray(file.splats.means, np.float64)
        of_splats[inert] = weights[cKDTree(means[ellipses.rows]).query(means[inert])[1]]
    poses = [[handle.pose for handle in edit_at_frame(edit, frame).active_handles] for frame in frames]
    return Skin(
        names=tuple(handle.name for handle in edit.active_handles),
        weights=of_splats,
        centers=np.array([handle.region.center for handle in edit.active_handles], np.float64),
        translations=np.array([[pose.translate for pose in each] for each in poses], np.float64),
        rotations=np.array([[pose.rotate for pose in each] for each in poses], np.float64),
        scales=np.array([[np.broadcast_to(pose.scale, 3) for pose in each] for each in poses], np.float64),
        seconds=(np.arange(len(frames))) / edit.timeline.fps,
        place=edit.place.matrix,
        camera=camera_of(edit, frames),
    )


def camera_of(edit: Edit, frames: range) -> CameraTrack | None:
    """The keyed camera of an edit at frames, in its place; None without camera keys."""
    poses = [pose for frame in frames if (pose := edit.timeline.camera_at(frame)) is not None]
    return camera_track(poses, edit.place) if poses else None
