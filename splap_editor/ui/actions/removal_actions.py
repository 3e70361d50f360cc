"""Removing splats from the scene and bringing them back, as keys and the Edit menu do."""

import numpy as np

from splap_editor.engine.removal import Removal
from splap_editor.session.scene import Scene
from splap_editor.session.session import Session
from splap_editor.ui.actions.handle_actions import HandleActions
from splap_editor.ui.widgets.toast import Toast


class RemovalActions:
    """Removing splats and bringing them back; each is one undoable step, and the file stays as it is.

    Parameters
    ----------
    session : Session
    handles : HandleActions
        Deletes handles and pins, which the key for deleting takes first.
    toast : Toast
        Tells how many splats went or came back.
    """

    def __init__(self, session: Session, handles: HandleActions, toast: Toast) -> None:
        self._session = session
        self._handles = handles
        self._toast = toast

    @property
    def _scene(self) -> Scene:
        return self._session.shown_scene

    def delete(self) -> None:
        """Delete the chosen handles and pins; without any, the selected splats."""
        if self._scene.active_handles or self._scene.active_pins:
            self._handles.delete()
        else:
            self.selected()

    def selected(self) -> None:
        """Remove the selected splats."""
        scene = self._scene
        self._change(scene.edit.removal.with_rows(scene.selection), "Delete splats")

    def all_but_selected(self) -> None:
        """Remove everything else."""
        scene = self._scene
        self._change(scene.edit.removal.with_rows(~scene.selection), "Keep only selected")

    def restore_selected(self) -> None:
        """Bring back the removed splats among the selected, which are seen while removed ones are shown."""
        scene = self._scene
        self._change(scene.edit.removal.with_rows(scene.selection, restores=True), "Restore selected")

    def restore_all(self) -> None:
        """Bring back everything."""
        self._change(Removal(), "Restore all")

    def show(self, on: bool) -> None:
        """Draw removed splats, tinted, so that they can be selected."""
        self._scene.set_shows_removed(on)

    def _change(self, removal: Removal, label: str) -> None:
        before = self._scene.edit.removal.n_removed
        try:
            n = self._session.steps.change_removal(removal, label)
        except ValueError as error:
            self._toast.fail(f"Nothing was removed: {error}.")
            return
        left = np.count_nonzero(~self._scene.removed)
        if not n:
            self._toast.say("Nothing to remove or bring back among the selected splats.")
        elif removal.n_removed > before:
            self._toast.say(f"Removed {n:,} splats; {left:,} are left.", Undo=self._session.history.undo)
        else:
            self._toast.say(f"Brought back {n:,} splats; {left:,} are there.", Undo=self._session.history.undo)
