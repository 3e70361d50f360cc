"""Frames and pictures from the command line."""

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from splap_editor.core.adaptation.options import RepairOptions
from splap_editor.io import plain_edit as plain
from splap_editor.io.atomic_file import not_written
from splap_editor.io.content_hash import has_content
from splap_editor.io.png import write_png
from splap_editor.io.recipe import read_recipe
from splap_editor.io.session_file import read_session_file
from splap_editor.io.session_specs import SessionFile
from splap_editor.io.video import is_video
from splap_editor.stage_report import StageReport

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from splap_editor.core.adaptation.kernel_adaptation import AdaptedKernels
    from splap_editor.core.camera_path import CameraPose
    from splap_editor.core.timeline import Timeline
    from splap_editor.engine.edit import Edit
    from splap_editor.engine.frames import FramePoser
    from splap_editor.io.splat_files import SplatFile
    from splap_editor.viewport.camera import View
    from splap_editor.viewport.studio import Studio

LARGEST_TURNTABLE = 10_000


def read_edit_file(options: argparse.Namespace) -> plain.Edit | SessionFile | None:
    """Read what ``--recipe`` or ``--session`` names, None for neither."""
    if options.recipe is not None:
        return read_recipe(options.recipe)
    return read_session_file(options.session) if options.session is not None else None


def edit_for(held: plain.Edit | SessionFile | None, file: "SplatFile", say: Callable[[str], None]) -> "Edit":
    """Make an edit of a recipe or session for a file; says so where the session was made for another."""
    from splap_editor.engine.edit import Edit
    from splap_editor.engine.recipe_edit import edit_of, require_rows_fit
    from splap_editor.session.saved_state import session_edit

    if held is None:
        return Edit()
    if isinstance(held, plain.Edit):
        require_rows_fit(held, file)
        return edit_of(held, file.splats)
    if held.ply.content_hash and not has_content(file.path, held.ply.content_hash):
        say(f"note: {file.path.name} is not the file that the session was saved with, or has changed since")
    return session_edit(held, file.splats)


def repairing(edit: "Edit", options: argparse.Namespace) -> "Edit":
    """An edit with the limit of ``--repair``, where the command has that flag and it was given."""
    limit = getattr(options, "repair", None)
    return edit if limit is None else edit.with_options(RepairOptions(limit))


def deform_frames(options: argparse.Namespace) -> int:
    """Write a PLY for each frame of a session."""
    from splap_editor.engine.frames import frame_range, write_frames
    from splap_editor.io.formats.table import format_to_write
    from splap_editor.io.splat_files import losses_of_saving

    if options.columns:
        raise ValueError("--columns goes with one PLY, not with --frames")
    if options.report:
        raise ValueError("--report looks at one pose, not at --frames")
    report = StageReport(quiet=options.quiet or options.json)
    held = read_edit_file(options)
    if not isinstance(held, SessionFile):
        raise ValueError("--frames needs keyframes: give a session saved by the editor with --session")
    frames = frame_range(options.frames, held.timeline.n_frames)
    file, poser = _prepared(options, held, report)
    row = format_to_write(options.output)
    for loss in losses_of_saving(file, row, as_3dgs=options.as_3dgs, is_edited=True):
        report.say(f"lost in {options.output.name}: {loss}")
    with report("frames"):
        as_3dgs, said = options.as_3dgs, report.say
        written = write_frames(poser, file, frames, options.output, as_3dgs=as_3dgs, say=said, progress=report.progress)
    _tell(options, report, written)
    return 0


def render(options: argparse.Namespace) -> int:
    """Draw a picture, one for each frame, or one for each step of a turntable."""
    from splap_editor.engine.frames import drawn_frames, frame_range, write_pictures
    from splap_editor.viewport.camera import view_of
    from splap_editor.viewport.studio import drawn_round

    if options.turntable is not None and not 1 <= options.turntable <= LARGEST_TURNTABLE:
        raise ValueError(f"--turntable must be 1 to {LARGEST_TURNTABLE} pictures, got {options.turntable}")
    if options.turntable is not None and options.frames is not None:
        raise ValueError("--frames and --turntable each make a series of pictures: give one of them")
    report = StageReport(quiet=options.quiet or options.json)
    held = read_edit_file(options)
    timeline = held.timeline if isinstance(held, SessionFile) else None
    frames = None
    if options.frames is not None:
        if timeline is not None:
            last = timeline.n_frames
        elif isinstance(held, plain.Edit) and held.camera:
            last = held.camera[-1].frame
        else:
            raise ValueError(
                "--frames needs keyframes: give a session saved by the editor with --session, or a recipe with a camera"
            )
        frames = frame_range(options.frames, last)
    file, poser = _prepared(options, held, report)
    output, rate = options.output, _rate(options, timeline)
    makes_video = is_video(output)
    if makes_video and frames is None and options.turntable is None:
        raise ValueError(f"{output.name} is a video, which needs --frames or --turntable")
    output = output if makes_video else _picture_path(output, file.path.stem)
    with report("scene"):
        studio, view = _studio(options, held, file, poser)
    try:

        def draw_view(seen: "View") -> "NDArray[np.uint8]":
            return studio.picture(seen, is_transparent=options.transparent)

        def draw(kernels: "AdaptedKernels | None", camera: "CameraPose | None") -> "NDArray[np.uint8]":
            studio.pose(kernels)
            return draw_view(view if camera is None else view_of(camera))

        with report("pictures"):
            if frames is not None:
                pictures = drawn_frames(poser, frames, draw, progress=report.progress)
                written = write_pictures(output, pictures, frames, rate)
            elif options.turntable is None:
                write_png(output, draw(poser.kernels(None), None))
                written = [output]
            else:
                studio.pose(poser.kernels(None))
                n, up = options.turntable, studio.viewport.camera.up
                pictures = drawn_round(view, n, up, draw_view, progress=report.progress)
                written = write_pictures(output, pictures, range(1, n + 1), rate)
    finally:
        studio.close()
    _tell(options, report, written)
    return 0


