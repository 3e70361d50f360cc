"""Cards of the inspected splat and edge."""

from dataclasses import replace

import numpy as np
from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QComboBox, QGridLayout, QHBoxLayout, QLabel, QPushButton, QVBoxLayout, QWidget

from splap_editor.core.graph.splat_graph import GraphOptions
from splap_editor.session.cards import EdgeCard, SplatCard, edge_card, has_edge, splat_card
from splap_editor.session.graph_preview import GraphPreview
from splap_editor.session.neighbor_sets import NEIGHBOR_KINDS, NeighborComparison
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.session.session import Session
from splap_editor.ui.theme import STEP
from splap_editor.ui.widgets.choices import Choice
from splap_editor.ui.widgets.number_field import NumberField
from splap_editor.ui.widgets.options_form import form_label
from splap_editor.ui.widgets.plain_text import PlainLabel
from splap_editor.viewport.inspect_view import BOTH_COLOR, FIRST_COLOR, SECOND_COLOR, InspectView

HINT = "Take the Inspect tool (I) and click a splat."


Rgb = tuple[int, int, int]


class InspectPanel(QWidget):
    """Says what is known of the picked splat and edge; chooses whose neighbours are shown."""

    edge_toggled = Signal()
    """The inspected edge shall be cut, or put in if there is none."""

    def __init__(
        self, session: Session, inspected: InspectView, preview: GraphPreview, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self._session = session
        self._inspected = inspected
        self._preview = preview
        self._is_epsilon_typed = False
        self.splat = _text_label()
        self.kind = _kind_combo("Whose neighbours are marked")
        self.other = _kind_combo("Compare with another set", "Nothing else")
        self.kind.currentIndexChanged.connect(lambda index: inspected.set(kind=self.kind.itemData(index)))
        self.other.currentIndexChanged.connect(lambda index: inspected.set(other=self.other.itemData(index)))
        self.k = NumberField(1, 500, decimals=0, step=1)
        self.k.setToolTip("How many neighbours, where the kind does not say itself")
        self.k.committed.connect(lambda k: inspected.set(k=int(k)))
        self.counts = ColoredLines()
        self.edge = _text_label()
        self.epsilon = NumberField(0.0, 100.0, decimals=4, step=0.05, unit="%")
        self.epsilon.setToolTip("Would the edge survive at this gap, in percent of the size of the scene?")
        self.epsilon.committed.connect(self._on_epsilon_committed)
        self.verdict = _text_label()
        self.toggle = QPushButton()
        self.toggle.clicked.connect(self.edge_toggled)
        self._add_parts()
        inspected.changed.connect(self._show)
        preview.changed.connect(self._show_verdict)
        SceneFollower(session, self._show)
        self._show()

    def _add_parts(self) -> None:
        self._sets = QWidget()
        grid = QGridLayout(self._sets)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setHorizontalSpacing(2 * STEP)
        grid.setVerticalSpacing(STEP)
        grid.setColumnStretch(1, 1)
        for row, (text, part) in enumerate((("Neighbours", self.kind), ("Beside", self.other), ("How many", self.k))):
            grid.addWidget(form_label(text, part), row, 0)
            grid.addWidget(part, row, 1)
        self._edge_part = QWidget()
        edge = QVBoxLayout(self._edge_part)
        edge.setContentsMargins(0, 0, 0, 0)
        edge.setSpacing(STEP)
        line = QHBoxLayout()
        line.addWidget(form_label("At a gap of", self.epsilon))
        line.addWidget(self.epsilon, 1)
        edge.addWidget(self.edge)
        edge.addLayout(line)
        edge.addWidget(self.verdict)
        edge.addWidget(self.toggle)
        layout = QVBoxLayout(self)
        layout.setSpacing(2 * STEP)
        for part in (self.splat, self._sets, self.counts, self._edge_part):
            layout.addWidget(part)

    # Showing ------------------------------------------------------------------------------------------------------

    def _show(self) -> None:
        scene, options = self._session.scene, self._inspected.options
        for combo, data in ((self.kind, options.kind), (self.other, options.other)):
            combo.blockSignals(True)
            combo.setCurrentIndex(combo.findData(data))
            combo.blockSignals(False)
        self.k.show_value(options.k)
        self.k.setEnabled({options.kind, options.other} - {"graph", ""} != set())
        picked = scene.picked if scene is not None else None
        graph = scene.surface.graph if scene is not None and scene.surface is not None else None
        text = HINT
        if scene is not None and picked is not None:
            text = _splat_text(splat_card(scene.splats, scene.ellipses, graph, picked))
        self.splat.setText(text)
        both = self._inspected.comparison
        for part in (self._sets, self.counts):
            part.setVisible(picked is not None and both is not None)
        if both is not None:
            self.counts.show_lines(self._count_lines(both))
        self._show_edge()

    def _count_lines(self, both: NeighborComparison) -> list[tuple[Rgb, str]]:
        """How many neighbours are of which set, each line with the colour they are marked in."""
        options = self._inspected.options
        first = f"{len(both.first)} by {_words(options.kind)}"
        if not options.other:
            return [(FIRST_COLOR, first)]
        second = f"{len(both.second)} by {_words(options.other)}"
        return [
            (FIRST_COLOR, f"{first}, {len(both.only_first)} by it alone"),
            (SECOND_COLOR, f"{second}, {len(both.only_second)} by it alone"),
            (BOTH_COLOR, f"{len(both.common)} by both"),
        ]

    def _show_edge(self) -> None:
        scene, rows = self._session.scene, self._inspected.edge
        if scene is None or rows is None or (scene.ellipses.node_of_row[list(rows)] < 0).any():
            self._edge_part.setVisible(False)
            return
        self._edge_part.setVisible(True)
        options = scene.edit.graph
        is_joined = scene.surface is not None and has_edge(scene.ellipses, scene.surface.graph, rows)
        self.edge.setText(_edge_text(edge_card(scene.ellipses, rows, options.epsilon), is_joined))
        self.toggle.setText("Cut this edge" if is_joined else "Join the two")
        self.toggle.setEnabled(scene.surface is not None)
        if not self._is_epsilon_typed:
            self.epsilon.show_value(100.0 * options.epsilon)
        elif abs(self.epsilon.value() / 100.0 - options.epsilon) > 1e-9:
            self._preview.ask(_at(options, self.epsilon.value() / 100.0))
        self._show_verdict()

    def _on_epsilon_committed(self, percent: float) -> None:
        self._is_epsilon_typed = True
        self._preview.ask(_at(self._session.shown_scene.edit.graph, percent / 100.0))
        self._show_verdict()

    def _show_verdict(self) -> None:
        scene, rows = self._session.scene, self._inspected.edge
        if scene is None or rows is None or self._edge_part.isHidden():
            return
        epsilon = self.epsilon.value() / 100.0
        is_other = abs(epsilon - scene.edit.graph.epsilon) > 1e-9
        self.verdict.setVisible(is_other)
        if not is_other:
            return
        card = edge_card(scene.ellipses, rows, epsilon)
        touch = f"touch scale {_scale(card.touch)}" if scene.edit.graph.rule == "touch" else _gap_words(card)
        if self._preview.wanted != _at(scene.edit.graph, epsilon):
            self.verdict.setText(f"There: {touch}.")
        elif self._preview.graph is not None:
            stays = has_edge(scene.ellipses, self._preview.graph, rows)
            self.verdict.setText(f"There: {touch}; the edge {'is in the graph' if stays else 'is not in the graph'}.")
        else:
            self.verdict.setText(f"There: {touch}. {self._preview.error or 'Making the graph …'}")


class ColoredLines(QWidget):
    """Lines of text, each behind a dot of the colour it speaks of."""

    def __init__(self) -> None:
        super().__init__()
        self._grid = QGridLayout(self)
        self._grid.setContentsMargins(0, 0, 0, 0)
        self._grid.setHorizontalSpacing(STEP)
        self._grid.setVerticalSpacing(STEP)
        self._grid.setColumnStretch(1, 1)
        self._lines: list[tuple[QLabel, QLabel]] = []

    def show_lines(self, lines: list[tuple[Rgb, str]]) -> None:
        """Show these lines in place of those before."""
        while len(self._lines) < len(lines):
            dot: QLabel = PlainLabel("●")
            line = _text_label()
            self._grid.addWidget(dot, len(self._lines), 0, Qt.AlignmentFlag.AlignTop)
            self._grid.addWidget(line, len(self._lines), 1)
            self._lines.append((dot, line))
        for place, (dot, line) in enumerate(self._lines):
            is_shown = place < len(lines)
            dot.setVisible(is_shown)
            line.setVisible(is_shown)
            if is_shown:
                color, text = lines[place]
                dot.setStyleSheet(f"color: rgb{color};")
                line.setText(text)

    def text(self) -> str:
        """What is shown, without the dots."""
        return "\n".join(line.text() for _, line in self._lines if not line.isHidden())


def _at(options: GraphOptions, epsilon: float) -> GraphOptions:
    return replace(options, epsilon=epsilon, k=GraphOptions.k)


def _splat_text(card: SplatCard) -> str:
    lines = [f"Row {card.row:,}"]
    if card.semi_axes is not None:
        lines.append(f"Semi-axes {card.semi_axes[0]:.4g} × {card.semi_axes[1]:.4g}")
    lines.append(
        f"Opacity {card.opacity:.3g}" + ("" if card.threshold is None else f", threshold {card.threshold:.3g}")
    )
    if card.inert:
        lines.append(f"Takes no part in the surface: {card.inert}.")
    elif card.degree is None:
        lines.append("The surface is being prepared.")
    else:
        lines.append(
            f"{card.degree} graph neighbour{'s' if card.degree != 1 else ''}; component {card.component} of "
            f"{card.n_components:,}, {card.component_size:,} splats"
        )
    return "\n".join(lines)


def _edge_text(card: EdgeCard, is_joined: bool) -> str:
    there, back = (_length(offset) for offset in card.offsets)
    return (
        f"{'Edge' if is_joined else 'No edge'} {card.rows[0]:,} – {card.rows[1]:,}\n"
        f"Length {card.length:.4g}\nδ {there} there, {back} back; ε {card.epsilon:.4g}\n"
        f"Touch scale {_scale(card.touch)}"
    )


def _length(offset: float) -> str:
    return "never meets" if np.isinf(offset) else f"{offset:.3g}"


def _scale(touch: float) -> str:
    return "none: they never touch" if np.isinf(touch) else f"{touch:.3g}"


def _gap_words(card: EdgeCard) -> str:
    return f"the smaller δ is {'within' if card.is_within else 'beyond'} ε"


def _words(kind: str) -> str:
    return {
        "graph": "graph",
        "geodesic": "surface",
        "paper-graph": "paper's graph",
        "paper": "paper's surface",
        "euclidean": "space",
        "mahalanobis": "Mahalanobis",
    }[kind]


def _kind_combo(tip: str, none: str = "") -> QComboBox:
    combo = Choice(toolTip=tip)
    if none:
        combo.addItem(none, "")
    for kind, words in NEIGHBOR_KINDS.items():
        combo.addItem(words, kind)
    combo.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
    return combo


def _text_label() -> QLabel:
    return PlainLabel(wordWrap=True, textInteractionFlags=Qt.TextInteractionFlag.TextSelectableByMouse)
