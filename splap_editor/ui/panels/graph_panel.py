"""The splat graph: edges in view, its options with a preview, components, mends."""

from dataclasses import replace

import numpy as np
from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import (
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QListWidget,
    QListWidgetItem,
    QPushButton,
    QSizePolicy,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from splap_editor.core.graph.options import GraphOptions, edges_only
from splap_editor.core.graph.splat_graph import SplatGraph
from splap_editor.core.index_spaces import FileRows
from splap_editor.session.graph_preview import GraphPreview
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.session.session import Session
from splap_editor.ui.actions.actions import ActionSet
from splap_editor.ui.theme import STEP
from splap_editor.ui.widgets.number_field import set_tone
from splap_editor.ui.widgets.options_form import FieldHint, OptionsForm
from splap_editor.ui.widgets.plain_text import PlainLabel
from splap_editor.viewport.graph_view import EDGE_COLORS, GraphView

MOST_LISTED = 60

VIEW_HINTS = {
    "hops": FieldHint(
        "Steps", "How far from the selection edges are drawn.", low=1, high=50, only_for=("shown", ("near",))
    ),
    "color": FieldHint("Colour by", "What the colour of an edge says.", choices=EDGE_COLORS),
}


class GraphPanel(QWidget):
    """Follows graph, edit and preview; changes nothing before Apply."""

    component_chosen = Signal(object)
    """File rows of a component to look at."""

    def __init__(
        self,
        session: Session,
        view: GraphView,
        preview: GraphPreview,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._session = session
        self._view = view
        self._preview = preview
        self._wanted: GraphOptions | None = None
        self._listed: SplatGraph | None = None
        self._segments = QHBoxLayout()
        self._segments.setSpacing(0)
        self.form = OptionsForm(view.options, VIEW_HINTS)
        self.form.changed.connect(lambda options: view.set(hops=options.hops, color=options.color))
        self.counts = _label()
        self.rule = OptionsForm(GraphOptions())
        self.rule.changed.connect(self._on_rule_changed)
        self.estimate = _label()
        self.apply = QPushButton("Apply")
        self.apply.clicked.connect(self._on_applied)
        self.revert = QPushButton("Revert")
        self.revert.setFlat(True)
        self.revert.clicked.connect(self._on_reverted)
        self.components = QListWidget()
        self.components.setToolTip("Components by size; click one to look at it")
        self.components.setFixedHeight(96)
        self.components.itemClicked.connect(
            lambda item: self.component_chosen.emit(self._rows_of(item.data(Qt.ItemDataRole.UserRole)))
        )
        self.mends = _label()
        self._buttons = QGridLayout()
        self._add_parts()
        view.changed.connect(self._show_view)
        preview.changed.connect(self._show_estimate)
        SceneFollower(session, self._on_scene_changed, surface_changed=self._show, edit_changed=self._show)
        self._show()

    def set_actions(self, actions: ActionSet) -> None:
        """Make the buttons that perform actions."""
        for name in ("off", "near", "all"):
            self._segments.addWidget(_action_button(actions, f"graph.{name}"), 1)
        names = ("join_fragments", "clear_mends")
        for k, name in enumerate(names):
            self._buttons.addWidget(_action_button(actions, f"graph.{name}"), k // 2, k % 2)

    def _add_parts(self) -> None:
        self._asked = QWidget()
        asked = QHBoxLayout(self._asked)
        asked.setContentsMargins(0, 0, 0, 0)
        asked.addWidget(self.apply, 1)
        asked.addWidget(self.revert)
        layout = QVBoxLayout(self)
        layout.setSpacing(2 * STEP)
        layout.addLayout(self._segments)
        for part in (self.form, self.counts, self.rule, self.estimate, self._asked, self.components, self.mends):
            layout.addWidget(part)
        self._buttons.setSpacing(STEP)
        layout.addLayout(self._buttons)

    # Showing ------------------------------------------------------------------------------------------------------

    def _on_scene_changed(self) -> None:
        self._wanted = self._listed = None
        self._show()

    @property
    def _graph(self) -> SplatGraph | None:
        scene = self._session.scene
        return scene.surface.graph if scene is not None and scene.surface is not None else None

    def _show(self) -> None:
        scene = self._session.scene
        self.setEnabled(scene is not None)
        if scene is not None and self._wanted in (None, scene.edit.graph):
            self._wanted = None
            self.rule.show_value(scene.edit.graph)
        self._show_view()
        self._show_estimate()
        self._show_components()
        self._show_mends()

    def _show_view(self) -> None:
        self.form.show_value(self._view.options)
        graph = self._graph
        if graph is None:
            self.counts.setText("The graph is being made.")
            return
        text = f"{graph.n_edges:,} edges, {2 * graph.n_edges / max(graph.n_nodes, 1):.3g} at a splat"
        made = self._view.colored
        if self._view.options.shown != "off":
            text += f"\n{self._view.n_shown:,} in view"
            if made is not None and np.isfinite(made.high):
                text += f"; {EDGE_COLORS[made.color].lower()} from {made.low:.3g} (dark) to {made.high:.3g} (bright)"
        self.counts.setText(text)

    def _show_estimate(self) -> None:
        preview, wanted = self._preview, self._wanted
        self._asked.setVisible(wanted is not None)
        self.estimate.setVisible(wanted is not None)
        if wanted is None:
            return
        text, tone = "Counting edges …", "quiet"
        if preview.error:
            text, tone = preview.error, "danger"
        elif preview.graph is not None and preview.wanted == edges_only(self._wanted_options()):
            n, pieces = preview.graph.n_edges, int(preview.graph.components.max(initial=-1)) + 1
            change = n - self._graph.n_edges if self._graph is not None else 0
            text = f"{n:,} edges ({change:+,}), {_pieces(pieces)}"
        elif preview.share:
            text = f"Counting edges … {100 * preview.share:.0f} %"
        self.estimate.setText(text)
        set_tone(self.estimate, tone)

    def _show_components(self) -> None:
        graph = self._graph
        if graph is self._listed:
            return
        self._listed = graph
        self.components.clear()
        sizes = np.bincount(graph.components) if graph is not None and graph.n_nodes else np.zeros(0, int)
        for label, size in enumerate(sizes[:MOST_LISTED].tolist()):
            item = QListWidgetItem(f"{label}: {size:,} splat{'' if size == 1 else 's'}")
            item.setData(Qt.ItemDataRole.UserRole, label)
            self.components.addItem(item)
        if len(sizes) > MOST_LISTED:
            item = QListWidgetItem(f"and {len(sizes) - MOST_LISTED:,} more, of at most {sizes[MOST_LISTED]:,}")
            item.setFlags(Qt.ItemFlag.NoItemFlags)
            self.components.addItem(item)
        self.components.setVisible(len(sizes) > 1)

    def _rows_of(self, label: int) -> FileRows:
        scene = self._session.shown_scene
        graph = self._graph
        return scene.ellipses.rows[graph.components == label] if graph is not None else np.empty(0, np.int64)

    def _show_mends(self) -> None:
        scene = self._session.scene
        options = scene.edit.graph if scene is not None else GraphOptions()
        words = f"{len(options.cut):,} cut and {len(options.add):,} added by hand" if options.cut or options.add else ""
        for n, did in ((len(options.separate), "separated"), (len(options.join), "joined")):
            if n:
                words += f"{'; ' if words else ''}{did} by {n:,} stroke{'' if n == 1 else 's'}"
        self.mends.setText(words)
        self.mends.setVisible(bool(words))

    # Changing the rule --------------------------------------------------------------------------------------------

    def _wanted_options(self) -> GraphOptions:
        """What Apply would put in force: mends made meanwhile stay."""
        held = self._session.shown_scene.edit.graph
        wanted = held if self._wanted is None else self._wanted
        return replace(wanted, cut=held.cut, add=held.add, separate=held.separate, join=held.join)

    def _on_rule_changed(self, wanted: GraphOptions) -> None:
        if self._session.scene is None:
            return
        self._wanted = wanted if wanted != self._session.scene.edit.graph else None
        if self._wanted is not None:
            self._preview.ask(self._wanted_options())
        self._show_estimate()

    def _on_applied(self) -> None:
        options, self._wanted = self._wanted_options(), None
        self._session.steps.change_edit(self._session.shown_scene.edit.with_options(options), "Change graph")

    def _on_reverted(self) -> None:
        self._wanted = None
        self._preview.clear()
        self._show()


def _pieces(n: int) -> str:
    return "in one piece" if n == 1 else f"in {n:,} pieces"


def _label() -> QLabel:
    label = PlainLabel(wordWrap=True)
    label.setProperty("tone", "quiet")
    return label


def _action_button(actions: ActionSet, action_id: str) -> QToolButton:
    button = QToolButton()
    button.setDefaultAction(actions[action_id])
    button.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextOnly)
    button.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
    button.setObjectName("segment")
    return button
