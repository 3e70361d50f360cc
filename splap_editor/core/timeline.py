"""Keyframes: the poses of all handles and the camera at some frames, and what is in between."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from splap_editor.core.bbw.rigid_curves import rigid_curve, scale_curve
from splap_editor.core.camera_path import CameraKey, CameraPose, camera_between
from splap_editor.core.pose import Pose
from splap_editor.core.splats.rotations import matrices_to_quats, quats_to_matrices

LAST_FRAME = 1_000_000


@dataclass(frozen=True)
class Key:
    """Poses of the handles, by id, at a frame."""

    frame: int
    poses: Mapping[int, Pose]


@dataclass(frozen=True)
class Timeline:
    """Keys, how long they play and how fast, as one immutable value.

    Parameters
    ----------
    keys : tuple of Key
        Ascending by frame, one at most for each.
    frame : int
        The frame shown; the first is 1.
    n_frames : int
        Length. Keys after it are kept and do not play.
    fps : float
        Frames per second.
    is_smooth : bool
        Motion through the keys without corners; otherwise straight from one to the next.
    is_auto : bool
        Once there is a key, posing a handle sets one at the frame shown.
    camera_keys : tuple of CameraKey
        Likewise, of the camera.
    """

    keys: tuple[Key, ...] = ()
    frame: int = 1
    n_frames: int = 72
    fps: float = 24.0
    is_smooth: bool = True
    is_auto: bool = True
    camera_keys: tuple[CameraKey, ...] = ()

    def __post_init__(self) -> None:
        for frames in (list(self.key_frames), list(self.camera_key_frames)):
            if frames != sorted(set(frames)) or (frames and not 1 <= frames[0] <= frames[-1] <= LAST_FRAME):
                raise ValueError(f"keys must be at ascending frames from 1 to {LAST_FRAME}, got {frames}")
        if not 1 <= self.frame <= LAST_FRAME or not 1 <= self.n_frames <= LAST_FRAME or not 0.0 < self.fps <= 1000.0:
            raise ValueError(
                f"frame and n_frames must be from 1 to {LAST_FRAME} and fps above 0 and up to 1000, "
                f"got {self.frame}, {self.n_frames} and {self.fps}"
            )

    @property
    def key_frames(self) -> tuple[int, ...]:
        """Frames with a key, ascending."""
        return tuple(key.frame for key in self.keys)

    @property
    def camera_key_frames(self) -> tuple[int, ...]:
        """Frames with a camera key, ascending."""
        return tuple(key.frame for key in self.camera_keys)

    @property
    def is_empty(self) -> bool:
        """Whether there is no key of either kind: nothing to play."""
        return not self.keys and not self.camera_keys

    def with_key(self, frame: int, poses: Mapping[int, Pose]) -> "Timeline":
        """Set the key of a frame."""
        others = [key for key in self.keys if key.frame != frame]
        return replace(self, keys=tuple(sorted((*others, Key(frame, dict(poses))), key=lambda key: key.frame)))

    def without_key(self, frame: int) -> "Timeline":
        """Delete the key of a frame, if there is one."""
        return replace(self, keys=tuple(key for key in self.keys if key.frame != frame))

    def with_key_moved(self, frame: int, to: int) -> "Timeline":
        """Move a key to another frame, over the key that is there; KeyError when there is none to move."""
        moved = next((key for key in self.keys if key.frame == frame), None)
        if moved is None:
            raise KeyError(frame)
        return self.without_key(frame).with_key(to, moved.poses)

    def with_camera_key(self, frame: int, pose: CameraPose) -> "Timeline":
        """Set the camera key of a frame."""
        others = [key for key in self.camera_keys if key.frame != frame]
        keys = sorted((*others, CameraKey(frame, pose)), key=lambda key: key.frame)
        return replace(self, camera_keys=tuple(keys))

    def without_camera_key(self, frame: int) -> "Timeline":
        """Delete the camera key of a frame, if there is one."""
        return replace(self, camera_keys=tuple(key for key in self.camera_keys if key.frame != frame))

    def with_camera_key_moved(self, frame: int, to: int) -> "Timeline":
        """Move a camera key, as `with_key_moved` does."""
        moved = next((key for key in self.camera_keys if key.frame == frame), None)
        if moved is None:
            raise KeyError(frame)
        return self.without_camera_key(frame).with_camera_key(to, moved.pose)

    def camera_at(self, frame: float) -> CameraPose | None:
        """The keyed camera at any frame; None without a camera key. See `camera_between`."""
        return camera_between(self.camera_keys, frame, is_smooth=self.is_smooth) if self.camera_keys else None

    def poses_at(self, frame: float, centers: Mapping[int, ArrayLike]) -> dict[int, Pose]:
        """Poses of the keyed handles at any frame.

        Each handle goes by the keys that name it; before its first and after
        its last it stands still.

        Parameters
        ----------
        frame : float
            May lie between frames.
        centers : mapping of handle id to (3,) float
            Rest centres of the handles; others are left out of the result.

        Returns
        -------
        dict
            By handle id; at a key exactly its pose.
        """
        posed = {h: [(key.frame, key.poses[h]) for key in self.keys if h in key.poses] for h in centers}
        posed = {h: keys for h, keys in posed.items() if keys}
        if not posed:
            return {}
        # Tangents are limited about one point for all, so that handles that move as one keep doing so between keys.
        pivot = np.mean([np.asarray(centers[h], np.float64) for h in posed], axis=0)
        return {
            h: _pose_between(keys, frame, np.asarray(centers[h], np.float64) - pivot, self.is_smooth)
            for h, keys in posed.items()
        }


def _pose_between(keys: list[tuple[int, Pose]], frame: float, center: NDArray[np.float64], is_smooth: bool) -> Pose:
    frames = np.array([at for at, _ in keys], np.float64)
    near = int(np.clip(np.searchsorted(frames, frame, side="right") - 1, 0, len(keys) - 1))
    after = min(near + 1, len(keys) - 1)
    if frame <= frames[near] or near == after or keys[near][1] == keys[after][1]:
        return keys[near][1]
    motions = np.array([_motion(pose, center) for _, pose in keys])
    motion = rigid_curve(frames, motions, frame, is_smooth=is_smooth)
    shift = motion[:3, 3] - center + motion[:3, :3] @ center
    quat = matrices_to_quats(motion[None, :3, :3])[0]
    return Pose(tuple(shift.tolist()), tuple(quat.tolist()), _scale_between(keys, frames, frame, is_smooth))


def _scale_between(
    keys: list[tuple[int, Pose]], frames: NDArray[np.float64], frame: float, is_smooth: bool
) -> float | tuple[float, float, float]:
    is_uniform = not any(isinstance(pose.scale, tuple) for _, pose in keys)
    scales = np.array([np.broadcast_to(pose.scale, 1 if is_uniform else 3) for _, pose in keys], np.float64)
    scale = scale_curve(frames, scales, frame, is_smooth=is_smooth).tolist()
    return scale[0] if is_uniform else tuple(scale)


def _motion(pose: Pose, center: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rigid part of a pose."""
    motion = np.eye(4)
    motion[:3, :3] = quats_to_matrices(np.array([pose.rotate]))[0]
    motion[:3, 3] = center + np.array(pose.translate) - motion[:3, :3] @ center
    return motion
