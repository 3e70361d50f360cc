"""Numbers a person types, or drags by their label."""

from PySide6.QtCore import QEvent, QPoint, Qt, Signal
from PySide6.QtGui import QEnterEvent, QKeyEvent, QMouseEvent, QWheelEvent
from PySide6.QtWidgets import QDoubleSpinBox, QWidget

from splap_editor.ui.widgets.plain_text import PlainLabel
from splap_editor.ui.widgets.widget_gestures import WidgetGestures


class NumberField(QDoubleSpinBox):
    """A number with its unit; it tells a finished entry, never each key.

    The wheel is left to the panel unless the field has the focus, so that
    scrolling past it changes nothing.
    """

    gestures = WidgetGestures("Numbers", (("Return, Esc", "Take it, leave it: the keys are the picture's again"),))

    committed = Signal(float)

    def __init__(
        self,
        low: float,
        high: float,
        *,
        decimals: int = 3,
        step: float = 0.1,
        unit: str = "",
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self.setRange(low, high)
        self.setDecimals(decimals)
        self.setSingleStep(step)
        self.setSuffix(f" {unit}" if unit else "")
        self.setKeyboardTracking(False)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setMinimumWidth(48)
        self.lineEdit().setTextMargins(5, 0, 2, 0)
        self.valueChanged.connect(self.committed)

    def show_value(self, value: float) -> None:
        """Show a value without telling anyone; one that is being typed is left alone."""
        if self.hasFocus() and self.lineEdit().isModified():
            return
        self.blockSignals(True)
        self.setValue(value)
        self.blockSignals(False)

    def textFromValue(self, value: float) -> str:
        """Trim zeros that say nothing."""
        text = self.locale().toString(value, "f", self.decimals())
        point = self.locale().decimalPoint()
        if point in text:
            text = text.rstrip("0").rstrip(point)
        return "0" if text in ("-0", "−0") else text

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Step only while focused."""
        if self.hasFocus():
            super().wheelEvent(event)
        else:
            event.ignore()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Enter takes what was typed, Escape drops it; the window then has the keyboard go to the picture."""
        if event.key() == Qt.Key.Key_Escape:
            self.setValue(self.value())
            self.lineEdit().setModified(False)
        super().keyPressEvent(event)
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter, Qt.Key.Key_Escape):
            event.ignore()


class ScrubLabel(PlainLabel):
    """A label that changes its number when dragged sideways: a step each few pixels, finer with Shift.

    `started` comes before the first change, `finished` after the last.
    """

    PIXELS_PER_STEP = 4
    gestures = WidgetGestures("Numbers", (("Drag a label sideways", "Change the number; Shift finely"),))

    started = Signal()
    moved = Signal(float)
    finished = Signal()
    cancelled = Signal()

    def __init__(self, text: str, field: NumberField, parent: QWidget | None = None) -> None:
        super().__init__(text, parent)
        self._field = field
        self._from: QPoint | None = None
        self._value = 0.0
        self._is_moving = False
        self.setCursor(Qt.CursorShape.SizeHorCursor)
        self.setProperty("tone", "quiet")
        self.setToolTip("Drag sideways to change; Shift for fine steps")

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Remember where and at what value the drag starts."""
        if event.button() == Qt.MouseButton.LeftButton and self._field.isEnabled():
            self._from = event.globalPosition().toPoint()
            self._value = self._field.value()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Turn the way gone into steps."""
        if self._from is None:
            return
        steps = (event.globalPosition().x() - self._from.x()) / self.PIXELS_PER_STEP
        if not self._is_moving:
            if abs(steps) < 1:
                return
            self._is_moving = True
            self.started.emit()
        fine = 0.1 if event.modifiers() & Qt.KeyboardModifier.ShiftModifier else 1.0
        value = self._value + steps * fine * self._field.singleStep()
        self.moved.emit(min(max(value, self._field.minimum()), self._field.maximum()))

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """End the drag, or focus the field when there was none."""
        if self._from is None:
            return
        self._from = None
        if self._is_moving:
            self._is_moving = False
            self.finished.emit()
        else:
            self._field.setFocus()
            self._field.selectAll()

    def enterEvent(self, event: QEnterEvent) -> None:
        """Show that it can be dragged."""
        self._tone("")
        super().enterEvent(event)

    def leaveEvent(self, event: QEvent) -> None:
        """Fall quiet again."""
        self._tone("quiet")
        super().leaveEvent(event)

    def _tone(self, tone: str) -> None:
        set_tone(self, tone)


def set_tone(widget: QWidget, tone: str) -> None:
    """Give a widget the colours that the style sheet keeps for a tone."""
    if widget.property("tone") != tone:
        widget.setProperty("tone", tone)
        widget.style().unpolish(widget)
        widget.style().polish(widget)
