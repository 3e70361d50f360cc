"""Every action by name: type some letters, press Enter."""

from collections.abc import Sequence
from typing import Any

from PySide6.QtCore import QEvent, QModelIndex, QObject, QPersistentModelIndex, QRect, QSettings, QSize, Qt
from PySide6.QtGui import QColor, QKeyEvent, QPainter
from PySide6.QtWidgets import (
    QDialog,
    QLineEdit,
    QListWidget,
    QListWidgetItem,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QVBoxLayout,
    QWidget,
)

from splap_editor.ui.actions.action_spec import ActionSpec
from splap_editor.ui.actions.actions import ActionSet, shown_keys
from splap_editor.ui.dialogs.fuzzy import fuzzy_score
from splap_editor.ui.theme import FAINT, QUIET, RAISED, STEP, TEXT

WIDTH, ROW_PX, MOST_ROWS = 520, 30, 12
N_RECENT = 20
KEY = "palette/recent"
_STEPS: dict[int, int] = {Qt.Key.Key_Down: 1, Qt.Key.Key_Up: -1, Qt.Key.Key_PageDown: 10, Qt.Key.Key_PageUp: -10}
ID, PLACE, KEYS, ENABLED = (Qt.ItemDataRole.UserRole + k for k in range(4))


def ranked(query: str, texts: Sequence[tuple[str, str]], recent: Sequence[str]) -> list[str]:
    """Ids of the actions that a query finds, best first.

    Parameters
    ----------
    query : str
        Nothing finds everything.
    texts : sequence of (str, str)
        Id, and the words to search in.
    recent : sequence of str
        Ids used lately, newest first; of equally good ones, and without a query, they come first.
    """
    age = {action_id: k for k, action_id in enumerate(recent)}
    found = []
    for place, (action_id, words) in enumerate(texts):
        score = fuzzy_score(query, words)
        if score is not None:
            # Of equally good ones the shorter has less that was not asked for.
            found.append((-score, age.get(action_id, len(age)), len(words) if query else 0, place, action_id))
    return [action_id for *_, action_id in sorted(found)]


