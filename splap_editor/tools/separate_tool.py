"""Taking two parts apart where they touch, by a stroke over each."""

from dataclasses import replace

import numpy as np

from splap_editor.core.graph.options import Point, Separation
from splap_editor.session.jobs import Job
from splap_editor.session.latest_job import LatestJob
from splap_editor.session.mends import edges_between, with_cut
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.session.seam_preview import FoundSeam, found_seam
from splap_editor.tools.bindings import Binding
from splap_editor.tools.tool import KeyEvent, PointerEvent, Tool, ToolContext

MOST_POINTS = 16
"""Places that a stroke keeps."""

WIDEST = 24
PART_COLORS = ((0.34, 0.71, 0.91), (0.90, 0.62, 0.0))
SEAM_COLOR = (1.0, 0.25, 0.25)
_PART_RINGS = ("separate a", "separate b")
_SEAM_RING = "separate seam"


class PartStroke:
    """A line over one part."""

    def __init__(self, tool: "SeparateTool", press: PointerEvent) -> None:
        self.tool = tool
        self.path = [press.xy]

    def move(self, event: PointerEvent) -> None:
        """Draw on."""
        if event.xy != self.path[-1]:
            self.path.append(event.xy)
            self.tool.context.hud.show(outline=tuple(self.path))

    def end(self, event: PointerEvent) -> None:
        """Take what lies under the line as one part."""
        self.move(event)
        self.tool.context.hud.clear()
        places = np.unique(np.linspace(0, len(self.path) - 1, MOST_POINTS).round().astype(int))
        self.tool.take_part([self.path[place] for place in places])

    def cancel(self) -> None:
        """Draw nothing."""
        self.tool.context.hud.clear()


