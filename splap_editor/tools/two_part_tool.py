"""Pointing at two parts by a stroke or a click each: what separating and joining have in common."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np

from splap_editor.core.graph.options import Joint, Point, Separation
from splap_editor.core.index_spaces import FileRow
from splap_editor.engine.surface import Surface
from splap_editor.session.jobs import Job
from splap_editor.session.latest_job import LatestJob
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.tools.tool import KeyEvent, PointerEvent, Tool, ToolContext

MOST_POINTS = 16
"""Places that a stroke keeps."""

PART_COLORS = ((0.34, 0.71, 0.91), (0.90, 0.62, 0.0))


class PartStroke:
    """A line over one part."""

    def __init__(self, tool: "TwoPartTool", press: PointerEvent) -> None:
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


class TwoPartTool(Tool, ABC):
    """Two parts are pointed at; what would be done to them is found in the background and shown.

    `found` has the `stroke` it was found for; it is None while that is looked for.
    """

    looking: ClassVar[str] = ""
    color: ClassVar[tuple[float, float, float]]

    def __init__(self, context: ToolContext) -> None:
        super().__init__(context)
        self.parts: tuple[tuple[Point, ...], ...] = ()
        self.rows: tuple[tuple[FileRow, ...], ...] = ()
        self.found: Any = None
        self._is_shown = False
        self._job = LatestJob(context.session.detail_worker, self.name, failed=self._on_failed)
        # What was found in another graph, or is drawn where splats no longer are, would mislead.
        SceneFollower(context.session, self.drop, surface_changed=self.ask, pose_changed=self._draw)

    @abstractmethod
    def wanted(self) -> Separation | Joint:
        """The stroke that both parts make."""

    @abstractmethod
    def finder(self) -> Callable[[Surface, Any], Any]:
        """Find, on the worker, what a stroke does to a surface."""

    @abstractmethod
    def shown(self, found: Any, positions: np.ndarray) -> tuple[list[np.ndarray], str]:
        """Lines to draw over the splats at their positions (N, 3) for what was found, and what to say of it."""

    # Pointing -----------------------------------------------------------------------------------------------------

    def draw(self, press: PointerEvent) -> PartStroke:
        """Begin a line over a part."""
        return PartStroke(self, press)

    def place(self, event: PointerEvent) -> None:
        """Point at a part by one place on it."""
        self.take_part([event.xy])

    def take_part(self, path: list[tuple[float, float]]) -> None:
        """Take the splats under some pixels as the next part; after two, begin anew."""
        hits = [hit for hit in (self.context.viewport.pick(*xy) for xy in path) if hit is not None]
        rows = tuple(dict.fromkeys(hit.row for hit in hits))
        if rows:
            self.take_rows(rows)

    def take_rows(self, *parts: tuple[int, ...]) -> None:
        """Take some file rows as the next part or parts."""
        if len(self.parts) + len(parts) > 2:
            self.drop()
        means = self.context.session.shown_scene.splats.means
        for rows in parts:
            # At rest, whatever the pose: there the stroke is read again.
            points = np.asarray(means[list(rows)], np.float64)
            self.parts += (tuple((float(x), float(y), float(z)) for x, y, z in points),)
        self.rows += parts
        self.ask()

    def let_go(self, event: KeyEvent) -> bool:
        """Forget both parts."""
        had = bool(self.parts)
        self.drop()
        return had

    def drop(self) -> None:
        """Forget both parts, and show nothing."""
        self._job.drop()
        self.parts, self.rows, self.found = (), (), None
        self._draw()

    def cancel(self) -> None:
        """Drop the stroke under way and what is pointed at."""
        super().cancel()
        self.drop()

    # Showing ------------------------------------------------------------------------------------------------------

    def ask(self) -> None:
        """Look for what would be done, once both parts are known."""
        self.found = None
        self._draw()
        scene = self.context.session.scene
        if len(self.parts) < 2 or scene is None or scene.surface is None:
            return
        stroke, surface, find = self.wanted(), scene.surface, self.finder()

        def make(job: Job) -> Any:
            return find(surface, stroke)

        def take(found: Any) -> None:
            is_wanted = len(self.parts) == 2 and self.wanted() == stroke
            if is_wanted and self.context.session.scene is scene and scene.surface is surface:
                self.found = found
                self._draw()

        self._job.ask(make, take)

    def _on_failed(self, error: Exception) -> None:
        self.drop()
        self.context.hud.show(text=str(error))

    def _draw(self) -> None:
        # What other tools say is theirs.
        if not self.parts and not self._is_shown:
            return
        self._is_shown = bool(self.parts)
        scene, rings = self.context.session.scene, self.context.viewport.rings
        part_rings = (f"{self.name} a", f"{self.name} b")
        found_ring = f"{self.name} found"
        for name in (*part_rings, found_ring):
            rings.hide(name)
        text = ""
        if scene is not None and self.parts:
            positions = np.asarray(scene.positions, np.float64)
            for name, rows, color in zip(part_rings, self.rows, PART_COLORS, strict=False):
                # A place alone is drawn as its own short line.
                line = positions[list(rows)] if len(rows) > 1 else positions[[rows[0], rows[0]]]
                rings.show(name, [line], color, width_px=5.0, is_closed=False)
            text = "Point at the other part" if len(self.parts) < 2 else self.looking
            if self.found is not None:
                lines, text = self.shown(self.found, positions)
                if lines:
                    rings.show(found_ring, lines, self.color, width_px=2.5, is_closed=False)
        self.context.hud.show(text=text)
        self.context.viewport.request_render()
