"""The command line: deform, inspect and dump graphs without a window, or open the window."""

import argparse
import json
import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import splap_editor
from splap_editor.arranging_cli import add_grade, add_merge
from splap_editor.cleaning_cli import add_clean, add_place
from splap_editor.core.adaptation.options import USUAL_REPAIR
from splap_editor.installation import commands as installation
from splap_editor.session.background_thread import leave
from splap_editor.stage_report import ShareLine, StageReport, printable

if TYPE_CHECKING:
    from splap_editor.io.formats.table import SplatFormat
    from splap_editor.io.ply import SplatFile

EXIT_OK, EXIT_REFUSED = 0, 2

_AS_3DGS = (
    "write a PLY that programs which only know 3DGS read rightly: a thin third scale beside two, and of SpikingGS or a "
    "3-D filter a plain file"
)
_PICTURES = "a .png, a folder, or of several pictures a .mp4, .webm, .gif or .apng"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run ``splap-editor``.

    Returns
    -------
    int
        0, or 2 after one sentence on standard error that says what is wrong and what to do.
    """
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    arguments = _with_command(arguments)
    options = _parser(arguments[0]).parse_args(arguments)
    try:
        return options.run(options)
    except (ValueError, OSError, MemoryError) as error:
        print(f"splap-editor: {printable(_sentence(error))}", file=sys.stderr)
        return EXIT_REFUSED
    except KeyboardInterrupt:
        print("splap-editor: stopped; no file was left half-written", file=sys.stderr)
        # What the window or a deformer had going in the background is no longer wanted.
        return leave(EXIT_REFUSED)


def _with_command(arguments: list[str]) -> list[str]:
    """``splap-editor [FILE]`` opens the window, so that a file can be dropped on the program."""
    if arguments and (arguments[0] in _COMMANDS or arguments[0] in ("-h", "--help", "--version")):
        return arguments
    return ["edit", *arguments]


def _parser(chosen: str) -> argparse.ArgumentParser:
    """Make the parser; flags that take loading are only those of the command chosen."""
    parser = argparse.ArgumentParser(
        prog="splap-editor",
        description="Bend, pose and reshape captured Gaussian splats. Without a command, open the editor.",
    )
    parser.add_argument("--version", action="version", version=f"splap-editor {splap_editor.__version__}")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)

    edit = commands.add_parser("edit", help="open the editor (also: splap-editor [FILE])")
    edit.add_argument("file", nargs="?", type=Path, help="a splat file; the bundled sample by default")
    edit.set_defaults(run=_edit)

    _add_deform(commands.add_parser("deform", help="deform splats by a recipe"))
    for name, text, add in (
        ("clean", "remove floaters, and what lies outside a box", add_clean),
        ("place", "level, turn, scale and move a whole scene", add_place),
        ("grade", "change colours and opacities, of all splats or of some", add_grade),
    ):
        command = commands.add_parser(name, help=text)
        _add_input(command)
        if chosen == name:
            add(command)
        _add_output(command)

    convert = commands.add_parser("convert", help="write a splat file in another format")
    _add_input(convert)
    convert.add_argument("-o", "--output", required=True, type=Path, metavar="OUT", help="its ending names the format")
    convert.add_argument(
        "--as-3dgs",
        action="store_true",
        help=_AS_3DGS,
    )
    _add_output(convert)
    convert.set_defaults(run=_convert)

    merge = commands.add_parser("merge", help="write the rows of several files into one")
    add_merge(merge)
    _add_output(merge)

    turn = "draw a picture, the frames of an animation, or a turn all round"
    _add_render(commands.add_parser("render", help=turn))

    info = commands.add_parser("info", help="say what wrote a file, what is in it and what is odd about it")
    _add_input(info)
    info.add_argument("--graph", action="store_true", help="also build the splat graph and its Laplacian")
    _add_output(info)
    info.set_defaults(run=_info)

    graph = commands.add_parser("graph", help="write the splat graph as a PLY with vertices and edges")
    _add_input(graph)
    graph.add_argument("-o", "--output", required=True, type=Path, metavar="EDGES.ply")
    if chosen == "graph":
        _add_edge_options(graph)
    _add_output(graph)
    graph.set_defaults(run=_graph)
    installation.add_commands(commands)
    return parser


def _add_deform(deform: argparse.ArgumentParser) -> None:
    _add_input(deform)
    _add_edit(deform, required=True)
    _add_frames(deform, "write a PLY for each frame of a session's timeline")
    deform.add_argument(
        "-o", "--output", required=True, type=Path, metavar="OUT", help="a PLY, or what its ending names"
    )
    deform.add_argument(
        "--as-3dgs",
        action="store_true",
        help=_AS_3DGS,
    )
    deform.add_argument("--columns", default="", metavar="NAMES", help="also write quantities: displacement,stretch")
    deform.add_argument(
        "--repair",
        nargs="?",
        const=USUAL_REPAIR,
        type=float,
        metavar="LIMIT",
        help=f"split splats drawn out to more than LIMIT times their length, {USUAL_REPAIR} by default",
    )
    deform.add_argument("--report", action="store_true", help="say where the pose tears or draws out the surface")
    deform.add_argument("--no-cache", action="store_true", help="neither read nor keep graph and Laplacian")
    _add_output(deform)
    deform.set_defaults(run=_deform)


def _add_render(render: argparse.ArgumentParser) -> None:
    _add_input(render)
    _add_edit(render, required=False)
    render.add_argument(
        "-o", "--output", required=True, type=Path, metavar="OUT.png", help="or a folder, .mp4, .webm, .gif or .apng"
    )
    _add_frames(render, "draw a picture for each frame of a session's timeline")
    render.add_argument("--turntable", type=int, metavar="N", help="draw N pictures all round")
    render.add_argument("--fps", type=float, metavar="N", help="of a video; default the session's, or 24")
    render.add_argument("--size", type=_size, default=(1280, 720), metavar="WxH", help="in pixels; default 1280x720")
    render.add_argument("--mode", choices=("splats", "ellipses", "points"), help="how; default splats")
    render.add_argument("--transparent", action="store_true", help="no background")
    render.add_argument("--no-cache", action="store_true", help="neither read nor keep graph and Laplacian")
    _add_output(render)
    render.set_defaults(run=_render)


def _add_input(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", type=Path, metavar="IN", help="a splat file of any format")
    parser.add_argument("--layout", help="read the file as this layout instead of the recognised one")


def _add_edit(parser: argparse.ArgumentParser, *, required: bool) -> None:
    edit = parser.add_mutually_exclusive_group(required=required)
    edit.add_argument("--recipe", type=Path, metavar="EDIT.json", help="what to deform, and how")
    edit.add_argument("--session", type=Path, metavar="FILE.splap", help="the same, saved by the editor")


def _add_frames(parser: argparse.ArgumentParser, text: str) -> None:
    parser.add_argument("--frames", nargs="?", const="", metavar="A-B", help=f"{text}; all of them by default")


def _add_edge_options(parser: argparse.ArgumentParser) -> None:
    """Flags for what a graph's edges depend on; lists of rows are for recipes."""
    from splap_editor.core.graph.options import EDGE_OPTIONS, GraphOptions
    from splap_editor.core.options import options_of

    for name, known in options_of(GraphOptions).items():
        if name in EDGE_OPTIONS and known.kind not in ("pairs", "strokes"):
            parser.add_argument(
                f"--{name.replace('_', '-')}",
                type=type(known.default),
                choices=tuple(known.choices) or None,
                default=known.default,
                help=f"{known.sentence[0].lower()}{known.sentence[1:].rstrip('.')}; default {known.default}",
            )


