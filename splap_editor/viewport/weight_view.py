"""Bounded biharmonic weights over the splats, and the cage that the chosen handle reaches in."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.handle_nodes import Region, handle_nodes
from splap_editor.core.options import Length, world_length
from splap_editor.engine.edit import Handle
from splap_editor.engine.quantities import splat_weights
from splap_editor.session.scene import Scene
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.session.session import Session
from splap_editor.session.signals import Signal
from splap_editor.viewport.viewport import Viewport
from splap_editor.viewport.weight_colors import weight_tints

Paint = Callable[[NDArray[np.uint8] | None], None]


class WeightView:
    """Follows the chosen handle.

    `changed` tells when another handle's weights are shown, or none.

    Parameters
    ----------
    session : Session
    viewport : Viewport
        Where the cage is outlined.
    paint : callable
        Lays colours (N, 4) over the splats, or takes them away (None).
    """

    def __init__(self, session: Session, viewport: Viewport, paint: Paint) -> None:
        self.changed = Signal()
        self.handle: Handle | None = None
        self._session = session
        self._viewport = viewport
        self._paint = paint
        self._is_on = False
        self._painted: tuple[object, int] | None = None
        self._node_points: tuple[Region | None, NDArray[np.float64]] = (None, np.empty((0, 3)))
        SceneFollower(
            session,
            self._on_scene_changed,
            active_handles_changed=self._show,
            edit_changed=self._show,
            preview_changed=self._show,
        )
        session.state_changed.connect(self._show_weights)

    @property
    def is_on(self) -> bool:
        """Whether weights are shown wherever there are some."""
        return self._is_on

    @is_on.setter
    def is_on(self, on: bool) -> None:
        self._is_on = on
        self._show_weights()

    def preview_cage(self, radius: float | None) -> None:
        """Outline the chosen handle's cage at another radius than it has; None for the whole object."""
        self._show_cage(radius)

    def _on_scene_changed(self) -> None:
        self._node_points = (None, np.empty((0, 3)))
        self._painted = None
        self._show()

    def _show(self) -> None:
        self._show_weights()
        handle = self._chosen()
        self._show_cage(handle.cage_radius if handle is not None else None)

    def _chosen(self) -> Handle | None:
        """The handle whose cage and weights are looked at: the one chosen last."""
        scene = self._session.scene
        if scene is None or not scene.edit.deformer.has_weights:
            return None
        wanted = scene.active_handles
        found = [handle for handle in scene.edit.active_handles if handle.handle_id in wanted]
        return max(found, key=lambda handle: wanted.index(handle.handle_id), default=None)

    # Weights ------------------------------------------------------------------------------------------------------

    def _show_weights(self) -> None:
        scene, bound = self._session.scene, self._session.bound
        surface = scene.surface if scene is not None else None
        deformer = bound.weighted if bound is not None else None
        if not self._is_on or scene is None or surface is None or bound is None or deformer is None:
            self._take(None, None, None)
            return
        shown = bound.edit.active_handles if bound.edit.deformer == scene.edit.deformer else ()
        handle = self._chosen() or next(iter(shown), None)
        ids = [each.handle_id for each in shown]
        if handle is None or handle.handle_id not in ids:
            self._take(None, None, None)
            return
        column = ids.index(handle.handle_id)
        if self._painted is None or self._painted[0] is not deformer or self._painted[1] != column:
            self._take(
                (deformer, column), weight_tints(splat_weights(surface, deformer.sparse_weights, column)), handle
            )
        else:
            self._take(self._painted, None, handle)

    def _take(self, painted: tuple[object, int] | None, tints: NDArray[np.uint8] | None, handle: Handle | None) -> None:
        if tints is not None or (painted is None and self._painted is not None):
            self._paint(tints)
        self._painted = painted
        if handle is not self.handle:
            self.handle = handle
            self.changed.emit()

    # Cage ---------------------------------------------------------------------------------------------------------

    def _show_cage(self, length: Length) -> None:
        self._viewport.cage.hide()
        scene, handle = self._session.scene, self._chosen()
        # A drag shows the deformed object; the cage is of the one at rest.
        if scene is not None and handle is not None and scene.preview is None:
            radius = world_length(length, scene.ellipses.scene_scale)
            if radius is not None and radius > 0:
                r, g, b = (int(handle.color[k : k + 2], 16) / 255 for k in (1, 3, 5))
                self._viewport.cage.show(self._nodes_of(scene, handle), radius, (r, g, b))
        self._viewport.request_render()

    def _nodes_of(self, scene: Scene, handle: Handle) -> NDArray[np.float64]:
        if self._node_points[0] is not handle.region:
            nodes = handle_nodes(scene.ellipses, [handle.region]).indices
            self._node_points = (handle.region, scene.ellipses.centers[nodes])
        return self._node_points[1]
