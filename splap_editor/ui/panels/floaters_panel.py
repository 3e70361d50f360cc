"""Groups of floaters: how large, what gives them away, which of them go."""

from typing import Any

from PySide6.QtCore import QAbstractListModel, QModelIndex, QPersistentModelIndex, Qt, Signal
from PySide6.QtWidgets import QAbstractItemView, QHBoxLayout, QListView, QPushButton, QVBoxLayout, QWidget

from splap_editor.session.floater_preview import FloaterPreview
from splap_editor.tools.floaters_tool import FloaterOptions, FloatersTool
from splap_editor.ui.theme import STEP
from splap_editor.ui.widgets.choices import Slider
from splap_editor.ui.widgets.plain_text import PlainLabel

_HEIGHT = 220
_MOST = 99
"""The strength in percent at which nearly all floats."""

_Index = QModelIndex | QPersistentModelIndex


class GroupsModel(QAbstractListModel):
    """A row for each group, made when it is looked at: there may be thousands.

    Parameters
    ----------
    preview : FloaterPreview
    """

    ticked = Signal()

    def __init__(self, preview: FloaterPreview, parent: QWidget) -> None:
        super().__init__(parent)
        self._preview = preview

    def rowCount(self, parent: _Index | None = None) -> int:
        """Number of groups."""
        found = self._preview.found
        return 0 if found is None or (parent is not None and parent.isValid()) else found.n_groups

    def data(self, index: _Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        """Size and reason of a group, and whether it goes."""
        found = self._preview.found
        if found is None or not index.row() < found.n_groups:
            return None
        if role == Qt.ItemDataRole.DisplayRole:
            n = int(found.sizes[index.row()])
            return f"{n:,} splat{'' if n == 1 else 's'} · {found.reason(index.row())}"
        if role == Qt.ItemDataRole.CheckStateRole:
            return Qt.CheckState.Unchecked if self._preview.keeps(index.row()) else Qt.CheckState.Checked
        return None

    def setData(self, index: _Index, value: Any, role: int = Qt.ItemDataRole.EditRole) -> bool:
        """Tick a group to have it go, untick it to keep it."""
        if role != Qt.ItemDataRole.CheckStateRole or self._preview.found is None:
            return False
        self.ticked.emit()
        self._preview.keep(index.row(), Qt.CheckState(value) is Qt.CheckState.Unchecked)
        return True

    def flags(self, index: _Index) -> Qt.ItemFlag:
        """A group can be chosen and ticked."""
        return Qt.ItemFlag.ItemIsEnabled | Qt.ItemFlag.ItemIsSelectable | Qt.ItemFlag.ItemIsUserCheckable


class FloatersPanel(QWidget):
    """Strength, the groups that it finds, and a button that removes those ticked.

    Parameters
    ----------
    tool : FloatersTool
    """

    def __init__(self, tool: FloatersTool, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._tool = tool
        self._held = tool.context.held(FloaterOptions)
        self._shown: object = None
        self._is_tick = False
        self.status = PlainLabel(wordWrap=True)
        self.status.setProperty("tone", "quiet")
        self.strength = Slider(Qt.Orientation.Horizontal)
        self.strength.setRange(0, _MOST)
        self.strength.setToolTip("How readily a splat counts as floating; 0: none does.")
        self.strength.setAccessibleName("Strength")
        self.strength.valueChanged.connect(lambda value: self._held.set(FloaterOptions(value / 100.0)))
        self.model = GroupsModel(tool.preview, self)
        self.list = QListView()
        self.list.setModel(self.model)
        self.list.setUniformItemSizes(True)
        self.list.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        self.list.setFixedHeight(_HEIGHT)
        self.list.setToolTip("Click a group to look at it; untick it to keep it.")
        self.list.setAccessibleName("Groups of floaters")
        self.model.ticked.connect(self._on_ticked)
        self.list.clicked.connect(self._on_clicked)
        self.list.activated.connect(lambda index: self._tool.look_at(index.row()))
        self.take = QPushButton("Remove")
        self.take.setToolTip("Remove the groups that are ticked: one step that can be undone")
        self.take.clicked.connect(lambda: self._tool.take())
        self.leave = QPushButton("Leave")
        self.leave.setToolTip("Show no floaters, and change nothing")
        self.leave.clicked.connect(lambda: self._tool.let_go())
        buttons = QHBoxLayout()
        buttons.addWidget(self.take)
        buttons.addWidget(self.leave)
        layout = QVBoxLayout(self)
        layout.setSpacing(2 * STEP)
        for part in (self.status, self.strength, self.list):
            layout.addWidget(part)
        layout.addLayout(buttons)
        self._held.changed.connect(self._show_strength)
        tool.changed.connect(self._show)
        self._show_strength()
        self._show()

    def _on_ticked(self) -> None:
        self._is_tick = True

    def _on_clicked(self, index: QModelIndex) -> None:
        """Look at the group, unless it was its tick that was clicked."""
        was_tick, self._is_tick = self._is_tick, False
        if not was_tick:
            self._tool.look_at(index.row())

    def _show_strength(self) -> None:
        self.strength.blockSignals(True)
        self.strength.setValue(round(100.0 * self._held.value.strength))
        self.strength.blockSignals(False)

    def _show(self) -> None:
        found = self._tool.found
        if found is not self._shown:
            self._shown = found
            self.model.beginResetModel()
            self.model.endResetModel()
        elif self.model.rowCount():
            self.model.dataChanged.emit(self.model.index(0), self.model.index(self.model.rowCount() - 1))
        group = self._tool.looked_at
        if group is None:
            self.list.clearSelection()
        elif group != self.list.currentIndex().row():
            self.list.setCurrentIndex(self.model.index(group))
        has_some = found is not None and found.n_groups > 0
        self.take.setEnabled(has_some)
        self.list.setEnabled(has_some)
        if found is None:
            is_shown = self._tool.preview.is_shown
            self.status.setText(self._tool.doing if is_shown else "Click the picture to look for floaters.")
        else:
            n, k = len(found.rows), found.n_groups
            self.status.setText(
                f"{n:,} splats float in {k:,} group{'' if k == 1 else 's'}." if k else "Nothing floats."
            )
