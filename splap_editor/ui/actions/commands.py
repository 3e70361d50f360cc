"""What the actions do to the models: history, selection, handles, display, tools."""

from dataclasses import replace

import numpy as np

from splap_editor.engine.edit import Pose
from splap_editor.session.placement import rows_region
from splap_editor.session.scene import Scene
from splap_editor.session.selection import connected_selection, grown_selection, shrunk_selection
from splap_editor.session.session import Session
from splap_editor.tools.select_tool import SelectTool
from splap_editor.tools.tool import ToolManager
from splap_editor.ui.display import Display
from splap_editor.viewport.viewport import Viewport

SELECT_SHAPES = {"select": "rectangle", "lasso": "lasso", "brush": "brush"}
"""Shapes of the one select tool, by the action that chooses them."""


class EditCommands:
    """Undo, redo, and the background work."""

    def __init__(self, session: Session, tools: ToolManager) -> None:
        self._session = session
        self._tools = tools

    def undo(self) -> None:
        """Take the last step back; a drag under way is dropped first."""
        self._tools.cancel()
        self._session.history.undo()

    def redo(self) -> None:
        """Repeat the step taken back."""
        self._tools.cancel()
        self._session.history.redo()

    def stop(self) -> None:
        """Cancel the background work."""
        self._session.halt()

    def resume(self) -> None:
        """Go on with it."""
        self._session.resume()


class SelectCommands:
    """Selecting by command; each is one undoable step."""

    def __init__(self, session: Session, select_tool: SelectTool) -> None:
        self._session = session
        self._tool = select_tool

    @property
    def _scene(self) -> Scene:
        return self._session.scene

    def all(self) -> None:
        """Select every splat that is not hidden."""
        self._select(~self._scene.hidden, "Select all")

    def none(self) -> None:
        """Select nothing."""
        self._select(np.zeros_like(self._scene.selection), "Select none")

    def invert(self) -> None:
        """Swap selected and unselected among the visible."""
        self._select(~self._scene.selection & ~self._scene.hidden, "Invert selection")

    def grow(self) -> None:
        """Add the neighbours on the surface."""
        scene = self._scene
        self._select(grown_selection(scene.selection, scene.ellipses, scene.surface.graph), "Grow selection")

    def shrink(self) -> None:
        """Drop the rim."""
        scene = self._scene
        self._select(shrunk_selection(scene.selection, scene.ellipses, scene.surface.graph), "Shrink selection")

    def connected(self) -> None:
        """Select all that hangs together with the selection."""
        scene = self._scene
        self._select(connected_selection(scene.selection, scene.ellipses, scene.surface.graph), "Select connected")

    def hide(self) -> None:
        """Hide the selected splats."""
        self._hide(self._scene.hidden | self._scene.selection, "Hide selected")

    def isolate(self) -> None:
        """Hide all but the selected splats."""
        self._hide(~self._scene.selection, "Isolate selected")

    def show_all(self) -> None:
        """Hide nothing."""
        self._hide(np.zeros_like(self._scene.hidden), "Show all")

    def through(self, on: bool) -> None:
        """Select what lies behind as well."""
        self._tool.set_options(replace(self._tool.options, through=on))

    def _select(self, mask: np.ndarray, label: str) -> None:
        self._session.change_mask("selection", mask, label)

    def _hide(self, mask: np.ndarray, label: str) -> None:
        self._session.change_mask("hidden", mask, label)


class HandleCommands:
    """Making, posing and deleting handles and pins."""

    def __init__(self, session: Session, viewport: Viewport) -> None:
        self._session = session
        self._viewport = viewport

    def from_selection(self) -> None:
        """Make the selected splats a handle."""
        self._session.add_handle(self._selected_region())

    def pin_selection(self) -> None:
        """Hold the selected splats where they are."""
        self._session.add_pin(self._selected_region())

    def clear_pins(self) -> None:
        """Let go of all pins."""
        self._session.change_edit(replace(self._session.scene.edit, pins=()), "Clear pins")

    def reset(self) -> None:
        """Put the chosen handles back to rest."""
        scene = self._session.scene
        self._reset(scene.active_handles, "Reset pose")

    def reset_all(self) -> None:
        """Put every handle back to rest."""
        scene = self._session.scene
        self._reset(tuple(handle.handle_id for handle in scene.edit.handles), "Reset all poses")

    def delete(self) -> None:
        """Delete the chosen handles."""
        scene = self._session.scene
        n = len(scene.active_handles)
        label = "Delete handle" if n == 1 else f"Delete {n} handles"
        self._session.change_edit(scene.edit.without_handles(scene.active_handles), label)

    def local(self, on: bool) -> None:
        """Turn the gizmo with the handle."""
        self._viewport.gizmo.is_local = on
        self._viewport.gizmo_changed()

    def _reset(self, handle_ids: tuple[int, ...], label: str) -> None:
        edit = self._session.scene.edit
        if any(not edit.handle(handle_id).pose.is_identity for handle_id in handle_ids):
            self._session.change_edit(edit.with_poses(dict.fromkeys(handle_ids, Pose())), label)

    def _selected_region(self):
        scene = self._session.scene
        return rows_region(scene, np.flatnonzero(scene.selection))


class DisplayCommands:
    """How splats are drawn, by key and menu."""

    def __init__(self, display: Display) -> None:
        self._display = display

    def ellipses(self) -> None:
        """Draw ellipses."""
        self._display.set(mode="ellipses")

    def splats(self) -> None:
        """Draw blended Gaussians."""
        self._display.set(mode="splats")

    def points(self) -> None:
        """Draw centres."""
        self._display.set(mode="points")

    def deformed(self) -> None:
        """Show the edit."""
        self._display.set(shown="deformed")

    def original(self) -> None:
        """Show the file as it is."""
        self._display.set(shown="original")

    def both(self) -> None:
        """Show the edit over a ghost of the original."""
        self._display.set(shown="both")

    def weights(self, on: bool) -> None:
        """Show how much each splat follows the chosen handle."""
        self._display.set(weights=on)


class ToolCommands:
    """Choosing the tool that the left button works with."""

    def __init__(self, tools: ToolManager, select_tool: SelectTool) -> None:
        self._tools = tools
        self._select_tool = select_tool

    def select(self) -> None:
        """Select by click and rectangle."""
        self._choose_select("select")

    def lasso(self) -> None:
        """Select by lasso."""
        self._choose_select("lasso")

    def brush(self) -> None:
        """Select by brush."""
        self._choose_select("brush")

    def handle(self) -> None:
        """Place handles."""
        self._tools.choose("handle")

    def pin(self) -> None:
        """Place pins."""
        self._tools.choose("pin")

    def inspect(self) -> None:
        """Look at splats and edges."""
        self._tools.choose("inspect")

    def _choose_select(self, action: str) -> None:
        self._tools.cancel()
        self._select_tool.set_options(replace(self._select_tool.options, shape=SELECT_SHAPES[action]))
        self._tools.choose("select")
