"""What the Select menu does."""

from dataclasses import replace

import numpy as np

from splap_editor.core.index_spaces import FileMask
from splap_editor.session.scene import Scene
from splap_editor.session.selection import (
    boundary_selection,
    connected_selection,
    grown_selection,
    rim_selection,
    shrunk_selection,
)
from splap_editor.session.session import Session
from splap_editor.tools.select_tool import SelectOptions
from splap_editor.tools.tool import Held
from splap_editor.viewport.viewport import Viewport


class SelectActions:
    """Selecting and hiding by name; each is one undoable step."""

    def __init__(self, session: Session, options: Held[SelectOptions], viewport: Viewport) -> None:
        self._session = session
        self._viewport = viewport
        self._options = options

    @property
    def _scene(self) -> Scene:
        return self._session.shown_scene

    def all(self) -> None:
        """Select every splat that is not hidden."""
        self._select(~self._scene.unseen, "Select all")

    def none(self) -> None:
        """Select nothing."""
        self._select(np.zeros_like(self._scene.selection), "Select none")

    def invert(self) -> None:
        """Swap selected and unselected among the visible."""
        self._select(~self._scene.selection & ~self._scene.unseen, "Invert selection")

    def grow(self) -> None:
        """Add the neighbours on the surface."""
        scene = self._scene
        self._select(grown_selection(scene.selection, scene.ellipses, scene.prepared.graph), "Grow selection")

    def shrink(self) -> None:
        """Drop the rim."""
        scene = self._scene
        self._select(shrunk_selection(scene.selection, scene.ellipses, scene.prepared.graph), "Shrink selection")

    def connected(self) -> None:
        """Select all that hangs together with the selection."""
        scene = self._scene
        self._select(connected_selection(scene.selection, scene.ellipses, scene.prepared.graph), "Select connected")

    def rim(self) -> None:
        """Keep only those with a neighbour outside."""
        scene = self._scene
        self._select(rim_selection(scene.selection, scene.ellipses, scene.prepared.graph), "Select rim")

    def boundary(self) -> None:
        """Keep only those at an open rim of the surface; without a selection, take all of these."""
        scene = self._scene
        found = boundary_selection(scene.ellipses, scene.prepared.neighborhoods) & ~scene.unseen
        self._select(found & scene.selection if scene.selection.any() else found, "Select boundary")

    def front(self) -> None:
        """Keep only what nothing hides in the view; without a selection, take all of that."""
        screen = self._viewport.screen_points()
        width, height = self._viewport.projection.width, self._viewport.projection.height
        within = self._viewport.in_rectangle(screen, 0, 0, width, height)
        if self._scene.selection.any():
            within &= self._scene.selection
        self._select(self._viewport.visible_only(screen, within), "Select front layer")

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
        self._options.set(replace(self._options.value, through=on))

    def _select(self, mask: FileMask, label: str) -> None:
        self._session.steps.change_mask("selection", mask, label)

    def _hide(self, mask: FileMask, label: str) -> None:
        self._session.steps.change_mask("hidden", mask, label)
