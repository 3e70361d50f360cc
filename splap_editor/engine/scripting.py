"""The engine for scripts, the command line and the README alike: a file, an edit, a file."""

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from splap_editor.core.adaptation.kernel_adaptation import AdaptedKernels
from splap_editor.core.graph.carriers import carriers_of, carrying
from splap_editor.core.graph.ellipse_offset import normal_offsets
from splap_editor.core.graph.options import GraphOptions
from splap_editor.core.graph.splat_graph import SplatGraph, splat_graph
from splap_editor.core.index_spaces import FileMask
from splap_editor.core.progress import Runner, StageProgress, in_turn, silent
from splap_editor.core.splats.occupancy import Ellipses, occupancy_ellipses
from splap_editor.engine.bound_edit import posed
from splap_editor.engine.cache import StageCache
from splap_editor.engine.deformation_check import DeformationCheck, posed_check
from splap_editor.engine.edit import Edit
from splap_editor.engine.export_report import ExportReport, export_report
from splap_editor.engine.quantities import Snapshot, columns_of
from splap_editor.engine.repairing import written_scene
from splap_editor.engine.surface import Surface, surface_of
from splap_editor.io import plain_edit as plain
from splap_editor.io.edges_ply import write_edges_ply
from splap_editor.io.splat_files import SplatFile, read_splats, write_splats


def prepare(
    file: SplatFile,
    options: GraphOptions = GraphOptions(),
    *,
    ellipses: Ellipses | None = None,
    removed: FileMask | None = None,
    cache: StageCache | None = None,
    stages: StageProgress = silent,
) -> Surface:
    """Make what all handles of a file's scene share: ellipses, graph, geodesics, Laplacian; for `bind`.

    Parameters
    ----------
    file : SplatFile
    options : GraphOptions
    ellipses : Ellipses, optional
        The scene's occupancy ellipses where they are at hand.
    removed : (N,) bool, optional
        Splats that are left out, where the ellipses are not at hand: ``edit.removed``.
    cache : StageCache, optional
        Keeps the slow stages between runs.
    stages : callable
        ``stages(name)`` gives the progress callback of a stage.
    """
    return surface_of(file.splats, options, ellipses=ellipses, removed=removed, cache=cache, stages=stages)


def deform(
    source: str | os.PathLike[str],
    edit: Edit | plain.Edit,
    output: str | os.PathLike[str],
    *,
    layout: str | None = None,
    columns: Sequence[str] = (),
    as_3dgs: bool = False,
    is_checked: bool = False,
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
    is_checked : bool
        Look for tears, webs and spikes too, see `splap_editor.engine.deformation_check`.
    cache, stages, run
        As of `posed`.
    """
    file = read_splats(source, layout=layout, progress=stages("read"))
    made = posed(file, edit, cache=cache, stages=stages, run=run, with_surface=bool(columns))
    return write_posed(
        output,
        file,
        made.kernels,
        made.edit,
        surface=made.surface,
        columns=columns,
        snapshot=made.snapshot if columns else None,
        as_3dgs=as_3dgs,
        check=posed_check(made, stages=stages) if is_checked else None,
        stages=stages,
    )


def write_posed(
    path: str | os.PathLike[str],
    file: SplatFile,
    kernels: AdaptedKernels | None,
    edit: Edit,
    *,
    surface: Surface | None = None,
    columns: Sequence[str] = (),
    snapshot: Snapshot | None = None,
    as_3dgs: bool = False,
    check: DeformationCheck | None = None,
    stages: StageProgress = silent,
) -> ExportReport:
    """Write posed splats, as a PLY with only what changed changed, and say what changed.

    Parameters
    ----------
    path : path
    file : SplatFile
    kernels : AdaptedKernels or None
        None where everything is at rest.
    edit : Edit
        Says which splats are left out, how the others are graded, where they are put, and which are split.
    surface : Surface, optional
        Needed where a grade fades out along it.
    columns : sequence of str
        Quantities to write too.
    snapshot : Snapshot
        What they are worked out from; needed where there are any.
    as_3dgs : bool
        Add a thin third scale to a file of two.
    check : DeformationCheck, optional
        What the pose spoils, for the report.
    stages : callable
        ``stages(name)`` gives the progress callback of a stage.
    """
    if columns and snapshot is None:
        raise ValueError("columns need the snapshot that they are worked out from")
    made = written_scene(file, kernels, edit, surface, stages("colour"))
    progress = stages("write")
    extra = made.with_copies(columns_of(columns, snapshot) if snapshot is not None else {})
    form = write_splats(
        path, made.file, made.splats, removed=made.removed, as_3dgs=as_3dgs, extra=extra, progress=progress
    )
    report = export_report(Path(path), file.splats, kernels, edit, form, check)
    n_new = len(made.copied)
    return replace(report, n_splats=report.n_splats + n_new, n_split=made.n_split, n_new=n_new)


def write_graph(
    path: str | os.PathLike[str],
    file: SplatFile,
    options: GraphOptions = GraphOptions(),
    *,
    stages: StageProgress = silent,
) -> SplatGraph:
    """Write the splat graph of a file as a PLY: its splats' centres, and the edges with offset and length.

    Parameters
    ----------
    path : path
    file : SplatFile
    options : GraphOptions
        Of what is made from the graph nothing matters.
    stages : callable
        ``stages(name)`` gives the progress callback of a stage.
    """
    stages("occupancy")
    visible = occupancy_ellipses(file.splats)
    ellipses = carrying(visible, carriers_of(visible, file.splats, options))
    graph = splat_graph(ellipses, options, progress=stages("graph"))
    stages("offsets")
    offsets = normal_offsets(ellipses, graph.edges).min(axis=1)
    stages("write")
    rows = ellipses.rows[graph.edges]
    means = np.asarray(file.splats.means, np.float64)
    lengths = np.linalg.norm(means[rows[:, 0]] - means[rows[:, 1]], axis=1)
    write_edges_ply(path, file.splats.means, rows, offsets, lengths)
    return graph
