"""A histogram that selects by dragging, with handles for the ends of the colour map."""

import numpy as np
from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QMouseEvent, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QSizePolicy, QWidget

from splap_editor.session.selection import SelectionMode
from splap_editor.ui.theme import ACCENT, FAINT, FIELD, LINE, TEXT
from splap_editor.ui.widgets.widget_gestures import WidgetGestures
from splap_editor.viewport.quantity_view import ShownQuantity

HANDLE_PX = 6.0
STRIP_PX = 14.0
SLACK_PX = 3.0


class Histogram(QWidget):
    """How often each value occurs.

    A drag over the bars picks values: `picking` follows it, `picked` ends it,
    `dropped` tells that it came to nothing. The two handles below move the
    ends of the colour map: `range_changed`; a double click there,
    `range_reset`.
    """

    gestures = WidgetGestures(
        "Quantities",
        (
            ("Drag over the histogram", "Select by value; Shift adds, Ctrl removes"),
            ("Drag the marks below it", "Ends of the colours; double click resets"),
        ),
    )

    picking = Signal(float, float, object)
    picked = Signal(float, float, object)
    dropped = Signal()
    range_changed = Signal(float, float)
    range_reset = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setMouseTracking(True)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setToolTip(
            "Drag over the bars to select splats by value; Shift adds, Ctrl removes.\n"
            "Drag the two marks below to set the ends of the colours; double click to reset them."
        )
        self._shown: ShownQuantity | None = None
        self._dragged = ""
        self._ends = (0.0, 0.0)

    def sizeHint(self) -> QSize:
        """As wide as there is room."""
        return QSize(200, 84)

    def show_quantity(self, shown: ShownQuantity | None) -> None:
        """Show another quantity, or nothing."""
        self._shown = shown
        self.update()

    # Places and values --------------------------------------------------------------------------------------------

    @property
    def _drawn(self) -> ShownQuantity:
        """What is shown, for what is asked only while something is."""
        assert self._shown is not None
        return self._shown

    @property
    def _bars(self) -> QRectF:
        return QRectF(HANDLE_PX, 1.0, self.width() - 2 * HANDLE_PX, self.height() - STRIP_PX - 1.0)

    def x_of(self, value: float) -> float:
        """Pixel column of a value, inside of the bars."""
        shown, bars = self._drawn, self._bars
        edges = shown.edges
        low, high = float(edges[0]), float(edges[-1])
        if shown.is_log:
            low, high, value = np.log(low), np.log(high), np.log(max(value, edges[0] * 1e-6))
        return bars.left() + bars.width() * float(np.clip((value - low) / (high - low), 0.0, 1.0))

    def value_at(self, x: float) -> float:
        """Value at a pixel column."""
        shown, bars = self._drawn, self._bars
        edges = shown.edges
        share = float(np.clip((x - bars.left()) / bars.width(), 0.0, 1.0))
        if share in (0.0, 1.0):
            return float(edges[-1] if share else edges[0])
        if shown.is_log:
            return float(edges[0] * (edges[-1] / edges[0]) ** share)
        return float(edges[0] + share * (edges[-1] - edges[0]))

    # Dragging -----------------------------------------------------------------------------------------------------

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Take a handle, or begin to pick."""
        if event.button() != Qt.MouseButton.LeftButton or self._shown is None:
            return
        x, y = event.position().x(), event.position().y()
        if y < self._bars.bottom():
            self._dragged, self._ends = "pick", (x, x)
        elif not self._shown.quantity.is_label:
            low, high = self.x_of(self._shown.low), self.x_of(self._shown.high)
            self._dragged = "low" if abs(x - low) < abs(x - high) or (low == high and x < low) else "high"

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Follow the drag."""
        x = event.position().x()
        if self._dragged == "pick":
            self._ends = (self._ends[0], x)
            if abs(x - self._ends[0]) > SLACK_PX:
                self.picking.emit(*self._picked(), _mode(event))
            self.update()
        elif self._dragged:
            value = self.value_at(x)
            low, high = self._drawn.low, self._drawn.high
            low, high = (min(value, high), high) if self._dragged == "low" else (low, max(value, low))
            self.range_changed.emit(low, high)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """End the drag."""
        dragged, self._dragged = self._dragged, ""
        if dragged == "pick":
            if abs(event.position().x() - self._ends[0]) > SLACK_PX:
                self._ends = (self._ends[0], event.position().x())
                self.picked.emit(*self._picked(), _mode(event))
            else:
                self.dropped.emit()
        self.update()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Leave the ends to the values again."""
        if event.position().y() >= self._bars.bottom():
            self.range_reset.emit()

    def _picked(self) -> tuple[float, float]:
        low, high = sorted(self._ends)
        return self.value_at(low), self.value_at(high)

    # Painting -----------------------------------------------------------------------------------------------------

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint bars, the picked range and the handles."""
        painter = QPainter(self)
        bars = self._bars
        painter.fillRect(bars, QColor(FIELD))
        if self._shown is None:
            return
        self._paint_bars(painter, bars)
        if self._dragged == "pick":
            left, right = sorted(self._ends)
            tone = QColor(ACCENT)
            tone.setAlpha(70)
            painter.fillRect(QRectF(left, bars.top(), right - left, bars.height()) & bars, tone)
        if not self._shown.quantity.is_label:
            self._paint_handles(painter, bars)

    def _paint_bars(self, painter: QPainter, bars: QRectF) -> None:
        shown = self._drawn
        most = int(shown.counts.max(initial=0))
        if not most:
            return
        middles = 0.5 * (shown.edges[:-1] + shown.edges[1:])
        colors = shown.colors(np.rint(middles) if shown.quantity.is_label else middles)
        width = bars.width() / len(shown.counts)
        for k in np.flatnonzero(shown.counts):
            # The root lets rare values be seen beside common ones.
            height = max(bars.height() * float(np.sqrt(shown.counts[k] / most)), 1.5)
            bar = QRectF(bars.left() + k * width, bars.bottom() - height, max(width - 0.5, 1.0), height)
            painter.fillRect(bar, QColor(*colors[k].tolist()))

    def _paint_handles(self, painter: QPainter, bars: QRectF) -> None:
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        low, high = self.x_of(self._drawn.low), self.x_of(self._drawn.high)
        top = bars.bottom() + 2.0
        painter.fillRect(QRectF(bars.left(), top + 4.0, bars.width(), 2.0), QColor(LINE))
        painter.fillRect(QRectF(low, top + 4.0, high - low, 2.0), QColor(FAINT))
        for x, name in ((low, "low"), (high, "high")):
            painter.setPen(QPen(QColor(TEXT), 1.0, Qt.PenStyle.DotLine))
            painter.drawLine(QPointF(x, bars.top()), QPointF(x, bars.bottom()))
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(ACCENT if self._dragged == name else TEXT))
            painter.drawPolygon(
                QPolygonF([QPointF(x, top), QPointF(x - HANDLE_PX, top + 10.0), QPointF(x + HANDLE_PX, top + 10.0)])
            )


def _mode(event: QMouseEvent) -> SelectionMode:
    shift = bool(event.modifiers() & Qt.KeyboardModifier.ShiftModifier)
    ctrl = bool(event.modifiers() & Qt.KeyboardModifier.ControlModifier)
    if shift and ctrl:
        return SelectionMode.INTERSECT
    if shift:
        return SelectionMode.ADD
    return SelectionMode.REMOVE if ctrl else SelectionMode.REPLACE
