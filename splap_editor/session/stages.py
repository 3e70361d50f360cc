"""What a session does in the background, as a table of stages: file → surface → bound handles → pose → file."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

from splap_editor.engine.bound_edit import BoundEdit
from splap_editor.engine.cache import StageCache
from splap_editor.engine.edit import Edit, binds_like, poses_like, writes_like
from splap_editor.engine.export_report import ExportReport
from splap_editor.engine.removal import Removal
from splap_editor.engine.surface import Surface
from splap_editor.session.bound_edit import snapshot_of
from splap_editor.session.depictor import Depictor, Unseen
from splap_editor.session.jobs import Job
from splap_editor.session.scene import Scene
from splap_editor.session.work import (
    BindRequest,
    ExportOrder,
    ExportRequest,
    MadePose,
    OpenedScene,
    OpenRequest,
    PoseRequest,
    SurfaceRequest,
    bound_edit,
    dragged_pose,
    exported_file,
    opened_scene,
    prepared_surface,
    settled_pose,
)


@dataclass(frozen=True, eq=False)
class Posed:
    """Whose kernels are on screen: an edit's as it settled, or a frame of its drag."""

    edit: Edit
    is_settled: bool


@dataclass(eq=False)
class Ledger:
    """What is asked for, and what has been made of it so far. Only for the main thread.

    Parameters
    ----------
    scene : Scene, optional
        On screen, with the edit that is asked for and the surface made for it.
    opening : OpenRequest, optional
        The file that is asked for in its place.
    exports : tuple of ExportOrder
        Files to be written, in this order: at once, or once the splats have settled where they are posed.
    bound : BoundEdit, optional
        The deformer in use.
    posed : Posed, optional
        What ``scene.kernels`` belong to.
    exported : Edit, optional
        The edit last exported.
    given_up : Edit, optional
        An edit that failed; it is left until another is asked for.
    is_halted : bool
        Nothing more is made for the scene until the person says so.
    is_held : bool
        Files are opened and edits taken, but nothing is made of them yet: it would run loops that are being compiled.
    """

    cache: StageCache | None = None
    n_threads: int = 4
    depictor: Depictor = field(default_factory=Unseen)
    scene: Scene | None = None
    opening: OpenRequest | None = None
    exports: tuple[ExportOrder, ...] = ()
    bound: BoundEdit | None = None
    posed: Posed | None = None
    exported: Edit | None = None
    given_up: Edit | None = None
    is_halted: bool = False
    is_held: bool = False
    state: str = "empty"

    @property
    def shown_scene(self) -> Scene:
        """The scene on screen, for who asks only while there is one; RuntimeError without."""
        if self.scene is None:
            raise RuntimeError("no scene is open")
        return self.scene

    @property
    def is_dragging(self) -> bool:
        """Whether an edit is on screen that is not in the history yet."""
        return self.shown_scene.preview is not None

    @property
    def is_posed(self) -> bool:
        """Whether the kernels on screen are those of the edit on screen: settled, or the newest frame of a drag."""
        posed, edit = self.posed, self.shown_scene.shown_edit
        if posed is None or not (posed.is_settled or self.is_dragging):
            return False
        return binds_like(posed.edit, edit) and poses_like(posed.edit, edit)

    def is_written_at_once(self, order: ExportOrder) -> bool:
        """Whether a file takes nothing but the splats at rest: no surface is awaited for it."""
        return not (order.columns or self.shown_scene.edit.needs_surface)

    @property
    def has_unexported_edit(self) -> bool:
        """Whether the edit differs from the one last exported (or from the file's own pose)."""
        exported = self.exported or Edit()
        return not self._is_exported and not (self.shown_scene.edit.is_identity and exported.is_identity)

    @property
    def _is_exported(self) -> bool:
        return writes_like(self.shown_scene.edit, self.exported or Edit())

    @property
    def state_at_rest(self) -> str:
        """What to say once nothing is left to be made."""
        if not self.shown_scene.shown_edit.active_handles:
            return "ready"
        return "dragging" if self.is_dragging else "settled"


