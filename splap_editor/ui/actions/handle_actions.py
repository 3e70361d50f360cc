"""Making, posing and deleting handles and pins."""

from dataclasses import replace

import numpy as np

from splap_editor.core.handle_nodes import Region
from splap_editor.core.pose import Pose
from splap_editor.session.pivot import Pivot
from splap_editor.session.placement import held_pose, rows_region
from splap_editor.session.session import Session
from splap_editor.viewport.viewport import Viewport


class HandleActions:
    """Making, posing and deleting handles and pins."""

    def __init__(self, session: Session, viewport: Viewport) -> None:
        self._session = session
        self._viewport = viewport

    def from_selection(self) -> None:
        """Make the selected splats a handle, which moves nothing by itself."""
        region = self._selected_region()
        self._session.steps.add_handle(region, pose=held_pose(self._session.shown_scene, region))

    def pin_selection(self) -> None:
        """Hold the selected splats where they are: where they have gone, if they have."""
        region = self._selected_region()
        pose = held_pose(self._session.shown_scene, region)
        if pose.is_identity:
            self._session.steps.add_pin(region)
        else:
            self._session.steps.add_held(region, pose)

    def pin_rest(self) -> None:
        """Hold all that is not selected, as one pin; of what handles hold, these stay the masters."""
        scene = self._session.shown_scene
        self._session.steps.add_pin(rows_region(scene, np.flatnonzero(~scene.selection)))

    def clear_pins(self) -> None:
        """Let go of all pins."""
        self._session.steps.change_edit(replace(self._session.shown_scene.edit, pins=()), "Clear pins")

    def reset(self) -> None:
        """Put the chosen handles back to rest."""
        scene = self._session.shown_scene
        self._reset(scene.active_handles, "Reset pose")

    def reset_all(self) -> None:
        """Put every handle back to rest."""
        scene = self._session.shown_scene
        self._reset(tuple(handle.handle_id for handle in scene.edit.handles), "Reset all poses")

    def delete(self) -> None:
        """Delete the chosen handles and pins."""
        scene = self._session.shown_scene
        handles, pins = scene.active_handles, scene.active_pins
        counts = ((len(handles), "handle"), (len(pins), "pin"))
        what = " and ".join(f"{n} {noun}s" if n > 1 else noun for n, noun in counts if n)
        self._session.steps.change_edit(scene.edit.without_handles(handles).without_pins(pins), f"Delete {what}")

    def pivot(self, pivot: Pivot) -> None:
        """Choose what handles turn and scale about."""
        self._session.shown_scene.set_pivot(pivot)

    def next_pivot(self) -> None:
        """Choose the next of them."""
        pivots = list(Pivot)
        self.pivot(pivots[(pivots.index(self._session.shown_scene.pivot) + 1) % len(pivots)])

    def local(self, on: bool) -> None:
        """Turn the gizmo with the handle."""
        self._viewport.gizmo.is_local = on
        self._viewport.gizmo_changed()

    def _reset(self, handle_ids: tuple[int, ...], label: str) -> None:
        edit = self._session.shown_scene.edit
        if any(not edit.handle(handle_id).pose.is_identity for handle_id in handle_ids):
            self._session.steps.change_edit(edit.with_poses(dict.fromkeys(handle_ids, Pose())), label)

    def _selected_region(self) -> Region:
        scene = self._session.shown_scene
        return rows_region(scene, np.flatnonzero(scene.selection))
