"""Looking into a scene: quantities in colours, one splat or edge, the splat graph."""

from collections.abc import Callable

from PySide6.QtWidgets import QWidget

from splap_editor.core.index_spaces import FileRows
from splap_editor.session.graph_preview import GraphPreview
from splap_editor.session.pose_check import PoseCheck
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.session.session import Session
from splap_editor.session.signals import Signal
from splap_editor.tools.inspect_tool import InspectTool
from splap_editor.tools.probe_tool import ProbeTool
from splap_editor.tools.tool import ToolContext
from splap_editor.tools.tool_manager import ToolManager
from splap_editor.ui.actions.actions import ActionSet
from splap_editor.ui.actions.graph_actions import GraphActions
from splap_editor.ui.panels.check_panel import CheckPanel
from splap_editor.ui.panels.graph_panel import GraphPanel
from splap_editor.ui.panels.inspect_panel import InspectPanel
from splap_editor.ui.panels.quantity_panel import QuantityPanel
from splap_editor.ui.panels.section import bring_into_view
from splap_editor.ui.widgets.plain_text import PlainLabel
from splap_editor.ui.widgets.quantity_legend import QuantityLegend
from splap_editor.viewport.camera import View
from splap_editor.viewport.graph_view import GraphView
from splap_editor.viewport.inspect_view import InspectView
from splap_editor.viewport.quantity_view import QuantityView
from splap_editor.viewport.scene_view import SceneView


class Inspection:
    """Makes and wires all that shows why a scene bends as it does.

    `changed` tells that other actions can be used than before.

    Parameters
    ----------
    session : Session
    view : SceneView
    context : ToolContext
    tools : ToolManager
    viewport : QWidget
        Where legends go.
    say : callable
        Tells the person what was done.
    fly_to : callable
        Brings the camera to a view.
    """

    def __init__(
        self,
        session: Session,
        view: SceneView,
        context: ToolContext,
        tools: ToolManager,
        viewport: QWidget,
        *,
        say: Callable[[str], None],
        fly_to: Callable[[View], None],
    ) -> None:
        self.changed = Signal()
        self._session = session
        self._view = view
        self._tools = tools
        self._fly_to = fly_to
        tool = tools.tools["inspect"]
        assert isinstance(tool, InspectTool)
        self.quantities = QuantityView(session, view)
        self.inspected: InspectView = context.inspected
        self.graph_view = GraphView(session, view)
        self.inspected.more_edges = lambda: self.graph_view.rows
        self.preview, self.edge_preview = GraphPreview(session), GraphPreview(session)
        self.graph_actions = GraphActions(session, self.graph_view, self.inspected, say)
        tool.cut_asked.connect(self.graph_actions.cut_edge)
        self.probe = ProbeTool(context)
        tools.stand(self.probe)
        self._make_widgets(session, viewport)
        self._connect(session)
        self._show_value()

    def _make_widgets(self, session: Session, viewport: QWidget) -> None:
        self.legend = QuantityLegend(self.quantities, viewport)
        self.read_out = PlainLabel()
        self.quantity_panel = QuantityPanel(session, self.quantities)
        self.inspect_panel = InspectPanel(session, self.inspected, self.edge_preview)
        self.inspect_panel.edge_toggled.connect(self.graph_actions.toggle_edge)
        self.graph_panel = GraphPanel(session, self.graph_view, self.preview)
        self.graph_panel.component_chosen.connect(self.look_at)
        self.pose_check = PoseCheck(session)
        self.check_panel = CheckPanel(session, self._view, self._tools, self._fly_to_rows)
        self.panels: tuple[tuple[str, QWidget], ...] = (
            ("Check", self.check_panel),
            ("Quantities", self.quantity_panel),
            ("Inspect", self.inspect_panel),
            ("Graph", self.graph_panel),
        )

    def _connect(self, session: Session) -> None:
        self.quantities.changed.connect(self._show_value)
        self.probe.changed.connect(self._show_value)
        SceneFollower(session, self.probe.cancel, picked_changed=self._on_picked)
        self._tools.chosen_changed.connect(self._on_tool_chosen)
        self.inspected.changed.connect(self.changed.emit)

    def set_actions(self, actions: ActionSet) -> None:
        """Give the panels the actions they have buttons for, and keep their marks right."""
        self.graph_panel.set_actions(actions)

        def check() -> None:
            actions.check(f"graph.{self.graph_view.options.shown}")

        self.graph_view.changed.connect(check)
        check()

    def _fly_to_rows(self, rows: FileRows) -> None:
        self._fly_to(self._view.viewport.frame(rows))

    def look_at(self, rows: FileRows) -> None:
        """Fly to some splats, and inspect the first of them."""
        self._fly_to_rows(rows)
        self.inspected.pick(int(rows[0]))

    def _on_tool_chosen(self) -> None:
        self.inspected.is_on = self._tools.chosen.name == "inspect"
        if self.inspected.is_on:
            bring_into_view(self.inspect_panel)

    def _on_picked(self) -> None:
        if self.inspected.is_on and self._session.shown_scene.picked is not None:
            bring_into_view(self.inspect_panel)

    def _show_value(self) -> None:
        self.probe.is_on = self.quantities.shown is not None
        text = self.quantities.value_text(self.probe.row)
        self.read_out.setText(f"{text} · row {self.probe.row:,}" if text else "")
        self.read_out.setVisible(bool(text))
