"""A panel section that folds away."""

from PySide6.QtCore import QSettings, QSize, Qt, QTimer
from PySide6.QtWidgets import QFrame, QScrollArea, QSizePolicy, QToolButton, QVBoxLayout, QWidget

from splap_editor.ui.theme import STEP, icon


class Section(QFrame):
    """A titled part of the dock; whether it is folded is remembered.

    Parameters
    ----------
    title : str
    body : QWidget
        What folds away.
    """

    def __init__(self, title: str, body: QWidget, *, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("panelSection")
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Preferred)
        self._key = f"panels/{title.lower()}"
        self.body = body
        self.header = QToolButton()
        self.header.setText(title)
        self.header.setCheckable(True)
        self.header.setObjectName("sectionHeader")
        self.header.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
        self.header.setIconSize(QSize(12, 12))
        self.header.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.header.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addWidget(self.header)
        layout.addWidget(body)
        body.setContentsMargins(0, 0, 0, 0)
        inner = body.layout()
        if inner is not None:
            inner.setContentsMargins(3 * STEP, STEP, 3 * STEP, 3 * STEP)
        is_open = bool(QSettings().value(self._key, True, type=bool))
        self.header.setChecked(is_open)
        self._unfold(is_open)
        self.header.toggled.connect(self._on_toggled)

    def _on_toggled(self, is_open: bool) -> None:
        self._unfold(is_open)
        QSettings().setValue(self._key, is_open)

    def _unfold(self, is_open: bool) -> None:
        self.header.setIcon(icon("chevron-down" if is_open else "chevron-right"))
        self.body.setVisible(is_open)


def bring_into_view(body: QWidget) -> None:
    """Unfold the section of a body, and scroll to it once it has its size."""
    section = body.parentWidget()
    if not isinstance(section, Section):
        return
    section.header.setChecked(True)
    scroll = section.parentWidget()
    while scroll is not None and not isinstance(scroll, QScrollArea):
        scroll = scroll.parentWidget()
    if scroll is not None:
        QTimer.singleShot(0, scroll, lambda: _scroll_to(scroll, section))


def _scroll_to(scroll: QScrollArea, section: Section) -> None:
    """Bring the top of a section to the top, unless all of it is seen."""
    bar, top = scroll.verticalScrollBar(), section.y()
    if top < bar.value() or top + section.height() > bar.value() + scroll.viewport().height():
        bar.setValue(top)
