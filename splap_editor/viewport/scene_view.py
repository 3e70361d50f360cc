"""The viewport of a session: it follows the scene's signals and speaks the words of the tools."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow

from splap_editor.core.kernel_adaptation import AdaptedKernels
from splap_editor.core.rotations import quats_to_matrices
from splap_editor.core.spherical_harmonics import view_colors
from splap_editor.session.edit import Handle
from splap_editor.session.jobs import Job
from splap_editor.session.scene import Scene
from splap_editor.session.session import Session
from splap_editor.viewport.depth_order import depth_order
from splap_editor.viewport.gizmo import Part
from splap_editor.viewport.glyphs import base_colors, rgba_bytes, splat_glyphs
from splap_editor.viewport.overlays import circle
from splap_editor.viewport.projection import Projection
from splap_editor.viewport.regions import in_brush, in_lasso, in_rectangle
from splap_editor.viewport.splat_actor import DisplayMode, SplatFlag
from splap_editor.viewport.viewport import Viewport

FIXED_TINT = (46, 49, 58, 150)
HANDLE_SHARE = 165
PIN_TINT = (120, 150, 200, 150)
FREE_RING_COLOR = (0.75, 0.77, 0.82)


@dataclass(frozen=True, eq=False)
class Presented:
    """What the worker made for one view of the splats: their drawing order and their colours."""

    order: NDArray[np.int32] | None
    colors: NDArray[np.uint8] | None


class SceneView(Viewport):
    """Shows a session's scene: splats, selection, handles, what is free and what is fixed.

    Parameters
    ----------
    session : Session
        Followed; its ``presenter`` is set, so that each pose comes with its drawing order and colours.
    window, request_render, renderer, scale
        As for `Viewport`.
    """

    def __init__(
        self,
        session: Session,
        window: vtkRenderWindow,
        request_render: Callable[[], None],
        *,
        renderer: vtkRenderer | None = None,
        scale: float = 1.0,
    ) -> None:
        super().__init__(window, request_render, renderer=renderer, scale=scale)
        self._session = session
        self._scene: Scene | None = None
        self._disc: NDArray[np.int64] | None = None
        self._shows_tints = True
        self._tinted_for: tuple[object, ...] = ()
        self._wants_view = False
        self._view_job: Job | None = None
        self._view_state = (np.zeros(3), np.array([0.0, 0.0, -1.0], np.float32), False)
        self.view_turned = self._on_view_turned
        session.presenter = self._presented
        session.scene_changed.connect(self._on_scene_changed)
        session.state_changed.connect(self._show_tints)

    def close(self) -> None:
        """Let go of session and window."""
        self._session.presenter = None
        super().close()

    # Words of the tools -------------------------------------------------------------------------------------------

    def in_rectangle(self, screen: NDArray[np.float32], x0: float, y0: float, x1: float, y1: float):
        """(N,) bool: splats whose centre is in a rectangle of the screen."""
        return in_rectangle(screen, x0, y0, x1, y1)

    def in_lasso(self, screen: NDArray[np.float32], polygon: ArrayLike) -> NDArray[np.bool_]:
        """(N,) bool: splats whose centre is in a polygon of the screen."""
        return in_lasso(screen, polygon)

    def in_brush(self, screen: NDArray[np.float32], path: ArrayLike, radius_px: float) -> NDArray[np.bool_]:
        """(N,) bool: splats whose centre is near a path on the screen."""
        return in_brush(screen, path, radius_px)

    def gizmo_part(self, x: float, y: float) -> Part | None:
        """Part of the gizmo under the cursor."""
        return self.gizmo.hit(self.projection(), x, y) if self.gizmo.is_shown else None

    def hover_gizmo(self, x: float, y: float) -> None:
        """Light up the part under the cursor."""
        part = self.gizmo_part(x, y)
        if part != self.gizmo.hovered:
            self.gizmo.hovered = part
            self.request_render()

    def gizmo_changed(self) -> None:
        """Draw the gizmo anew; between drags it stands at the active handles."""
        self._place_gizmo()
        self.request_render()

    def camera_moved(self) -> None:
        """Draw the scene from where the camera is."""
        self.request_render()

    def show_disc(self, rows: NDArray[np.int64] | None) -> None:
        """Light up splats on the surface, or none."""
        self._disc = rows
        self._show_flags()

    # Look ---------------------------------------------------------------------------------------------------------

    @property
    def shows_tints(self) -> bool:
        """Whether handles, pins and what is fixed are tinted."""
        return self._shows_tints

    @shows_tints.setter
    def shows_tints(self, on: bool) -> None:
        self._shows_tints = on
        self._tinted_for = ()
        self._show_tints()

    def core_points(self) -> NDArray[np.float64]:
        """(2, 3) corners of the box that holds the scene without its far floaters."""
        return self._core_points()

    def set_scale(self, scale: float) -> None:
        """Follow the window to a screen of another density, device pixels per logical pixel."""
        if scale != self.scale:
            self.scale = self.gizmo.scale = self.triad.scale = scale
            self._apply_looks()

    def rows_of_handles(self, handle_ids: Iterable[int]) -> NDArray[np.int64]:
        """File rows that these handles hold, empty while nothing is bound."""
        bound = self._session.bound
        if bound is None or self._scene is None:
            return np.empty(0, np.int64)
        labels = [i for i, h in enumerate(bound.edit.active_handles) if h.handle_id in set(handle_ids)]
        nodes = bound.handles.indices[np.isin(bound.handles.labels, labels)]
        return self._scene.ellipses.rows[nodes]

    # Following the scene ------------------------------------------------------------------------------------------

    def _on_scene_changed(self) -> None:
        self._scene = scene = self._session.scene
        self._disc = None
        self._tinted_for = ()
        self.gizmo.detach()
        if scene is None:
            self.clear()
            return
        scene.pose_changed.connect(self._show_pose)
        scene.selection_changed.connect(self._show_flags)
        scene.hidden_changed.connect(self._show_flags)
        scene.edit_changed.connect(self._show_handles)
        scene.preview_changed.connect(self._show_handles)
        scene.active_handles_changed.connect(self._show_handles)
        self.load(splat_glyphs(scene.splats), base_colors(scene.splats))
        self.reset_camera()
        self._show_flags()
        self._show_handles()

    def _show_pose(self) -> None:
        scene = self._scene
        kernels, presented = scene.kernels, scene.presented
        if self.splats is None:
            return
        if kernels is None:
            self.move_splats(self._rest.means, self._rest.axes_u, self._rest.axes_v)
            self._ask_for_view()
        else:
            order = presented.order if presented is not None else None
            self.move_splats(kernels.means_f32, kernels.axes_f32[:, 0], kernels.axes_f32[:, 1], order=order)
            if presented is not None and presented.colors is not None:
                self.set_colors(presented.colors)
        self._show_tints()

    def _show_flags(self) -> None:
        scene = self._scene
        if scene is None or self.splats is None:
            return
        flags = np.where(scene.selection, np.uint8(SplatFlag.SELECTED), np.uint8(0))
        flags |= np.where(scene.hidden, np.uint8(SplatFlag.HIDDEN), np.uint8(0))
        if self._disc is not None:
            flags[self._disc] |= np.uint8(SplatFlag.HIGHLIGHTED)
        self.set_flags(flags)

    def _show_handles(self) -> None:
        scene = self._scene
        if scene is None or self.splats is None:
            return
        handles = scene.shown_edit.active_handles
        centers = np.array([_center(handle) for handle in handles]).reshape(-1, 3)
        colors = np.array([_rgb(handle.color) for handle in handles]).reshape(-1, 3) / 255.0
        active = [i for i, handle in enumerate(handles) if handle.handle_id in scene.active_handles]
        self.markers.show(centers, colors, active[-1] if active else None)
        self._place_gizmo()
        self._show_tints()
        self.request_render()

    def _place_gizmo(self) -> None:
        if self.gizmo.dragged is not None or self._scene is None:
            return
        shown = self._scene.shown_edit.active_handles
        handles = [handle for handle in shown if handle.handle_id in self._scene.active_handles]
        if not handles:
            self.gizmo.detach()
            return
        frame = np.eye(4)
        frame[:3, :3] = quats_to_matrices(np.array([handles[-1].pose.rotate]))[0]
        frame[:3, 3] = np.mean([_center(handle) for handle in handles], axis=0)
        self.gizmo.attach(frame)

    def _show_tints(self) -> None:
        """Tint what handles hold in their colours and darken what is fixed, once something is bound."""
        scene, bound = self._scene, self._session.bound
        if scene is None or self.splats is None:
            return
        colors = tuple(handle.color for handle in scene.edit.active_handles)
        wanted = (bound, colors) if self._shows_tints and colors and bound is not None else ()
        if wanted == self._tinted_for:
            return
        self._tinted_for = wanted
        if not wanted or len(bound.edit.active_handles) != len(colors):
            self.set_tints(None)
            return
        tints = np.zeros((self.splats.n_splats, 4), np.uint8)
        rows = scene.ellipses.rows[bound.handles.indices]
        pinned = bound.handles.labels < 0
        tints[rows[pinned]] = FIXED_TINT
        palette = np.array([(*_rgb(color), HANDLE_SHARE) for color in colors], np.uint8)
        tints[rows[~pinned]] = palette[bound.handles.labels[~pinned]]
        self.set_tints(tints)

    def show_free_ring(self, is_shown: bool) -> None:
        """Draw the free radius about each active handle, facing the viewer."""
        self.rings.hide("free")
        scene = self._scene
        if is_shown and scene is not None and scene.edit.free_radius is not None:
            radius = scene.edit.free_radius
            radius = 0.5 * scene.ellipses.scene_scale if np.isnan(radius) else radius
            direction = self.projection().direction
            handles = [h for h in scene.edit.active_handles if h.handle_id in scene.active_handles]
            loops = [circle(handle.region.center, direction, radius) for handle in handles]
            self.rings.show("free", loops, FREE_RING_COLOR, width_px=1.5 * self.scale, opacity=0.8)
        self.request_render()

    # Colours and order of a view ----------------------------------------------------------------------------------

    def _presented(self, kernels: AdaptedKernels) -> Presented:
        """Sort and colour on the worker; camera and mode are read as they stand."""
        return _presented(self._scene, kernels, *self._view_state)

    def _on_view_turned(self, projection: Projection) -> None:
        is_blended = self.mode is DisplayMode.SPLATS
        self._view_state = (projection.eye, projection.direction.astype(np.float32), is_blended)
        self._ask_for_view()

    def _ask_for_view(self) -> None:
        """Have colours and order made for the present view; the newest view wins."""
        scene = self._scene
        if scene is None:
            return
        if self._view_job is not None:
            self._wants_view = True
            return
        view, kernels = self._view_state, scene.kernels

        def present(job: Job) -> Presented:
            return _presented(scene, kernels, *view)

        def done(presented: Presented) -> None:
            finished()
            if self._scene is not scene or scene.kernels is not kernels or self.splats is None:
                return
            if presented.order is not None:
                self.set_order(presented.order)
            if presented.colors is not None:
                self.set_colors(presented.colors)

        def finished(*_: object) -> None:
            self._view_job = None
            if self._wants_view:
                self._wants_view = False
                self._ask_for_view()

        self._view_job = Job("view", "", present, done=done, failed=finished, stopped=finished)
        self._session.worker.submit(self._view_job)


def _presented(
    scene: Scene,
    kernels: AdaptedKernels | None,
    eye: NDArray[np.float64],
    direction: NDArray[np.float32],
    is_blended: bool,
) -> Presented:
    splats = scene.splats
    means = np.ascontiguousarray(splats.means, np.float32) if kernels is None else kernels.means_f32
    order = depth_order(means, direction) if is_blended else None
    if not splats.shN.shape[1]:
        return Presented(order, None)
    if kernels is None:
        rotations = np.broadcast_to(np.eye(3), (splats.n_splats, 3, 3))
    else:
        rotations = kernels.rotations
    rgb = view_colors(splats.sh0, splats.shN, means, rotations, eye)
    return Presented(order, rgba_bytes(rgb, splats.opacities))


def _center(handle: Handle) -> NDArray[np.float64]:
    return np.asarray(handle.region.center, np.float64) + handle.pose.translate


def _rgb(color: str) -> tuple[int, int, int]:
    return int(color[1:3], 16), int(color[3:5], 16), int(color[5:7], 16)
