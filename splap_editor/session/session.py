"""One open scene, its history and its background work: what the window and its tools talk to."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from splap_editor.core.handle_nodes import Region
from splap_editor.core.index_spaces import FileMask
from splap_editor.core.pose import Pose
from splap_editor.engine.bound_edit import BoundEdit
from splap_editor.engine.cache import StageCache
from splap_editor.engine.edit import HANDLE_COLORS, Edit, Handle, Pin
from splap_editor.engine.keyframes import auto_keyed_edit
from splap_editor.engine.recipe_edit import edit_of, recipe_of, require_rows_fit, rows_of
from splap_editor.engine.removal import Removal
from splap_editor.io.recipe import read_recipe, write_recipe
from splap_editor.session.commands import ChangeEdit, ChangeMask, ChangeTogether
from splap_editor.session.depictor import Depictor, Unseen
from splap_editor.session.history import History
from splap_editor.session.jobs import Job, Post, Starter, Threads, Worker
from splap_editor.session.latest_job import Gate
from splap_editor.session.scene import Scene
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.session.signals import Signal
from splap_editor.session.stage_runner import StageRunner
from splap_editor.session.stages import Ledger
from splap_editor.session.work import ExportOrder, OpenRequest


class Session:
    """Reconciles what the artist asked for with what has been made so far.

    What is asked for stands in the scene's edit and in a `Ledger`. Whenever
    either changes, a `StageRunner` walks the table of `stages` and starts the
    one job that is missing next: prepare the surface, bind the deformer, pose
    the splats. A job that is no longer wanted is cancelled. Nothing here waits
    for the worker.

    Parameters
    ----------
    post : callable
        Runs a callable on the main thread, soon; used by the workers.
    cache : StageCache, optional
        Where stages are kept between runs; none are kept without.
    """

    def __init__(self, post: Post, *, cache: StageCache | None = None) -> None:
        self.cache = cache
        self.history = History()
        self.worker = Worker(post)
        # A turned view must not wait behind a scene being prepared, nor behind quantities, edges and previews.
        self.view_worker = Worker(post, name="splap-view")
        self.detail_worker = Worker(post, name="splap-detail")
        # A file that is opened must not wait behind any of them, nor behind another that is slow or blocked.
        self._openings = Starter(post, name="splap-open")
        self._busy: dict[Threads, Job | None] = {self._openings: None, self.worker: None}
        for threads in self._busy:
            threads.on_progress = lambda job: self.job_changed.emit(job)
            threads.on_busy = partial(self._on_busy, threads)
        self._told_job: Job | None = None
        self._elsewhere: Job | None = None
        self._ledger = Ledger(cache)
        self._runner = StageRunner(self._ledger, self.worker, self._openings)
        self._frames = self._runner.loop("drag")
        self._runner.made.connect(self._on_made)
        self.opening = Signal()
        self.scene_changed = Signal()
        self.job_changed = Signal()
        self.exported = Signal()
        self.failed = self._runner.failed
        self.state_changed = self._runner.state_changed
        SceneFollower(self, edit_changed=self._runner.advance, preview_changed=self._runner.advance)

    def close(self) -> None:
        """Cancel everything and join the workers."""
        for worker in (self._openings, self.worker, self.view_worker, self.detail_worker):
            worker.close()

    # ------------------------------------------------------------------ what there is

    @property
    def scene(self) -> Scene | None:
        """The scene on screen."""
        return self._ledger.scene

    @property
    def shown_scene(self) -> Scene:
        """The scene on screen, for what is offered only while there is one; RuntimeError without."""
        return self._ledger.shown_scene

    @property
    def state(self) -> str:
        """One of empty, opening, preparing, ready, binding, dragging, settling, settled, halted and failed."""
        return self._ledger.state

    @property
    def bound(self) -> BoundEdit | None:
        """The deformer in use, for read-outs such as weights and residuals."""
        return self._ledger.bound

    @property
    def is_posed(self) -> bool:
        """Whether the kernels on screen are those of the edit on screen: settled, or the newest frame of a drag."""
        return self.scene is not None and self._ledger.is_posed

    @property
    def has_unexported_edit(self) -> bool:
        """Whether the edit differs from the one last exported (or from the file's own pose)."""
        return self.scene is not None and self._ledger.has_unexported_edit

    @property
    def has_unexported_work(self) -> bool:
        """Whether there are handles or pins that no export had, moved or not, or such an edit."""
        return self.scene is not None and self._ledger.has_unexported_work

    @property
    def n_threads(self) -> int:
        """Threads that weights of handles may be solved on."""
        return self._ledger.n_threads

    @n_threads.setter
    def n_threads(self, n_threads: int) -> None:
        self._ledger.n_threads = n_threads

    # ------------------------------------------------------------------ files

    def open(self, path: Path, *, layout: str | None = None, restore: Callable[[Scene], None] | None = None) -> None:
        """Read a splat PLY in the background, at once; the scene on screen stays until it is read.

        A file that is still being read is given up, however long its reader takes to hear of it. `opening` tells.

        Parameters
        ----------
        path : Path
        layout : str, optional
            Read it as this layout instead of the recognised one.
        restore : callable, optional
            Given the new scene, on the worker, before anyone else knows it: to put a saved edit in place.
        """
        self._ledger.opening = OpenRequest(path, layout, restore, self._ledger.depictor)
        self.opening.emit()
        self._runner.advance()

    def stop_opening(self) -> None:
        """Give up the file that is being read, as another is on its way."""
        self._runner.stop_opening()

    def export(self, path: Path, *, as_3dgs: bool = False, columns: tuple[str, ...] = ()) -> None:
        """Write the splats on screen, once they have settled, as a PLY."""
        self._ledger.exports += (ExportOrder(path, columns, as_3dgs),)
        self._runner.advance()

    def save_edit(self, path: Path) -> None:
        """Write the edit as a recipe for ``splap-editor deform``."""
        scene = self.shown_scene
        write_recipe(path, replace(recipe_of(scene.edit), rows_of=rows_of(scene.file)))

    def open_edit(self, path: Path) -> None:
        """Replace the edit by a recipe's, as one undoable step."""
        scene, recipe = self.shown_scene, read_recipe(path)
        require_rows_fit(recipe, scene.file)
        self.change_edit(edit_of(recipe, scene.splats), "Open edit")

    # ------------------------------------------------------------------ edits

    def change_edit(self, edit: Edit, label: str) -> None:
        """Replace the edit as one undoable step."""
        scene = self.shown_scene
        self.history.push(ChangeEdit(scene, scene.edit, auto_keyed_edit(scene.edit, edit), label))

    def change_mask(self, name: str, mask: FileMask, label: str) -> None:
        """Replace ``"selection"`` or ``"hidden"``, (N,) of file rows, as one undoable step; none if nothing changes.

        What is removed is not selected unless it is shown.
        """
        scene = self.shown_scene
        if name == "selection" and scene.edit.removed is not None and not scene.shows_removed:
            mask = mask & ~scene.removed
        if not np.array_equal(getattr(scene, name), mask):
            self.history.push(ChangeMask(scene, name, mask, label))

    def change_removal(self, removal: Removal, label: str) -> int:
        """Leave other splats out, as one undoable step that also selects what comes back, and else what stays selected.

        Returns
        -------
        int
            How many splats changed; without any there is no step.

        Raises
        ------
        ValueError
            Every splat would be left out.
        """
        scene = self.shown_scene
        before = scene.removed
        after = np.zeros_like(before) if removal.mask is None else removal.mask
        changed = int(np.count_nonzero(before ^ after))
        if not changed:
            return 0
        if after.all():
            raise ValueError("that would remove every splat: keep at least one")
        back = before & ~after
        selection = back if back.any() else scene.selection & ~after
        edit = auto_keyed_edit(scene.edit, replace(scene.edit, removal=removal))
        commands = ChangeEdit(scene, scene.edit, edit, label), ChangeMask(scene, "selection", selection, label)
        self.history.push(ChangeTogether(commands, label))
        return changed

    def add_handle(self, region: Region, *, pose: Pose | None = None, name: str | None = None) -> Handle:
        """Place a handle, make it the active one, and prepare to move it."""
        scene = self.shown_scene
        handle_id = scene.edit.next_handle_id()
        color = HANDLE_COLORS[(handle_id - 1) % len(HANDLE_COLORS)]
        handle = Handle(handle_id, name or f"Handle {handle_id}", color, region, pose or Pose())
        self._ledger.is_halted = False
        self.change_edit(scene.edit.with_handle(handle), "Place handle")
        scene.set_active_handles((handle_id,))
        return handle

    def add_pin(self, region: Region, *, reach: float | None = None) -> Pin:
        """Hold splats where they are; ``reach``: the region is a disc on the surface of this radius."""
        edit = self.shown_scene.edit
        pin_id = edit.next_pin_id()
        pin = Pin(pin_id, f"Pin {pin_id}", region, reach)
        self.change_edit(edit.with_pin(pin), "Place pin")
        return pin

    # ------------------------------------------------------------------ a drag

    def drag(self, step: Callable[[], None]) -> None:
        """Take a step of a drag as soon as the frame before it is shown; of steps that wait only the newest is taken.

        The step says where the pointer is by then: it moves the gizmo and calls `preview_poses`.
        """
        self._frames.when_free(step)

    def catch_up(self) -> None:
        """Take the step that waits now, as before a drag is committed."""
        self._frames.catch_up()

    def preview_poses(self, poses: Mapping[int, Pose]) -> None:
        """Show handles at poses that are not in the history yet; the newest request wins."""
        scene = self.shown_scene
        scene.set_preview(scene.edit.with_poses(dict(poses)))

    def commit_preview(self, label: str) -> None:
        """Make the previewed poses one undoable step, and settle."""
        scene = self.shown_scene
        if scene.preview is not None:
            self.change_edit(scene.preview, label)

    def cancel_preview(self) -> None:
        """Go back to the poses from before the drag; a step that waits is not taken."""
        self._frames.forget()
        scene = self.shown_scene
        if scene.preview is not None:
            scene.set_preview(None)

    def prepare_for(self, depictor: Depictor | None) -> None:
        """Have the worker prepare what a view draws of scenes and poses to come; None: there is no view."""
        self._ledger.depictor = depictor or Unseen()

    def pace_frames(self, gate: Gate) -> None:
        """Hold each frame of a drag at ``gate``, until the picture has shown the one before."""
        self._frames.gate = gate

    @property
    def awaits_frame(self) -> bool:
        """Whether the next frame of a drag is on its way."""
        return self._frames.is_busy

    # ------------------------------------------------------------------ background work

    def halt(self) -> None:
        """Cancel the background work and leave it until `resume`, as a person's Cancel does."""
        self._runner.halt()

    def resume(self) -> None:
        """Go on with the work that `halt` left, or that failed."""
        self._ledger.is_halted = False
        self._ledger.given_up = None
        self._runner.advance()

    def hold(self) -> None:
        """Open files and take edits, but make nothing of them until `release`."""
        self._ledger.is_held = True

    def release(self) -> None:
        """Make what is missing."""
        self._ledger.is_held = False
        self._runner.advance()

    def is_busy(self, *kinds: str) -> bool:
        """Whether a file is being read, or something made of it, of these kinds or of any."""
        return any(threads.is_busy(*kinds) for threads in self._busy)

    def tell(self, job: Job | None) -> None:
        """Show work that is done elsewhere whenever the worker has none to show; None: it is over."""
        self._elsewhere = job
        if self._told_job is None and self.state != "halted":
            self.job_changed.emit(job)

    def _on_busy(self, threads: Threads, job: Job | None) -> None:
        """Tell which job runs; frames of a drag, which have no title, come and go too fast to be told."""
        if job is None or job.title:
            self._busy[threads] = job
        told = self._busy[self._openings] or self._busy[self.worker]
        if told is not self._told_job:
            self._told_job = told
            self.job_changed.emit(told or self._elsewhere)

    def _on_made(self, stage: str, value: Any) -> None:
        if stage == "open":
            self.history.clear()
            self.scene_changed.emit()
        elif stage == "export":
            self.exported.emit(value)
