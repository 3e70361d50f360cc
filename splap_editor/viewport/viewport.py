"""The picture: splats, marks over them, and the camera that looks at them."""

from collections.abc import Callable
from dataclasses import replace
from time import perf_counter

import numpy as np
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401 - registers the OpenGL implementations
from numpy.typing import ArrayLike, NDArray
from vtkmodules.vtkCommonCore import vtkCommand
from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow

from splap_editor.core.index_spaces import FileMask
from splap_editor.core.place import Place
from splap_editor.viewport.axes_triad import AxesTriad
from splap_editor.viewport.cage_outline import CageOutline
from splap_editor.viewport.camera import Camera, View, box_corners
from splap_editor.viewport.frame_quality import FrameQuality, QualityChooser
from splap_editor.viewport.gizmo import Gizmo
from splap_editor.viewport.gizmo_actor import GizmoActor
from splap_editor.viewport.gizmo_parts import Part
from splap_editor.viewport.magnifier import Magnifier
from splap_editor.viewport.overlays import Markers, Rings
from splap_editor.viewport.picking import Hit, surface_hit
from splap_editor.viewport.projection import Projection
from splap_editor.viewport.regions import in_brush, in_lasso, in_rectangle, screen_points, visible_only
from splap_editor.viewport.splat_actor import DisplayMode
from splap_editor.viewport.splat_scene import SplatScene

BACKGROUND = ((0.085, 0.088, 0.095), (0.150, 0.155, 0.165))
_MARKER_PX = 13.0
RESTS_AFTER_S = 0.15
"""Something that is being moved but has not for so long rests: the picture gets finer."""
REFINEMENT = 4.0
"""Each frame of a picture at rest may take so many times as long as the one before."""


