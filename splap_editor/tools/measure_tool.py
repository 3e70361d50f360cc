"""Measuring between two splats, straight and along the surface; the true length typed scales the object."""

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.index_spaces import FileRow
from splap_editor.core.place import placed_points, recentred_on, sized
from splap_editor.engine.measure import Measured, measured
from splap_editor.session.latest_job import LatestJob
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.tools.bindings import Binding
from splap_editor.tools.tool import KeyEvent, PointerEvent, Tool, ToolContext
from splap_editor.viewport.overlays import circle

GRAB_PX = 12.0
_LINE, _ENDS, _PATH = "measure", "measure ends", "measure path"
_COLOR, _PATH_COLOR = (1.0, 0.8, 0.3), (0.45, 0.8, 1.0)


class EndStroke:
    """Drags one end from splat to splat."""

    def __init__(self, tool: "MeasureTool", end: int) -> None:
        self._tool, self._end, self._before = tool, end, tool.rows[end]

    def move(self, event: PointerEvent) -> None:
        """Put the end on the splat under the pointer; beside the object it stays."""
        hit = self._tool.context.viewport.pick(*event.xy)
        if hit is not None:
            self._tool.put(self._end, hit.row)

    def end(self, event: PointerEvent) -> None:
        """Leave it there."""
        self.move(event)

    def cancel(self) -> None:
        """Put it back."""
        if self._end < len(self._tool.rows):
            self._tool.put(self._end, self._before)


