"""What the colours of the shown quantity mean."""

import numpy as np
from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QPainter
from PySide6.QtWidgets import QWidget

from splap_editor.ui.theme import STEP
from splap_editor.ui.widgets.legend import LEFT, Legend
from splap_editor.viewport.colormaps import UNDEFINED, label_colors
from splap_editor.viewport.quantity_view import QuantityView, ShownQuantity, value_text

BAR_PX = 200
BAR_HEIGHT_PX = 10
MOST_LABELS = 6


class QuantityLegend(Legend):
    """A colour bar with its ends at the upper left of the viewport; it takes no input.

    Parameters
    ----------
    view : QuantityView
        Shown while it shows something.
    parent : QWidget
        The viewport.
    """

    def __init__(self, view: QuantityView, parent: QWidget) -> None:
        self._view = view
        super().__init__(view.changed, parent)

    @property
    def title(self) -> str:
        """Name of the quantity shown; empty while none is."""
        shown = self._view.shown
        return "" if shown is None else shown.quantity.label + (" (log)" if shown.is_log else "")

    def _place(self, metrics: QFontMetricsF) -> None:
        shown = self._view.shown
        assert shown is not None  # else there is no title
        line = metrics.lineSpacing()
        n_lines = 1 + (len(_labels(shown)) if shown.quantity.is_label else 1)
        height = n_lines * line + 5 * STEP + (0 if shown.quantity.is_label else BAR_HEIGHT_PX)
        self.setGeometry(3 * STEP, 3 * STEP, BAR_PX + 6 * STEP, round(height))

    def _paint_colors(self, painter: QPainter, top: float, line: float) -> None:
        shown = self._view.shown
        assert shown is not None  # else there is no title
        if not shown.quantity.is_label:
            _paint_bar(painter, shown, top, line)
            return
        for text, color in _labels(shown):
            painter.fillRect(QRectF(LEFT, top + 0.25 * line, 0.5 * line, 0.5 * line), QColor(*color))
            painter.drawText(QRectF(LEFT + line, top, BAR_PX, line), text)
            top += line


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


def _paint_bar(painter: QPainter, shown: ShownQuantity, top: float, line: float) -> None:
    places = (np.arange(BAR_PX) + 0.5) / BAR_PX
    if shown.is_log:
        values = shown.low * (shown.high / shown.low) ** places
    else:
        values = shown.low + places * (shown.high - shown.low)
    for k, color in enumerate(shown.colors(values).tolist()):
        painter.fillRect(QRectF(LEFT + k, top, 1.0, BAR_HEIGHT_PX), QColor(*color))
    row = QRectF(LEFT, top + BAR_HEIGHT_PX + 2.0, BAR_PX, line)
    ends = (shown.low, Qt.AlignmentFlag.AlignLeft), (shown.high, Qt.AlignmentFlag.AlignRight)
    for value, side in ends:
        painter.drawText(row, side | Qt.AlignmentFlag.AlignTop, value_text(shown.quantity, value))
