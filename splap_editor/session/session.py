"""One open scene, its history and its background work: what the window and its tools talk to."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from splap_editor.engine.bound_edit import BoundEdit
from splap_editor.engine.cache import StageCache
from splap_editor.engine.edit import Edit
from splap_editor.engine.removal import Finder
from splap_editor.session.depictor import Depictor, Unseen
from splap_editor.session.drag import Drag
from splap_editor.session.edit_file import read_edit
from splap_editor.session.history import History
from splap_editor.session.jobs import Post, Starter, Worker, close_all
from splap_editor.session.latest_job import LatestJob
from splap_editor.session.scene import Scene
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.session.signals import Signal
from splap_editor.session.stage_runner import StageRunner
from splap_editor.session.stages import Ledger
from splap_editor.session.told_job import ToldJob
from splap_editor.session.undo_steps import UndoSteps
from splap_editor.session.work import ExportOrder, OpenRequest, told_finder


class Session:
    """Reconciles what the artist asked for with what has been made so far.

    What is asked for stands in the scene's edit and in a `Ledger`. Whenever
    either changes, a `StageRunner` walks the table of `stages` and starts the
    one job that is missing next: prepare the surface, bind the deformer, pose
    the splats. A job that is no longer wanted is cancelled. Nothing here waits
    for the worker.

    The edit is changed through its parts: ``steps`` that ``history`` can undo,
    and the ``drag`` that ends in one of them. ``told_job`` is what to show of
    the background work.

    Parameters
    ----------
    post : callable
        Runs a callable on the main thread, soon; used by the workers.
    cache : StageCache, optional
        Where stages are kept between runs; none are kept without.
    """

    def __init__(self, post: Post, *, cache: StageCache | None = None) -> None:
        self.cache = cache
        self.worker = Worker(post)
        # A turned view must not wait behind a scene being prepared, nor behind quantities, edges and previews.
        self.view_worker = Worker(post, name="splap-view")
        self.detail_worker = Worker(post, name="splap-detail")
        # What is searched for long, ahead of being asked for, is in nobody's way.
        self.search_worker = Starter(post, name="splap-search")
        # A file that is opened must not wait behind any of them, nor behind another that is slow or blocked.
        self._openings = Starter(post, name="splap-open")
        self.told_job = ToldJob(self._openings, self.worker)
        self._ledger = Ledger(cache)
        self._runner = StageRunner(self._ledger, self.worker, self._openings)
        self._runner.made.connect(self._on_made)
        self.history = History()
        self.steps = UndoSteps(self._ledger, self.history)
        self.drag = Drag(self._ledger, self.steps, self._runner.loop("drag"))
        self._edits = LatestJob(self._openings, "edit", abandons=True)
        self.opening = Signal()
        self.edit_opened = Signal()
        self.scene_changed = Signal()
        self.exported = Signal()
        self.failed = self._runner.failed
        self.state_changed = self._runner.state_changed
        SceneFollower(self, self._edits.drop, edit_changed=self._runner.advance, preview_changed=self._runner.advance)

    def close(self) -> None:
        """Cancel everything and join the workers, as far as they come to an end in time."""
        close_all((self._openings, self.search_worker, self.worker, self.view_worker, self.detail_worker))

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
    def has_unexported_edit(self) -> bool:
        """Whether the edit differs from the one last exported (or from the file's own pose)."""
        return self.scene is not None and self._ledger.has_unexported_edit

    @property
    def n_threads(self) -> int:
        """Threads that weights of handles may be solved on."""
        return self._ledger.n_threads

    @n_threads.setter
    def n_threads(self, n_threads: int) -> None:
        self._ledger.n_threads = n_threads

    # ------------------------------------------------------------------ files

    def open(
        self, path: Path, *, layout: str | None = None, restore: Callable[[Scene, Finder], None] | None = None
    ) -> None:
        """Read a splat PLY in the background, at once; the scene on screen stays until it is read.

        A file that is still being read is given up, however long its reader takes to hear of it. `opening` tells.

        Parameters
        ----------
        path : Path
        layout : str, optional
            Read it as this layout instead of the recognised one.
        restore : callable, optional
            Given the new scene, on the worker, before anyone else knows it, and what finds the splats that an edit
            removes: to put a saved edit in place.
        """
        self._ledger.opening = OpenRequest(path, layout, restore, self._ledger.depictor)
        self.opening.emit()
        self._runner.advance()

    def open_edit(self, path: Path) -> None:
        """Read a recipe in the background and make it the edit of the scene on screen; `edit_opened` tells.

        What it removes as floaters or by a quantity is looked for there too. The newest is taken, if the scene is
        still there.
        """
        scene = self.shown_scene

        def taken(edit: Edit) -> None:
            self.steps.change_edit(edit, "Open edit")
            self.edit_opened.emit(path)

        title = f"Opening {path.name}"
        self._edits.ask(
            lambda job: read_edit(path, scene, told_finder(job, scene.splats), job.progress("reading the edit")),
            taken,
            failed=lambda error: self.failed.emit(title, error),
            title=title,
        )

    def stop_opening(self) -> None:
        """Give up the file that is being read, as another is on its way."""
        self._runner.stop_opening()

    def export(self, path: Path, *, as_3dgs: bool = False, columns: tuple[str, ...] = ()) -> None:
        """Write the splats on screen: at once, or once they have settled, for which work that was halted goes on."""
        order = ExportOrder(path, columns, as_3dgs)
        self._ledger.exports += (order,)
        self._ledger.is_halted &= self._ledger.is_written_at_once(order)
        self._runner.advance()

    # ------------------------------------------------------------------ background work

    def prepare_for(self, depictor: Depictor | None) -> None:
        """Have the worker prepare what a view draws of scenes and poses to come; None: there is no view."""
        self._ledger.depictor = depictor or Unseen()

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
        return self._openings.is_busy(*kinds) or self.worker.is_busy(*kinds)

    def _on_made(self, stage: str, value: Any) -> None:
        if stage == "open":
            self.history.clear()
            self.scene_changed.emit()
        elif stage in ("export", "export at rest"):
            self.exported.emit(value)
