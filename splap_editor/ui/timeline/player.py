"""Playing the timeline in the window."""

from time import perf_counter

from PySide6.QtCore import QObject, Qt, QTimer, Signal

from splap_editor.engine.edit import Edit
from splap_editor.engine.keyframes import edit_at_frame
from splap_editor.session.scene import Scene
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.session.session import Session
from splap_editor.viewport.viewport import Viewport

TICK_MS = 10


class Player(QObject):
    """Shows frame after frame in time, over and over, until it is stopped or somebody drags a handle.

    A machine that poses slower than the frames come leaves some out and keeps time.

    Parameters
    ----------
    session : Session
    viewport : Viewport
        Thinned while frames change, as in any motion.
    """

    playing_changed = Signal(bool)

    def __init__(self, session: Session, viewport: Viewport, parent: QObject) -> None:
        super().__init__(parent)
        self._session = session
        self._viewport = viewport
        self._scene: Scene | None = None
        self._shown: Edit | None = None
        self._start = (0.0, 1)
        self._timer = QTimer(self, interval=TICK_MS, timerType=Qt.TimerType.PreciseTimer)
        self._timer.timeout.connect(self._on_tick)
        SceneFollower(session, self.stop)

    @property
    def is_playing(self) -> bool:
        """Whether frames are being shown."""
        return self._timer.isActive()

    def play(self) -> None:
        """Go on from the frame shown, or from the first if that is the last."""
        scene = self._session.scene
        if self.is_playing or scene is None or scene.edit.timeline.is_empty:
            return
        timeline = scene.edit.timeline
        self._scene, self._shown = scene, None
        self._start = perf_counter(), timeline.frame if timeline.frame < timeline.n_frames else 1
        self._viewport.begin_motion()
        self._timer.start()
        self.playing_changed.emit(True)

    def stop(self) -> None:
        """Stay at the frame shown."""
        if not self.is_playing:
            return
        self._timer.stop()
        self._viewport.end_motion()
        scene, shown = self._scene, self._shown
        self._scene = self._shown = None
        if scene is not None and scene is self._session.scene and shown is not None and scene.preview is shown:
            scene.set_edit(edit_at_frame(scene.edit, shown.timeline.frame))
        self.playing_changed.emit(False)

    def _on_tick(self) -> None:
        scene = self._scene
        if scene is None or scene.preview not in (None, self._shown) or scene.edit.timeline.is_empty:
            self.stop()
            return
        begun, first = self._start
        timeline = scene.edit.timeline
        elapsed = int((perf_counter() - begun) * timeline.fps)
        frame = 1 + (first - 1 + elapsed) % timeline.n_frames
        if self._shown is None or frame != self._shown.timeline.frame or scene.preview is None:
            self._shown = edit_at_frame(scene.edit, frame)
            scene.set_preview(self._shown)
