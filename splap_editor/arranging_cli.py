"""Grading captures, and putting several into one, from the command line."""

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING

from splap_editor.cleaning_cli import add_output_path, picked_box, read_input, tell_written, write_edited
from splap_editor.stage_report import StageReport

if TYPE_CHECKING:
    from splap_editor.core.removal import Picked


def add_grade(parser: argparse.ArgumentParser) -> None:
    """Add the flags of ``splap-editor grade``: a grade's options, and what it is of."""
    from splap_editor.core.grade_options import GradeOptions
    from splap_editor.core.options import options_of

    add_output_path(parser)
    for name, known in options_of(GradeOptions).items():
        words = f"{known.sentence[0].lower()}{known.sentence[1:].rstrip('.')}; default {known.default:g}"
        parser.add_argument(f"--{name}", type=float, default=known.default, metavar="X", help=words)
    of = parser.add_mutually_exclusive_group()
    box, ball = ("X0", "Y0", "Z0", "X1", "Y1", "Z1"), ("X", "Y", "Z", "RADIUS")
    of.add_argument("--box", type=float, nargs=6, metavar=box, help="only of splats whose centre is in this box")
    of.add_argument("--sphere", type=float, nargs=4, metavar=ball, help="only of splats whose centre is in this sphere")
    of.add_argument("--rows", type=int, nargs="+", metavar="ROW", help="only of these rows of the file")
    parser.add_argument("--outside", action="store_true", help="of all splats but these")
    parser.set_defaults(run=grade)


def add_merge(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``splap-editor merge``."""
    parser.add_argument("files", type=Path, nargs="+", metavar="IN", help="splat files of any formats, two or more")
    parser.add_argument("-o", "--output", required=True, type=Path, metavar="OUT", help="its ending names the format")
    parser.add_argument("--layout", help="make this of them: 3dgs, or a layout that all of them have")
    parser.set_defaults(run=merge)


def merge(options: argparse.Namespace) -> int:
    """Write the rows of several files into one."""
    from splap_editor.io.formats.table import format_to_write
    from splap_editor.io.merging import merged_files
    from splap_editor.io.splat_files import losses_of_saving, read_splats, write_splats

    report = StageReport(quiet=options.quiet or options.json)
    row = format_to_write(options.output)
    files = []
    for path in options.files:
        with report(f"read {path.name}"):
            files.append(read_splats(path, progress=report.progress))
        for warning in files[-1].warnings:
            report.say(f"note: {path.name}: {warning}")
    with report("merge"):
        merged = merged_files(files, layout=options.layout, progress=report.progress)
    lost = losses_of_saving(merged.file, row)
    for note in merged.notes:
        report.say(f"note: {note}")
    for loss in lost:
        report.say(f"lost in {options.output.name}: {loss}")
    with report("write"):
        write_splats(options.output, merged.file, merged.file.splats, progress=report.progress)
    n = merged.file.splats.n_splats
    if options.json:
        told = {"n_splats": n, "counts": merged.counts, "layout": merged.file.layout.name, "to": row.name}
        told |= {"output": str(options.output), "notes": merged.notes, "losses": lost}
        print(json.dumps({**told, "timings_s": report.timings_s}))
    else:
        parts = " + ".join(f"{count:,}" for count in merged.counts)
        report.say(f"{options.output.name}: {n:,} splats ({parts}) as {merged.file.layout.name}, {row.title}")
    return 0


def grade(options: argparse.Namespace) -> int:
    """Grade colours and opacities."""
    from splap_editor.core.grade import GradeStep
    from splap_editor.core.grade_options import GradeOptions
    from splap_editor.core.options import options_of
    from splap_editor.engine.edit import Edit
    from splap_editor.engine.grading import grading_of

    held = {name: getattr(options, name) for name in options_of(GradeOptions)}
    for name, known in options_of(GradeOptions).items():
        if not known.accepts(held[name]):
            raise ValueError(f"--{name} must be {known.wanted}, got {held[name]:g}")
    picked = _picked(options)
    if picked is None and (options.outside or held["falloff"] > 0.0):
        raise ValueError("--outside and --falloff need --box, --sphere or --rows, about which they are")
    report = StageReport(quiet=options.quiet or options.json)
    file = read_input(options, report)
    grading = grading_of((GradeStep(GradeOptions(**held), picked, options.outside),), file.splats)
    n = file.splats.n_splats if grading.masks[0] is None else int(grading.masks[0].sum())
    summary = write_edited(options, file, Edit(grading=grading), report)
    return tell_written(options, report, summary, {"n_graded": n})


def _picked(options: argparse.Namespace) -> "Picked | None":
    import numpy as np

    from splap_editor.core.removal import PickedBall, PickedRows

    if options.box is not None:
        return picked_box(options.box, "--box")
    if options.sphere is not None:
        x, y, z, radius = options.sphere
        if not (radius > 0.0 and np.isfinite(options.sphere).all()):
            raise ValueError("--sphere needs x, y and z of a point, and a radius above 0")
        return PickedBall((x, y, z), radius)
    if options.rows is not None:
        if not 0 <= min(options.rows) <= max(options.rows) < 2**31:
            raise ValueError("--rows needs rows of the file, from 0 on")
        return PickedRows(np.unique(np.array(options.rows, np.int32)))
    return None
