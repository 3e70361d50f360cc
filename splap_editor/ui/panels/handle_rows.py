"""Rows of the list of handles and pins."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QColor, QKeyEvent, QMouseEvent
from PySide6.QtWidgets import QCheckBox, QColorDialog, QFrame, QHBoxLayout, QLineEdit, QToolButton, QWidget

from splap_editor.core.pose import Pose
from splap_editor.engine.edit import PIN_COLOR, Handle, Pin
from splap_editor.ui.theme import STEP, icon
from splap_editor.ui.widgets.plain_text import PlainLabel
from splap_editor.ui.widgets.widget_gestures import WidgetGestures

if TYPE_CHECKING:
    from splap_editor.ui.panels.handles_panel import HandlesPanel

_MORE = Qt.KeyboardModifier.ShiftModifier | Qt.KeyboardModifier.ControlModifier


class ListRow(QFrame):
    """One line of the list: a click anywhere on it chooses what it stands for, with Shift or Ctrl as well.

    Parameters
    ----------
    choose : callable
        ``choose(add)`` chooses what it stands for, or that as well.
    rename : callable
        ``rename(name)`` names it; empty for the usual name.
    """

    def __init__(self, choose: Callable[[bool], None], rename: Callable[[str], None]) -> None:
        super().__init__()
        self.setObjectName("handleRow")
        self._choose, self._rename = choose, rename
        self.name = NameField(choose)
        self.name.editingFinished.connect(self._on_renamed)
        self.delete = tool_button("trash", "Delete")
        self._layout = QHBoxLayout(self)
        self._layout.setContentsMargins(STEP, 2, STEP, 2)
        self._layout.setSpacing(STEP)

    def lay_out(self, *before: QWidget, after: tuple[QWidget, ...] = ()) -> None:
        """Put parts before and after the name; the bin is the last."""
        for part in before:
            self._layout.addWidget(part)
        self._layout.addWidget(self.name, 1)
        for part in (*after, self.delete):
            self._layout.addWidget(part)

    def show_active(self, is_chosen: bool, is_active: bool) -> None:
        """Mark the row of what is chosen, and of the one chosen last."""
        wanted = "last" if is_active else "yes" if is_chosen else "no"
        if self.property("chosen") != wanted:
            self.setProperty("chosen", wanted)
            self.style().unpolish(self)
            self.style().polish(self)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Choose it."""
        self._choose(bool(event.modifiers() & _MORE))

    def _on_renamed(self) -> None:
        self._rename(self.name.text().strip())


class NameField(QLineEdit):
    """A name that a double click edits in place; a click chooses its row and leaves the keys with the picture."""

    gestures = WidgetGestures("Handles", (("Double click on a name in the list", "Rename it"),))

    def __init__(self, choose: Callable[[bool], None]) -> None:
        super().__init__()
        self.setToolTip("Double click to rename")
        self.setObjectName("nameField")
        self._choose = choose
        self._before = ""
        self.editingFinished.connect(self._rest)
        self._rest()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Choose the row; while the name is edited, put the caret there."""
        if self.isReadOnly():
            self._choose(bool(event.modifiers() & _MORE))
        else:
            super().mousePressEvent(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Select text only while the name is edited."""
        if not self.isReadOnly():
            super().mouseMoveEvent(event)

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Edit the name."""
        if not self.isReadOnly():
            super().mouseDoubleClickEvent(event)
            return
        self._before = self.text()
        self.setReadOnly(False)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setCursor(Qt.CursorShape.IBeamCursor)
        self.setFocus()
        self.selectAll()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Escape leaves the name as it was."""
        if event.key() == Qt.Key.Key_Escape:
            self.setText(self._before)
        super().keyPressEvent(event)

    def _rest(self) -> None:
        """Be a label again, which no key goes to."""
        self.setReadOnly(True)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setCursor(Qt.CursorShape.ArrowCursor)
        self.deselect()


