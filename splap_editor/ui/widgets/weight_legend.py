"""What the bands of colour mean while the weights of a handle are shown."""

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QPainter
from PySide6.QtWidgets import QWidget

from splap_editor.ui.theme import STEP
from splap_editor.ui.widgets.legend import LEFT, Legend
from splap_editor.viewport.weight_colors import BAND_COLORS, REST_COLOR
from splap_editor.viewport.weight_view import WeightView

BAND_PX = 18
BAR_PX = 10


class WeightLegend(Legend):
    """A strip of bands at the lower right of the viewport; it takes no input.

    Parameters
    ----------
    weights : WeightView
        Shown while it shows a handle.
    parent : QWidget
        The viewport.
    """

    def __init__(self, weights: WeightView, parent: QWidget) -> None:
        self._weights = weights
        super().__init__(weights.changed, parent)

    @property
    def title(self) -> str:
        """Whose weights are shown; empty while none are."""
        return f"Weight of {self._weights.handle.name}" if self._weights.handle is not None else ""

    def _place(self, metrics: QFontMetricsF) -> None:
        bar = BAND_PX * (len(BAND_COLORS) + 1) + STEP
        width = max(bar, metrics.horizontalAdvance(self.title)) + 6 * STEP
        height = 2 * metrics.lineSpacing() + BAR_PX + 5 * STEP
        parent = self.parentWidget()
        assert parent is not None
        self.setGeometry(
            round(parent.width() - width) - 3 * STEP,
            round(parent.height() - height) - 3 * STEP,
            *map(round, (width, height)),
        )

    def _paint_colors(self, painter: QPainter, top: float, line: float) -> None:
        painter.fillRect(QRectF(LEFT, top, BAND_PX, BAR_PX), QColor(*REST_COLOR))
        first = LEFT + BAND_PX + STEP
        for k, color in enumerate(BAND_COLORS.tolist()):
            painter.fillRect(QRectF(first + k * BAND_PX, top, BAND_PX, BAR_PX), QColor(*color))
        top += BAR_PX + STEP / 2
        painter.setPen(QColor("#b9bac0"))
        center = Qt.AlignmentFlag.AlignCenter
        painter.drawText(QRectF(LEFT - STEP, top, BAND_PX + 2 * STEP, line), center, "rest")
        for k in (0, 5, 10):
            if k:
                painter.drawText(QRectF(first + (k - 1) * BAND_PX, top, 2 * BAND_PX, line), center, f"{k / 10:g}")
