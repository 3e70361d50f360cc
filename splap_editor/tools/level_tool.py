"""Setting the whole object level: by a floor that is clicked, or by three points of it."""

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.floor import REACH, Floor, floor_plane
from splap_editor.core.index_spaces import FileRows
from splap_editor.core.place import fitted_plane, laid_level, recentred_on
from splap_editor.session.jobs import Job
from splap_editor.session.latest_job import LatestJob
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.tools.bindings import Binding
from splap_editor.tools.tool import KeyEvent, PointerEvent, Tool, ToolContext
from splap_editor.viewport.gizmo import Claim
from splap_editor.viewport.overlays import circle

FLOOR_TINT = (79, 179, 255, 150)
_COLOR = (1.0, 0.8, 0.3)
_RING = "level"


class LevelTool(Tool):
    """A click finds the floor about it and shows the object standing on it; Return takes it, Escape leaves."""

    name = "level"

    def __init__(self, context: ToolContext) -> None:
        super().__init__(context)
        self.points: list[NDArray[np.float64]] = []
        self._is_shown = self._is_asked = False
        self._job = LatestJob(context.session.detail_worker, self.name, cancels=True, failed=self._on_failed)
        SceneFollower(context.session, self._forget, edit_changed=self._forget)

    @property
    def is_looking(self) -> bool:
        """Whether a floor is being looked for, wanted or not."""
        return self._job.is_busy

    @property
    def claim(self) -> Claim:
        """No gizmo: a handle that is moved would drop the preview."""
        return Claim(None)

    def fit(self, event: PointerEvent) -> None:
        """Level by the floor about the pointer, once it is found: that takes looking at all splats."""
        viewport, scene = self.context.viewport, self.context.session.shown_scene
        hit = viewport.pick(*event.xy)
        if hit is None:
            return
        reach = REACH * scene.ellipses.scene_scale
        positions, seen_of, edit = scene.positions, viewport.sight(), scene.edit
        self.leave()
        self.context.hud.show(text="Looking for the floor …")

        def make(job: Job) -> tuple[FileRows, Floor]:
            rows = np.flatnonzero(seen_of(np.linalg.norm(positions - hit.point, axis=1) <= reach))
            return rows, floor_plane(np.asarray(positions[rows], np.float64), reach)

        def take(found: tuple[FileRows, Floor]) -> None:
            if self.context.session.scene is scene and scene.edit is edit:
                self._show_floor(*found, reach)

        self._is_asked = True
        self._job.ask(make, take)

    def _show_floor(self, rows: FileRows, floor: Floor, reach: float) -> None:
        tints = np.zeros((self.context.session.shown_scene.splats.n_splats, 4), np.uint8)
        tints[rows[floor.inside]] = FLOOR_TINT
        self.context.paint(tints)
        n = int(np.count_nonzero(floor.inside))
        self._show(floor.middle, floor.normal, reach, f"Floor of {n:,} of {len(rows):,} splats in front")

    def _on_failed(self, error: Exception) -> None:
        self.leave()
        self.context.hud.show(text=str(error))

    def add(self, event: PointerEvent) -> None:
        """Take one of three points."""
        hit = self.context.viewport.pick(*event.xy)
        if hit is None:
            return
        if not self.points or len(self.points) == 3:
            self.leave()
        self.points.append(hit.point)
        reach = REACH * self.context.session.shown_scene.ellipses.scene_scale
        if len(self.points) < 3:
            self._draw([circle(point, hit.normal, 0.1 * reach) for point in self.points])
            left = 3 - len(self.points)
            self.context.hud.show(text=f"{left} more point{'s' if left > 1 else ''} of the floor · Esc leaves")
            return
        try:
            middle, normal = fitted_plane(np.array(self.points))
        except ValueError as error:
            self.leave()
            self.context.hud.show(text=str(error))
            return
        self._show(middle, normal, reach, "Floor through three points")

    def take(self, event: KeyEvent) -> bool:
        """Keep what is shown, and look at it: the turn may have taken it out of the picture."""
        had = self._is_shown or self._is_asked or bool(self.points)
        if self._is_shown:
            self.context.session.drag.commit("Level object")
            self.context.fly_to(self.context.viewport.frame())
        return had

    def let_go(self, event: KeyEvent) -> bool:
        """Leave the object as it was."""
        had = self._is_shown or self._is_asked or bool(self.points)
        self.leave()
        return had

    def cancel(self) -> None:
        """Leave the object as it was."""
        super().cancel()
        self.leave()

    def leave(self) -> None:
        """Drop points and preview."""
        was_shown = self._is_shown
        self._forget()
        if was_shown:
            self.context.session.drag.cancel()

    def _forget(self) -> None:
        """Show none of it: the edit is another one, or will be."""
        self._job.drop()
        had = self._is_shown or self._is_asked or bool(self.points)
        self._is_shown, self._is_asked, self.points = False, False, []
        if had:
            self.context.viewport.rings.hide(_RING)
            self.context.paint(None)
            self.context.hud.show()
            self.context.viewport.request_render()

    def _show(self, middle: NDArray[np.float64], normal: NDArray[np.float64], reach: float, found: str) -> None:
        session, viewport = self.context.session, self.context.viewport
        scene = session.shown_scene
        before = recentred_on(scene.edit.place, scene.ellipses.subject.center)
        # The side that is seen is the upper one.
        place = laid_level(before, middle, normal, np.array(scene.up), viewport.projection.eye)
        turned = np.clip((np.trace(place.rotation @ before.rotation.T) - 1.0) / 2.0, -1.0, 1.0)
        self._is_shown = True
        session.drag.preview_place(place)
        stem = 0.5 * reach * np.array(scene.up) @ place.rotation
        self._draw([circle(middle, normal, reach), np.array([middle, middle + stem])])
        degrees = np.degrees(np.arccos(turned))
        self.context.hud.show(text=f"{found}, {degrees:.1f}° off level · Return levels it, Esc leaves")

    def _draw(self, loops: list[NDArray[np.float64]]) -> None:
        self.context.viewport.rings.show(_RING, loops, _COLOR)
        self.context.viewport.request_render()

    bindings = (
        Binding(("Click",), fit, "Find the floor here and show the object on it", "level by it", on="a floor"),
        Binding(("Shift+Click",), add, "One of three points of the floor", "three points", on="a floor"),
        Binding(("Return", "Enter"), take, "Level the object as shown", "take it"),
        Binding(("Esc",), let_go, "Leave the object as it was", "leave"),
    )