@dataclass(frozen=True)
class Stage:
    """One kind of background work.

    Parameters
    ----------
    name : str
        Kind of its jobs.
    needs : callable
        ``needs(ledger)``: whether it is called for, given that the stages before it are up to date.
    is_current : callable
        ``is_current(ledger)``: whether what it makes is there already.
    state : callable
        ``state(ledger)``: what the session says meanwhile.
    cancels : tuple of str
        Stages whose work is of no use once this one starts.
    request : callable
        ``request(ledger)``: what is missing, with all that making it takes.
    serves : callable
        ``serves(a, b)``: whether what is made for one request serves another just as well.
    make : callable, optional
        ``make(job, request)`` on the worker; without, there is nothing to wait for.
    take : callable
        ``take(ledger, request, made)`` puts what was made in its place.
    fail : callable
        ``fail(ledger, request)`` stops asking for what could not be made.
    title : callable
        ``title(request)``, as shown beside the progress bar and in front of an error.
    is_told : bool
        Shown in the progress bar; frames of a drag come and go too fast for that.
    is_at_once : bool
        Runs on a thread of its own, beside the work of all others, whatever becomes of that.
    is_beside : bool
        Those after it neither wait for it nor build on it.
    awaits : tuple of str
        Stages whose value is taken first if it is on its way.
    """

    name: str
    needs: Callable[[Ledger], bool]
    is_current: Callable[[Ledger], bool]
    state: Callable[[Ledger], str]
    cancels: tuple[str, ...]
    take: Callable[[Ledger, Any, Any], None]
    request: Callable[[Ledger], Any] = lambda ledger: None
    serves: Callable[[Any, Any], bool] = lambda a, b: a is b
    make: Callable[[Job, Any], Any] | None = None
    fail: Callable[[Ledger, Any], None] = lambda ledger, request: None
    title: Callable[[Any], str] = lambda request: ""
    is_told: bool = True
    is_at_once: bool = False
    is_beside: bool = False
    awaits: tuple[str, ...] = ()


# What each stage asks for ---------------------------------------------------------------------------------------------


def _surface_request(ledger: Ledger) -> SurfaceRequest:
    scene = ledger.shown_scene
    edit = scene.shown_edit
    return SurfaceRequest(scene, scene.surface, edit.graph, edit.removal, scene.visible, ledger.cache)


def _bind_request(ledger: Ledger) -> BindRequest:
    scene = ledger.shown_scene
    assert scene.surface is not None  # else it is prepared first
    return BindRequest(scene.surface, scene.shown_edit, ledger.cache, ledger.n_threads)


def _pose_request(ledger: Ledger) -> PoseRequest:
    scene = ledger.shown_scene
    assert scene.surface is not None and ledger.bound is not None  # else they are made first
    return PoseRequest(
        scene.surface,
        ledger.bound,
        scene.shown_edit,
        ledger.depictor.presenter(),
        lambda made: _show_pose(scene, made),
    )


def _rest_export_request(ledger: Ledger) -> ExportRequest:
    scene = ledger.shown_scene
    return ExportRequest(ledger.exports[0], scene, scene.edit, scene.file, None, snapshot_of(scene, None))


def _export_request(ledger: Ledger) -> ExportRequest:
    scene = ledger.shown_scene
    snapshot = snapshot_of(scene, ledger.bound)
    return ExportRequest(ledger.exports[0], scene, scene.edit, scene.file, scene.kernels, snapshot, scene.check)


# Where what was made goes ---------------------------------------------------------------------------------------------


def _take_scene(ledger: Ledger, request: OpenRequest, opened: OpenedScene) -> None:
    opened.hand_over()
    ledger.scene = opened.scene
    ledger.bound = ledger.posed = ledger.given_up = ledger.exported = ledger.opening = None
    ledger.exports = ()
    ledger.is_halted = False


def _take_surface(ledger: Ledger, request: SurfaceRequest, surface: Surface) -> None:
    ledger.bound = ledger.posed = None
    request.scene.set_surface(surface)


def _take_bound(ledger: Ledger, request: BindRequest, bound: BoundEdit) -> None:
    ledger.bound, ledger.posed = bound, None


def _take_pose(ledger: Ledger, request: PoseRequest, made: MadePose, *, is_settled: bool) -> None:
    ledger.posed = Posed(request.edit, is_settled)
    _show_pose(ledger.shown_scene, made)


def _show_pose(scene: Scene, made: MadePose) -> None:
    made.hand_over()
    scene.set_pose(made.kernels, made.deformation)


def _take_rest(ledger: Ledger, request: None, made: None) -> None:
    ledger.bound = ledger.posed = None
    if ledger.shown_scene.kernels is not None:
        ledger.shown_scene.set_pose(None)


def _take_export(ledger: Ledger, request: ExportRequest, report: ExportReport) -> None:
    _forget_export(ledger, request)
    if ledger.scene is request.scene:
        ledger.exported = request.edit


# What is given up with what failed ------------------------------------------------------------------------------------


def _forget_file(ledger: Ledger, request: OpenRequest) -> None:
    ledger.opening = None


def _give_up(ledger: Ledger, request: object) -> None:
    ledger.given_up = ledger.shown_scene.shown_edit


