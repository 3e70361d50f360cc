"""Text that comes from a file, a path or an exception, shown letter by letter.

Qt takes a text with a tag in it for a document: it would fetch the pictures
that a file's header names. Labels, tips and boxes are made here and nowhere
else, so that no text is ever taken for more than text.
"""

import html

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction
from PySide6.QtGui import Qt as GuiQt
from PySide6.QtWidgets import QLabel, QListWidgetItem, QMessageBox, QWidget


class PlainLabel(QLabel):
    """A label that shows its text as it is."""

    def __init__(self, *arguments: object, **properties: object) -> None:
        super().__init__(*arguments, **properties)
        self.setTextFormat(Qt.TextFormat.PlainText)


class PlainMessageBox(QMessageBox):
    """A message box that shows its texts as they are."""

    def __init__(self, *arguments: object, **properties: object) -> None:
        super().__init__(*arguments, **properties)
        self.setTextFormat(Qt.TextFormat.PlainText)


def set_plain_tip(shown: QWidget | QAction | QListWidgetItem, text: str) -> None:
    """Give a tool-tip whose text is shown as it is; tips have no format of their own to set."""
    # What looks like a document is made one, in which it is mere text.
    shown.setToolTip(f"<span>{html.escape(text)}</span>" if GuiQt.mightBeRichText(text) else text)