class ActionPalette(QDialog):
    """A line to type in and the actions it finds; Enter runs the marked one, Escape leaves.

    Parameters
    ----------
    actions : ActionSet
    parent : QWidget
        The window; the palette hangs from its upper edge.
    """

    def __init__(self, actions: ActionSet, parent: QWidget) -> None:
        super().__init__(parent, Qt.WindowType.Popup | Qt.WindowType.FramelessWindowHint)
        self.setObjectName("palette")
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self._actions = actions
        self._specs = {spec.action_id: spec for spec in actions.specs if spec.action_id != "program.palette"}
        self.field = QLineEdit(placeholderText="Type what you want to do")
        self.field.textChanged.connect(self._show)
        self.field.installEventFilter(self)
        self.list = QListWidget()
        self.list.setItemDelegate(_Row(self.list))
        self.list.setUniformItemSizes(True)
        self.list.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.list.setMouseTracking(True)
        self.list.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.list.itemClicked.connect(lambda item: self.run(item.data(ID)))
        layout = QVBoxLayout(self)
        layout.setContentsMargins(2 * STEP, 2 * STEP, 2 * STEP, 2 * STEP)
        layout.setSpacing(2 * STEP)
        layout.addWidget(self.field)
        layout.addWidget(self.list)
        self.setFixedWidth(WIDTH)
        self.list.setFixedHeight(ROW_PX * MOST_ROWS)
        corner = parent.mapToGlobal(parent.rect().topLeft())
        self.move(corner.x() + (parent.width() - WIDTH) // 2, corner.y() + 18 * STEP)
        self._show()
        self.field.setFocus()

    @property
    def found(self) -> list[str]:
        """Ids of the actions listed, in order."""
        return [self.list.item(row).data(ID) for row in range(self.list.count())]

    def run(self, action_id: str) -> None:
        """Leave, and perform an action that can be performed; it is the first of the recent ones from then on."""
        action = self._actions[action_id]
        if not action.isEnabled():
            return
        recent = [action_id, *(other for other in recent_actions() if other != action_id)]
        QSettings().setValue(KEY, recent[:N_RECENT])
        self.close()
        action.trigger()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Let the arrow keys move the mark while the line has the keyboard."""
        if not isinstance(event, QKeyEvent) or event.type() != QEvent.Type.KeyPress:
            return False
        step = _STEPS.get(event.key())
        if step is not None and self.list.count():
            far = abs(step) > 1
            row = self.list.currentRow() + step
            last = self.list.count() - 1
            self.list.setCurrentRow(min(max(row, 0), last) if far else row % (last + 1))
            return True
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            if self.list.currentItem() is not None:
                self.run(self.list.currentItem().data(ID))
            return True
        return False

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Leave on Escape."""
        if event.key() == Qt.Key.Key_Escape:
            self.close()
        else:
            super().keyPressEvent(event)

    def _show(self) -> None:
        self.list.clear()
        # The menu comes between, so that "select all" and "all select" both find it.
        texts = [
            (action_id, f"{self._words(spec)} {_place(spec)} {self._words(spec)}")
            for action_id, spec in self._specs.items()
        ]
        for action_id in ranked(self.field.text(), texts, recent_actions()):
            spec, action = self._specs[action_id], self._actions[action_id]
            item = QListWidgetItem(self._words(spec))
            item.setData(ID, action_id)
            item.setData(PLACE, _place(spec))
            item.setData(KEYS, shown_keys(spec.shortcuts[0]).replace("&lt;", "<") if spec.shortcuts else "")
            item.setData(ENABLED, action.isEnabled())
            item.setToolTip(spec.tip)
            self.list.addItem(item)
        self.list.setCurrentRow(0)

    def _words(self, spec: ActionSpec) -> str:
        action = self._actions[spec.action_id]
        text = action.text().replace("&", "").removesuffix("…")
        return f"✓ {text}" if action.isCheckable() and action.isChecked() else text


class _Row(QStyledItemDelegate):
    """Name, the menu it is in, and its keys at the right."""

    def sizeHint(self, option: QStyleOptionViewItem, index: QModelIndex | QPersistentModelIndex) -> QSize:
        """All rows are as high."""
        return QSize(WIDTH - 8 * STEP, ROW_PX)

    def paint(
        self, painter: QPainter, option: QStyleOptionViewItem, index: QModelIndex | QPersistentModelIndex
    ) -> None:
        """Paint one action; one that cannot be used is grey."""
        painter.save()
        if option.state & (QStyle.StateFlag.State_Selected | QStyle.StateFlag.State_MouseOver):
            painter.fillRect(option.rect, QColor(RAISED))
        box = option.rect.adjusted(2 * STEP, 0, -2 * STEP, 0)
        middle, right = Qt.AlignmentFlag.AlignVCenter, Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignRight
        text = index.data(Qt.ItemDataRole.DisplayRole)
        is_enabled = index.data(ENABLED)
        painter.setPen(QColor(TEXT if is_enabled else FAINT))
        painter.drawText(box, middle, text)
        painter.setPen(QColor(QUIET if is_enabled else FAINT))
        painter.drawText(box, right, index.data(KEYS))
        after = painter.fontMetrics().horizontalAdvance(text) + 3 * STEP
        painter.setPen(QColor(FAINT))
        painter.drawText(
            QRect(box.left() + after, box.top(), box.width() - after, box.height()), middle, index.data(PLACE)
        )
        painter.restore()


def recent_actions() -> list[str]:
    """Ids run from the palette lately, newest first."""
    held: Any = QSettings().value(KEY, [])
    return [held] if isinstance(held, str) else [str(action_id) for action_id in held or []]


def _place(spec: ActionSpec) -> str:
    return " › ".join(part.replace("&", "") for part in spec.menu.split("/")) if spec.menu else ""
