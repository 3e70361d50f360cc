"""Frames as a ruler: keys as diamonds, the frame shown as a line; both can be dragged."""

from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QContextMenuEvent, QKeyEvent, QMouseEvent, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QMenu, QSizePolicy, QWidget

from splap_editor.core.timeline import Timeline
from splap_editor.ui.theme import ACCENT, FAINT, FIELD, LINE, QUIET, STEP, TEXT
from splap_editor.ui.widgets.widget_gestures import WidgetGestures

MARGIN = 4 * STEP
LABEL_PX = 56
DIAMOND_PX = 5.5
REACH_PX = 8.0
STEPS = tuple(digit * 10**power for power in range(6) for digit in (1, 2, 5))


class TimelineRuler(QWidget):
    """Shows a timeline; says what a person does to it and changes nothing itself.

    ``scrubbed(frame)`` comes while the line is dragged, ``chosen(frame)`` at
    the end; ``key_moved(frame, to)`` when a diamond is let go elsewhere,
    ``key_deleted(frame)`` from its menu.
    """

    gestures = WidgetGestures(
        "Frames",
        (
            ("Drag the line", "Look at a frame"),
            ("Drag a diamond, Esc", "Move a key, drop it where it was"),
            ("Right click on a diamond", "Delete the key"),
        ),
    )

    scrubbed = Signal(int)
    chosen = Signal(int)
    key_moved = Signal(int, int)
    key_deleted = Signal(int)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setMouseTracking(True)
        self._timeline = Timeline()
        self._is_scrubbing = False
        self._dragged: int | None = None
        self._dragged_to = 0
        self._hovered: int | None = None

    def sizeHint(self) -> QSize:
        """Two lines high."""
        return QSize(400, 40)

    def show_timeline(self, timeline: Timeline) -> None:
        """Show this timeline."""
        if timeline != self._timeline:
            self._timeline = timeline
            self.update()

    def x_of(self, frame: float) -> float:
        """Where a frame is, in logical pixels from the left."""
        return MARGIN + (frame - 1) * (self.width() - 2 * MARGIN) / max(self._timeline.n_frames - 1, 1)

    def frame_at(self, x: float) -> int:
        """The frame nearest to a place, of those that play."""
        share = (x - MARGIN) / max(self.width() - 2 * MARGIN, 1)
        return min(max(1 + round(share * (self._timeline.n_frames - 1)), 1), self._timeline.n_frames)

    def key_at(self, x: float) -> int | None:
        """The frame of the diamond within reach of a place."""
        near = min(self._timeline.key_frames, key=lambda frame: abs(self.x_of(frame) - x), default=None)
        return near if near is not None and abs(self.x_of(near) - x) <= REACH_PX else None

    # ---------------------------------------------------------------- mouse

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Take hold of a diamond in the lower half, else of the line."""
        if event.button() != Qt.MouseButton.LeftButton:
            return
        self.setFocus()
        x = event.position().x()
        key = self.key_at(x) if event.position().y() >= self.height() / 2 else None
        if key is not None:
            self._dragged = self._dragged_to = key
        else:
            self._is_scrubbing = True
            self.scrubbed.emit(self.frame_at(x))

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Move what is held; light up what could be."""
        x = event.position().x()
        if self._dragged is not None:
            self._dragged_to = self.frame_at(x)
        elif self._is_scrubbing:
            self.scrubbed.emit(self.frame_at(x))
        else:
            self._hovered = self.key_at(x)
            self.setToolTip(f"Key at frame {self._hovered}" if self._hovered is not None else "")
        self.update()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Let go; a diamond that was not moved is gone to."""
        if event.button() != Qt.MouseButton.LeftButton:
            return
        dragged, self._dragged = self._dragged, None
        was_scrubbing, self._is_scrubbing = self._is_scrubbing, False
        if dragged is not None and self._dragged_to != dragged:
            self.key_moved.emit(dragged, self._dragged_to)
        elif dragged is not None:
            self.chosen.emit(dragged)
        elif was_scrubbing:
            self.chosen.emit(self.frame_at(event.position().x()))
        self.update()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Escape drops a diamond where it was."""
        if event.key() == Qt.Key.Key_Escape and self._dragged is not None:
            self._dragged = None
            self.update()
        else:
            super().keyPressEvent(event)

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        """Offer to delete the key under the pointer."""
        key = self.key_at(event.pos().x())
        if key is not None:
            menu = QMenu(self)
            menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
            menu.addAction("Delete key").triggered.connect(lambda: self.key_deleted.emit(key))
            menu.popup(event.globalPos())

    # ---------------------------------------------------------------- picture

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint frames, keys and the line."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        middle = self.height() / 2
        painter.fillRect(QRectF(0, middle, self.width(), middle), QColor(FIELD))
        self._paint_ticks(painter, middle)
        line = QPen(QColor(ACCENT), 1.5)
        x = self.x_of(min(self._timeline.frame, self._timeline.n_frames))
        painter.setPen(line)
        painter.drawLine(QPointF(x, middle - 7), QPointF(x, self.height() - 2))
        for frame in self._timeline.key_frames:
            if frame <= self._timeline.n_frames:
                self._paint_diamond(painter, self._dragged_to if frame == self._dragged else frame, middle)

    def _paint_ticks(self, painter: QPainter, middle: float) -> None:
        last = self._timeline.n_frames
        per_frame = (self.width() - 2 * MARGIN) / max(last - 1, 1)
        labelled = next((step for step in STEPS if step * per_frame >= LABEL_PX), STEPS[-1])
        ticked = next((step for step in STEPS if step * per_frame >= LABEL_PX / 8), STEPS[-1])
        for frame in sorted({1, *range(ticked, last + 1, ticked)}):
            x = self.x_of(frame)
            is_labelled = frame == 1 or frame % labelled == 0
            painter.setPen(QPen(QColor(FAINT if is_labelled else LINE), 1.0))
            painter.drawLine(QPointF(x, middle - (6 if is_labelled else 3)), QPointF(x, middle))
            # The label of the first frame makes room for the next one.
            if is_labelled and (frame != 1 or labelled * per_frame >= LABEL_PX):
                painter.setPen(QColor(QUIET))
                box = QRectF(x - LABEL_PX / 2, 0, LABEL_PX, middle - 5)
                painter.drawText(box, Qt.AlignmentFlag.AlignCenter, str(frame))

    def _paint_diamond(self, painter: QPainter, frame: int, middle: float) -> None:
        x, y, size = self.x_of(frame), 1.5 * middle, DIAMOND_PX
        is_lit = frame in (self._hovered, self._timeline.frame)
        painter.setPen(QPen(QColor(TEXT if is_lit else QUIET), 1.2))
        painter.setBrush(QColor(ACCENT if frame == self._timeline.frame else LINE))
        painter.drawPolygon(
            QPolygonF([QPointF(x, y - size), QPointF(x + size, y), QPointF(x, y + size), QPointF(x - size, y)])
        )
