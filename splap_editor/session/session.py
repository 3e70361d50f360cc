"""One open scene, its history and its background work: what the window and its tools talk to."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.adaptation.kernel_adaptation import AdaptedKernels
from splap_editor.core.deformer import Deformation
from splap_editor.core.graph.splat_graph import GraphOptions
from splap_editor.core.handle_nodes import Region
from splap_editor.engine.cache import StageCache
from splap_editor.engine.edit import HANDLE_COLORS, Edit, Handle, Pose, binds_like, poses_like
from splap_editor.engine.export_report import ExportReport
from splap_editor.engine.keyframes import auto_keyed_edit
from splap_editor.engine.pipeline import Surface, kernels_of
from splap_editor.engine.recipe_edit import edit_of, recipe_of
from splap_editor.io.recipe import read_recipe, write_recipe
from splap_editor.session.bound_edit import BoundEdit, snapshot_of
from splap_editor.session.commands import ChangeEdit, ChangeMask
from splap_editor.session.history import History
from splap_editor.session.jobs import Job, Post, Worker
from splap_editor.session.scene import Scene
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.session.signals import Signal
from splap_editor.session.work import Depictor, bound_edit, exported_file, opened_scene, prepared_surface

Presenter = Callable[[AdaptedKernels | None], object]
"""Prepares on the worker what the view needs of new kernels, such as a drawing order."""


class Session:
    """Reconciles what the artist asked for with what has been made so far.

    Every change of scene or edit ends in `_advance`, which looks at the edit
    on screen and starts the one job that is missing next: prepare the
    surface, bind the deformer, pose the splats. A job that is no longer
    wanted is cancelled. Nothing here waits for the worker.

    Parameters
    ----------
    post : callable
        Runs a callable on the main thread, soon; used by the worker.
    cache : StageCache, optional
        Where stages are kept between runs; none are kept without.
    """

    def __init__(self, post: Post, *, cache: StageCache | None = None) -> None:
        self.scene: Scene | None = None
        self.history = History()
        self.worker = Worker(post)
        # A turned view must not wait behind a scene being prepared, nor behind quantities, edges and previews.
        self.view_worker = Worker(post, name="splap-view")
        self.detail_worker = Worker(post, name="splap-detail")
        self.worker.on_progress = lambda job: self.job_changed.emit(job)
        self.worker.on_busy = self._on_busy
        self.cache = cache
        self.n_threads = 4
        self.presenter: Presenter | None = None
        self.depictor: Depictor | None = None
        self.awaits_drag = False  # whether the next pose of a drag is on its way
        self.scene_changed = Signal()
        SceneFollower(self, edit_changed=self._advance, preview_changed=self._advance)
        self.job_changed = Signal()
        self.state_changed = Signal()
        self.failed = Signal()
        self.exported = Signal()
        self.state = "empty"
        self.is_halted = False
        self._bound: BoundEdit | None = None
        self._shown: tuple[Edit, bool] | None = None
        self._given_up: Edit | None = None
        self._pending_export: tuple[Path, tuple[str, ...], dict] | None = None
        self._exported_edit: Edit | None = None
        self._jobs: dict[str, tuple[Job, object]] = {}
        self._told_job: Job | None = None

    # ------------------------------------------------------------------ files

    def open(self, path: Path, *, layout: str | None = None, restore: Callable[[Scene], None] | None = None) -> None:
        """Read a splat PLY in the background; the scene on screen stays until it is read.

        Parameters
        ----------
        path : Path
        layout : str, optional
            Read it as this layout instead of the recognised one.
        restore : callable, optional
            Given the new scene, on the worker, before anyone else knows it: to put a saved edit in place.
        """
        read = partial(opened_scene, path=path, layout=layout, depictor=self.depictor, restore=restore)
        cancels = ("open", "prepare", "bind", "pose")
        self._submit("open", f"Opening {path.name}", read, self._show, cancels=cancels)

    def export(self, path: Path, *, as_3dgs: bool = False, columns: tuple[str, ...] = ()) -> None:
        """Write the splats on screen, once they have settled, as a PLY."""
        self._pending_export = (path, columns, {"as_3dgs": as_3dgs})
        self._advance()

    def save_edit(self, path: Path) -> None:
        """Write the edit as a recipe for ``splap-editor deform``."""
        write_recipe(path, recipe_of(self._scene().edit))

    def open_edit(self, path: Path) -> None:
        """Replace the edit by a recipe's, as one undoable step."""
        scene = self._scene()
        self.change_edit(edit_of(read_recipe(path), scene.splats), "Open edit")

    @property
    def has_unexported_edit(self) -> bool:
        """Whether the edit differs from the one last exported (or from the file's own pose)."""
        scene = self.scene
        if scene is None:
            return False
        exported = self._exported_edit or Edit()
        return not (binds_like(scene.edit, exported) and poses_like(scene.edit, exported)) and not (
            scene.edit.is_identity and exported.is_identity
        )

    # ------------------------------------------------------------------ edits

    def change_edit(self, edit: Edit, label: str) -> None:
        """Replace the edit as one undoable step."""
        scene = self._scene()
        self.history.push(ChangeEdit(scene, scene.edit, auto_keyed_edit(scene.edit, edit), label))

    def change_mask(self, name: str, mask: NDArray[np.bool_], label: str) -> None:
        """Replace ``"selection"`` or ``"hidden"`` as one undoable step; no step when nothing changes."""
        scene = self._scene()
        if not np.array_equal(getattr(scene, name), mask):
            self.history.push(ChangeMask(scene, name, mask, label))

    def add_handle(self, region: Region, *, pose: Pose | None = None, name: str | None = None) -> Handle:
        """Place a handle, make it the active one, and prepare to move it."""
        scene = self._scene()
        handle_id = scene.edit.next_handle_id()
        handle = Handle(
            handle_id,
            name or f"Handle {handle_id}",
            HANDLE_COLORS[(handle_id - 1) % len(HANDLE_COLORS)],
            region,
            pose or Pose(),
        )
        self.is_halted = False
        self.change_edit(scene.edit.with_handle(handle), "Place handle")
        scene.set_active_handles((handle_id,))
        return handle

    def add_pin(self, region: Region) -> None:
        """Hold splats where they are."""
        edit = self._scene().edit
        self.change_edit(replace(edit, pins=(*edit.pins, region)), "Place pin")

    def preview_poses(self, poses: Mapping[int, Pose]) -> None:
        """Show handles at poses that are not in the history yet; the newest request wins."""
        scene = self._scene()
        scene.set_preview(scene.edit.with_poses(dict(poses)))

    def commit_preview(self, label: str) -> None:
        """Make the previewed poses one undoable step, and settle."""
        scene = self._scene()
        if scene.preview is not None:
            self.change_edit(scene.preview, label)

    def cancel_preview(self) -> None:
        """Go back to the poses from before the drag."""
        scene = self._scene()
        if scene.preview is not None:
            scene.set_preview(None)

    # ------------------------------------------------------------------ background work

    def halt(self) -> None:
        """Cancel the background work and leave it until `resume`, as a person's Cancel does."""
        self.is_halted = True
        self._pending_export = None
        self.worker.cancel()
        self._set_state("halted")

    def resume(self) -> None:
        """Go on with the work that `halt` left, or that failed."""
        self.is_halted = False
        self._given_up = None
        self._advance()

    def refresh_pose(self) -> None:
        """Pose anew, although no handle moved: the view wants its presentation made again."""
        self._shown = None
        self._advance()

    def close(self) -> None:
        """Cancel everything and join the workers."""
        for worker in (self.worker, self.view_worker, self.detail_worker):
            worker.close()

    @property
    def bound(self) -> BoundEdit | None:
        """The deformer in use, for read-outs such as weights and residuals."""
        return self._bound

    def _on_busy(self, job: Job | None) -> None:
        """Tell which job runs; frames of a drag, which have no title, come and go too fast to be told."""
        if job is not self._told_job and (job is None or job.title):
            self._told_job = job
            self.job_changed.emit(job)

    def _advance(self) -> None:
        scene = self.scene
        if scene is None or self.is_halted or self.worker.is_busy("open"):
            return
        edit = scene.shown_edit
        if edit is self._given_up:
            return
        if scene.surface is None or scene.surface.options != edit.graph:
            self._prepare(scene, edit.graph)
        elif not edit.active_handles:
            self._rest(scene, edit)
        elif self._bound is None or not binds_like(self._bound.edit, edit):
            self._bind(scene, edit)
        elif not self._is_posed(edit, settled=scene.preview is None):
            self._pose(scene, edit)
        else:
            self._set_state("settled" if scene.preview is None else "dragging")
            self._export_pending(scene)

    def _is_posed(self, edit: Edit, *, settled: bool) -> bool:
        """Whether the kernels on screen are those of an edit: settled, or the newest frame of a drag."""
        if self._shown is None:
            return False
        made, is_settled = self._shown
        return (is_settled or not settled) and binds_like(made, edit) and poses_like(made, edit)

    def _prepare(self, scene: Scene, options: GraphOptions) -> None:
        if self._is_making("prepare", lambda wanted: wanted == options):
            return
        prepare = partial(
            prepared_surface,
            splats=scene.splats,
            ellipses=scene.ellipses,
            options=options,
            cache=self.cache,
            near=scene.surface,
        )

        def done(surface: Surface) -> None:
            if self.scene is scene:
                self._bound = self._shown = None
                scene.set_surface(surface)
                self._advance()

        self._set_state("preparing")
        title = f"Preparing {scene.file.path.name}"
        self._submit("prepare", title, prepare, done, wanted=options, cancels=("prepare", "bind", "pose"))

    def _bind(self, scene: Scene, edit: Edit) -> None:
        if self._is_making("bind", lambda wanted: binds_like(wanted, edit)):
            return
        surface = scene.surface
        bind = partial(bound_edit, surface=surface, edit=edit, cache=self.cache, n_threads=self.n_threads)

        def done(bound: BoundEdit) -> None:
            if self.scene is scene and scene.surface is surface:
                self._bound = bound
                self._shown = None
                self._advance()

        self._set_state("binding")
        self._submit("bind", "Binding handles", bind, done, wanted=edit, cancels=("bind", "pose"))

    def _pose(self, scene: Scene, edit: Edit) -> None:
        dragging = scene.preview is not None
        if self.awaits_drag:
            return
        if not dragging and self._is_making("pose", lambda made: binds_like(made, edit) and poses_like(made, edit)):
            return
        self.worker.cancel("pose")
        bound, surface, presenter, transforms = self._bound, scene.surface, self.presenter, edit.transforms

        def kernels(deformation: Deformation) -> tuple[AdaptedKernels, Deformation, object]:
            adapted = kernels_of(surface, edit, deformation)
            return adapted, deformation, presenter(adapted) if presenter is not None else None

        def show(result: tuple) -> None:
            if self.scene is scene and scene.surface is surface:
                scene.set_pose(*result)

        def drag(job: Job) -> tuple:
            return kernels(bound.deformer.drag(transforms))

        def dragged(result: tuple) -> None:
            self._shown = (edit, False)
            self.awaits_drag = False
            show(result)
            self._advance()

        def settle(job: Job) -> tuple:
            def shown(deformation: Deformation) -> None:
                result = kernels(deformation)
                job.deliver(lambda: show(result))

            return kernels(bound.deformer.solve(transforms, progress=job.progress("settling"), shown=shown))

        def settled(result: tuple) -> None:
            self._shown = (edit, True)
            show(result)
            self._advance()

        if dragging:
            self._set_state("dragging")
            self.awaits_drag = True
            self._submit("drag", "", drag, dragged, wanted=edit)
        else:
            self._set_state("settling")
            self._submit("pose", "Settling", settle, settled, wanted=edit)

    def _rest(self, scene: Scene, edit: Edit) -> None:
        self.worker.cancel("bind", "pose", "drag")
        self._bound = None
        self._shown = None
        if scene.kernels is not None:
            scene.set_pose(None)
        self._set_state("ready")
        self._export_pending(scene)

    def _export_pending(self, scene: Scene) -> None:
        if self._pending_export is None or scene.preview is not None:
            return
        (path, columns, options), self._pending_export = self._pending_export, None
        edit = scene.edit
        export = partial(
            exported_file,
            path=path,
            file=scene.file,
            kernels=scene.kernels,
            columns=columns,
            snapshot=snapshot_of(scene, self._bound),
            options=options,
        )

        def done(report: ExportReport) -> None:
            if self.scene is scene:
                self._exported_edit = edit
            self.exported.emit(report)

        self._submit("export", f"Exporting {path.name}", export, done)

    def _show(self, scene: Scene) -> None:
        self._bound = self._shown = self._given_up = self._exported_edit = None
        self.is_halted = False
        self.scene = scene
        self.history.clear()
        self.scene_changed.emit()
        self._advance()

    def _is_making(self, kind: str, serves: Callable[[object], bool]) -> bool:
        """Whether the job of this kind that waits or runs makes something that serves."""
        job, wanted = self._jobs.get(kind, (None, None))
        return job is not None and not job.is_cancelled and self.worker.is_busy(kind) and serves(wanted)

    def _submit(
        self,
        kind: str,
        title: str,
        function: Callable[[Job], object],
        done: Callable[[object], None],
        *,
        wanted: object = None,
        cancels: tuple[str, ...] = (),
    ) -> None:
        def failed(error: Exception) -> None:
            if kind == "drag":
                self.awaits_drag = False
            if kind in ("prepare", "bind", "pose", "drag") and self.scene is not None:
                self._given_up = self.scene.shown_edit
                self._set_state("failed")
            self.failed.emit(title or "Moving the handle", error)
            if kind == "open":
                self._advance()

        def stopped() -> None:
            if kind == "drag":
                self.awaits_drag = False
            self._advance()

        job = Job(kind, title, function, done=done, failed=failed, stopped=stopped)
        self._jobs[kind] = (job, wanted)
        self.worker.submit(job, cancels=cancels)

    def _set_state(self, state: str) -> None:
        if state != self.state:
            self.state = state
            self.state_changed.emit()

    def _scene(self) -> Scene:
        if self.scene is None:
            raise RuntimeError("no scene is open")
        return self.scene
