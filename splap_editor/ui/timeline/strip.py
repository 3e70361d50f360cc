"""The strip under the picture: play, keys, frames."""

from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QGridLayout, QToolButton, QWidget

from splap_editor.core.timeline import LAST_FRAME
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.session.session import Session
from splap_editor.ui.actions.actions import ActionSet
from splap_editor.ui.actions.timeline_actions import TimelineActions
from splap_editor.ui.theme import STEP
from splap_editor.ui.timeline.ruler import TimelineRuler
from splap_editor.ui.widgets.number_field import NumberField
from splap_editor.ui.widgets.plain_text import PlainLabel

NARROW_PX = 720
"""A strip narrower than this has its ruler in a line of its own."""

NARROWEST_PX = 360
"""Narrower than this, length and speed have a line of their own too."""


class TimelineStrip(QWidget):
    """Shows the timeline of the edit on screen; hidden until it is asked for or a key is set.

    Parameters
    ----------
    session : Session
    timeline : TimelineActions
        Carry out what is done here.
    actions : ActionSet
    """

    def __init__(
        self, session: Session, timeline: TimelineActions, actions: ActionSet, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self.setObjectName("headerBar")
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self._session = session
        self._actions = actions
        self._looks_through = lambda: timeline.looks_through
        self.ruler = TimelineRuler()
        self.frame_field = _field("Frame shown", 1, LAST_FRAME)
        self.length_field = _field("Number of frames", 1, LAST_FRAME)
        self.fps_field = _field("Frames per second", 1, 240)
        self._grid = QGridLayout(self)
        self._grid.setContentsMargins(2 * STEP, STEP, 2 * STEP, STEP)
        self._grid.setHorizontalSpacing(STEP)
        self._grid.setVerticalSpacing(0)
        self._line: list[QWidget] = []
        for action_id in ("timeline.play", "timeline.set_key", "timeline.set_camera_key"):
            button = QToolButton()
            button.setDefaultAction(actions[action_id])
            button.setIconSize(QSize(18, 18))
            self._line.append(button)
        self._line.append(self.frame_field)
        self._after = [self.length_field, PlainLabel("at"), self.fps_field, PlainLabel("fps")]
        self._n_lines = 0
        self._arrange(1)
        self.ruler.scrubbed.connect(timeline.scrub)
        self.ruler.chosen.connect(timeline.go_to)
        self.ruler.key_moved.connect(timeline.move_key)
        self.ruler.key_deleted.connect(timeline.delete_key_at)
        self.ruler.camera_key_moved.connect(timeline.move_camera_key)
        self.ruler.camera_key_deleted.connect(timeline.delete_camera_key_at)
        self.frame_field.committed.connect(lambda frame: timeline.go_to(int(frame)))
        self.length_field.committed.connect(lambda n: timeline.change("Change length", n_frames=int(n)))
        self.fps_field.committed.connect(lambda fps: timeline.change("Change speed", fps=float(fps)))
        timeline.shown_changed.connect(self.setVisible)
        timeline.player.playing_changed.connect(lambda on: actions.check("timeline.play", on))
        SceneFollower(session, self._show, edit_changed=self._show, preview_changed=self._show)
        self.hide()

    def minimumSizeHint(self) -> QSize:
        """The width of its narrowest arrangement, in which alone it is that narrow."""
        margins, space = self._grid.contentsMargins(), self._grid.horizontalSpacing()
        columns = zip(self._line, self._after, strict=True)
        # Of a field that is given its width, the hint is of another.
        widths = [max(min(w.minimumSizeHint().width(), w.maximumWidth()) for w in column) for column in columns]
        least = margins.left() + sum(widths) + space * len(widths) + margins.right()
        return QSize(least, super().minimumSizeHint().height())

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Put the ruler between the fields, or under them where they leave it too little room."""
        width = event.size().width()
        self._arrange(1 if width >= NARROW_PX else 2 if width >= NARROWEST_PX else 3)
        super().resizeEvent(event)

    def _arrange(self, n_lines: int) -> None:
        """Lay buttons, fields and ruler out in so many lines."""
        if n_lines == self._n_lines:
            return
        self._n_lines = n_lines
        stretched, n_columns = len(self._line), len(self._line) + 1 + len(self._after)
        for widget in (*self._line, self.ruler, *self._after):
            self._grid.removeWidget(widget)
        for k, widget in enumerate(self._line):
            self._grid.addWidget(widget, 0, k)
        for k, widget in enumerate(self._after, stretched + 1 if n_lines < 3 else 0):
            self._grid.addWidget(widget, n_lines // 3, k)
        if n_lines == 1:
            self._grid.addWidget(self.ruler, 0, stretched)
        else:
            self._grid.addWidget(self.ruler, n_lines - 1, 0, 1, n_columns)
        for k in range(n_columns):
            self._grid.setColumnStretch(k, int(k == stretched))

    def _show(self) -> None:
        timeline = self._session.shown_scene.shown_edit.timeline
        self.ruler.show_timeline(timeline)
        self.frame_field.show_value(timeline.frame)
        self.length_field.show_value(timeline.n_frames)
        self.fps_field.show_value(timeline.fps)
        self._actions.check("timeline.smooth", timeline.is_smooth)
        self._actions.check("timeline.auto_key", timeline.is_auto)
        self._actions.check("timeline.look_through", self._looks_through())


def _field(tip: str, low: float, high: float) -> NumberField:
    field = NumberField(low, high, decimals=0 if low == high or high > 1000 else 2, step=1)
    field.setToolTip(tip)
    field.setFixedWidth(56)
    return field
