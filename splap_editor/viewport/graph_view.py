"""The splat graph over the splats: which edges are drawn, and what their colours mean."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.graph.ellipse_offset import normal_offsets
from splap_editor.core.index_spaces import FileRows
from splap_editor.engine.surface import Surface
from splap_editor.session.jobs import Job
from splap_editor.session.latest_job import LatestJob
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.session.session import Session
from splap_editor.session.signals import Signal
from splap_editor.viewport.colormaps import label_colors, mapped_colors, shares
from splap_editor.viewport.edge_lines import edges_within_hops
from splap_editor.viewport.scene_view import SceneView

EDGE_COLORS = {"length": "Length", "offset": "Offset δ", "component": "Component"}
"""What edges are coloured by, and words for it."""

SHOWN = ("off", "near", "all")
WIDTHS_PX = {"near": 2.0, "all": 1.0}
"""Width of edges: a few may be bold, many must leave room for each other."""
_CHUNK = 32768


@dataclass(frozen=True)
class GraphViewOptions:
    """Which edges are drawn, and how.

    Parameters
    ----------
    shown : str
        ``"off"``, ``"near"`` (around the selection and the inspected splat) or ``"all"``.
    hops : int
        So many steps from the selection.
    color : str
        Key of `EDGE_COLORS`.
    """

    shown: str = "off"
    hops: int = 2
    color: str = "length"


@dataclass(frozen=True, eq=False)
class ColoredEdges:
    """All edges of a surface, coloured.

    Parameters
    ----------
    surface : Surface
    color : str
    rows : (E, 2) int64
        File rows.
    colors : (E, 3) uint8
    low, high : float
        Ends of the colour map in world units; NaN for components.
    """

    surface: Surface
    color: str
    rows: FileRows
    colors: NDArray[np.uint8]
    low: float
    high: float


def colored_edges(surface: Surface, color: str, job: Job) -> ColoredEdges:
    """Colour every edge of a surface by length, smaller offset or component; for the worker."""
    graph, ellipses = surface.graph, surface.ellipses
    pairs = graph.edges
    rows = ellipses.rows[pairs]
    if color == "component":
        labels = graph.components[pairs[:, 0]].astype(np.float64)
        return ColoredEdges(surface, color, rows, label_colors(labels), np.nan, np.nan)
    if color == "offset":
        values = np.empty(len(pairs))
        for start in range(0, len(pairs), _CHUNK):
            job.report(start / len(pairs))
            chunk = slice(start, start + _CHUNK)
            values[chunk] = normal_offsets(ellipses, pairs[chunk]).min(axis=1)
        low, high = 0.0, graph.epsilon
        places = shares(np.minimum(values, 1e300), low, high)
        return ColoredEdges(surface, color, rows, mapped_colors(places, "magma"), low, high)
    starts = np.repeat(np.arange(graph.n_nodes), graph.degrees)
    lengths = graph.lengths[starts < graph.indices]
    low, high = np.quantile(lengths, (0.01, 0.99)) if len(lengths) else (1.0, 1.0)
    places = shares(lengths, low, high, is_log=True)
    return ColoredEdges(surface, color, rows, mapped_colors(places, "viridis"), float(low), float(high))


class GraphView:
    """Draws the edges of the splat graph as its options say.

    `changed` tells of other edges, options or a new graph.

    Parameters
    ----------
    session : Session
    view : SceneView
        Where edges are drawn.
    """

    def __init__(self, session: Session, view: SceneView) -> None:
        self.changed = Signal()
        self.options = GraphViewOptions()
        self.colored: ColoredEdges | None = None
        self.rows: FileRows = np.empty((0, 2), np.int64)
        self._session = session
        self._view = view
        self._job = LatestJob(session.detail_worker, "edges")
        SceneFollower(
            session,
            self._on_scene_changed,
            surface_changed=self._update,
            hidden_changed=self._update,
            removed_changed=self._update,
            selection_changed=self._on_selection_changed,
            picked_changed=self._on_selection_changed,
        )

    def set(self, **values: Any) -> None:
        """Change some options."""
        options = replace(self.options, **values)
        if options != self.options:
            self.options = options
            self._update()

    @property
    def n_shown(self) -> int:
        """Edges that are drawn, or would be if there were room for all."""
        return len(self.rows)

    def _on_scene_changed(self) -> None:
        self.colored = None
        self._update()

    def _on_selection_changed(self) -> None:
        if self.options.shown == "near":
            self._draw()

    def _update(self) -> None:
        scene, options = self._session.scene, self.options
        surface = scene.surface if scene is not None else None
        if scene is None or surface is None or options.shown == "off":
            self._job.drop()
            self._draw()
            return
        made = self.colored
        if made is not None and made.surface is surface and made.color == options.color:
            self._draw()
            return

        def done(colored: ColoredEdges) -> None:
            if self._session.scene is scene and scene.surface is surface:
                self.colored = colored
                self._draw()

        self._job.ask(lambda job: colored_edges(surface, options.color, job), done)

    def _draw(self) -> None:
        scene, lines = self._session.scene, self._view.viewport.splats.edges
        self.rows = np.empty((0, 2), np.int64)
        made = self.colored
        if scene is not None and made is not None and made.surface is scene.surface and self.options.shown != "off":
            wanted = ~scene.unseen[made.rows].any(axis=1)
            if self.options.shown == "near":
                around = scene.selection.copy()
                if scene.picked is not None:
                    around[scene.picked] = True
                rows = np.flatnonzero(around)
                wanted &= edges_within_hops(made.rows, rows, self.options.hops, len(around))
            self.rows = made.rows[wanted]
            colors = made.colors[wanted]
        if lines is not None:
            if len(self.rows):
                width = WIDTHS_PX[self.options.shown] * self._view.viewport.gizmo.scale
                lines.show(self.rows, colors, width)
            else:
                lines.hide()
            self._view.viewport.request_render()
        self.changed.emit()
