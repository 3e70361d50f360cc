"""The splats in the picture: the deformed ones, the original, and how they are shown."""

from collections.abc import Callable
from dataclasses import replace
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike, NDArray
from vtkmodules.vtkRenderingCore import vtkRenderer

from splap_editor.core.index_spaces import FileMask, FileRows, RowsByPlace
from splap_editor.core.splats.main_subject import MainSubject, main_subject
from splap_editor.viewport.contribution import Contribution
from splap_editor.viewport.depth_order import depth_order
from splap_editor.viewport.edge_lines import EdgeLines
from splap_editor.viewport.frame_quality import FrameQuality
from splap_editor.viewport.glyphs import Glyphs
from splap_editor.viewport.projection import Projection
from splap_editor.viewport.splat_actor import DisplayMode, SplatActor, SplatFlag, SplatLook

# Captured ellipses end where 1/255 of their opacity is left, far outside of what the eye takes for the surface:
# six tenths of it, without mere haze, reads as the object. Size 1 is the exact occupancy.
DEFAULT_LOOKS = {
    DisplayMode.ELLIPSES: SplatLook(DisplayMode.ELLIPSES, size_factor=0.6, opacity_cut=0.1),
    DisplayMode.SPLATS: SplatLook(DisplayMode.SPLATS),
    DisplayMode.POINTS: SplatLook(DisplayMode.POINTS, opacity_cut=0.1),
}
GHOST_TINT = (0.55, 0.70, 0.95, 0.75)
GHOST_COVERAGE = {DisplayMode.ELLIPSES: 0.32, DisplayMode.SPLATS: 0.12, DisplayMode.POINTS: 0.4}
_TURN_RAD = np.radians(0.5)
_MOVE_SHARE = 0.02


class Compare(Enum):
    """Which state of the scene is shown; BOTH draws the original as a ghost."""

    DEFORMED = "deformed"
    ORIGINAL = "original"
    BOTH = "both"


