"""Grading a capture from the command line."""

import argparse
from typing import TYPE_CHECKING

from splap_editor.cleaning_cli import add_output_path, picked_box, read_input, tell_written, write_edited
from splap_editor.core.grade_options import GradeOptions
from splap_editor.core.options import options_of
from splap_editor.stage_report import StageReport

if TYPE_CHECKING:
    from splap_editor.core.removal import Picked


def add_grade(parser: argparse.ArgumentParser) -> None:
    """Add the flags of ``splap-editor grade``: a grade's options, and what it is of."""
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


def grade(options: argparse.Namespace) -> int:
    """Grade colours and opacities."""
    from splap_editor.core.grade import GradeStep
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
