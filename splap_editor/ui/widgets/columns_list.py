"""Which quantities are written into a PLY beside the splats."""

from collections.abc import Mapping

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QCheckBox, QListWidget, QListWidgetItem, QVBoxLayout, QWidget

from splap_editor.engine.quantities import QUANTITIES
from splap_editor.ui.theme import STEP


class ColumnsList(QWidget):
    """A switch, and under it a list of quantities to tick.

    Parameters
    ----------
    lacks : dict
        What each quantity lacks to be written, by name; empty where it can be.
    """

    def __init__(self, lacks: Mapping[str, str], parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.switch = QCheckBox("Also write quantities, as extra columns")
        self.list = QListWidget()
        self.list.setFixedHeight(150)
        self.list.setSelectionMode(QListWidget.SelectionMode.NoSelection)
        for name, quantity in QUANTITIES.items():
            item = QListWidgetItem(f"{quantity.label}  ({name})")
            item.setData(Qt.ItemDataRole.UserRole, name)
            item.setCheckState(Qt.CheckState.Unchecked)
            if lacks.get(name):
                item.setFlags(Qt.ItemFlag.NoItemFlags)
                item.setToolTip(f"Needs {lacks[name]}")
            self.list.addItem(item)
        self.list.setVisible(False)
        self.switch.toggled.connect(self.list.setVisible)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(2 * STEP)
        layout.addWidget(self.switch)
        layout.addWidget(self.list)

    @property
    def names(self) -> tuple[str, ...]:
        """The quantities ticked, none while the switch is off."""
        items = [self.list.item(k) for k in range(self.list.count())] if self.switch.isChecked() else []
        return tuple(
            item.data(Qt.ItemDataRole.UserRole) for item in items if item.checkState() is Qt.CheckState.Checked
        )

    def tick(self, *names: str) -> None:
        """Switch on and tick quantities."""
        self.switch.setChecked(True)
        for k in range(self.list.count()):
            if self.list.item(k).data(Qt.ItemDataRole.UserRole) in names:
                self.list.item(k).setCheckState(Qt.CheckState.Checked)
