"""The inspected splat, its neighbours and the inspected edge, marked in the picture."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.index_spaces import FileRow, FileRows, Nodes, RowPair
from splap_editor.session.neighbor_sets import NeighborComparison, compared, neighbor_set
from splap_editor.session.scene import Scene
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.session.session import Session
from splap_editor.session.signals import Signal
from splap_editor.viewport.scene_view import SceneView

FIRST_COLOR, SECOND_COLOR, BOTH_COLOR = (86, 180, 233), (230, 159, 0), (245, 245, 245)
"""Blue and orange of Okabe and Ito, white for what both sets have."""

MARK_SHARE = 225
LINE_PX = 1.6
_RINGS = ("picked", "edge", "edge ends", "first", "second", "both")


@dataclass(frozen=True)
class InspectOptions:
    """Whose neighbours are shown.

    Parameters
    ----------
    kind, other : str
        Keys of `NEIGHBOR_KINDS`; ``other`` may be empty.
    k : int
        How many, where the kind does not say itself.
    """

    kind: str = "graph"
    other: str = ""
    k: int = 10


class InspectView:
    """Follows the picked splat and the pose.

    `changed` tells that something else is inspected, or that the graph is another.

    Parameters
    ----------
    session : Session
    view : SceneView
        Where marks are made.
    """

    def __init__(self, session: Session, view: SceneView) -> None:
        self.changed = Signal()
        self.options = InspectOptions()
        self.comparison: NeighborComparison | None = None
        self.edge: RowPair | None = None
        self.more_edges: Callable[[], FileRows] = lambda: np.empty((0, 2), np.int64)
        self._is_on = False
        self._session = session
        self._view = view
        SceneFollower(
            session,
            self._on_scene_changed,
            picked_changed=self._update,
            surface_changed=self._update,
            pose_changed=self._draw_lines,
        )

    @property
    def is_on(self) -> bool:
        """Whether marks are made."""
        return self._is_on

    @is_on.setter
    def is_on(self, on: bool) -> None:
        self._is_on = on
        self._update()

    def set(self, **values: Any) -> None:
        """Change whose neighbours are shown."""
        self.options = replace(self.options, **values)
        self._update()

    def pick(self, row: FileRow | None) -> None:
        """Inspect a splat, or none; an edge that was inspected is let go."""
        scene = self._session.shown_scene
        self.edge = None
        if row == scene.picked:
            self._update()
        else:
            scene.set_picked(row)

    def pick_edge(self, rows: RowPair | None) -> None:
        """Inspect a pair of splats, or none."""
        self.edge = rows
        self._update()

    def neighbor_edges(self) -> FileRows:
        """(E, 2) file rows of the picked splat and each of its neighbours that are shown."""
        scene, both = self._session.scene, self.comparison
        if scene is None or both is None:
            return np.empty((0, 2), np.int64)
        near = scene.ellipses.rows[np.concatenate([both.first, both.only_second])]
        return np.column_stack([np.full(len(near), scene.picked), near])

    # Following the scene ------------------------------------------------------------------------------------------

    def _on_scene_changed(self) -> None:
        self.edge = self.comparison = None
        self._update()

    def _update(self) -> None:
        scene = self._session.scene
        if scene is None:
            return
        self.comparison = self._compare(scene)
        self._mark(scene)
        self._draw_lines()
        self.changed.emit()

    def _compare(self, scene: Scene) -> NeighborComparison | None:
        surface, options = scene.surface, self.options
        node = -1 if scene.picked is None else int(scene.ellipses.node_of_row[scene.picked])
        if surface is None or node < 0:
            return None

        def near(kind: str) -> Nodes:
            return neighbor_set(kind, node, scene.ellipses, surface.graph, surface.neighborhoods, k=options.k)

        first = near(options.kind)
        return compared(first, near(options.other) if options.other else first)

    def _mark(self, scene: Scene) -> None:
        marks = []
        if self._is_on and scene.picked is not None:
            for nodes, color in self._groups():
                marks.append((scene.ellipses.rows[nodes], (*color, MARK_SHARE)))
            marks.append((np.array([scene.picked]), (255, 255, 255, 255)))
        self._view.mark(marks)

    def _groups(self) -> list[tuple[Nodes, tuple[int, int, int]]]:
        """Neighbours and their colours."""
        both = self.comparison
        if both is None:
            return []
        if not self.options.other:
            return [(both.first, FIRST_COLOR)]
        return [(both.common, BOTH_COLOR), (both.only_first, FIRST_COLOR), (both.only_second, SECOND_COLOR)]

    def _draw_lines(self) -> None:
        scene, rings = self._session.scene, self._view.viewport.rings
        for name in _RINGS:
            rings.hide(name)
        if not self._is_on or scene is None:
            return
        if scene.picked is not None:
            start = np.asarray(scene.positions[scene.picked], np.float64)
            rings.show("picked", [ellipse_loop(scene, scene.picked)], (1.0, 1.0, 1.0), width_px=2.0)
            for name, (nodes, color) in zip(("both", "first", "second"), self._groups(), strict=False):
                ends = np.asarray(scene.positions, np.float64)[scene.ellipses.rows[nodes]]
                lines = [np.stack([start, end]) for end in ends]
                rgb = (color[0] / 255.0, color[1] / 255.0, color[2] / 255.0)
                rings.show(name, lines, rgb, width_px=LINE_PX, is_closed=False)
        if self.edge is not None:
            ends = np.asarray(scene.positions, np.float64)[list(self.edge)]
            rings.show("edge", [ends], (1.0, 1.0, 1.0), width_px=3.0, is_closed=False)
            rings.show("edge ends", [ellipse_loop(scene, row) for row in self.edge], (1.0, 0.9, 0.4), width_px=2.0)
        self._view.viewport.request_render()


def ellipse_loop(scene: Scene, row: FileRow, n_points: int = 72) -> NDArray[np.float64]:
    """(n_points, 3) rim of a splat's occupancy ellipse where it is on screen; its centre alone if it is inert."""
    node = int(scene.ellipses.node_of_row[row])
    center = np.asarray(scene.positions[row], np.float64)
    if node < 0:
        return center[None]
    axes = scene.ellipses.semi_axes[node]
    if scene.kernels is not None:
        axes = scene.ellipses.cutoffs[node] * scene.kernels.axes_f32[row].astype(np.float64)
    angles = np.linspace(0.0, 2.0 * np.pi, n_points, endpoint=False)
    return center + np.cos(angles)[:, None] * axes[0] + np.sin(angles)[:, None] * axes[1]
