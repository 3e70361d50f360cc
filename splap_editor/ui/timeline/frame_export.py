"""Frames as files: posed on the worker, drawn on the main thread between its events."""

import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.adaptation.kernel_adaptation import AdaptedKernels
from splap_editor.core.camera_path import CameraPose
from splap_editor.core.splats.splats import Splats
from splap_editor.engine.edit import binds_like
from splap_editor.engine.frames import FramePoser, drawn_frames, frame_poser, write_frames, write_pictures
from splap_editor.session.jobs import Job
from splap_editor.session.scene import Scene
from splap_editor.session.session import Session
from splap_editor.session.side_by_side import side_by_side
from splap_editor.viewport.camera import View, view_of
from splap_editor.viewport.studio import Studio, drawn_round
from splap_editor.viewport.viewport import Viewport

POLL_S = 0.05


@dataclass(frozen=True)
class FrameOrder:
    """What to export.

    Parameters
    ----------
    kind : str
        ``"splats"``, ``"pictures"`` or ``"turntable"``.
    frames : range
        Frames of the timeline; of a turntable, 1 to the number of pictures.
    path : Path
        The frames are named after it.
    size : (int, int)
        Of pictures, in pixels.
    is_transparent : bool
        Pictures without a background.
    as_3dgs : bool
        PLYs of flat splats with a third scale.
    """

    kind: str
    frames: range
    path: Path
    size: tuple[int, int] = (1280, 720)
    is_transparent: bool = False
    as_3dgs: bool = False


def submit_frames(
    session: Session,
    viewport: Viewport,
    order: FrameOrder,
    done: Callable[[list[Path], str], None],
    failed: Callable[[Exception], None],
) -> Job:
    """Queue the export of frames as they are now; cancelling keeps the files that are whole.

    Parameters
    ----------
    session : Session
        With a scene, whose surface is made where a handle is enabled.
    viewport : Viewport
        Its look and background are those of the pictures; its camera too, where the timeline has no camera keys.
    order : FrameOrder
    done : callable
        Given the written files, and what a format plays otherwise than the frames are.
    failed : callable
        Given what went wrong.
    """
    scene, bound = session.shown_scene, session.bound
    file, edit, surface, cache = scene.file, scene.edit, scene.surface, session.cache
    n_threads = session.n_threads
    serves = bound is not None and binds_like(bound.edit, edit)
    desk = _Desk(scene.splats, viewport, order, scene) if order.kind != "splats" else None

    def poser(job: Job) -> FramePoser:
        if serves and edit.active_handles:
            return FramePoser(edit, bound, surface)
        return frame_poser(surface, edit, cache=cache, progress=job.progress("binding"), run=side_by_side(n_threads))

    said: list[str] = []

    def work(job: Job) -> list[Path]:
        poses = poser(job)
        if desk is None:
            progress, as_3dgs = job.progress("frames"), order.as_3dgs
            return write_frames(
                poses, file, order.frames, order.path, as_3dgs=as_3dgs, say=said.append, progress=progress
            )
        return _draw(desk, order, poses, edit.timeline.fps, job)

    def ended(call: Callable[[], None]) -> None:
        if desk is not None:
            desk.close()
        call()

    title = {"splats": "Exporting frames", "pictures": "Drawing frames", "turntable": "Drawing a turntable"}[order.kind]
    return session.worker.submit(
        Job(
            "frames",
            title,
            work,
            done=lambda written: ended(lambda: done(written, " ".join(said))),
            failed=lambda error: ended(lambda: failed(error)),
            stopped=lambda: ended(lambda: None),
        )
    )


def _draw(desk: "_Desk", order: FrameOrder, poses: FramePoser, fps: float, job: Job) -> list[Path]:
    """Draw frames of an animation or a turn all round, into pictures or a video; runs on the worker."""
    progress = job.progress("frames")

    def drawn(kernels: AdaptedKernels | None, camera: CameraPose | None) -> NDArray[np.uint8]:
        return desk.picture(job, kernels, None if camera is None else view_of(camera))

    if order.kind == "pictures":
        pictures = drawn_frames(poses, order.frames, drawn, progress=progress)
    else:
        rest = poses.kernels(None)
        n, draw = len(order.frames), lambda view: desk.picture(job, rest, view)
        pictures = drawn_round(desk.view, n, desk.up, draw, progress=progress)
    return write_pictures(order.path, pictures, order.frames, fps)


class _Desk:
    """A studio of the main thread, asked for pictures by the worker."""

    def __init__(self, splats: Splats, viewport: Viewport, order: FrameOrder, scene: Scene) -> None:
        self.view = viewport.camera.view
        self.up = viewport.camera.up
        self._is_transparent = order.is_transparent
        self._splats, self._hidden, self._size = splats, scene.hidden, order.size
        self._grading, self._surface = scene.edit.grading, scene.surface
        self._removed = scene.edit.removed
        self._look = viewport.splats.look
        shown = viewport.renderer
        bottom = shown.GetBackground()
        self._background = bottom, shown.GetBackground2() if shown.GetGradientBackground() else bottom
        self._studio: Studio | None = None

    def picture(self, job: Job, kernels: AdaptedKernels | None, view: View | None = None) -> NDArray[np.uint8]:
        """Pixels of kernels; waits for the main thread, and no longer than until the job is cancelled."""
        is_drawn = threading.Event()
        result: list[NDArray[np.uint8] | Exception] = []

        def draw() -> None:
            try:
                result.append(self._draw(kernels, view or self.view))
            except (ValueError, MemoryError) as error:
                result.append(error)
            is_drawn.set()

        job.deliver(draw)
        while not is_drawn.wait(POLL_S):
            job.report(job.share)
        made = result[0]
        if isinstance(made, Exception):
            raise made
        return made

    def close(self) -> None:
        """Let go of the graphics; on the main thread."""
        if self._studio is not None:
            self._studio.close()
            self._studio = None

    def _draw(self, kernels: AdaptedKernels | None, view: View) -> NDArray[np.uint8]:
        if self._studio is None:
            splats = self._grading.graded_so_far(self._splats, self._surface)
            self._studio = Studio(splats, self._look, *self._size, hidden=self._hidden, removed=self._removed)
            self._studio.viewport.set_background(*self._background)
        self._studio.pose(kernels)
        return self._studio.picture(view, is_transparent=self._is_transparent)
