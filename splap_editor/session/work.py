"""What the session's jobs do on the worker: a snapshot in, a value out. Nothing here touches a scene on screen."""

from collections.abc import Callable, Mapping
from pathlib import Path

from splap_editor.core.adaptation.kernel_adaptation import AdaptedKernels, adapted_splats
from splap_editor.core.graph.splat_graph import GraphOptions
from splap_editor.core.splats.occupancy import Ellipses, occupancy_ellipses
from splap_editor.core.splats.splats import Splats
from splap_editor.engine.cache import StageCache
from splap_editor.engine.edit import Edit
from splap_editor.engine.export_report import ExportReport, export_report
from splap_editor.engine.pipeline import Surface, deformer_of, handles_of, surface_of
from splap_editor.engine.quantities import Snapshot, columns_of
from splap_editor.io.ply import SplatFile, read_ply, write_ply
from splap_editor.session.bound_edit import BoundEdit
from splap_editor.session.jobs import Job
from splap_editor.session.scene import Scene

Depictor = Callable[[Splats], object]
"""Prepares what the view needs of a scene that is being opened, such as its shapes."""


def opened_scene(
    job: Job, path: Path, layout: str | None, depictor: Depictor | None, restore: Callable[[Scene], None] | None
) -> Scene:
    """Read a splat PLY and find its ellipses; ``restore`` puts a saved edit in place."""
    file = read_ply(path, layout=layout, progress=job.progress("reading"))
    job.report(1.0, "occupancy")
    scene = Scene(file, occupancy_ellipses(file.splats))
    scene.depicted = depictor(file.splats) if depictor is not None else None
    if restore is not None:
        restore(scene)
    return scene


def prepared_surface(
    job: Job, splats: Splats, ellipses: Ellipses, options: GraphOptions, cache: StageCache | None, near: Surface | None
) -> Surface:
    """Build everything that handles of a scene share, a drag's coarse model included; mends go on from ``near``."""
    surface = surface_of(splats, options, ellipses=ellipses, cache=cache, stages=job.progress, near=near)
    job.report(0.0, "coarse model")
    _ = surface.arap_scene.coarse  # made here, so that the first drag need not wait for it
    return surface


def bound_edit(job: Job, surface: Surface, edit: Edit, cache: StageCache | None, n_threads: int) -> BoundEdit:
    """Bind the deformer of an edit."""
    handles, progress = handles_of(surface, edit), job.progress("binding")
    made = deformer_of(surface, edit, handles, cache=cache, progress=progress, stages=job.progress, n_threads=n_threads)
    return BoundEdit(edit, handles, made)


def exported_file(
    job: Job,
    path: Path,
    file: SplatFile,
    kernels: AdaptedKernels | None,
    columns: tuple[str, ...],
    snapshot: Snapshot,
    options: Mapping[str, bool],
) -> ExportReport:
    """Write a file as it is posed."""
    job.report(0.1, "rotating colours")
    splats = file.splats if kernels is None else adapted_splats(file.splats, kernels)
    extra = columns_of(columns, snapshot)
    write_ply(path, file, splats, extra=extra, progress=job.progress("writing"), **options)
    return export_report(path, file.splats, kernels)
