"""Handles on their way: poses on screen that the history does not have yet."""

from collections.abc import Callable, Mapping
from dataclasses import replace

from splap_editor.core.place import Place
from splap_editor.core.pose import Pose
from splap_editor.engine.grading import Grading
from splap_editor.session.latest_job import Gate, LatestJob
from splap_editor.session.stages import Ledger
from splap_editor.session.undo_steps import UndoSteps


class Drag:
    """Previews poses frame by frame, and makes them one step or none.

    Parameters
    ----------
    ledger : Ledger
        Says which scene is on screen.
    steps : UndoSteps
    frames : LatestJob
        Makes the frames.
    """

    def __init__(self, ledger: Ledger, steps: UndoSteps, frames: LatestJob) -> None:
        self._ledger = ledger
        self._steps = steps
        self._frames = frames

    def take(self, step: Callable[[], None]) -> None:
        """Take a step as soon as the frame before it is shown; of steps that wait only the newest is taken.

        The step says where the pointer is by then: it moves the gizmo and calls `preview`.
        """
        self._frames.when_free(step)

    def catch_up(self) -> None:
        """Take the step that waits now, as before a drag is committed."""
        self._frames.catch_up()

    def preview(self, poses: Mapping[int, Pose]) -> None:
        """Show handles, by their ids, at poses that are not in the history yet; the newest request wins."""
        scene = self._ledger.shown_scene
        scene.set_preview(scene.edit.with_poses(dict(poses)))

    def preview_place(self, place: Place) -> None:
        """Show the whole scene put elsewhere, which is not in the history yet."""
        scene = self._ledger.shown_scene
        scene.set_preview(replace(scene.edit, place=place))

    def preview_grading(self, grading: Grading) -> None:
        """Show the splats graded otherwise, which is not in the history yet."""
        scene = self._ledger.shown_scene
        scene.set_preview(replace(scene.edit, grading=grading))

    def commit(self, label: str) -> None:
        """Make the previewed poses one undoable step, and settle."""
        scene = self._ledger.shown_scene
        if scene.preview is not None:
            self._steps.change_edit(scene.preview, label)

    def cancel(self) -> None:
        """Go back to the poses from before the drag; a step that waits is not taken."""
        self._frames.forget()
        scene = self._ledger.shown_scene
        if scene.preview is not None:
            scene.set_preview(None)

    def pace(self, gate: Gate) -> None:
        """Hold each frame at ``gate``, until the picture has shown the one before."""
        self._frames.gate = gate

    @property
    def awaits_frame(self) -> bool:
        """Whether the next frame is on its way."""
        return self._frames.is_busy
