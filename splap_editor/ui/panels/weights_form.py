"""Bounded biharmonic weights in the Deformer panel: show them, and how good they are."""

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QLabel, QSizePolicy, QToolButton, QVBoxLayout, QWidget

from splap_editor.session.session import Session
from splap_editor.session.weight_report import weight_lines
from splap_editor.ui.theme import STEP
from splap_editor.ui.widgets.number_field import set_tone
from splap_editor.ui.widgets.plain_text import PlainLabel


class WeightsForm(QWidget):
    """A button that shows the weights on the surface, and a line for each thing that is wrong with them."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self.button = QToolButton()
        self.button.setObjectName("segment")
        self.button.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextOnly)
        self.button.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.labels: list[QLabel] = []
        self._lines = QVBoxLayout()
        self._lines.setSpacing(STEP)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(2 * STEP)
        layout.addWidget(self.button)
        layout.addLayout(self._lines)
        session.state_changed.connect(self._show)

    def set_action(self, action: QAction) -> None:
        """Let the button perform this."""
        self.button.setDefaultAction(action)

    @property
    def lines(self) -> list[str]:
        """What is said to be wrong with the weights."""
        return [label.text() for label in self.labels]

    def _show(self) -> None:
        bound = self._session.bound
        said = weight_lines(bound.edit, bound.weighted.report) if bound and bound.weighted else []
        # What is in order is told among the details: a line for each handle would push the panel about.
        lines = [(text, tone) for text, tone in said if tone != "quiet"]
        while len(self.labels) < len(lines):
            label: QLabel = PlainLabel(wordWrap=True, textInteractionFlags=Qt.TextInteractionFlag.TextSelectableByMouse)
            self._lines.addWidget(label)
            self.labels.append(label)
        while len(self.labels) > len(lines):
            label = self.labels.pop()
            self._lines.removeWidget(label)
            label.hide()
            label.deleteLater()
        for label, (text, tone) in zip(self.labels, lines, strict=True):
            label.setText(text)
            set_tone(label, tone)
