"""Frames as a ruler: keys as diamonds, the camera's in a row of their own, the frame shown as a line; all draggable."""

from typing import NamedTuple

from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QContextMenuEvent, QKeyEvent, QMouseEvent, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QMenu, QSizePolicy, QWidget

from splap_editor.core.timeline import Timeline
from splap_editor.ui.theme import ACCENT, FAINT, FIELD, LINE, QUIET, STEP, TEXT
from splap_editor.ui.widgets.widget_gestures import WidgetGestures

MARGIN = 5 * STEP
LABEL_PX = 56
DIAMOND_PX = 5.5
REACH_PX = 8.0
ROW_PX = 20
STEPS = tuple(digit * 10**power for power in range(6) for digit in (1, 2, 5))


class Mark(NamedTuple):
    """A diamond: a key of the handles, or of the camera, at a frame."""

    frame: int
    is_camera: bool


class TimelineRuler(QWidget):
    """Shows a timeline; says what a person does to it and changes nothing itself.

    ``scrubbed(frame)`` comes while the line is dragged, ``chosen(frame)`` at
    the end; ``key_moved(frame, to)`` when a diamond is let go elsewhere,
    ``key_deleted(frame)`` from its menu, or by a key while it is chosen.
    ``camera_key_moved`` and ``camera_key_deleted`` are the same of the camera's.
    """

    gestures = WidgetGestures(
        "Frames",
        (
            ("Drag the line", "Look at a frame"),
            ("Drag a diamond, Esc", "Move a key, drop it where it was"),
            ("Click on a diamond, then Delete or Backspace", "Go to the key, delete it"),
            ("Right click on a diamond", "Delete the key"),
        ),
    )

    scrubbed = Signal(int)
    chosen = Signal(int)
    key_moved = Signal(int, int)
    key_deleted = Signal(int)
    camera_key_moved = Signal(int, int)
    camera_key_deleted = Signal(int)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setMouseTracking(True)
        self._timeline = Timeline()
        self._is_scrubbing = False
        self._dragged: Mark | None = None
        self._dragged_to = 0
        self._hovered: Mark | None = None
        self._chosen: Mark | None = None

    def sizeHint(self) -> QSize:
        """Two lines high; three where the camera has keys."""
        return QSize(400, ROW_PX * (2 + bool(self._timeline.camera_keys)))

    def show_timeline(self, timeline: Timeline) -> None:
        """Show this timeline."""
        if timeline != self._timeline:
            self._timeline = timeline
            if self._chosen not in self._marks():
                self._chosen = None
            self.updateGeometry()
            self.update()

    def x_of(self, frame: float) -> float:
        """Where a frame is, in logical pixels from the left."""
        return MARGIN + (frame - 1) * (self.width() - 2 * MARGIN) / max(self._timeline.n_frames - 1, 1)

    def frame_at(self, x: float) -> int:
        """The frame nearest to a place, of those that play."""
        share = (x - MARGIN) / max(self.width() - 2 * MARGIN, 1)
        return min(max(1 + round(share * (self._timeline.n_frames - 1)), 1), self._timeline.n_frames)

    def y_of(self, *, is_camera: bool) -> float:
        """Middle of a row of diamonds, in logical pixels from the top."""
        if is_camera:
            return self.height() - ROW_PX / 2
        return (self._top + self.height() - (ROW_PX if self._has_camera else 0)) / 2

    def mark_at(self, x: float, y: float) -> Mark | None:
        """The diamond within reach of a place, in the row that the place is in."""
        if y < self._top:
            return None
        is_camera = self._has_camera and y >= self.height() - ROW_PX
        row = [mark for mark in self._marks() if mark.is_camera == is_camera]
        near = min(row, key=lambda mark: abs(self.x_of(mark.frame) - x), default=None)
        return near if near is not None and abs(self.x_of(near.frame) - x) <= REACH_PX else None

    def _marks(self) -> list[Mark]:
        timeline = self._timeline
        handles = [Mark(frame, False) for frame in timeline.key_frames]
        return handles + [Mark(frame, True) for frame in timeline.camera_key_frames]

    @property
    def _has_camera(self) -> bool:
        return bool(self._timeline.camera_keys)

    @property
    def _top(self) -> float:
        """Where the rows of diamonds begin."""
        return self.height() / (3 if self._has_camera else 2)

    # ---------------------------------------------------------------- mouse

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Take hold of a diamond in its row, else of the line."""
        if event.button() != Qt.MouseButton.LeftButton:
            return
        self.setFocus()
        x = event.position().x()
        self._chosen = self._dragged = self.mark_at(x, event.position().y())
        if self._dragged is not None:
            self._dragged_to = self._dragged.frame
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
            held = self._hovered = self.mark_at(x, event.position().y())
            kind = "Camera key" if held is not None and held.is_camera else "Key"
            self.setToolTip(f"{kind} at frame {held.frame}" if held is not None else "")
        self.update()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Let go; a diamond that was not moved is gone to."""
        if event.button() != Qt.MouseButton.LeftButton:
            return
        dragged, self._dragged = self._dragged, None
        was_scrubbing, self._is_scrubbing = self._is_scrubbing, False
        if dragged is not None and self._dragged_to != dragged.frame:
            self._chosen = Mark(self._dragged_to, dragged.is_camera)
            moved = self.camera_key_moved if dragged.is_camera else self.key_moved
            moved.emit(dragged.frame, self._dragged_to)
        elif dragged is not None:
            self.chosen.emit(dragged.frame)
        elif was_scrubbing:
            self.chosen.emit(self.frame_at(event.position().x()))
        self.update()

    def event(self, event: QEvent) -> bool:
        """Keep Delete for the chosen diamond: in the window it is a shortcut, and removes something else."""
        if event.type() == QEvent.Type.ShortcutOverride and isinstance(event, QKeyEvent) and self._deletes(event):
            event.accept()
            return True
        return super().event(event)

    def _deletes(self, event: QKeyEvent) -> bool:
        return self._chosen is not None and event.key() in (Qt.Key.Key_Delete, Qt.Key.Key_Backspace)

    def _delete(self, mark: Mark) -> None:
        (self.camera_key_deleted if mark.is_camera else self.key_deleted).emit(mark.frame)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Escape drops a diamond where it was; Delete deletes the chosen one."""
        if event.key() == Qt.Key.Key_Escape and self._dragged is not None:
            self._dragged = None
            self.update()
        elif self._chosen is not None and self._deletes(event):
            self._delete(self._chosen)
        else:
            super().keyPressEvent(event)

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        """Offer to delete the key under the pointer."""
        mark = self.mark_at(event.pos().x(), event.pos().y())
        if mark is not None:
            menu = QMenu(self)
            menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
            text = "Delete camera key" if mark.is_camera else "Delete key"
            menu.addAction(text).triggered.connect(lambda: self._delete(mark))
            menu.popup(event.globalPos())

    # ---------------------------------------------------------------- picture

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint frames, keys and the line."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        middle = self._top
        painter.fillRect(QRectF(0, middle, self.width(), self.height() - middle), QColor(FIELD))
        if self._has_camera:
            painter.setPen(QPen(QColor(LINE), 1.0))
            between = self.height() - ROW_PX
            painter.drawLine(QPointF(0, between), QPointF(self.width(), between))
            self._paint_camera(painter, between + ROW_PX / 2)
        self._paint_ticks(painter, middle)
        line = QPen(QColor(ACCENT), 1.5)
        x = self.x_of(min(self._timeline.frame, self._timeline.n_frames))
        painter.setPen(line)
        painter.drawLine(QPointF(x, middle - 7), QPointF(x, self.height() - 2))
        for mark in self._marks():
            if mark.frame <= self._timeline.n_frames:
                self._paint_diamond(painter, mark)

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

    def _paint_camera(self, painter: QPainter, y: float) -> None:
        """A small camera, so that the row is known for what it is."""
        painter.setPen(QPen(QColor(QUIET), 1.2))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawRect(QRectF(1.0, y - 3, 6.5, 6))
        painter.drawPolyline(QPolygonF([QPointF(7.5, y), QPointF(11, y - 2.5), QPointF(11, y + 2.5), QPointF(7.5, y)]))

    def _paint_diamond(self, painter: QPainter, mark: Mark) -> None:
        frame = self._dragged_to if mark == self._dragged else mark.frame
        x, y, size = self.x_of(frame), self.y_of(is_camera=mark.is_camera), DIAMOND_PX
        is_lit = mark in (self._hovered, self._chosen) or frame == self._timeline.frame
        painter.setPen(QPen(QColor(TEXT if is_lit else QUIET), 2.0 if mark == self._chosen else 1.2))
        painter.setBrush(QColor(ACCENT if frame == self._timeline.frame else LINE))
        painter.drawPolygon(
            QPolygonF([QPointF(x, y - size), QPointF(x + size, y), QPointF(x, y + size), QPointF(x - size, y)])
        )
