"""The picture: splats, their original, marks over them, and the camera that looks at them."""

from collections.abc import Callable
from dataclasses import replace
from enum import Enum
from time import perf_counter

import numpy as np
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401 - registers the OpenGL implementations
from numpy.typing import ArrayLike, NDArray
from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow

from splap_editor.viewport.axes_triad import AxesTriad
from splap_editor.viewport.camera import Camera
from splap_editor.viewport.depth_order import depth_order
from splap_editor.viewport.edge_lines import EdgeLines
from splap_editor.viewport.gizmo import Gizmo
from splap_editor.viewport.gizmo_actor import GizmoActor
from splap_editor.viewport.glyphs import Glyphs
from splap_editor.viewport.overlays import Markers, Rings
from splap_editor.viewport.picking import Hit, surface_hit
from splap_editor.viewport.projection import Projection
from splap_editor.viewport.regions import screen_points, visible_only
from splap_editor.viewport.splat_actor import DisplayMode, SplatActor, SplatLook
from splap_editor.viewport.thinning import Thinning

# Captured ellipses end where 1/255 of their opacity is left, far outside of what the eye takes for the surface:
# six tenths of it, without mere haze, reads as the object. Size 1 is the exact occupancy.
DEFAULT_LOOKS = {
    DisplayMode.ELLIPSES: SplatLook(DisplayMode.ELLIPSES, size_factor=0.6, opacity_cut=0.1),
    DisplayMode.SPLATS: SplatLook(DisplayMode.SPLATS),
    DisplayMode.POINTS: SplatLook(DisplayMode.POINTS, opacity_cut=0.1),
}
GHOST_TINT = (0.55, 0.70, 0.95, 0.75)
GHOST_COVERAGE = {DisplayMode.ELLIPSES: 0.32, DisplayMode.SPLATS: 0.12, DisplayMode.POINTS: 0.4}
BACKGROUND = ((0.085, 0.088, 0.095), (0.150, 0.155, 0.165))
_TURN_RAD = np.radians(0.5)


class Compare(Enum):
    """Which state of the scene is shown; BOTH draws the original as a ghost."""

    DEFORMED = "deformed"
    ORIGINAL = "original"
    BOTH = "both"


