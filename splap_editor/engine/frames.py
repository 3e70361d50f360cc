"""The frames of an edit's timeline: posed, and written one file each."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.adaptation.kernel_adaptation import AdaptedKernels
from splap_editor.core.camera_path import CameraPose
from splap_editor.core.progress import Progress, Runner, StageProgress, in_turn, no_progress, part_of
from splap_editor.core.splats.splats import Splats
from splap_editor.core.timeline import LAST_FRAME
from splap_editor.engine.bound_edit import BoundEdit, bind, written_splats
from splap_editor.engine.cache import StageCache
from splap_editor.engine.edit import Edit
from splap_editor.engine.keyframes import edit_at_frame
from splap_editor.engine.scripting import write_posed
from splap_editor.engine.skin import camera_of, write_skin
from splap_editor.engine.surface import Surface
from splap_editor.io.formats.table import format_named, format_to_write, stem_of
from splap_editor.io.png import write_png
from splap_editor.io.splat_files import SplatFile, write_animation
from splap_editor.io.video import is_video, write_video

Pixels = TypeVar("Pixels")
_POSED, _TURNED = 0.6, 0.7
"""Shares of a frame's work that are done once it is posed, and once its colours are turned; then it is written."""

Draw = Callable[[AdaptedKernels | None, CameraPose | None], Pixels]


@dataclass(frozen=True, eq=False)
class FramePoser:
    """Poses an edit as at any frame of its timeline, each by itself and settled.

    Parameters
    ----------
    edit : Edit
    bound : BoundEdit or None
        Bound for the edit; None where no handle is enabled.
    surface : Surface, optional
        Of the scene; needed by a grade that fades out along it.
    """

    edit: Edit
    bound: BoundEdit | None
    surface: Surface | None = None

    def kernels(self, frame: int | None, *, progress: Progress = no_progress) -> AdaptedKernels | None:
        """Adapted kernels at a frame, or of the poses that the edit itself holds; None without a handle."""
        if self.bound is None:
            return None
        edit = self.edit if frame is None else edit_at_frame(self.edit, frame)
        return self.bound.pose(edit, progress=progress).kernels


def frame_poser(
    surface: Surface | None,
    edit: Edit,
    *,
    cache: StageCache | None = None,
    progress: Progress = no_progress,
    run: Runner = in_turn,
) -> FramePoser:
    """Bind the deformer of an edit; ``surface`` is needed where it has an enabled handle."""
    if not edit.active_handles:
        return FramePoser(edit, None, surface)
    if surface is None:
        raise ValueError("an edit with an enabled handle needs the surface of the scene")
    return FramePoser(edit, bind(surface, edit, cache=cache, progress=progress, run=run), surface)


def frame_range(text: str, n_frames: int) -> range:
    """Frames named as ``"7"``, ``"3-40"``, ``"3-"`` to the last, or ``""`` for all.

    Raises
    ------
    ValueError
        If the text says something else, or no frame.
    """
    first, dash, last = text.strip().partition("-")
    try:
        start = int(first) if first else 1
        stop = int(last) if last else n_frames if dash or not first else start
    except ValueError:
        start = stop = 0
    if not 1 <= start <= stop <= LAST_FRAME:
        raise ValueError(f"frames must be given as 7, 3-40 or 3-, from 1 on, got {text!r}")
    return range(start, stop + 1)


def frame_path(path: Path, frame: int, last: int) -> Path:
    """``out.ply`` → ``out_0007.ply``, with as many digits as the last frame needs."""
    # "out.compressed.ply" has two endings that are one.
    stem = stem_of(path)
    return path.with_name(f"{stem}_{frame:0{max(4, len(str(last)))}d}{path.name[len(stem) :]}")


def holds_all_frames(path: Path) -> bool:
    """Whether frames under a name become one file of that name, not a numbered one each."""
    if is_video(path):
        return True
    row = format_named(path)
    return row is not None and (bool(row.writes_frames) or row.name == "gltf")


