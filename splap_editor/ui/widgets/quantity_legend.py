"""What the colours of the shown quantity mean."""

import numpy as np
from PySide6.QtCore import QEvent, QObject, QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QPainter, QPainterPath, QPaintEvent
from PySide6.QtWidgets import QWidget

from splap_editor.ui.theme import STEP
from splap_editor.ui.widgets.overlay import SHADE
from splap_editor.viewport.colormaps import UNDEFINED, label_colors
from splap_editor.viewport.quantity_view import QuantityView, ShownQuantity, value_text

BAR_PX = 200
BAR_HEIGHT_PX = 10
INK = QColor("#f2f2f4")
MOST_LABELS = 6


class QuantityLegend(QWidget):
    """A colour bar with its ends at the upper left of the viewport; it takes no input.

    Parameters
    ----------
    view : QuantityView
        Shown while it shows something.
    parent : QWidget
        The viewport.
    """

    def __init__(self, view: QuantityView, parent: QWidget) -> None:
        super().__init__(parent)
        self._view = view
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        parent.installEventFilter(self)
        view.changed.connect(self._show)
        self._show()

    @property
    def title(self) -> str:
        """Name of the quantity shown; empty while none is."""
        shown = self._view.shown
        return "" if shown is None else shown.quantity.label + (" (log)" if shown.is_log else "")

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Stay in the corner."""
        if event.type() == QEvent.Type.Resize:
            self._place()
        return False

    def _show(self) -> None:
        self.setVisible(bool(self.title))
        self._place()
        self.update()

    def _place(self) -> None:
        shown = self._view.shown
        if not self.title or shown is None:
            return
        line = QFontMetricsF(self.font()).lineSpacing()
        n_lines = 1 + (len(_labels(shown)) if shown.quantity.is_label else 1)
        height = n_lines * line + 5 * STEP + (0 if shown.quantity.is_label else BAR_HEIGHT_PX)
        self.setGeometry(3 * STEP, 3 * STEP, BAR_PX + 6 * STEP, round(height))

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint title, colours and ends."""
        shown = self._view.shown
        if shown is None:
            return
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        box = QPainterPath()
        box.addRoundedRect(QRectF(self.rect()), 6, 6)
        painter.fillPath(box, SHADE)
        painter.setPen(INK)
        line = QFontMetricsF(self.font()).lineSpacing()
        left, top = 3.0 * STEP, 2.0 * STEP
        painter.drawText(QRectF(left, top, BAR_PX, line), self.title)
        top += line + STEP
        if shown.quantity.is_label:
            for text, color in _labels(shown):
                painter.fillRect(QRectF(left, top + 0.25 * line, 0.5 * line, 0.5 * line), QColor(*color))
                painter.drawText(QRectF(left + line, top, BAR_PX, line), text)
                top += line
        else:
            _paint_bar(painter, shown, left, top, line)


def _labels(shown: ShownQuantity) -> list[tuple[str, tuple[int, ...]]]:
    """Words and colours of the commonest labels."""
    known = shown.values[np.isfinite(shown.values)].astype(np.int64)
    counts = np.bincount(known) if known.size else np.zeros(0, np.int64)
    wanted = [k for k in range(len(counts)) if counts[k]][:MOST_LABELS]
    colors = label_colors(np.array(wanted, np.float64))
    lines = [
        (f"{value_text(shown.quantity, float(k))}: {counts[k]:,} splats", tuple(color))
        for k, color in zip(wanted, colors.tolist(), strict=True)
    ]
    n_more = int(np.count_nonzero(counts)) - len(wanted)
    return lines + ([(f"and {n_more:,} more", UNDEFINED)] if n_more else [])


def _paint_bar(painter: QPainter, shown: ShownQuantity, left: float, top: float, line: float) -> None:
    places = (np.arange(BAR_PX) + 0.5) / BAR_PX
    if shown.is_log:
        values = shown.low * (shown.high / shown.low) ** places
    else:
        values = shown.low + places * (shown.high - shown.low)
    for k, color in enumerate(shown.colors(values).tolist()):
        painter.fillRect(QRectF(left + k, top, 1.0, BAR_HEIGHT_PX), QColor(*color))
    row = QRectF(left, top + BAR_HEIGHT_PX + 2.0, BAR_PX, line)
    ends = (shown.low, Qt.AlignmentFlag.AlignLeft), (shown.high, Qt.AlignmentFlag.AlignRight)
    for value, side in ends:
        painter.drawText(row, side | Qt.AlignmentFlag.AlignTop, value_text(shown.quantity, value))