def _size(text: str) -> tuple[int, int]:
    width, _, height = text.lower().partition("x")
    if not (width.isdecimal() and height.isdecimal()):
        raise argparse.ArgumentTypeError(f"must be width x height in pixels, as 1280x720, got {text!r}")
    return int(width), int(height)


def _add_output(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--quiet", action="store_true", help="no progress lines")
    parser.add_argument("--json", action="store_true", help="one JSON object on standard output")


def _edit(options: argparse.Namespace) -> int:
    from splap_editor.installation.readiness import WindowCheck

    check = WindowCheck()
    from splap_editor.app import run

    check.finish()
    return run(options.file, tell=ShareLine("compiling for this computer, once; the window works meanwhile"))


def _render(options: argparse.Namespace) -> int:
    from splap_editor.frames_cli import render
    from splap_editor.installation.readiness import check_picture

    check_picture()
    return render(options)


def _deform(options: argparse.Namespace) -> int:
    from splap_editor.engine.bound_edit import posed
    from splap_editor.engine.cache import StageCache
    from splap_editor.engine.deformation_check import posed_check
    from splap_editor.engine.quantities import column_names
    from splap_editor.engine.scripting import write_posed
    from splap_editor.frames_cli import deform_frames, edit_for, read_edit_file, repairing
    from splap_editor.io.formats.table import format_to_write
    from splap_editor.session.side_by_side import side_by_side

    if options.frames is not None:
        return deform_frames(options)
    report = StageReport(quiet=options.quiet or options.json)
    row = format_to_write(options.output)
    columns = column_names(options.columns)
    held = read_edit_file(options)
    file = _read(options, report)
    edit = repairing(edit_for(held, file, report.say), options)
    lost = _said_losses(options, file, row, report, is_edited=not edit.is_identity)
    cache = None if options.no_cache else StageCache(say=lambda text: report.say(f"note: {text}"))
    made = posed(file, edit, cache=cache, stages=report.stage, run=side_by_side(), with_surface=bool(columns))
    summary = write_posed(
        options.output,
        file,
        made.kernels,
        made.edit,
        surface=made.surface,
        columns=columns,
        snapshot=made.snapshot if columns else None,
        as_3dgs=options.as_3dgs,
        check=posed_check(made, stages=report.stage) if options.report else None,
        stages=report.stage,
    )
    report.end_stage()
    deformation = made.deformation
    if not options.json:
        report.say(str(summary))
        for line in summary.check.lines if summary.check is not None else ():
            report.say(line)
        return EXIT_OK
    told = {
        **vars(summary),
        "check": None if summary.check is None else summary.check.told,
        "output": str(options.output),
        "residual": _known(deformation.residual) if deformation is not None else 0.0,
        "n_iterations": deformation.n_iterations if deformation is not None else 0,
        "warnings": file.warnings,
        "losses": lost,
        "timings_s": report.timings_s,
    }
    print(json.dumps({name: value for name, value in told.items() if name != "path"}))
    return EXIT_OK


def _read(options: argparse.Namespace, report: StageReport) -> "SplatFile":
    """Read the file, and say what to know about it."""
    from splap_editor.io.splat_files import read_splats

    with report("read"):
        file = read_splats(options.file, layout=options.layout, progress=report.progress)
    for warning in file.warnings:
        report.say(f"note: {warning}")
    return file


def _said_losses(
    options: argparse.Namespace, file: "SplatFile", row: "SplatFormat", report: StageReport, *, is_edited: bool
) -> list[str]:
    """Say what is lost in the format that a file is to be written in."""
    from splap_editor.io.splat_files import losses_of_saving

    lost = losses_of_saving(file, row, as_3dgs=options.as_3dgs, is_edited=is_edited)
    for loss in lost:
        report.say(f"lost in {options.output.name}: {loss}")
    return lost


def _convert(options: argparse.Namespace) -> int:
    from splap_editor.io.formats.table import endings_to_write, format_named, format_to_write
    from splap_editor.io.splat_files import FormatError, write_splats

    report = StageReport(quiet=options.quiet or options.json)
    if format_named(options.output) is None:
        raise FormatError(
            f"{options.output.name} ends in no known format. Choose a name with one of {endings_to_write()}."
        )
    row = format_to_write(options.output)
    file = _read(options, report)
    lost = _said_losses(options, file, row, report, is_edited=False)
    with report("write"):
        write_splats(options.output, file, file.splats, as_3dgs=options.as_3dgs, progress=report.progress)
    if options.json:
        told = {
            "n_splats": file.splats.n_splats,
            "from": file.format_name,
            "to": row.name,
            "output": str(options.output),
        }
        print(json.dumps({**told, "warnings": file.warnings, "losses": lost, "timings_s": report.timings_s}))
    else:
        report.say(f"{options.output.name}: {file.splats.n_splats:,} splats as {row.title}")
    return EXIT_OK


def _info(options: argparse.Namespace) -> int:
    from splap_editor.engine.scene_info import graph_info, scene_info
    from splap_editor.io.splat_files import losses_by_format, read_splats

    report = StageReport(quiet=options.quiet or options.json)
    with report("read"):
        file = read_splats(options.file, layout=options.layout, progress=report.progress)
    with report("occupancy"):
        info, ellipses = scene_info(file)
        info["saving_loses"] = losses_by_format(file)
    if options.graph:
        from splap_editor.engine.scripting import prepare

        surface = prepare(file, ellipses=ellipses, stages=report.stage)
        report.end_stage()
        info["graph"] = graph_info(surface.graph)
    if options.graph:
        info["timings_s"] = {name: round(seconds, 4) for name, seconds in report.timings_s.items()}
    print(json.dumps(info) if options.json else _readable(info))
    return EXIT_OK


def _graph(options: argparse.Namespace) -> int:
    from splap_editor.core.graph.options import EDGE_OPTIONS, GraphOptions
    from splap_editor.engine.scene_info import graph_info
    from splap_editor.engine.scripting import write_graph
    from splap_editor.io.splat_files import read_splats

    report = StageReport(quiet=options.quiet or options.json)
    with report("read"):
        file = read_splats(options.file, layout=options.layout, progress=report.progress)
    wanted = GraphOptions(**{name: value for name, value in vars(options).items() if name in EDGE_OPTIONS})
    info = graph_info(write_graph(options.output, file, wanted, stages=report.stage))
    report.end_stage()
    if options.json:
        print(json.dumps(info))
    else:
        for line in _readable(info).splitlines():
            report.say(line)
    return EXIT_OK


_COMMANDS = (
    "edit",
    "deform",
    "convert",
    "clean",
    "place",
    "grade",
    "merge",
    "render",
    "info",
    "graph",
    *installation.NAMES,
)


def _readable(info: dict, indent: str = "") -> str:
    lines = []
    for key, value in info.items():
        name = printable(key.replace("_", " "))
        if isinstance(value, dict):
            lines += [f"{indent}{name}:", _readable(value, indent + "  ")]
        elif isinstance(value, list):
            lines.append(f"{indent}{name}: " + ("none" if not value else ""))
            lines += [f"{indent}  - {printable(str(item))}" for item in value]
        else:
            lines.append(f"{indent}{name}: " + (f"{value:,}" if isinstance(value, int) else printable(str(value))))
    return "\n".join(lines)


def _known(residual: float) -> float | None:
    """JSON has no infinity, which stands for a residual that the solver does not estimate."""
    return residual if math.isfinite(residual) else None


def _sentence(error: BaseException) -> str:
    if isinstance(error, MemoryError):
        return "there is not enough memory for this scene; close other programs or use a smaller file"
    if isinstance(error, OSError) and error.filename:
        return f"{error.filename}: {error.strerror}"
    return str(error)