def _forget_export(ledger: Ledger, request: ExportRequest) -> None:
    ledger.exports = tuple(order for order in ledger.exports if order is not request.order)


def _has_handles(ledger: Ledger) -> bool:
    return bool(ledger.shown_scene.shown_edit.active_handles)


def _is_prepared(ledger: Ledger) -> bool:
    scene = ledger.shown_scene
    surface, edit = scene.surface, scene.shown_edit
    return (
        surface is not None
        and surface.options == edit.graph
        and edit.removal.like(Removal(mask=surface.ellipses.removed))
    )


def _is_bound(ledger: Ledger) -> bool:
    return ledger.bound is not None and binds_like(ledger.bound.edit, ledger.shown_scene.shown_edit)


def _pose_like(a: PoseRequest, b: PoseRequest) -> bool:
    return a.bound is b.bound and binds_like(a.edit, b.edit) and poses_like(a.edit, b.edit)


_EXPORT = Stage(
    "export",
    needs=lambda ledger: bool(ledger.exports) and not ledger.is_dragging,
    is_current=lambda ledger: False,
    state=lambda ledger: ledger.state_at_rest,
    cancels=(),
    awaits=("export at rest", "export"),
    request=_export_request,
    make=exported_file,
    take=_take_export,
    fail=_forget_export,
    title=lambda request: f"Exporting {request.order.path.name}",
)

STAGES = (
    replace(
        _EXPORT,
        name="export at rest",
        needs=lambda ledger: _EXPORT.needs(ledger) and ledger.is_written_at_once(ledger.exports[0]),
        state=lambda ledger: ledger.state,
        request=_rest_export_request,
        is_at_once=True,
        is_beside=True,
    ),
    Stage(
        "open",
        needs=lambda ledger: ledger.opening is not None,
        is_current=lambda ledger: False,
        state=lambda ledger: "opening" if ledger.scene is None else ledger.state,
        cancels=("prepare", "bind", "pose", "drag"),
        request=lambda ledger: ledger.opening,
        make=opened_scene,
        take=_take_scene,
        fail=_forget_file,
        title=lambda request: f"Opening {request.path.name}",
        is_at_once=True,
    ),
    Stage(
        "prepare",
        needs=lambda ledger: True,
        is_current=_is_prepared,
        state=lambda ledger: "preparing",
        cancels=("bind", "pose", "drag"),
        request=_surface_request,
        serves=lambda a, b: a.scene is b.scene and a.options == b.options and a.removal.like(b.removal),
        make=prepared_surface,
        take=_take_surface,
        fail=_give_up,
        title=lambda request: f"Preparing {request.scene.file.path.name}",
    ),
    Stage(
        "rest",
        needs=lambda ledger: not _has_handles(ledger),
        is_current=lambda ledger: False,
        state=lambda ledger: "ready",
        cancels=("bind", "pose", "drag"),
        take=_take_rest,
    ),
    Stage(
        "bind",
        needs=_has_handles,
        is_current=lambda ledger: (
            ledger.bound is not None and binds_like(ledger.bound.edit, ledger.shown_scene.shown_edit)
        ),
        state=lambda ledger: "binding",
        cancels=("pose", "drag"),
        request=_bind_request,
        serves=lambda a, b: a.surface is b.surface and binds_like(a.edit, b.edit),
        make=bound_edit,
        take=_take_bound,
        fail=_give_up,
        title=lambda request: "Binding handles",
    ),
    Stage(
        "drag",
        needs=lambda ledger: _has_handles(ledger) and ledger.is_dragging,
        is_current=lambda ledger: ledger.is_posed,
        state=lambda ledger: "dragging",
        cancels=("pose",),
        awaits=("drag",),
        request=_pose_request,
        make=dragged_pose,
        take=lambda ledger, request, made: _take_pose(ledger, request, made, is_settled=False),
        fail=_give_up,
        title=lambda request: "Moving the handle",
        is_told=False,
    ),
    Stage(
        "pose",
        needs=lambda ledger: _has_handles(ledger) and not ledger.is_dragging,
        is_current=lambda ledger: ledger.is_posed,
        state=lambda ledger: "settling",
        cancels=(),
        awaits=("drag",),
        request=_pose_request,
        serves=_pose_like,
        make=settled_pose,
        take=lambda ledger, request, made: _take_pose(ledger, request, made, is_settled=True),
        fail=_give_up,
        title=lambda request: "Settling",
    ),
    _EXPORT,
)
"""In the order in which they build on each other: the first that is called for and not current is made next, and beside
it what is in nobody's way."""
