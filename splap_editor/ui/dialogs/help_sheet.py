"""The help sheet: every key and gesture on one page."""

from collections.abc import Iterable

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QDialog, QGridLayout, QHBoxLayout, QScrollArea, QVBoxLayout, QWidget

from splap_editor.ui.actions.action_spec import ActionSpec
from splap_editor.ui.gestures import key_blocks
from splap_editor.ui.theme import STEP
from splap_editor.ui.widgets.plain_text import PlainLabel

COLUMN_PX = 400


class HelpSheet(QDialog):
    """Made from the tables of actions and tools; F1 or Escape closes it."""

    def __init__(self, specs: Iterable[ActionSpec], parent: QWidget) -> None:
        super().__init__(parent)
        self.setWindowTitle("Keys and gestures")
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        blocks = list(key_blocks(specs).items())
        page = QWidget()
        columns = QHBoxLayout(page)
        columns.setContentsMargins(6 * STEP, 5 * STEP, 6 * STEP, 6 * STEP)
        columns.setSpacing(10 * STEP)
        for column in _in_columns(blocks, min(max(parent.width() // COLUMN_PX, 1), 3)):
            stack = QVBoxLayout()
            stack.setSpacing(5 * STEP)
            for title, rows in column:
                stack.addLayout(_block(title, rows))
            stack.addStretch(1)
            columns.addLayout(stack)
        scroll = QScrollArea(widgetResizable=True)
        scroll.setWidget(page)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(scroll)
        room = parent.size()
        wanted = page.sizeHint()
        self.resize(min(wanted.width() + 16, room.width() - 32), min(wanted.height() + 4, room.height() - 32))


def _in_columns(blocks: list, n_columns: int) -> list[list]:
    """Share blocks out in order, columns about equally tall."""
    total = sum(len(rows) + 2 for _, rows in blocks)
    columns: list[list] = [[]]
    filled = 0
    for block in blocks:
        if columns[-1] and filled >= total * len(columns) / n_columns:
            columns.append([])
        columns[-1].append(block)
        filled += len(block[1]) + 2
    return columns


def _block(title: str, rows: list[tuple[str, str]]) -> QGridLayout:
    grid = QGridLayout()
    grid.setHorizontalSpacing(4 * STEP)
    grid.setVerticalSpacing(STEP)
    grid.setColumnStretch(1, 1)
    head = PlainLabel(title)
    head.setProperty("tone", "title")
    grid.addWidget(head, 0, 0, 1, 2)
    for row, (keys, what) in enumerate(rows, start=1):
        cap = PlainLabel(keys)
        cap.setObjectName("keyCap")
        grid.addWidget(cap, row, 0, Qt.AlignmentFlag.AlignLeft)
        grid.addWidget(PlainLabel(what), row, 1)
    return grid
