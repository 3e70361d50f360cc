"""Selecting splats like the picked one, everywhere or as a flood along the surface."""

from typing import ClassVar

import numpy as np

from splap_editor.session.jobs import Job
from splap_editor.session.latest_job import LatestJob
from splap_editor.session.likeness import LikenessOptions, alike
from splap_editor.session.selection import SelectionMode
from splap_editor.tools.select_tool import SelectTool, picking
from splap_editor.tools.tool import PointerEvent, ToolContext


class SimilarTool(SelectTool):
    """A click selects what is like the splat under it; a drag looks around.

    Found in the background: a flood over a million splats takes a while.
    """

    name = "similar"
    option_kinds: ClassVar[tuple[type, ...]] = (LikenessOptions,)

    def __init__(self, context: ToolContext) -> None:
        super().__init__(context)
        self._likeness = context.held(LikenessOptions)
        self._job = LatestJob(context.session.detail_worker, self.name, failed=self._on_failed)

    def cancel(self) -> None:
        """Select nothing more."""
        super().cancel()
        self._job.drop()

    def take(self, event: PointerEvent, mode: SelectionMode) -> None:
        """Select what is like the splat under the pointer; beside the object, nothing."""
        session, options = self.context.session, self._likeness.value
        scene, hit = session.shown_scene, self.context.viewport.pick(*event.xy)
        self._job.drop()
        if hit is None:
            self.select(np.zeros_like(scene.selection), mode)
            return
        # Ellipses and graph belong together; before the graph is there, those of the scene do.
        surface = scene.surface
        ellipses, graph = (scene.ellipses, None) if surface is None else (surface.ellipses, surface.graph)
        splats, row = scene.splats, hit.row

        def make(job: Job) -> np.ndarray:
            return alike(splats, ellipses, graph, row, options)

        def done(found: np.ndarray) -> None:
            if session.scene is scene:
                self.context.hud.show()
                self.select(found & ~scene.unseen, mode)

        self._job.ask(make, done)

    def _on_failed(self, error: Exception) -> None:
        self.context.hud.show(text=str(error))

    bindings = picking(take, "The splats like the one under the pointer", "the like", gesture="Click")