class SeparateTool(Tool):
    """A stroke or click on each of two parts shows the seam between them; Return cuts it, Escape drops it.

    With nothing pointed at, Return takes the selection apart from the rest.
    """

    name = "separate"

    def __init__(self, context: ToolContext) -> None:
        super().__init__(context)
        self.parts: tuple[tuple[Point, ...], ...] = ()
        self.rows: tuple[tuple[int, ...], ...] = ()
        self.wider = 0
        self.seam: FoundSeam | None = None
        self._job = LatestJob(context.session.detail_worker, "seam", failed=self._on_failed)
        # A seam of another graph, or where splats no longer are, would mislead.
        SceneFollower(context.session, self.drop, surface_changed=self._ask, pose_changed=self._draw)

    # Pointing -----------------------------------------------------------------------------------------------------

    def draw(self, press: PointerEvent) -> PartStroke:
        """Begin a line over a part."""
        return PartStroke(self, press)

    def place(self, event: PointerEvent) -> None:
        """Point at a part by one place on it."""
        self.take_part([event.xy])

    def take_part(self, path: list[tuple[float, float]]) -> None:
        """Take the splats under some pixels as the next part; after two, begin anew."""
        scene, viewport = self.context.session.shown_scene, self.context.viewport
        hits = [hit for hit in (viewport.pick(*xy) for xy in path) if hit is not None]
        rows = tuple(dict.fromkeys(hit.row for hit in hits))
        if not rows:
            return
        if len(self.parts) == 2:
            self.drop()
        # At rest, whatever the pose: there the stroke is read again.
        means = np.asarray(scene.splats.means, np.float64)[list(rows)]
        self.parts += (tuple((float(x), float(y), float(z)) for x, y, z in means),)
        self.rows += (rows,)
        self._ask()

    # Deciding -----------------------------------------------------------------------------------------------------

    def widen(self, event: KeyEvent) -> bool:
        """Cut a seam more, or one fewer."""
        if len(self.parts) < 2:
            return False
        self.wider = int(np.clip(self.wider + (1 if event.key == "BracketRight" else -1), -WIDEST, WIDEST))
        self._ask()
        return True

    def cut(self, event: KeyEvent) -> bool:
        """Cut the seam that is shown, or between the selection and the rest: one step of the history."""
        session = self.context.session
        scene = session.scene
        if scene is None or scene.surface is None:
            return False
        graph = scene.edit.graph
        if not self.parts and scene.selection.any():
            pairs = edges_between(scene.ellipses, scene.surface.graph, scene.selection, ~scene.selection)
            wanted = with_cut(graph, pairs)
        elif self.seam is not None and len(self.seam.rows):
            wanted = replace(graph, separate=(*graph.separate, self.seam.stroke))
        else:
            return bool(self.parts)
        self.drop()
        if wanted != graph:
            session.steps.change_edit(scene.edit.with_options(wanted), "Separate")
        return True

    def let_go(self, event: KeyEvent) -> bool:
        """Forget both parts."""
        had = bool(self.parts)
        self.drop()
        return had

    def drop(self) -> None:
        """Forget both parts, and show no seam."""
        self._job.drop()
        self.parts, self.rows, self.wider, self.seam = (), (), 0, None
        self._draw()

    def cancel(self) -> None:
        """Drop the stroke under way and what is pointed at."""
        super().cancel()
        self.drop()

    # Showing ------------------------------------------------------------------------------------------------------

    def _ask(self) -> None:
        """Look for the seam in the background, once both parts are known."""
        self.seam = None
        self._draw()
        scene = self.context.session.scene
        if len(self.parts) < 2 or scene is None or scene.surface is None:
            return
        first, second = self.parts
        stroke, surface = Separation(first, second, self.wider), scene.surface

        def make(job: Job) -> FoundSeam:
            return found_seam(surface, stroke)

        def take(seam: FoundSeam) -> None:
            is_wanted = (seam.stroke.a, seam.stroke.b) == self.parts and seam.stroke.wider == self.wider
            if is_wanted and self.context.session.scene is scene and scene.surface is surface:
                self.seam = seam
                self._draw()

        self._job.ask(make, take)

    def _on_failed(self, error: Exception) -> None:
        self.drop()
        self.context.hud.show(text=str(error))

    def _draw(self) -> None:
        scene, rings = self.context.session.scene, self.context.viewport.rings
        for name in (*_PART_RINGS, _SEAM_RING):
            rings.hide(name)
        text = ""
        if scene is not None and self.parts:
            positions = np.asarray(scene.positions, np.float64)
            for name, rows, color in zip(_PART_RINGS, self.rows, PART_COLORS, strict=False):
                # A place alone is drawn as its own short line.
                line = positions[list(rows)] if len(rows) > 1 else positions[[rows[0], rows[0]]]
                rings.show(name, [line], color, width_px=5.0, is_closed=False)
            text = "Point at the other part" if len(self.parts) < 2 else "Looking for the seam …"
            if self.seam is not None:
                text = self._show_seam(self.seam, positions)
        self.context.hud.show(text=text)
        self.context.viewport.request_render()

    def _show_seam(self, seam: FoundSeam, positions: np.ndarray) -> str:
        """Draw a seam; what to say of it."""
        if not len(seam.rows):
            return "Nothing joins the two parts"
        contacts = positions[seam.rows]
        middles = contacts.mean(axis=1)
        lines = [*contacts, *middles[seam.line]]
        self.context.viewport.rings.show(_SEAM_RING, lines, SEAM_COLOR, width_px=2.5, is_closed=False)
        n = len(seam.rows)
        return f"Seam {seam.length:.3g} long, {n:,} contact{'' if n == 1 else 's'} · Return cuts · [ ] narrower, wider"

    bindings = (
        Binding(("Drag",), draw, "A stroke over one part, then over the other", "stroke over each part"),
        Binding(("Click",), place, "One place on a part instead of a stroke", on="the surface"),
        Binding(("[", "]"), widen, "Narrower or wider seam", "narrower, wider"),
        Binding(("Return", "Enter"), cut, "Cut the seam, or between selection and the rest", "cut"),
        Binding(("Esc",), let_go, "Forget both parts", "forget"),
    )
