"""The disc of surface under the pointer, that a click makes a handle or a pin."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace

import numpy as np

from splap_editor.core.handle_nodes import Region
from splap_editor.core.options import option
from splap_editor.core.pose import Pose
from splap_editor.session.placement import disc_rows, held_pose, rows_region
from splap_editor.tools.bindings import Binding
from splap_editor.tools.tool import Held, KeyEvent, PointerEvent, Tool, ToolContext

REACH_STEP = 1.15
REACH_RANGE = (0.002, 0.5)


@dataclass(frozen=True)
class DiscOptions:
    """Size of the disc.

    Parameters
    ----------
    reach : float
        Its radius on the surface, in units of the scene scale.
    """

    reach: float = option(
        0.03,
        "Radius of the disc on the surface, of the size of the scene; [ and ] change it too.",
        label="Reach",
        least=REACH_RANGE[0],
        most=REACH_RANGE[1],
        unit="of s",
        is_percent=True,
        step=0.005,
    )


class DiscTool(Tool, ABC):
    """Lights up the disc that a click takes; a drag, wherever it starts, moves the camera."""

    def __init__(self, context: ToolContext) -> None:
        super().__init__(context)
        self._hovered: tuple[int, float] = (-1, 0.0)
        self._reach: Held[DiscOptions] = context.held(self.option_kinds[0])
        self._reach.changed.connect(self._show)

    @property
    def radius_world(self) -> float:
        """Radius of the disc in world units."""
        return self._reach.value.reach * self.context.session.shown_scene.ellipses.scene_scale

    def hover(self, event: PointerEvent) -> bool:
        """Show the disc."""
        hit = self.context.viewport.pick(*event.xy)
        self._light((-1, 0.0) if hit is None else (hit.row, self._reach.value.reach))
        return False

    def left(self) -> None:
        """Show no disc."""
        self._light((-1, 0.0))

    def cancel(self) -> None:
        """Place nothing."""
        super().cancel()
        self.left()

    def place(self, event: PointerEvent) -> None:
        """Make the disc under the pointer what the tool makes."""
        hit, scene = self.context.viewport.pick(*event.xy), self.context.session.shown_scene
        if hit is not None:
            region = rows_region(scene, disc_rows(scene, hit.row, self.radius_world))
            self.left()
            self.take(region, held_pose(scene, region))

    @abstractmethod
    def take(self, region: Region, pose: Pose) -> None:
        """Make something of a region, whose splats have been moved by a pose."""

    def resize(self, event: PointerEvent | KeyEvent) -> None:
        """Change the reach by a wheel notch or a key."""
        if isinstance(event, KeyEvent):
            steps = 1.0 if event.key == "BracketRight" else -1.0
        else:
            steps = event.steps
        options = self._reach.value
        reach = float(np.clip(options.reach * REACH_STEP**steps, *REACH_RANGE))
        self._reach.set(replace(options, reach=reach))

    def _show(self) -> None:
        if self._hovered[0] >= 0 and self.context.session.scene is not None:
            self._light((self._hovered[0], self._reach.value.reach))

    def _light(self, hovered: tuple[int, float]) -> None:
        if hovered != self._hovered:
            self._hovered = hovered
            session, row = self.context.session, hovered[0]
            disc = None if row < 0 else disc_rows(session.shown_scene, row, self.radius_world)
            self.context.viewport.show_disc(disc)


RESIZE = Binding(("Ctrl+Wheel", "[", "]"), DiscTool.resize, "Reach of the next one", "reach")
