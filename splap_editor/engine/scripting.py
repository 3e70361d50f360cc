"""The engine for scripts, the command line and the README alike: a file, an edit, a file."""

import os
from collections.abc import Sequence
from pathlib import Path

from splap_editor.core.graph.options import GraphOptions
from splap_editor.core.progress import Runner, StageProgress, in_turn, silent
from splap_editor.engine.bound_edit import Posed, posed
from splap_editor.engine.cache import StageCache
from splap_editor.engine.edit import Edit
from splap_editor.engine.export_report import ExportReport, export_report
from splap_editor.engine.quantities import columns_of
from splap_editor.engine.surface import Surface, surface_of
from splap_editor.io import plain_edit as plain
from splap_editor.io.splat_files import SplatFile, read_splats, write_splats


def prepare(
    file: SplatFile,
    options: GraphOptions = GraphOptions(),
    *,
    cache: StageCache | None = None,
    stages: StageProgress = silent,
) -> Surface:
    """Make what all handles of a file's scene share: ellipses, graph, geodesics, Laplacian; for `bind`.

    Parameters
    ----------
    file : SplatFile
    options : GraphOptions
    cache : StageCache, optional
        Keeps the slow stages between runs.
    stages : callable
        ``stages(name)`` gives the progress callback of a stage.
    """
    return surface_of(file.splats, options, cache=cache, stages=stages)


def deform(
    source: str | os.PathLike[str],
    edit: Edit | plain.Edit,
    output: str | os.PathLike[str],
    *,
    layout: str | None = None,
    columns: Sequence[str] = (),
    as_3dgs: bool = False,
    cache: StageCache | None = None,
    stages: StageProgress = silent,
    run: Runner = in_turn,
) -> ExportReport:
    """Read splats, deform and write them: what `read_splats`, `prepare`, `bind`, `pose`, `write_splats` do in turn.

    Parameters
    ----------
    source, output : path
    edit : Edit, of a scene or plain
        ``splap.Edit`` is the plain one, by place or file row.
    layout : str, optional
        Read the file as this layout instead of the recognised one.
    columns : sequence of str
        Quantities to write too, see `QUANTITIES`.
    as_3dgs : bool
        Add a thin third scale to a file of two.
    cache, stages, run
        As of `posed`.
    """
    file = read_splats(source, layout=layout, progress=stages("read"))
    made = posed(file, edit, cache=cache, stages=stages, run=run, with_surface=bool(columns))
    return write_posed(output, file, made, columns=columns, as_3dgs=as_3dgs, stages=stages)


def write_posed(
    path: str | os.PathLike[str],
    file: SplatFile,
    made: Posed,
    *,
    columns: Sequence[str] = (),
    as_3dgs: bool = False,
    stages: StageProgress = silent,
) -> ExportReport:
    """Write posed splats, as a PLY with only what changed changed, and say what changed.

    Parameters
    ----------
    path : path
    file : SplatFile
    made : Posed
        Its splats.
    columns : sequence of str
        Quantities to write too; they need ``made`` to have a surface.
    as_3dgs : bool
        Add a thin third scale to a file of two.
    stages : callable
        ``stages(name)`` gives the progress callback of a stage.
    """
    stages("colour")
    splats = made.splats
    progress = stages("write")
    extra = columns_of(columns, made.snapshot) if columns else {}
    write_splats(path, file, splats, as_3dgs=as_3dgs, extra=extra, progress=progress)
    return export_report(Path(path), file.splats, made.kernels)
