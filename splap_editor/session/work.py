"""What the session's jobs do on the worker: a request in, a value out. Nothing here touches a scene on screen.

A request holds on to all that the work needs, so that it may go on while the scene changes.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from splap_editor.core.adaptation.kernel_adaptation import AdaptedKernels
from splap_editor.core.deformer import Deformation
from splap_editor.core.graph.splat_graph import GraphOptions
from splap_editor.core.progress import Progress, part_of
from splap_editor.core.splats.occupancy import Ellipses, occupancy_ellipses
from splap_editor.core.splats.splats import Splats
from splap_editor.engine.bound_edit import BoundEdit, Posed, bind, ready_for_drags
from splap_editor.engine.cache import StageCache
from splap_editor.engine.deformation_check import DeformationCheck
from splap_editor.engine.edit import Edit
from splap_editor.engine.export_report import ExportReport
from splap_editor.engine.quantities import Snapshot
from splap_editor.engine.removal import Finder, Removal
from splap_editor.engine.scripting import write_posed
from splap_editor.engine.surface import Surface, surface_of
from splap_editor.io.splat_files import SplatFile, read_splats
from splap_editor.session.depictor import Depictor, HandOver
from splap_editor.session.jobs import Job
from splap_editor.session.scene import Scene
from splap_editor.session.side_by_side import alone, side_by_side


@dataclass(frozen=True, eq=False)
class OpenRequest:
    """A splat PLY to be shown.

    Parameters
    ----------
    path : Path
    layout : str, optional
        Read it as this layout instead of the recognised one.
    restore : callable, optional
        Puts a saved edit in place, on the worker, and is given what finds the splats that it removes.
    depictor : Depictor
    """

    path: Path
    layout: str | None
    restore: Callable[[Scene, Finder], None] | None
    depictor: Depictor


@dataclass(frozen=True, eq=False)
class OpenedScene:
    """A scene, and what its view needs to draw it."""

    scene: Scene
    hand_over: HandOver


def opened_scene(job: Job, request: OpenRequest) -> OpenedScene:
    """Read a splat file and find its ellipses."""
    file = read_splats(request.path, layout=request.layout, progress=job.progress("reading"))
    scene = Scene(file, occupancy_ellipses(file.splats, progress=job.progress("occupancy")))
    hand_over = request.depictor.depict(file.splats)
    if request.restore is not None:
        request.restore(scene, told_finder(job, file.splats))
        if scene.edit.removed is not None:
            scene.ellipses = scene.visible = occupancy_ellipses(file.splats, removed=scene.edit.removed)
    return OpenedScene(scene, hand_over)


def told_finder(job: Job, splats: Splats) -> Finder:
    """Find the splats of a removal in a job: it says how far it is, and may be cancelled."""
    return Finder(splats, stages=job.progress, alone=alone)


@dataclass(frozen=True, eq=False)
class SurfaceRequest:
    """What all handles of a scene share, wanted with these options; mends go on from the scene's last surface.

    The ellipses serve if they are of the splats that the removal leaves.
    """

    scene: Scene
    near: Surface | None
    options: GraphOptions
    removal: Removal
    ellipses: Ellipses
    cache: StageCache | None


def prepared_surface(job: Job, request: SurfaceRequest) -> Surface:
    """Build everything that handles of a scene share, a drag's coarse model included."""
    scene, removal, ellipses = request.scene, request.removal, request.ellipses
    if not removal.like(Removal(mask=ellipses.removed)):
        job.report(0.0, "occupancy")
        ellipses = occupancy_ellipses(scene.splats, removed=removal.mask)
    surface = surface_of(
        scene.splats,
        request.options,
        ellipses=ellipses,
        cache=request.cache,
        stages=job.progress,
        near=request.near,
        alone=alone,
    )
    job.report(0.0, "coarse model")
    ready_for_drags(surface, request.cache)
    return surface


@dataclass(frozen=True, eq=False)
class BindRequest:
    """The deformer of an edit."""

    surface: Surface
    edit: Edit
    cache: StageCache | None
    n_threads: int


def bound_edit(job: Job, request: BindRequest) -> BoundEdit:
    """Bind the deformer of an edit."""
    return bind(
        request.surface,
        request.edit,
        cache=request.cache,
        progress=job.progress("binding"),
        stages=job.progress,
        run=side_by_side(request.n_threads),
    )


@dataclass(frozen=True, eq=False)
class PoseRequest:
    """The kernels of an edit.

    Parameters
    ----------
    surface : Surface
    bound : BoundEdit
    edit : Edit
    present : callable
        Prepares what a view needs of the kernels.
    show : callable
        Given, on the main thread, poses on the way to the settled one.
    """

    surface: Surface
    bound: BoundEdit
    edit: Edit
    present: Callable[[AdaptedKernels], HandOver]
    show: Callable[["MadePose"], None]


@dataclass(frozen=True, eq=False)
class MadePose:
    """Kernels of an edit, how they came about, and what their view needs to draw them."""

    kernels: AdaptedKernels
    deformation: Deformation
    hand_over: HandOver


def dragged_pose(job: Job, request: PoseRequest) -> MadePose:
    """Pose at the speed of a drag."""
    return _made_pose(request, request.bound.drag(request.edit))


def settled_pose(job: Job, request: PoseRequest) -> MadePose:
    """Pose to the end, and show how it comes about."""

    def shown(posed: Posed) -> None:
        made = _made_pose(request, posed)
        job.deliver(lambda: request.show(made))

    settling = job.progress("settling")
    posed = request.bound.pose(request.edit, progress=settling, shown=shown)
    return _made_pose(request, posed)


def _made_pose(request: PoseRequest, posed: Posed) -> MadePose:
    # What a bound deformer poses has both.
    assert posed.kernels is not None and posed.deformation is not None
    return MadePose(posed.kernels, posed.deformation, request.present(posed.kernels))


@dataclass(frozen=True, eq=False)
class ExportOrder:
    """A splat file to be written once the splats have settled.

    Parameters
    ----------
    path : Path
    columns : tuple of str
        Quantities that become columns of the file.
    as_3dgs : bool
        Write the layout of 3D Gaussian splats, whatever the file's own.
    """

    path: Path
    columns: tuple[str, ...] = ()
    as_3dgs: bool = False


@dataclass(frozen=True, eq=False)
class ExportRequest:
    """A file to be written as it is posed."""

    order: ExportOrder
    scene: Scene
    edit: Edit
    file: SplatFile
    kernels: AdaptedKernels | None
    snapshot: Snapshot = field(repr=False)
    check: DeformationCheck | None = None


EXPORT_WORDS = {"colour": "rotating colours", "write": "writing"}
"""Stages of an export as the window says them."""


def exported_file(job: Job, request: ExportRequest) -> ExportReport:
    """Write a file as it is posed."""
    order = request.order

    def stages(stage: str) -> Progress:
        told = job.progress(EXPORT_WORDS[stage])
        told(0.1)
        return part_of(told, 0.1, 1.0)

    return write_posed(
        order.path,
        request.file,
        request.kernels,
        request.edit,
        surface=request.snapshot.surface,
        columns=order.columns,
        snapshot=request.snapshot,
        as_3dgs=order.as_3dgs,
        check=request.check,
        stages=stages,
    )
