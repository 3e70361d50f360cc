"""When a frame is drawn while a drag is under way, and when the next pose may come."""

from collections.abc import Callable
from time import perf_counter

from splap_editor.session.session import Session

PATIENCE_S = 0.25
"""A pose that takes longer than this is not waited for: gizmo and markers move ahead of the splats."""


class FramePacer:
    """Stands between a session and the picture, so that neither runs ahead of the other in a drag.

    Requests for frames are held back while the next pose is on its way. The
    pose asks for a frame itself, and that one shows the moved gizmo too.
    Drawing the gizmo before, with the splats still where they were, would
    only double the frames of a drag.

    Poses are held back until the frame that was asked for is drawn: a pose
    that is replaced before it was seen is work for nothing.

    Parameters
    ----------
    session : Session
    update : callable
        Asks the host for a frame.
    is_seen : callable
        Whether the host draws at all; a hidden window does not.
    """

    def __init__(self, session: Session, update: Callable[[], None], is_seen: Callable[[], bool]) -> None:
        self._session = session
        self._update = update
        self._is_seen = is_seen
        self._asked_at = 0.0
        self._is_due = False
        self._held: Callable[[], None] | None = None
        session.state_changed.connect(self._ask)
        session.drag.pace(self._hold)

    def __call__(self) -> None:
        """Ask for a frame, now or with the pose to come."""
        if not self._session.drag.awaits_frame or perf_counter() - self._asked_at > PATIENCE_S:
            self._ask()

    def drawn(self) -> None:
        """Let the next pose through: the frame that was asked for is drawn."""
        self._is_due = False
        held, self._held = self._held, None
        if held is not None:
            held()

    def _ask(self) -> None:
        self._asked_at = perf_counter()
        self._is_due = True
        self._update()

    def _hold(self, show: Callable[[], None]) -> None:
        if self._is_due and self._is_seen():
            self._held = show
        else:
            show()