class SplatScene:
    """The deformed splats and, for comparison, the original, in one renderer.

    Rows are in file order throughout. Whatever changes the picture asks for
    a frame.

    Parameters
    ----------
    renderer : vtkRenderer
        Where the actors go.
    request_render : callable
        Asks the host for a frame.
    scale : float
        Device pixels per logical pixel.
    """

    def __init__(self, renderer: vtkRenderer, request_render: Callable[[], None], scale: float = 1.0):
        self._renderer = renderer
        self.request_render = request_render
        self._scale = scale
        self.view_turned: Callable[[Projection], None] | None = None
        self.deformed: SplatActor | None = None
        self.edges: EdgeLines | None = None
        self._original: SplatActor | None = None
        self._original_colors: NDArray[np.uint8] | None = None
        self._rest: Glyphs | None = None
        self._subject: MainSubject | None = None
        self._subject_rows: FileRows | None = None
        self._removed: FileMask | None = None
        self._flags = np.zeros(0, np.uint8)
        self._highlighted: FileRows | None = None
        self._looks = dict(DEFAULT_LOOKS)
        self._mode = DisplayMode.SPLATS
        self._compare = Compare.DEFORMED
        self._seen: Projection | None = None
        self._needs_order = True

    # Data ---------------------------------------------------------------------------------------------------------

    def load(
        self,
        glyphs: Glyphs,
        colors: NDArray[np.uint8],
        subject: MainSubject | None = None,
        by_contribution: Contribution | None = None,
    ) -> None:
        """Show a new scene, at rest: its glyphs and colours (N, 4) uint8, in file order. The camera stays.

        The main subject, and which splats give most, are found here where the caller does not know them.
        """
        self.clear()
        if not len(glyphs.means):
            return
        self._rest, self._removed = glyphs, None
        subject = subject or main_subject(glyphs.means, np.asarray(colors[:, 3], np.float64) / 255.0)
        self.deformed = SplatActor(glyphs, colors, subject, by_contribution)
        self._subject, self._subject_rows = subject, None
        self._renderer.AddActor(self.deformed.actor)
        self._flags = np.zeros(self.deformed.n_splats, np.uint8)
        self.edges = EdgeLines(self.deformed, self._renderer)
        self._needs_order = True
        self._apply_looks()

    def set_subject(self, subject: MainSubject, removed: FileMask | None) -> None:
        """Frame and clip by another subject of the same scene, and without the splats that are removed (N,)."""
        if self.deformed is None or self._rest is None:
            return
        self._subject, self._subject_rows = subject, None
        for actor in (self.deformed, self._original):
            if actor is not None:
                actor.set_subject(subject, removed)
        self._removed = removed
        self.request_render()

    def clear(self) -> None:
        """Show no scene."""
        if self.edges:
            self.edges.close()
        for actor in (self.deformed, self._original):
            if actor:
                self._renderer.RemoveActor(actor.actor)
        self.deformed = self.edges = self._original = self._rest = self._seen = self._highlighted = None
        self._original_colors = None
        self.request_render()

    @property
    def _loaded(self) -> SplatActor:
        """The deformed splats, for who asks only while there is a scene."""
        assert self.deformed is not None
        return self.deformed

    def move(
        self,
        means: NDArray[np.floating],
        axes_u: NDArray[np.floating],
        axes_v: NDArray[np.floating],
        *,
        thickness: NDArray[np.floating] | None = None,
        order: RowsByPlace | None = None,
    ) -> None:
        """Show deformed splats: centres and 1-sigma axes (N, 3); ``order``: their `depth_order`, if known."""
        self._loaded.set_geometry(means, axes_u, axes_v, thickness)
        if order is not None:
            self.set_order(order)
        else:
            self._needs_order = True
        self.request_render()

    def set_colors(self, colors: NDArray[np.uint8]) -> None:
        """Overwrite colours and opacities (N, 4) of the deformed splats, as after a turn of the view."""
        self._loaded.set_colors(colors)
        self.request_render()

    def set_original_colors(self, colors: NDArray[np.uint8] | None) -> None:
        """Say which colours (N, 4) uint8 the original has; None: those that the deformed splats have."""
        self._original_colors = colors
        if self._original is not None and colors is not None:
            self._original.set_colors(colors)

    def set_tints(self, tints: NDArray[np.uint8] | None) -> None:
        """Lay colours (N, 4) uint8, the fourth their share, over the deformed splats: handles, free and fixed."""
        self._loaded.set_tints(tints)
        self.request_render()

    def set_flags(self, flags: NDArray[np.uint8]) -> None:
        """Overwrite the state (N,) of `SplatFlag` bits: selected, hidden, highlighted."""
        if not np.array_equal(flags, self._flags):
            self._flags = np.array(flags, np.uint8)
            self._upload_flags()

    def highlight(self, rows: ArrayLike | None) -> None:
        """Let these rows glow, and no others, as under the cursor; set apart from `set_flags`."""
        self._highlighted = None if rows is None else np.asarray(rows)
        self._upload_flags()

    def _upload_flags(self) -> None:
        if self.deformed is None:
            return
        flags = self._flags
        if self._highlighted is not None:
            flags = flags.copy()
            flags[self._highlighted] |= np.uint8(SplatFlag.HIGHLIGHTED)
        self.deformed.set_flags(flags)
        if self._original:
            self._original.set_flags(self._flags)
        self.request_render()

    def set_order(self, order: RowsByPlace) -> None:
        """Take a `depth_order` that the worker made for the deformed splats."""
        self._loaded.set_order(order)
        self._needs_order = False
        self.request_render()

    @property
    def has_original(self) -> bool:
        """Whether there is the original to compare with, so that it wants an order too."""
        return self._original is not None

    @property
    def original(self) -> SplatActor | None:
        """The splats at rest, once they have been compared with."""
        return self._original

    def set_original_order(self, order: RowsByPlace) -> None:
        """Take a `depth_order` that the worker made for the original."""
        if self._original:
            self._original.set_order(order)
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
        """Settings of the mode shown; each mode keeps its own. Assign ``replace(scene.look, size_factor=…)``."""
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

    def _apply_looks(self) -> None:
        if self.deformed is None or self._rest is None:
            return
        is_both = self._compare is Compare.BOTH
        if self._compare is not Compare.DEFORMED and self._original is None:
            shown = self.deformed
            colors = shown.base_colors if self._original_colors is None else self._original_colors
            self._original = SplatActor(self._rest, colors, shown.subject, shown.by_contribution)
            self._original.set_subject(shown.subject, self._removed)
            self._original.set_flags(self._flags)
            # Blended actors are drawn in the order they were added: the ghost first, under the deformed splats.
            self._renderer.RemoveActor(self.deformed.actor)
            self._renderer.AddActor(self._original.actor)
            self._renderer.AddActor(self.deformed.actor)
            self._seen = None
        look = replace(self.look, point_size_px=self.look.point_size_px * self._scale)
        self.deformed.look = look
        self.deformed.actor.SetVisibility(self._compare is not Compare.ORIGINAL)
        if self._original:
            ghost = replace(look, ghost_tint=GHOST_TINT, coverage=GHOST_COVERAGE[self._mode])
            self._original.look = ghost if is_both else look
            self._original.actor.SetVisibility(self._compare is not Compare.DEFORMED)
        self.request_render()

    def set_scale(self, scale: float) -> None:
        """Device pixels per logical pixel."""
        self._scale = scale
        self._apply_looks()

    def shown_actors(self) -> list[SplatActor]:
        """The actors in the picture."""
        return [actor for actor in (self._original, self.deformed) if actor and actor.actor.GetVisibility()]

    @property
    def shown(self) -> SplatActor | None:
        """The actor that is picked: the original if it is shown alone."""
        return self._original if self._compare is Compare.ORIGINAL else self.deformed

    def bounds(self, *, of_drawn: bool = False) -> NDArray[np.float64] | None:
        """(2, 3) box around all that is shown, or what of it is drawn; None without a scene."""
        boxes = [actor.bounds(of_drawn=of_drawn) for actor in self.shown_actors()]
        return np.array([np.min(boxes, axis=0)[0], np.max(boxes, axis=0)[1]]) if boxes else None

    def subject_points(self) -> NDArray[np.float64]:
        """(n, 3) where the main subject and its sparser parts are in the picture, world units; none without a scene."""
        actor = self.shown
        if actor is None or self._subject is None or self._rest is None:
            return np.empty((0, 3))
        # Looked for when they are wanted: after a removal nobody waits for them.
        if self._subject_rows is None:
            self._subject_rows = _rows_seen(self._subject, self._rest.means, self._loaded.reach)
        return actor.means[self._subject_rows] + actor.origin

    def prepare(
        self,
        projection: Projection,
        quality: FrameQuality,
        size: tuple[int, int],
        background: tuple[float, float, float],
    ) -> None:
        """Bring uniforms, quality and drawing order up to the picture that comes next, drawn at a size in pixels."""
        if self.deformed is None or self.edges is None:
            return
        actors = [actor for actor in (self.deformed, self._original) if actor]
        for actor in actors:
            actor.set_viewport_size(*size)
            actor.set_quality(quality)
        self._follow_turn(projection, self.deformed)
        if self._mode is DisplayMode.SPLATS:
            for actor in actors:
                actor.sort_few(projection.direction)
        self.edges.background = background
        self.edges.refresh(projection, quality)

    def _follow_turn(self, projection: Projection, deformed: SplatActor) -> None:
        """Sort again, and tell the host, when the view has turned far enough to show."""
        direction = projection.direction
        seen = self._seen
        has_turned = seen is None or bool(seen.direction @ direction < np.cos(_TURN_RAD))
        if seen is not None and not has_turned and not projection.is_parallel:
            # A near eye that moves sees splats from new sides though it does not turn.
            distance = np.linalg.norm(projection.eye - deformed.origin)
            has_turned = bool(np.linalg.norm(projection.eye - seen.eye) > _MOVE_SHARE * distance)
        if has_turned:
            self._seen = projection
            if self.view_turned:
                self.view_turned(projection)
        if self._mode is not DisplayMode.SPLATS:
            return
        needs_order = self._needs_order or (has_turned and not self.view_turned)
        if deformed.is_thinned:
            # The few have an order of their own; that of all can wait until they are drawn.
            self._needs_order = needs_order
            return
        if needs_order:
            deformed.set_order(depth_order(deformed.means, direction))
            self._needs_order = False
        if self._original and (needs_order or self._original.order is None):
            self._original.set_order(depth_order(self._original.means, direction))


def _rows_seen(subject: MainSubject, means: NDArray[np.floating], reach: float) -> FileRows:
    """Splats that a picture of the subject is framed by."""
    return np.flatnonzero((subject.seen or subject).holds(means, room=reach))