class MeasureTool(Tool):
    """Two clicks measure, a third begins anew; the numbers follow what is dragged."""

    name = "measure"

    def __init__(self, context: ToolContext) -> None:
        super().__init__(context)
        self.rows: list[FileRow] = []
        self.found: Measured | None = None
        self._typed = ""
        self._why = ""
        self._job = LatestJob(context.session.detail_worker, self.name, cancels=True, failed=self._on_failed)
        SceneFollower(
            context.session,
            self.forget,
            pose_changed=self._measure,
            edit_changed=self._show,
            preview_changed=self._show,
            surface_changed=self._measure,
        )

    @property
    def ends(self) -> NDArray[np.float64]:
        """(k, 3) where the splats are on screen, in the file's coordinates."""
        return np.asarray(self.context.session.shown_scene.positions, np.float64)[self.rows].reshape(-1, 3)

    @property
    def straight(self) -> float:
        """Length between both splats in the units of the placed object."""
        ends = placed_points(self.ends, self.context.session.shown_scene.shown_edit.place)
        return float(np.linalg.norm(ends[1] - ends[0]))

    def pick(self, event: PointerEvent) -> None:
        """Take an end."""
        hit = self.context.viewport.pick(*event.xy)
        if hit is None:
            return
        if len(self.rows) == 2:
            self.rows = []
        self.put(len(self.rows), hit.row)

    def put(self, end: int, row: FileRow) -> None:
        """Put an end on a splat."""
        if self.rows[end : end + 1] != [row]:
            self.rows[end : end + 1] = [row]
            self._typed = ""
            self._measure()

    def pull(self, event: PointerEvent) -> EndStroke | bool:
        """Begin to drag an end."""
        if not self.rows:
            return False
        apart = np.linalg.norm(self.context.viewport.projection.pixels(self.ends) - np.array(event.xy), axis=1)
        near = int(np.argmin(apart))
        return EndStroke(self, near) if apart[near] <= GRAB_PX * self.context.viewport.gizmo.scale else False

    def enter(self, event: KeyEvent) -> bool:
        """Take one more character of the true length, or one less.

        Never left to the shortcuts: a digit too early would change the display, a Backspace too many delete handles.
        """
        if self.context.session.scene is None:
            return False
        if len(self.rows) < 2:
            self.context.hud.show(text="Click both ends, then type the true length")
            return True
        self._typed = self._typed[:-1] if event.key == "Backspace" else self._typed + event.text
        self._show()
        return True

    def take(self, event: KeyEvent) -> bool:
        """Scale the object so that its two splats are as far apart as typed."""
        if len(self.rows) < 2 or not self._typed:
            return False
        session = self.context.session
        scene = session.shown_scene
        place = recentred_on(scene.edit.place, scene.ellipses.subject.center)
        try:
            place = sized(place, self.ends[0], self.ends[1], float(self._typed))
        except ValueError as error:
            self._typed = ""
            self.context.hud.show(text=f"The size stays: {error}")
            return True
        self._typed = ""
        session.steps.change_place(place, "Set true size")
        self._show()
        return True

    def let_go(self, event: KeyEvent) -> bool:
        """Forget what was typed, then both ends."""
        had = bool(self.rows)
        if self._typed:
            self._typed = ""
            self._show()
        else:
            self.forget()
            self.context.hud.show()
        return had

    def cancel(self) -> None:
        """Measure nothing."""
        super().cancel()
        self.forget()

    def forget(self) -> None:
        """Show no measure."""
        self._job.drop()
        had, self.rows, self.found, self._typed = bool(self.rows), [], None, ""
        if had:
            for name in (_LINE, _ENDS, _PATH):
                self.context.viewport.rings.hide(name)
            self.context.hud.show()
            self.context.viewport.request_render()

    # Along the surface, aside ---------------------------------------------------------------------------------------

    def _measure(self) -> None:
        """Show the straight line at once, and have the way along the surface looked for."""
        if not self.rows:
            return
        self.found, self._why = None, ""
        scene = self.context.session.shown_scene
        if len(self.rows) == 2 and scene.surface is not None:
            a, b = self.rows
            surface, kernels = scene.surface, scene.kernels
            positions = None if kernels is None else kernels.means
            ellipses, graph = surface.ellipses, surface.graph
            self._job.ask(lambda job: measured(ellipses, graph, a, b, positions=positions), self._take_found)
        self._show()

    def _take_found(self, found: Measured) -> None:
        if len(self.rows) == 2:
            self.found = found
            self._show()

    def _on_failed(self, error: Exception) -> None:
        self._why = str(error)
        self._show()

    # Drawing --------------------------------------------------------------------------------------------------------

    def _show(self) -> None:
        if not self.rows or self.context.session.scene is None:
            return
        scene, rings = self.context.session.shown_scene, self.context.viewport.rings
        ends, size = self.ends, 0.006 * scene.ellipses.scene_scale
        rings.show(_ENDS, [circle(end, axis, size) for end in ends for axis in np.eye(3)], _COLOR, width_px=2.0)
        rings.show(_LINE, [ends], _COLOR, width_px=2.0, is_closed=False)
        path = [] if self.found is None else [np.asarray(scene.positions, np.float64)[self.found.path]]
        rings.show(_PATH, path, _PATH_COLOR, width_px=3.0, is_closed=False)
        self.context.hud.show(text=self._words())
        self.context.viewport.request_render()

    def _words(self) -> str:
        if len(self.rows) < 2:
            return "Click the other end · Esc clears"
        if self._typed:
            return f"{self.straight:.5g} becomes [{self._typed}] · Return scales the whole object, Esc leaves"
        scale = self.context.session.shown_scene.shown_edit.place.scale
        if self._why:
            along = self._why
        elif self.found is None:
            along = "along the surface …"
        elif np.isfinite(self.found.along):
            along = f"along the surface {scale * self.found.along:.5g}"
        else:
            along = "no way along the surface"
        return f"Straight {self.straight:.5g} · {along} · type the true length to scale the object"

    bindings = (
        Binding(("Click",), pick, "Measure from this splat, to that one", "an end", on="a splat"),
        Binding(("Drag",), pull, "Measure to elsewhere", "move it", on="an end", at_once=True),
        Binding(("Any+Number", "Backspace"), enter, "The true length between the ends", "true length"),
        Binding(("Return", "Enter"), take, "Scale the whole object to the true length", "scale"),
        Binding(("Esc",), let_go, "Forget the number, then the ends", "clear"),
    )
