"""What is painted over the picture without rendering it again."""

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QPainter, QPainterPath, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QWidget

from splap_editor.tools.tool import Hud
from splap_editor.ui.theme import ACCENT, STEP

_SHADE = QColor(16, 17, 19, 190)


class Overlay(QWidget):
    """Lasso, rubber band, brush circle, a line of text, a hint and the drop frame, over the viewport.

    It takes no input. Updating it composes the window anew but renders no VTK frame.
    """

    def __init__(self, hud: Hud, parent: QWidget) -> None:
        super().__init__(parent)
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self.setAttribute(Qt.WidgetAttribute.WA_NoSystemBackground)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._hud = hud
        self._hint: tuple[str, ...] = ()
        self._drop_text = ""
        hud.changed.connect(self.update)

    @property
    def hint(self) -> tuple[str, ...]:
        """Lines shown at the lower edge until they are taken away."""
        return self._hint

    def show_hint(self, *lines: str) -> None:
        """Show lines of text at the lower edge; none takes them away."""
        if lines != self._hint:
            self._hint = lines
            self.update()

    def show_drop(self, text: str) -> None:
        """Frame the picture while a file is held over it; an empty text takes the frame away."""
        if text != self._drop_text:
            self._drop_text = text
            self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint what there is."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        self._paint_outline(painter)
        self._paint_circle(painter)
        if self._hint:
            self._paint_hint(painter)
        if self._hud.text:
            self._paint_text(painter)
        if self._drop_text:
            self._paint_drop(painter)

    def _paint_outline(self, painter: QPainter) -> None:
        if len(self._hud.outline) < 2:
            return
        ratio = self.devicePixelRatioF()
        polygon = QPolygonF([QPointF(x / ratio, y / ratio) for x, y in self._hud.outline])
        painter.setBrush(_faded(ACCENT, 28))
        painter.setPen(QPen(QColor(0, 0, 0, 150), 2.5))
        painter.drawPolygon(polygon)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(QPen(QColor(ACCENT), 1.2, Qt.PenStyle.DashLine))
        painter.drawPolygon(polygon)

    def _paint_circle(self, painter: QPainter) -> None:
        if self._hud.circle is None:
            return
        ratio = self.devicePixelRatioF()
        x, y, radius = (number / ratio for number in self._hud.circle)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        for pen in (QPen(QColor(0, 0, 0, 150), 2.5), QPen(QColor("#ffffff"), 1.2)):
            painter.setPen(pen)
            painter.drawEllipse(QPointF(x, y), radius, radius)

    def _paint_hint(self, painter: QPainter) -> None:
        font = self.font()
        font.setPointSizeF(font.pointSizeF() * 1.15)
        metrics = QFontMetricsF(font)
        width = max(metrics.horizontalAdvance(line) for line in self._hint) + 8 * STEP
        height = metrics.lineSpacing() * len(self._hint) + 5 * STEP
        box = QRectF((self.width() - width) / 2, self.height() - height - 8 * STEP, width, height)
        paint_box(painter, box)
        painter.setFont(font)
        painter.setPen(QColor("#f2f2f4"))
        painter.drawText(box, Qt.AlignmentFlag.AlignCenter, "\n".join(self._hint))

    def _paint_text(self, painter: QPainter) -> None:
        painter.setFont(self.font())
        metrics = QFontMetricsF(self.font())
        lines = self._hud.text.split("\n")
        width = max(metrics.horizontalAdvance(line) for line in lines) + 4 * STEP
        height = metrics.lineSpacing() * len(lines) + 2 * STEP
        box = QRectF(3 * STEP, self.height() - height - 3 * STEP, width, height)
        paint_box(painter, box)
        painter.setPen(QColor("#f2f2f4"))
        text = box.adjusted(2 * STEP, 0, -STEP, 0)
        painter.drawText(text, Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignLeft, self._hud.text)

    def _paint_drop(self, painter: QPainter) -> None:
        painter.fillRect(self.rect(), QColor(16, 17, 19, 140))
        frame = QRectF(self.rect()).adjusted(4 * STEP, 4 * STEP, -4 * STEP, -4 * STEP)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(QPen(QColor(ACCENT), 2, Qt.PenStyle.DashLine))
        painter.drawRoundedRect(frame, 8, 8)
        font = self.font()
        font.setPointSizeF(font.pointSizeF() * 1.5)
        painter.setFont(font)
        painter.setPen(QColor("#ffffff"))
        painter.drawText(frame, Qt.AlignmentFlag.AlignCenter, self._drop_text)


def paint_box(painter: QPainter, box: QRectF) -> None:
    """Darken the picture behind words."""
    path = QPainterPath()
    path.addRoundedRect(box, 6, 6)
    painter.fillPath(path, _SHADE)


def _faded(color: str, alpha: int) -> QColor:
    result = QColor(color)
    result.setAlpha(alpha)
    return result
