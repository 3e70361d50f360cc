"""What a person changes in a scene, each as one step that can be undone."""

from dataclasses import replace
from itertools import count

import numpy as np

from splap_editor.core.handle_nodes import Region
from splap_editor.core.index_spaces import FileMask
from splap_editor.core.place import Place, stood_up
from splap_editor.core.pose import Pose
from splap_editor.core.removal import Vector
from splap_editor.engine.edit import HANDLE_COLORS, PIN_COLOR, Edit, Handle, Pin
from splap_editor.engine.keyframes import auto_keyed_edit
from splap_editor.engine.removal import Removal
from splap_editor.session.commands import ChangeEdit, ChangeMask, ChangeTogether, StandUp
from splap_editor.session.history import History
from splap_editor.session.stages import Ledger


class UndoSteps:
    """Changes the edit and the masks of the scene on screen through its history.

    Parameters
    ----------
    ledger : Ledger
        Says which scene is on screen.
    history : History
    """

    def __init__(self, ledger: Ledger, history: History) -> None:
        self._ledger = ledger
        self._history = history

    def change_edit(self, edit: Edit, label: str) -> None:
        """Replace the edit."""
        scene = self._ledger.shown_scene
        self._history.push(ChangeEdit(scene, scene.edit, auto_keyed_edit(scene.edit, edit), label))

    def change_mask(self, name: str, mask: FileMask, label: str) -> None:
        """Replace ``"selection"`` or ``"hidden"``, (N,) of file rows; no step if nothing changes.

        What is removed is not selected unless it is shown.
        """
        scene = self._ledger.shown_scene
        if name == "selection" and scene.edit.removed is not None and not scene.shows_removed:
            mask = mask & ~scene.removed
        if not np.array_equal(getattr(scene, name), mask):
            self._history.push(ChangeMask(scene, name, mask, label))

    def change_removal(self, removal: Removal, label: str) -> int:
        """Leave other splats out; the step also selects what comes back, and else what stays selected.

        Returns
        -------
        int
            How many splats changed; without any there is no step.

        Raises
        ------
        ValueError
            Every splat would be left out.
        """
        scene = self._ledger.shown_scene
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
        self._history.push(ChangeTogether(commands, label))
        return changed

    def change_place(self, place: Place, label: str) -> None:
        """Move, turn and scale the whole scene; no step if nothing changes."""
        scene = self._ledger.shown_scene
        if place != scene.edit.place:
            self.change_edit(replace(scene.edit, place=place), label)

    def stand_up(self, up: Vector) -> None:
        """Turn the whole scene about its subject, so that what was up points along another axis of what is written."""
        scene = self._ledger.shown_scene
        if up == scene.up:
            return
        edit = scene.edit
        place = stood_up(edit.place, np.array(scene.up), np.array(up), scene.ellipses.subject.center)
        self._history.push(StandUp(scene, edit, replace(edit, place=place), "Change up axis", scene.up, up))

    def add_handle(self, region: Region, *, pose: Pose | None = None, name: str | None = None) -> Handle:
        """Place a handle, make it the active one, and prepare to move it, even if work was halted."""
        scene = self._ledger.shown_scene
        handle_id = scene.edit.next_handle_id()
        color = HANDLE_COLORS[(handle_id - 1) % len(HANDLE_COLORS)]
        handle = Handle(handle_id, name or f"Handle {handle_id}", color, region, pose or Pose())
        self._ledger.is_halted = False
        self.change_edit(scene.edit.with_handle(handle), "Place handle")
        scene.set_active_handles((handle_id,))
        return handle

    def add_held(self, region: Region, pose: Pose) -> Handle:
        """Hold splats where they have been moved to: a handle that keeps their pose and frees nothing around it."""
        scene = self._ledger.shown_scene
        handle_id = scene.edit.next_handle_id()
        held = Handle(handle_id, _pin_name(scene.edit, 1), PIN_COLOR, region, pose, frees=False)
        self._ledger.is_halted = False
        self.change_edit(scene.edit.with_handle(held), "Place pin")
        return held

    def add_pin(self, region: Region, *, reach: float | None = None) -> Pin:
        """Hold splats where they are; ``reach``: the region is a disc on the surface of this radius."""
        edit = self._ledger.shown_scene.edit
        pin_id = edit.next_pin_id()
        pin = Pin(pin_id, _pin_name(edit, pin_id), region, reach)
        self.change_edit(edit.with_pin(pin), "Place pin")
        return pin


def _pin_name(edit: Edit, number: int) -> str:
    """First name from a number on that no pin has, nor a handle that holds like one."""
    names = {*(handle.name for handle in edit.handles), *(pin.name for pin in edit.pins)}
    return next(name for name in (f"Pin {n}" for n in count(number)) if name not in names)
