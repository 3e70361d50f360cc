"""What the bands of colour mean while the weights of a handle are shown."""

from PySide6.QtCore import QEvent, QObject, QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QPainter, QPainterPath, QPaintEvent
from PySide6.QtWidgets import QWidget

from splap_editor.ui.theme import STEP
from splap_editor.ui.widgets.overlay import SHADE
from splap_editor.viewport.weight_colors import BAND_COLORS, REST_COLOR
from splap_editor.viewport.weight_view import WeightView

BAND_PX = 18
BAR_PX = 10


class WeightLegend(QWidget):
    """A strip of bands at the lower right of the viewport; it takes no input.

    Parameters
    ----------
    weights : WeightView
        Shown while it shows a handle.
    parent : QWidget
        The viewport.
    """

    def __init__(self, weights: WeightView, parent: QWidget) -> None:
        super().__init__(parent)
        self._weights = weights
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        parent.installEventFilter(self)
        weights.changed.connect(self._show)
        self._show()

    @property
    def title(self) -> str:
        """Whose weights are shown; empty while none are."""
        return f"Weight of {self._weights.handle.name}" if self._weights.handle is not None else ""

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
        metrics = QFontMetricsF(self.font())
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

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint title, bands and their limits."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        box = QPainterPath()
        box.addRoundedRect(QRectF(self.rect()), 6, 6)
        painter.fillPath(box, SHADE)
        metrics = QFontMetricsF(self.font())
        line = metrics.lineSpacing()
        left, top = 3.0 * STEP, 2.0 * STEP
        painter.setPen(QColor("#f2f2f4"))
        painter.drawText(
            QRectF(left, top, self.width() - 2 * left, line),
            metrics.elidedText(self.title, Qt.TextElideMode.ElideRight, self.width() - 2 * left),
        )
        top += line + STEP
        painter.fillRect(QRectF(left, top, BAND_PX, BAR_PX), QColor(*REST_COLOR))
        first = left + BAND_PX + STEP
        for k, color in enumerate(BAND_COLORS.tolist()):
            painter.fillRect(QRectF(first + k * BAND_PX, top, BAND_PX, BAR_PX), QColor(*color))
        top += BAR_PX + STEP / 2
        painter.setPen(QColor("#b9bac0"))
        center = Qt.AlignmentFlag.AlignCenter
        painter.drawText(QRectF(left - STEP, top, BAND_PX + 2 * STEP, line), center, "rest")
        for k in (0, 5, 10) if first - left > 0 else ():
            if k:
                painter.drawText(QRectF(first + (k - 1) * BAND_PX, top, 2 * BAND_PX, line), center, f"{k / 10:g}")