def write_frames(
    poser: FramePoser,
    file: SplatFile,
    frames: range,
    path: Path,
    *,
    as_3dgs: bool = False,
    say: Callable[[str], None] = lambda text: None,
    progress: Progress = no_progress,
) -> list[Path]:
    """Write a splat file for each frame, or one file of all where its format holds an animation.

    Files of one frame each are repaired if the edit says so, each by its own pose.

    Parameters
    ----------
    poser : FramePoser
    file : SplatFile
        The file at rest.
    frames : range
    path : Path
        ``frame_path`` makes the names of it.
    as_3dgs : bool
        Add a thin third scale to a file of two.
    say : callable
        Told what a format plays otherwise than the frames are.
    progress : callable
        Asked several times a frame; what is written when it raises stays.

    Returns
    -------
    list of Path
    """
    row = format_to_write(path)
    if holds_all_frames(path):
        if poser.edit.repair:
            say(f"No splats are split: all frames of {path.name} are of the same ones.")
        if row.writes_frames:
            _write_animation(poser, file, frames, path, progress)
        else:
            farthest = _write_skin(poser, file, frames, path, progress)
            say(f"{path.name} plays by linear blending: centres are off by up to {farthest:.2g} from the frames' own.")
        return [path]
    written = []
    for done, kernels in _posed(poser, frames, progress):
        frame = frames[done]
        written.append(frame_path(path, frame, frames[-1]))
        told = part_of(progress, (done + _POSED) / len(frames), (done + 1) / len(frames))
        stages = _two_halves(told)
        write_posed(written[-1], file, kernels, poser.edit, surface=poser.surface, as_3dgs=as_3dgs, stages=stages)
        progress((done + 1) / len(frames))
    return written


def _write_animation(poser: FramePoser, file: SplatFile, frames: range, path: Path, progress: Progress) -> None:
    # What follows the last frame takes as long as one.
    n_parts = len(frames) + 1

    def posed() -> Iterator[tuple[int, Splats]]:
        for done, kernels in _posed(poser, frames, part_of(progress, 0.0, len(frames) / n_parts)):
            turning = part_of(progress, (done + _POSED) / n_parts, (done + _TURNED) / n_parts)
            yield frames[done], written_splats(file.splats, kernels, poser.edit, poser.surface, turning)

    def encoding(place: int) -> Progress:
        begun = _TURNED if place < len(frames) else 0.0
        return part_of(progress, (place + begun) / n_parts, (place + 1) / n_parts)

    edit = poser.edit
    camera = camera_of(edit, frames)
    write_animation(path, file, posed(), edit.timeline.fps, removed=edit.removed, camera=camera, progress_of=encoding)


def _two_halves(progress: Progress) -> StageProgress:
    """Progress of turning colours, and of writing."""
    halves = {"colour": part_of(progress, 0.0, 0.5), "write": part_of(progress, 0.5, 1.0)}
    return halves.__getitem__


def _write_skin(poser: FramePoser, file: SplatFile, frames: range, path: Path, progress: Progress) -> float:
    def centers(frame: int, told: Progress) -> NDArray[np.floating] | None:
        kernels = poser.kernels(frame, progress=told)
        return None if kernels is None else kernels.means

    return write_skin(path, file, poser.bound, frames, pose=centers, progress=progress)


def drawn_frames(
    poser: FramePoser,
    frames: range,
    draw: Draw[Pixels],
    *,
    progress: Progress = no_progress,
) -> Iterator[Pixels]:
    """Draw each frame, one at a time.

    Parameters
    ----------
    poser, frames, progress
        As of `write_frames`.
    draw : callable
        ``draw(kernels, camera)`` makes pixels of them; ``camera`` is the keyed one, None without camera keys.
    """
    for done, kernels in _posed(poser, frames, progress):
        yield draw(kernels, poser.edit.timeline.camera_at(frames[done]))
        progress((done + 1) / len(frames))


def write_pictures(path: Path, pictures: Iterator[NDArray[np.uint8]], numbers: range, fps: float) -> list[Path]:
    """Write a series of pictures: a video where the path ends like one, otherwise a PNG each.

    Parameters
    ----------
    path : Path
        ``frame_path`` makes the names of pictures of it.
    pictures : iterator of (H, W, 3 or 4) uint8
        Each is written before the next is asked for.
    numbers : range
        A picture's number each.
    fps : float
        Pictures per second of a video.

    Returns
    -------
    list of Path
    """
    if is_video(path):
        write_video(path, pictures, fps)
        return [path]
    written = []
    for number, picture in zip(numbers, pictures, strict=True):
        written.append(frame_path(path, number, numbers[-1]))
        write_png(written[-1], picture)
    return written


def _posed(poser: FramePoser, frames: range, progress: Progress) -> Iterable[tuple[int, AdaptedKernels | None]]:
    n = len(frames)
    for done, frame in enumerate(frames):
        yield done, poser.kernels(frame, progress=part_of(progress, done / n, (done + _POSED) / n))
