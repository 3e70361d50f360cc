"""Text that comes from a file, a path or an exception, shown letter by letter.

Qt takes a text with a tag in it for a document: it would fetch the pictures
that a file's header names. Labels, tips and boxes are made here and nowhere
else, so that no text is ever taken for more than text.
"""

import html
from typing import Any

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction, QResizeEvent
from PySide6.QtGui import Qt as GuiQt
from PySide6.QtWidgets import QLabel, QListWidgetItem, QMessageBox, QWidget


class PlainLabel(QLabel):
    """A label that shows its text as it is, and all lines of it."""

    def __init__(self, *arguments: Any, **properties: Any) -> None:
        super().__init__(*arguments, **properties)
        self.setTextFormat(Qt.TextFormat.PlainText)

    def setText(self, text: str) -> None:
        """Show another text, with room for all its lines."""
        super().setText(text)
        self._make_room()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Make room for the lines that there are at another width."""
        super().resizeEvent(event)
        self._make_room()

    def _make_room(self) -> None:
        # A layout in a scrolled page may count the lines for a width that it then does not give.
        if self.wordWrap():
            self.setMinimumHeight(max(self.heightForWidth(self.width()), 0))


class PlainMessageBox(QMessageBox):
    """A message box that shows its texts as they are."""

    def __init__(self, *arguments: Any, **properties: Any) -> None:
        super().__init__(*arguments, **properties)
        self.setTextFormat(Qt.TextFormat.PlainText)


def set_plain_tip(shown: QWidget | QAction | QListWidgetItem, text: str) -> None:
    """Give a tool-tip whose text is shown as it is; tips have no format of their own to set."""
    # What looks like a document is made one, in which it is mere text.
    shown.setToolTip(f"<span>{html.escape(text)}</span>" if GuiQt.mightBeRichText(text) else text)
