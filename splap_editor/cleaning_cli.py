"""Cleaning a capture and putting it in its place from the command line."""

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING

from splap_editor.stage_report import StageReport

if TYPE_CHECKING:
    import numpy as np

    from splap_editor.core.index_spaces import FileRow
    from splap_editor.core.place import Place
    from splap_editor.core.removal import PickedBox
    from splap_editor.engine.edit import Edit
    from splap_editor.engine.export_report import ExportReport
    from splap_editor.engine.removal import Removal
    from splap_editor.io.splat_files import SplatFile

UPS = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1), "-x": (-1, 0, 0), "-y": (0, -1, 0), "-z": (0, 0, -1)}


def add_output_path(parser: argparse.ArgumentParser) -> None:
    """Add the flag that names the file to write."""
    parser.add_argument("-o", "--output", required=True, type=Path, metavar="OUT.ply")


def add_clean(parser: argparse.ArgumentParser) -> None:
    """Add the flags of ``splap-editor clean``."""
    add_output_path(parser)
    parser.add_argument(
        "--strength",
        type=float,
        metavar="S",
        help="from 0, nothing, to 0.99",
    )
    box = ("X0", "Y0", "Z0", "X1", "Y1", "Z1")
    parser.add_argument("--crop", type=float, nargs=6, metavar=box, help="first keep what lies in this box alone")
    parser.add_argument("--report", action="store_true", help="also say what each step takes, and the size it leaves")
    parser.set_defaults(run=clean)


def add_place(parser: argparse.ArgumentParser) -> None:
    """Add the flags of ``splap-editor place``; what they say is done in this order."""
    add_output_path(parser)
    parser.add_argument(
        "--floor",
        type=int,
        nargs="+",
        metavar="ROW",
        help="three or more splats of a floor: level it; those off it count for nothing",
    )
    parser.add_argument("--up", choices=tuple(UPS), default="z", help="where up is in OUT.ply; default z")
    parser.add_argument("--turn", type=float, nargs=4, metavar=("X", "Y", "Z", "DEGREES"), help="about an axis")
    parser.add_argument("--scale", type=float, metavar="FACTOR")
    parser.add_argument("--length", nargs=3, metavar=("ROW", "ROW", "LENGTH"), help="make two splats so far apart")
    parser.add_argument("--recentre", action="store_true", help="put the middle of the main subject at the origin")
    parser.add_argument("--move", type=float, nargs=3, metavar=("X", "Y", "Z"))
    parser.set_defaults(run=place)


def clean(options: argparse.Namespace) -> int:
    """Crop, and remove floaters."""
    from splap_editor.core.removal import PickedFloaters, RemovalStep
    from splap_editor.core.splats.occupancy import occupancy_ellipses
    from splap_editor.engine.edit import Edit
    from splap_editor.engine.removal import removal_of

    strength = PickedFloaters.strength if options.strength is None else options.strength
    if not 0.0 <= strength <= 0.99:
        raise ValueError(f"--strength must be from 0 to 0.99, got {strength:g}")
    report = StageReport(quiet=options.quiet or options.json)
    steps = [RemovalStep(PickedFloaters(strength))]
    if options.crop is not None:
        steps.insert(0, RemovalStep(picked_box(options.crop, "--crop"), outside=True))
    file = read_input(options, report)
    counts: list[float] = []
    removal, sizes = removal_of((), file.splats), [occupancy_ellipses(file.splats).scene_scale]
    with report("floaters"):
        for step in steps:
            before = removal.n_removed
            removal = removal_of((*removal.steps, step), file.splats)
            counts.append(removal.n_removed - before)
    summary = write_edited(options, file, Edit(removal=removal), report)
    told = dict(zip(("cropped", "floaters") if len(counts) > 1 else ("floaters",), counts, strict=True))
    if options.report:
        sizes.append(_size(file, removal))
        told |= {"size_before": sizes[0], "size_after": sizes[1]}
        report.say(", ".join(f"{name.replace('_', ' ')} {value:,.6g}" for name, value in told.items()))
    return tell_written(options, report, summary, told)


def place(options: argparse.Namespace) -> int:
    """Turn, scale and move a whole scene."""
    from splap_editor.engine.edit import Edit

    report = StageReport(quiet=options.quiet or options.json)
    file = read_input(options, report)
    made = _place(options, file)
    summary = write_edited(options, file, Edit(place=made), report)
    return tell_written(options, report, summary, {"matrix": made.matrix.tolist()})


