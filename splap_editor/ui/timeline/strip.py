"""The strip under the picture: play, keys, frames."""

from PySide6.QtCore import QSize, Qt
from PySide6.QtWidgets import QHBoxLayout, QToolButton, QWidget

from splap_editor.core.timeline import LAST_FRAME
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.session.session import Session
from splap_editor.ui.actions.actions import ActionSet
from splap_editor.ui.actions.timeline_actions import TimelineActions
from splap_editor.ui.theme import STEP
from splap_editor.ui.timeline.ruler import TimelineRuler
from splap_editor.ui.widgets.number_field import NumberField
from splap_editor.ui.widgets.plain_text import PlainLabel


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
        layout = QHBoxLayout(self)
        layout.setContentsMargins(2 * STEP, STEP, 2 * STEP, STEP)
        layout.setSpacing(STEP)
        for action_id in ("timeline.play", "timeline.set_key", "timeline.set_camera_key"):
            button = QToolButton()
            button.setDefaultAction(actions[action_id])
            button.setIconSize(QSize(18, 18))
            layout.addWidget(button)
        layout.addWidget(self.frame_field)
        layout.addWidget(self.ruler, 1)
        layout.addWidget(self.length_field)
        layout.addWidget(PlainLabel("at"))
        layout.addWidget(self.fps_field)
        layout.addWidget(PlainLabel("fps"))
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
