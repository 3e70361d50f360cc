"""Figures that a panel tells only those who ask for them."""

from PySide6.QtCore import QSettings, QSize, Qt
from PySide6.QtWidgets import QToolButton, QVBoxLayout, QWidget

from splap_editor.ui.theme import STEP, icon

_KEY = "panels/details"


class Details(QWidget):
    """Unfolds its lines under a small header; folded at first, and as it was left afterwards.

    Parameters
    ----------
    lines : QWidget
        What is told.
    """

    def __init__(self, *lines: QWidget, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.header = QToolButton()
        self.header.setText("Details")
        self.header.setCheckable(True)
        self.header.setObjectName("detailsHeader")
        self.header.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
        self.header.setIconSize(QSize(12, 12))
        self.header.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.body = QWidget()
        body = QVBoxLayout(self.body)
        body.setContentsMargins(4 * STEP, 0, 0, 0)
        body.setSpacing(STEP)
        for line in lines:
            body.addWidget(line)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(STEP)
        layout.addWidget(self.header)
        layout.addWidget(self.body)
        is_open = bool(QSettings().value(_KEY, False, type=bool))
        self.header.setChecked(is_open)
        self._unfold(is_open)
        self.header.toggled.connect(self._on_toggled)

    def _on_toggled(self, is_open: bool) -> None:
        self._unfold(is_open)
        QSettings().setValue(_KEY, is_open)

    def _unfold(self, is_open: bool) -> None:
        self.header.setIcon(icon("chevron-down" if is_open else "chevron-right"))
        self.body.setVisible(is_open)