def _place(options: argparse.Namespace, file: "SplatFile") -> "Place":
    import numpy as np

    from splap_editor.core.floor import REACH, floor_plane
    from splap_editor.core.place import Place, about, laid_level, recentred, sized
    from splap_editor.core.splats.occupancy import occupancy_ellipses

    subject = occupancy_ellipses(file.splats).subject
    center = subject.center
    x, y, z = center.tolist()
    made = Place((x, y, z))
    if options.floor is not None:
        floor = floor_plane(_points(file, options.floor), REACH * subject.size)
        made = laid_level(made, floor.middle, floor.normal, np.array(UPS[options.up]), center)
    if options.turn is not None:
        *axis, degrees = options.turn
        length = float(np.linalg.norm(axis))
        if not 0.0 < length < np.inf:
            raise ValueError("--turn needs an axis that is not zero")
        half = np.radians(degrees) / 2.0
        w, u, v, t = np.concatenate([[np.cos(half)], np.sin(half) * np.array(axis) / length]).tolist()
        made = made.followed_by(about(center, turn=(w, u, v, t)))
    if options.scale is not None:
        if not 1e-6 <= options.scale <= 1e6:
            raise ValueError(f"--scale must be from 1e-6 to 1e6, got {options.scale:g}")
        made = made.followed_by(about(center, scale=options.scale))
    if options.length is not None:
        a, b = _points(file, [int(row) for row in options.length[:2]])
        made = sized(made, a, b, float(options.length[2]))
    if options.recentre:
        made = recentred(made, center)
    if options.move is not None:
        delta = np.eye(4)
        delta[:3, 3] = options.move
        made = made.followed_by(delta)
    return made


def _points(file: "SplatFile", rows: "list[FileRow]") -> "np.ndarray":
    """(k, 3) centres of file rows."""
    import numpy as np

    for row in rows:
        if not 0 <= row < file.splats.n_splats:
            raise ValueError(f"{file.path.name} has rows 0 to {file.splats.n_splats - 1}, not {row}")
    return np.asarray(file.splats.means, np.float64)[rows]


def picked_box(corners: list[float], flag: str) -> "PickedBox":
    """Box between two corners that a flag gives: least x, y, z, then greatest; a ValueError names the flag."""
    import numpy as np

    from splap_editor.core.removal import PickedBox

    ends = np.array(corners).reshape(2, 3)
    size = ends[1] - ends[0]
    if not (size > 0.0).all() or not np.isfinite(ends).all():
        raise ValueError(f"{flag} needs the least and then the greatest x, y and z of a box")
    cx, cy, cz = ends.mean(axis=0).tolist()
    sx, sy, sz = size.tolist()
    return PickedBox((cx, cy, cz), (sx, sy, sz))


def _size(file: "SplatFile", removal: "Removal") -> float:
    from splap_editor.core.splats.occupancy import occupancy_ellipses

    return occupancy_ellipses(file.splats, removed=removal.mask).scene_scale


def read_input(options: argparse.Namespace, report: StageReport) -> "SplatFile":
    """Read the file that a command is given, and say what to know about it."""
    from splap_editor.io.splat_files import read_splats

    with report("read"):
        file = read_splats(options.file, layout=options.layout, progress=report.progress)
    for warning in file.warnings:
        report.say(f"note: {warning}")
    return file


def write_edited(options: argparse.Namespace, file: "SplatFile", edit: "Edit", report: StageReport) -> "ExportReport":
    """Write a file as an edit without handles has it."""
    from splap_editor.engine.bound_edit import posed
    from splap_editor.engine.scripting import write_posed

    made = posed(file, edit, stages=report.stage)
    summary = write_posed(options.output, file, None, edit, surface=made.surface, stages=report.stage)
    report.end_stage()
    return summary


def tell_written(options: argparse.Namespace, report: StageReport, summary: "ExportReport", told: dict) -> int:
    """Say what was written, in words or as one JSON object with some facts more."""
    report.say(str(summary))
    if options.json:
        facts = {name: value for name, value in vars(summary).items() if name != "path"}
        print(json.dumps({**facts, **told, "output": str(options.output), "timings_s": report.timings_s}))
    return 0
