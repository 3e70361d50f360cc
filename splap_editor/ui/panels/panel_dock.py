"""The dock at the window's side: panels under each other, scrolled together."""

from collections.abc import Collection, Mapping

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QDockWidget, QScrollArea, QVBoxLayout, QWidget

from splap_editor.ui.panels.section import Section


class PanelDock(QDockWidget):
    """Holds a section for each panel; it is neither moved, floated nor closed by hand."""

    def __init__(self) -> None:
        super().__init__()
        self.setObjectName("panels")
        self.setTitleBarWidget(QWidget())
        self.setFeatures(QDockWidget.DockWidgetFeature.NoDockWidgetFeatures)
        self.toggleViewAction().setVisible(False)

    def filled(self, panels: Mapping[str, QWidget], *, hidden: Collection[str] = ()) -> dict[str, Section]:
        """Put panels into sections under their titles, the first at the top; once, when the dock is in its window.

        Those ``hidden`` wait to be shown, and make it no wider.

        Whatever gets a parent is styled anew with all that it holds: what holds the panels comes before them.
        """
        scroll = QScrollArea(widgetResizable=True)
        self.setWidget(scroll)
        page = QWidget()
        scroll.setWidget(page)
        stack = QVBoxLayout(page)
        stack.setContentsMargins(0, 0, 0, 0)
        stack.setSpacing(0)
        sections = {title: Section(title, panel, parent=page) for title, panel in panels.items()}
        for title, section in sections.items():
            stack.addWidget(section)
            section.setVisible(title not in hidden)
        stack.addStretch(1)
        scroll.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        # Nothing of a panel is cut off at the side.
        scroll.setMinimumWidth(page.minimumSizeHint().width() + scroll.verticalScrollBar().sizeHint().width())
        return sections