class Viewport:
    """Everything drawn in one render window.

    It never renders: whatever changes the picture calls ``request_render``,
    and the host draws when it likes. All positions on the screen are device
    pixels from the top left corner. Only for the thread of the window.

    Parts to work with: `splats` (what is shown and how), `camera`, `gizmo`,
    `markers`, `rings`, `cage`, `triad`. The camera and the gizmo are models that do
    not ask for frames: call `camera_moved` and `gizmo_changed` after them.

    `drawn` is what the last frame drew. A host that sets ``refine_in`` promises to draw again in so many seconds
    when asked by it: pictures then become finer frame by frame once nothing
    moves. Without it the picture at rest is drawn in full at once.

    Parameters
    ----------
    window : vtkRenderWindow
        On screen or off.
    request_render : callable
        Asks the host for a frame; may be called many times for one.
    renderer : vtkRenderer, optional
        The scene's renderer if the window has one already.
    scale : float
        Device pixels per logical pixel.
    """

    def __init__(
        self,
        window: vtkRenderWindow,
        request_render: Callable[[], None] = lambda: None,
        *,
        renderer: vtkRenderer | None = None,
        scale: float = 1.0,
    ):
        self._window = window
        self.request_render = request_render
        self.renderer = renderer or vtkRenderer()
        if renderer is None:
            window.AddRenderer(self.renderer)
        self._overlay, self._corner = vtkRenderer(), vtkRenderer()
        window.SetNumberOfLayers(max(3, window.GetNumberOfLayers()))
        for layer, each in enumerate((self.renderer, self._overlay, self._corner)):
            each.SetUseOIT(False)
            each.SetUseDepthPeeling(False)
            # The cullers would ask each actor for its bounds, which walks through all points.
            each.GetCullers().RemoveAllItems()
            if layer:
                each.SetLayer(layer)
                each.InteractiveOff()
                window.AddRenderer(each)
        self.splats = SplatScene(self.renderer, request_render, scale)
        self.camera = Camera(self.renderer)
        self.gizmo = Gizmo(scale=scale)
        self._gizmo_actor = GizmoActor(self.gizmo, self._overlay)
        self.markers = Markers(self._overlay)
        self.markers.set_size(_MARKER_PX * scale)
        self.rings = Rings(self._overlay)
        self.cage = CageOutline(self.rings)
        self.triad = AxesTriad(self._corner, scale)
        self.quality = QualityChooser(scale=scale)
        self.refine_in: Callable[[float], None] | None = None
        self._magnifier = Magnifier(self.renderer)
        self.drawn = FrameQuality(0)
        self._shown: tuple[object, ...] = ()
        self._rests_since = 0.0
        self._refined = 0
        self._motions = 0
        self._frame_start = 0.0
        self.set_background(*BACKGROUND)
        self._observed = [
            (self.renderer, self.renderer.AddObserver(vtkCommand.StartEvent, self._on_frame_started)),
            (self.renderer, self.renderer.AddObserver(vtkCommand.EndEvent, lambda *_: self._magnifier.end())),
            (window, window.AddObserver(vtkCommand.StartEvent, self._on_window_started)),
            (window, window.AddObserver(vtkCommand.EndEvent, self._on_window_ended)),
        ]

    def close(self) -> None:
        """Take everything out of the window and let go of it."""
        for subject, tag in self._observed:
            subject.RemoveObserver(tag)
        self._observed = []
        self.request_render = self.splats.request_render = lambda: None
        self.refine_in = None
        self._magnifier.close()
        self.splats.view_turned = None
        self.splats.clear()
        for part in (self._gizmo_actor, self.markers, self.rings, self.triad):
            part.close()
        for renderer in (self._overlay, self._corner):
            self._window.RemoveRenderer(renderer)

    def set_background(self, bottom: tuple[float, float, float], top: tuple[float, float, float]) -> None:
        """Colours 0..1 of the vertical gradient behind the scene."""
        self.renderer.SetGradientBackground(bottom != top)
        self.renderer.SetBackground(*bottom)
        self.renderer.SetBackground2(*top)
        self._background: tuple[float, float, float] = tuple((np.add(bottom, top) / 2.0).tolist())
        self.request_render()

    def set_scale(self, scale: float) -> None:
        """Device pixels per logical pixel, as when the window moves to another screen."""
        self.gizmo.scale = self.triad.scale = self.quality.scale = scale
        self.markers.set_size(_MARKER_PX * scale)
        self.splats.set_scale(scale)

    # Motion -------------------------------------------------------------------------------------------------------

    def begin_motion(self) -> None:
        """Something moves from here on: the picture gets coarser if the machine cannot draw all of it in time."""
        self._motions += 1

    def end_motion(self) -> None:
        """It rests: once nothing else moves, all of the picture is drawn."""
        self._motions = max(self._motions - 1, 0)
        if not self._motions:
            self.request_render()

    @property
    def is_moving(self) -> bool:
        """Between `begin_motion` and `end_motion`."""
        return self._motions > 0

    # Camera -------------------------------------------------------------------------------------------------------

    @property
    def projection(self) -> Projection:
        """The camera as it stands."""
        return self.camera.projection()

    def camera_moved(self) -> None:
        """The camera was moved: show it."""
        self.request_render()

    def show_place(self, place: Place, about: NDArray[np.float64] | None = None) -> None:
        """Show the scene put elsewhere, its axes in the corner and at the gizmo too; see `Camera.show_place`."""
        self.camera.show_place(place, about)
        self.triad.axes = place.rotation
        self.gizmo.world_axes, self.gizmo.unit = place.rotation.T, 1.0 / place.scale
        self.request_render()

    def reset_camera(self) -> None:
        """Look at the main subject from its home side: slightly from above, a quarter to the side."""
        actor = self.splats.shown
        if actor is None:
            return
        up = self.camera.world_up / np.linalg.norm(self.camera.world_up)
        side = np.eye(3)[np.argmin(np.abs(up))]
        toward = 0.55 * side + 0.80 * np.cross(side, up) + 0.38 * up
        axes = self.camera.axes
        toward, up = toward @ axes, up @ axes
        # Only its direction counts; far from the origin a step of one unit would be lost in rounding.
        toward *= max(1.0, float(np.abs(actor.origin).max()))
        home = replace(self.camera.home, position=actor.origin + toward, focal_point=actor.origin, view_up=up)
        self.camera.view = replace(home, is_parallel=self.camera.view.is_parallel)
        self.camera.view = self.camera.home = self.frame()
        self.request_render()

    def frame(self, rows: ArrayLike | None = None, *, room: float = 0.02) -> View:
        """View in which these splats fill the picture, or the main subject; fly there or assign `camera.view`.

        About the splats is some room, a share of the scene's extent.
        """
        actor = self.splats.shown
        if actor is None:
            return self.camera.view
        if rows is None:
            return self.camera.frame(self.splats.subject_points(), room=actor.reach)
        return self.camera.frame(actor.means[np.asarray(rows)] + actor.origin, room=room * actor.extent)

    def frame_everything(self) -> View:
        """View in which all splats are seen, far floaters too."""
        box = self.splats.bounds()
        return self.camera.view if box is None else self.camera.frame(box_corners(box))

    # Under the cursor ---------------------------------------------------------------------------------------------

    def pick(self, x: float, y: float) -> Hit | None:
        """The surface under a pixel, of the state that is shown."""
        actor = self.splats.shown
        return None if actor is None else surface_hit(actor, self.projection, x, y)

    def screen_points(self) -> NDArray[np.float32]:
        """(N, 3) where the splats are on the screen, for the regions below; hidden ones are NaN."""
        actor = self.splats.shown
        return np.empty((0, 3), np.float32) if actor is None else screen_points(actor, self.projection)

    def in_rectangle(self, screen: NDArray[np.float32], x0: float, y0: float, x1: float, y1: float) -> FileMask:
        """(N,) which `screen_points` lie between two corners."""
        return in_rectangle(screen, x0, y0, x1, y1)

    def in_lasso(self, screen: NDArray[np.float32], polygon: ArrayLike) -> FileMask:
        """(N,) which `screen_points` lie in a closed polygon (K, 2)."""
        return in_lasso(screen, polygon)

    def in_brush(self, screen: NDArray[np.float32], path: ArrayLike, radius_px: float) -> FileMask:
        """(N,) which `screen_points` lie within a radius of a stroke (K, 2)."""
        return in_brush(screen, path, radius_px)

    def visible_only(self, screen: NDArray[np.float32], inside: FileMask) -> FileMask:
        """Those of a region (N,) bool that no other splat hides."""
        actor = self.splats.shown
        return inside if actor is None else visible_only(actor, self.projection, screen, inside)

    def sight(self) -> Callable[[FileMask], FileMask]:
        """What tells, on any thread, which of some splats (N,) bool are in the picture as it is, and not hidden."""
        actor, projection = self.splats.shown, self.projection

        def seen(mask: FileMask) -> FileMask:
            if actor is None:
                return mask
            screen = screen_points(actor, projection)
            inside = mask & in_rectangle(screen, 0, 0, projection.width, projection.height)
            return visible_only(actor, projection, screen, inside)

        return seen

    # Marks --------------------------------------------------------------------------------------------------------

    def show_disc(self, rows: ArrayLike | None) -> None:
        """Let the splats that a click would take glow; None: no glow."""
        self.splats.highlight(rows)

    def gizmo_part(self, x: float, y: float) -> Part | None:
        """Part of the gizmo under the cursor."""
        return self.gizmo.hit(self.projection, x, y)

    def hover_gizmo(self, xy: tuple[float, float] | None) -> Part | None:
        """Light up the part of the gizmo under the cursor; None: the cursor is elsewhere."""
        part = None if xy is None else self.gizmo_part(*xy)
        if part != self.gizmo.hovered:
            self.gizmo.hovered = part
            self.request_render()
        return part

    def gizmo_changed(self) -> None:
        """The gizmo was attached, moved or detached: show it."""
        self.request_render()

    def hover_axes(self, xy: tuple[float, float] | None) -> NDArray[np.float64] | None:
        """Light up the end of the corner axes under the cursor: the axis (3,) to look from on a click."""
        before = self.triad.hovered
        axis = self.triad.hit(self.projection, *(xy or (np.nan, np.nan)))
        if self.triad.hovered != before:
            self.request_render()
        return axis

    # Frames -------------------------------------------------------------------------------------------------------

    def _on_frame_started(self, *_: object) -> None:
        box, actor = self.splats.bounds(of_drawn=self.is_moving), self.splats.deformed
        if box is not None and actor is not None:
            self.camera.fit_clipping(box, actor.subject.corners)
        projection = self.projection
        self.drawn = quality = self._next_quality(projection)
        # The projection is that of the whole window: what follows shrinks the renderer until its frame is done.
        self.splats.prepare(projection, quality, self._magnifier.begin(quality.coarseness), self._background)
        self._overlay_camera(projection)
        self.markers.set_viewport_size(projection.width, projection.height)
        self._gizmo_actor.refresh(projection)
        self.cage.refresh(projection)
        self.triad.refresh(projection)
        # Edges are smoothed in the picture at rest only: on a software renderer it costs half a frame.
        self._corner.SetUseFXAA(not self.is_moving and self.splats.mode is not DisplayMode.SPLATS)

    def _overlay_camera(self, projection: Projection) -> None:
        """The same camera with clipping planes of its own: marks may lie far outside of the scene."""
        camera = self._overlay.GetActiveCamera()
        camera.DeepCopy(self.camera.vtk)
        near, far = self.camera.vtk.GetClippingRange()
        reach = 10.0 * (far - near)
        camera.SetClippingRange(near - reach if projection.is_parallel else 1e-3 * max(near, 1e-6 * far), far + reach)

    def _on_window_started(self, *_: object) -> None:
        self._frame_start = perf_counter()

    def _on_window_ended(self, *_: object) -> None:
        actor = self.splats.deformed
        if actor is None:
            return
        self.quality.note(perf_counter() - self._frame_start, self.drawn)
        if self.refine_in and self.drawn != FrameQuality(actor.n_splats):
            if not self.is_moving:
                self.refine_in(0.0)
            elif self._refined == 0:
                self.refine_in(RESTS_AFTER_S)

    def _next_quality(self, projection: Projection) -> FrameQuality:
        """What the frame that starts draws: the coarser, the more lately what it shows has moved."""
        actor = self.splats.deformed
        if actor is None:
            return FrameQuality(0)
        now = perf_counter()
        size = projection.width, projection.height
        look = (self.splats.mode, self.splats.compare, actor, size)
        # Not the clipping planes: they follow from what is drawn.
        camera = projection.view_from_world.tobytes(), projection.clip_from_view[:2].tobytes()
        # Where another tint or a removal makes another picture, it need not be all of it at once.
        shows = (*look, *camera, actor.n_moves, actor.n_looks)
        if look != self._shown[: len(look)]:
            self.quality.forget()
        if shows != self._shown:
            self._shown, self._rests_since, self._refined = shows, now, 0
        elif not self.is_moving or now - self._rests_since >= RESTS_AFTER_S:
            self._refined += 1
        full = FrameQuality(actor.n_splats)
        if self.is_moving:
            return self.quality.choose(actor.by_contribution, REFINEMENT ** min(self._refined, 1))
        if self.refine_in is None:
            return full
        return self.quality.choose(actor.by_contribution, REFINEMENT ** (self._refined + 1))