def _prepared(
    options: argparse.Namespace, held: plain.Edit | SessionFile | None, report: StageReport
) -> tuple["SplatFile", "FramePoser"]:
    from splap_editor.engine.bound_edit import bound_file
    from splap_editor.engine.cache import StageCache
    from splap_editor.engine.frames import FramePoser
    from splap_editor.io.splat_files import read_splats
    from splap_editor.session.side_by_side import side_by_side

    layout = options.layout or (held.ply.layout if isinstance(held, SessionFile) else None)
    with report("read"):
        file = read_splats(options.file, layout=layout, progress=report.progress)
    for warning in file.warnings:
        report.say(f"note: {warning}")
    edit = repairing(edit_for(held, file, report.say), options)
    cache = None if options.no_cache else StageCache(say=lambda text: report.say(f"note: {text}"))
    surface, bound = bound_file(file, edit, cache=cache, stages=report.stage, run=side_by_side())
    report.end_stage()
    return file, FramePoser(edit, bound, surface)


def _studio(
    options: argparse.Namespace, held: plain.Edit | SessionFile | None, file: "SplatFile", poser: "FramePoser"
) -> tuple["Studio", "View"]:
    """The scene off screen as the session shows it, with the choices of the command line over that."""
    import numpy as np
    from vtkmodules.vtkCommonCore import vtkLogger

    from splap_editor.viewport.camera import View
    from splap_editor.viewport.looks import background_named, look_named
    from splap_editor.viewport.studio import Studio

    # Without a display VTK warns before it draws by other means.
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_ERROR)
    session = held if isinstance(held, SessionFile) else None
    display: dict[str, object] = dict(session.display) if session is not None else {}
    if options.mode is not None and options.mode != display.get("mode"):
        # Size and cut belong to the mode they were set in.
        display = {"background": display.get("background"), "mode": options.mode}
    width, height = options.size
    is_of_file = session is not None and session.ply.n_splats == file.splats.n_splats
    hidden = session.hidden if session is not None and is_of_file else None
    edit = poser.edit
    splats = edit.grading.graded(file.splats, poser.surface)
    studio = Studio(splats, look_named(display), width, height, hidden=hidden, removed=edit.removed)
    studio.viewport.set_background(*background_named(display))
    studio.viewport.show_place(edit.place)
    if session is None or session.view is None:
        return studio, studio.home()
    spec = session.view
    studio.viewport.camera.world_up = np.array(spec.world_up)
    eye, focus, up = (np.array(v, np.float64) for v in (spec.position, spec.focal_point, spec.view_up))
    return studio, View(eye, focus, up, spec.angle, spec.is_parallel)


def _picture_path(output: Path, stem: str) -> Path:
    """The PNG that is meant: the one named, or one in a folder, which is made; ValueError where it cannot be."""
    try:
        if not output.is_dir():
            if output.suffix.lower() == ".png":
                return output
            output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ValueError(f"{not_written(output, error)}.") from error
    return output / f"{stem}.png"


def _rate(options: argparse.Namespace, timeline: "Timeline | None") -> float:
    """Pictures per second of a video."""
    if options.fps is None:
        return 24.0 if timeline is None else timeline.fps
    if not 0 < options.fps <= 1000:
        raise ValueError(f"--fps must be above 0 and up to 1000, got {options.fps:g}")
    return float(options.fps)


def _tell(options: argparse.Namespace, report: StageReport, written: list[Path]) -> None:
    if options.json:
        print(json.dumps({"outputs": [str(path) for path in written], "timings_s": report.timings_s}))
    elif len(written) == 1:
        report.say(f"wrote {written[0]}")
    else:
        report.say(f"wrote {len(written)} files, {written[0].name} to {written[-1].name}, in {written[0].parent}")