class Viewport:
    """Everything drawn in one render window.

    It never renders: whatever changes the picture calls ``request_render``,
    and the host draws when it likes. All positions on the screen are device
    pixels from the top left corner. Only for the thread of the window.

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
        self.view_turned: Callable[[Projection], None] | None = None
        self.thinning = Thinning()
        self.splats: SplatActor | None = None
        self.edges: EdgeLines | None = None
        self._original: SplatActor | None = None
        self._rest: Glyphs | None = None
        self._looks = dict(DEFAULT_LOOKS)
        self._mode = DisplayMode.SPLATS
        self._compare = Compare.DEFORMED
        self._motions = 0
        self._sorted_for: NDArray[np.float64] | None = None
        self._needs_order = True

        self.renderer = renderer or vtkRenderer()
        if renderer is None:
            window.AddRenderer(self.renderer)
        self.renderer.SetUseOIT(False)
        self.renderer.SetUseDepthPeeling(False)
        # The cullers would ask each actor for its bounds, which walks through all points.
        self.renderer.GetCullers().RemoveAllItems()
        self._overlay, self._corner = vtkRenderer(), vtkRenderer()
        window.SetNumberOfLayers(max(3, window.GetNumberOfLayers()))
        for layer, renderer_over in enumerate((self._overlay, self._corner), start=1):
            renderer_over.SetLayer(layer)
            renderer_over.InteractiveOff()
            renderer_over.SetUseOIT(False)
            window.AddRenderer(renderer_over)
        self.camera = Camera(self.renderer)
        self.gizmo = Gizmo(scale=scale)
        self._gizmo_actor = GizmoActor(self.gizmo, self._overlay)
        self.markers = Markers(self._overlay)
        self.rings = Rings(self._overlay)
        self.triad = AxesTriad(self._corner, scale)
        self.scale = scale
        self.set_background(*BACKGROUND)
        self._observed = [
            (self.renderer, self.renderer.AddObserver("StartEvent", self._on_frame_started)),
            (window, window.AddObserver("StartEvent", self._on_window_started)),
            (window, window.AddObserver("EndEvent", self._on_window_ended)),
        ]
        self._frame_start = 0.0

    def close(self) -> None:
        """Take everything out of the window and let go of it."""
        for subject, tag in self._observed:
            subject.RemoveObserver(tag)
        self._observed = []
        self.clear()
        for part in (self._gizmo_actor, self.markers, self.rings, self.triad):
            part.close()
        for renderer in (self._overlay, self._corner):
            self._window.RemoveRenderer(renderer)

    # Scene --------------------------------------------------------------------------------------------------------

    def load(self, glyphs: Glyphs, colors: NDArray[np.uint8]) -> None:
        """Show a new scene, at rest: its glyphs and colours (N, 4) uint8, in file order. The camera stays."""
        self.clear()
        if not len(glyphs.means):
            return
        self._rest = glyphs
        self.splats = SplatActor(glyphs, colors)
        self.renderer.AddActor(self.splats.actor)
        self.edges = EdgeLines(self.splats, self.renderer)
        self._needs_order = True
        self._apply_looks()

    def clear(self) -> None:
        """Show no scene."""
        if self.edges:
            self.edges.close()
        for actor in (self.splats, self._original):
            if actor:
                self.renderer.RemoveActor(actor.actor)
        self.splats = self.edges = self._original = self._rest = self._sorted_for = None
        self.request_render()

    def move_splats(
        self,
        means: NDArray[np.floating],
        axes_u: NDArray[np.floating],
        axes_v: NDArray[np.floating],
        *,
        thickness: NDArray[np.floating] | None = None,
        order: NDArray[np.int32] | None = None,
    ) -> None:
        """Show deformed splats: centres and 1-sigma axes (N, 3); ``order`` is their `depth_order` if the worker sorted."""
        self.splats.set_geometry(means, axes_u, axes_v, thickness)
        if order is not None:
            self.set_order(order)
        else:
            self._needs_order = True
        self.request_render()

    def set_colors(self, colors: NDArray[np.uint8]) -> None:
        """Overwrite colours and opacities (N, 4) of the deformed splats, as after a turn of the view."""
        self.splats.set_colors(colors)
        self.request_render()

    def set_tints(self, tints: NDArray[np.uint8] | None) -> None:
        """Lay colours (N, 4) uint8, the fourth their share, over the deformed splats: handles, free and fixed."""
        self.splats.set_tints(tints)
        self.request_render()

    def set_flags(self, flags: NDArray[np.uint8]) -> None:
        """Overwrite the state (N,) of `SplatFlag` bits: selected, hidden, highlighted."""
        self.splats.set_flags(flags)
        if self._original:
            self._original.set_flags(flags)
        self.request_render()

    def set_order(self, order: NDArray[np.int32]) -> None:
        """Take a `depth_order` that the worker made for the deformed splats."""
        self.splats.set_order(order)
        self._needs_order = False
        self.request_render()

    # Display ------------------------------------------------------------------------------------------------------

    @property
    def mode(self) -> DisplayMode:
        """Ellipses, splats or points."""
        return self._mode

    @mode.setter
    def mode(self, mode: DisplayMode) -> None:
        self._mode = mode
        self._needs_order = True
        self._apply_looks()

    @property
    def look(self) -> SplatLook:
        """Settings of the mode shown; each mode keeps its own. Assign ``replace(viewport.look, size_factor=…)``."""
        return self._looks[self._mode]

    @look.setter
    def look(self, look: SplatLook) -> None:
        self._looks[look.mode] = look
        self.mode = look.mode

    @property
    def compare(self) -> Compare:
        """Deformed splats, the original, or both."""
        return self._compare

    @compare.setter
    def compare(self, compare: Compare) -> None:
        self._compare = compare
        self._apply_looks()

    def set_background(self, bottom: tuple[float, float, float], top: tuple[float, float, float]) -> None:
        """Colours 0..1 of the vertical gradient behind the scene."""
        self.renderer.SetGradientBackground(bottom != top)
        self.renderer.SetBackground(*bottom)
        self.renderer.SetBackground2(*top)
        self._background = tuple(np.add(bottom, top) / 2.0)
        self.request_render()

    def _apply_looks(self) -> None:
        if self.splats is None:
            return
        is_both = self._compare is Compare.BOTH
        if self._compare is not Compare.DEFORMED and self._original is None:
            self._original = SplatActor(self._rest, self.splats.colors)
            self._original.set_flags(self.splats.flags)
            # Blended actors are drawn in the order they were added: the ghost first, under the deformed splats.
            self.renderer.RemoveActor(self.splats.actor)
            self.renderer.AddActor(self._original.actor)
            self.renderer.AddActor(self.splats.actor)
            self._sorted_for = None
        look = replace(self.look, point_size_px=self.look.point_size_px * self.scale)
        self.splats.look = look
        self.splats.actor.SetVisibility(self._compare is not Compare.ORIGINAL)
        if self._original:
            ghost = replace(look, ghost_tint=GHOST_TINT, coverage=GHOST_COVERAGE[self._mode])
            self._original.look = ghost if is_both else look
            self._original.actor.SetVisibility(self._compare is not Compare.DEFORMED)
        self.request_render()

    def shown_actors(self) -> list[SplatActor]:
        """The actors in the picture."""
        return [actor for actor in (self._original, self.splats) if actor and actor.actor.GetVisibility()]

    # Motion -------------------------------------------------------------------------------------------------------

    def begin_motion(self) -> None:
        """Something moves from here on: splats are left out if the machine cannot draw all of them in time."""
        self._motions += 1

    def end_motion(self) -> None:
        """It rests: once nothing else moves, all splats are drawn."""
        self._motions = max(self._motions - 1, 0)
        if not self._motions:
            self.request_render()

    @property
    def is_moving(self) -> bool:
        """Between `begin_motion` and `end_motion`."""
        return self._motions > 0

    # Camera -------------------------------------------------------------------------------------------------------

    def projection(self) -> Projection:
        """The camera as it stands."""
        return self.camera.projection()

    def reset_camera(self) -> None:
        """Look at the whole scene from its home side: slightly from above, a quarter to the side."""
        if self.splats is None:
            return
        up = self.camera.world_up / np.linalg.norm(self.camera.world_up)
        side = np.eye(3)[np.argmin(np.abs(up))]
        toward = 0.55 * side + 0.80 * np.cross(side, up) + 0.38 * up
        center = self.splats.origin
        self.camera.view = replace(self.camera.home, position=center + toward, focal_point=center, view_up=up)
        self.camera.view = self.camera.frame(self._core_points(), margin=0.85)
        self.request_render()

    def frame_rows(self, rows: ArrayLike | None = None) -> None:
        """Fill the picture with these splats, or with the scene without its far floaters."""
        if self.splats is None:
            return
        points = self._core_points() if rows is None else self.splats.means[np.asarray(rows)] + self.splats.origin
        self.camera.view = self.camera.frame(points)
        self.request_render()

    def _core_points(self) -> NDArray[np.float64]:
        shown = self._shown
        return np.percentile(shown.means, [0.5, 99.5], axis=0) + shown.origin

    # Under the cursor ---------------------------------------------------------------------------------------------

    @property
    def _shown(self) -> SplatActor:
        return self._original if self._compare is Compare.ORIGINAL else self.splats

    def pick(self, x: float, y: float) -> Hit | None:
        """The surface under a pixel, of the state that is shown."""
        return surface_hit(self._shown, self.projection(), x, y) if self.splats else None

    def screen_points(self) -> NDArray[np.float32]:
        """(N, 3) where the splats are on the screen, for the functions of `regions`; hidden ones are NaN."""
        return screen_points(self._shown, self.projection()) if self.splats else np.empty((0, 3), np.float32)

    def visible_only(self, screen: NDArray[np.float32], inside: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Those of a region (N,) bool that no other splat hides."""
        return visible_only(self._shown, self.projection(), screen, inside) if self.splats else inside

    # Frames -------------------------------------------------------------------------------------------------------

    def _on_frame_started(self, *_: object) -> None:
        width, height = self.renderer.GetSize()
        projection = self.projection()
        if self.splats:
            box = self.splats.bounds()
            if self._original and self._compare is not Compare.DEFORMED:
                original = self._original.bounds()
                box = np.array([np.minimum(box[0], original[0]), np.maximum(box[1], original[1])])
            self.camera.fit_clipping(box)
            projection = self.projection()
            k = self.thinning.choose(self.splats.n_splats) if self.is_moving else 1
            for actor in (self.splats, self._original):
                if actor:
                    actor.set_viewport_size(width, height)
                    actor.set_thinning(k)
            self._follow_turn(projection)
            self.edges.background = self._background
            self.edges.refresh(projection)
        self._overlay_camera(projection)
        self.markers.set_viewport_size(width, height)
        self._gizmo_actor.refresh(projection)
        self.triad.refresh(projection)
        # Edges are smoothed in the picture at rest only: on a software renderer it costs half a frame.
        self._corner.SetUseFXAA(not self.is_moving and self._mode is not DisplayMode.SPLATS)

    def _follow_turn(self, projection: Projection) -> None:
        """Sort again, and tell the host, when the view has turned far enough to show."""
        direction = projection.direction
        has_turned = self._sorted_for is None or self._sorted_for @ direction < np.cos(_TURN_RAD)
        if has_turned:
            self._sorted_for = direction.copy()
            if self.view_turned:
                self.view_turned(projection)
        if self._mode is not DisplayMode.SPLATS:
            return
        if self._needs_order or (has_turned and not self.view_turned):
            self.splats.set_order(depth_order(self.splats.means, direction))
            self._needs_order = False
        if self._original and has_turned:
            self._original.set_order(depth_order(self._original.means, direction))

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
        if self.splats:
            self.thinning.note(perf_counter() - self._frame_start, self.splats.n_drawn)