class HandleRow(ListRow):
    """Switch, swatch, name, reset and delete of one handle."""

    def __init__(self, handle_id: int, panel: HandlesPanel) -> None:
        super().__init__(
            lambda add: panel.choose_handle(handle_id, add=add),
            lambda name: panel.change_handle(handle_id, "Rename handle", name=name or f"Handle {handle_id}"),
        )
        self._id, self._panel = handle_id, panel
        self._color = ""
        self.swatch = QToolButton(autoRaise=True)
        self.swatch.setToolTip("Colour")
        self.swatch.setFixedSize(20, 20)
        self.swatch.clicked.connect(self._on_swatch_clicked)
        self.is_enabled = QCheckBox()
        self.is_enabled.setToolTip("A switched-off handle neither moves nor holds anything")
        self.is_enabled.clicked.connect(lambda on: panel.change_handle(self._id, "Switch handle", enabled=on))
        self.reset = tool_button("reset", "Put it back to rest")
        self.reset.clicked.connect(lambda: panel.change_handle(self._id, "Reset pose", pose=Pose()))
        self.delete.clicked.connect(lambda: panel.delete_handle(self._id))
        self.lay_out(self.is_enabled, self.swatch, after=(self.reset,))

    def show_handle(self, handle: Handle) -> None:
        """Show a handle's name, colour and state."""
        self._color = handle.color
        # One that only holds looks like the pin it is.
        self.swatch.setStyleSheet(swatch_style(handle.color, "7px" if handle.frees else "0px"))
        if not self.name.hasFocus():
            self.name.setText(handle.name)
        self.is_enabled.setChecked(handle.enabled)
        self.reset.setEnabled(not handle.pose.is_identity)

    def _on_swatch_clicked(self) -> None:
        dialog = QColorDialog(QColor(self._color), self)
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.colorSelected.connect(
            lambda color: self._panel.change_handle(self._id, "Colour handle", color=color.name())
        )
        dialog.open()


class PinRow(ListRow):
    """Mark, name, number of splats and delete of one pin."""

    def __init__(self, pin_id: int, panel: HandlesPanel) -> None:
        super().__init__(
            lambda add: panel.choose_pin(pin_id, add=add),
            lambda name: panel.change_pin(pin_id, "Rename pin", name=name or f"Pin {pin_id}"),
        )
        # As wide as a handle's switch and swatch: names stand under names.
        self._mark = QToolButton(autoRaise=True)
        self._mark.setToolTip("Pin: stays where it is")
        self._mark.setFixedSize(20, 20)
        self._mark.setStyleSheet(swatch_style(PIN_COLOR, "0px"))
        self._mark.clicked.connect(lambda: panel.choose_pin(pin_id, add=False))
        space = QWidget()
        space.setFixedWidth(self._switch_width())
        self.held = PlainLabel()
        self.held.setProperty("tone", "quiet")
        self.delete.clicked.connect(lambda: panel.delete_pin(pin_id))
        self.lay_out(space, self._mark, after=(self.held,))

    def show_pin(self, pin: Pin, n_splats: int) -> None:
        """Show a pin's name, and how many splats it holds."""
        if not self.name.hasFocus():
            self.name.setText(pin.name)
        self.held.setText(f"{n_splats:,}")
        self.held.setToolTip(f"Holds {n_splats:,} splats")

    def _switch_width(self) -> int:
        return QCheckBox().sizeHint().width()


def swatch_style(color: str, radius: str) -> str:
    """Style of a small field of colour."""
    return f"QToolButton {{ background: {color}; border-radius: {radius}; margin: 3px; padding: 0; }}"


def tool_button(name: str, tip: str) -> QToolButton:
    """Small button with an icon."""
    button = QToolButton(autoRaise=True)
    button.setIcon(icon(name))
    button.setIconSize(QSize(16, 16))
    button.setToolTip(tip)
    return button
