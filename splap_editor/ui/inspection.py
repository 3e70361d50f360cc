"""Looking into a scene: quantities in colours, what is under the cursor."""

from PySide6.QtWidgets import QLabel, QWidget

from splap_editor.session.graph_preview import GraphPreview
from splap_editor.session.session import Session
from splap_editor.tools.probe_tool import ProbeTool
from splap_editor.tools.tool import ToolContext, ToolManager
from splap_editor.ui.panels.inspect_panel import InspectPanel
from splap_editor.ui.panels.quantity_panel import QuantityPanel
from splap_editor.ui.panels.section import bring_into_view
from splap_editor.ui.quantity_legend import QuantityLegend
from splap_editor.viewport.inspect_view import InspectView
from splap_editor.viewport.quantity_view import QuantityView
from splap_editor.viewport.scene_view import SceneView


class Inspection:
    """Makes and wires all that shows why a scene bends as it does.

    Parameters
    ----------
    session : Session
    view : SceneView
    context : ToolContext
    tools : ToolManager
    viewport : QWidget
        Where legends go.
    """

    def __init__(
        self, session: Session, view: SceneView, context: ToolContext, tools: ToolManager, viewport: QWidget
    ) -> None:
        self.quantities = QuantityView(session, view)
        self.probe = ProbeTool(context)
        tools.stand(self.probe)
        self.legend = QuantityLegend(self.quantities, viewport)
        self.read_out = QLabel()
        self.quantity_panel = QuantityPanel(session, self.quantities)
        self._tools = tools
        self.inspected: InspectView = tools.tools["inspect"].inspected
        self.preview = GraphPreview(session)
        self.inspect_panel = InspectPanel(session, self.inspected, self.preview)
        self.panels: tuple[tuple[str, QWidget], ...] = (
            ("Quantities", self.quantity_panel),
            ("Inspect", self.inspect_panel),
        )
        tools.chosen_changed.connect(self._on_tool_chosen)
        self.quantities.changed.connect(self._show_value)
        self.probe.changed.connect(self._show_value)
        session.scene_changed.connect(self.probe.cancel)
        self._show_value()

    def _on_tool_chosen(self) -> None:
        self.inspected.is_on = self._tools.chosen.name == "inspect"
        if self.inspected.is_on:
            bring_into_view(self.inspect_panel)

    def _show_value(self) -> None:
        self.probe.is_on = self.quantities.shown is not None
        text = self.quantities.value_text(self.probe.row)
        self.read_out.setText(f"{text} · row {self.probe.row:,}" if text else "")
        self.read_out.setVisible(bool(text))
