"""What colours in the picture mean, in a shaded box in one of its corners."""

from abc import abstractmethod

from PySide6.QtCore import QEvent, QObject, QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QPainter, QPaintEvent
from PySide6.QtWidgets import QWidget

from splap_editor.session.signals import Signal
from splap_editor.ui.theme import STEP
from splap_editor.ui.widgets.overlay import paint_box

INK = QColor("#f2f2f4")
LEFT, TOP = 3.0 * STEP, 2.0 * STEP


class Legend(QWidget):
    """A title and what stands below it, shown while there is something to tell; it takes no input.

    Parameters
    ----------
    changed : Signal
        Something else is to be told, or nothing.
    parent : QWidget
        The viewport.
    """

    def __init__(self, changed: Signal, parent: QWidget) -> None:
        super().__init__(parent)
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        parent.installEventFilter(self)
        changed.connect(self._show)
        self._show()

    @property
    @abstractmethod
    def title(self) -> str:
        """What the colours tell; empty while they tell nothing."""

    @abstractmethod
    def _place(self, metrics: QFontMetricsF) -> None:
        """Take the room it needs, in its corner."""

    @abstractmethod
    def _paint_colors(self, painter: QPainter, top: float, line: float) -> None:
        """Paint what stands below the title, whose next line begins at ``top``."""

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Stay in the corner."""
        if event.type() == QEvent.Type.Resize:
            self._stay()
        return False

    def _show(self) -> None:
        self.setVisible(bool(self.title))
        self._stay()
        self.update()

    def _stay(self) -> None:
        if self.title:
            self._place(QFontMetricsF(self.font()))

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint box, title and colours."""
        if not self.title:
            return
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        paint_box(painter, QRectF(self.rect()))
        metrics = QFontMetricsF(self.font())
        width, line = self.width() - 2 * LEFT, metrics.lineSpacing()
        painter.setPen(INK)
        painter.drawText(
            QRectF(LEFT, TOP, width, line), metrics.elidedText(self.title, Qt.TextElideMode.ElideRight, width)
        )
        self._paint_colors(painter, TOP + line + STEP, line)
