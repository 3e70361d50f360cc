"""When a frame is asked for while a drag is under way."""

from collections.abc import Callable
from time import perf_counter

from splap_editor.session.session import Session

PATIENCE_S = 0.25
"""A pose that takes longer than this is not waited for: gizmo and markers move ahead of the splats."""


class FramePacer:
    """Passes requests for frames on, but holds them back while the next pose of a drag is on its way.

    The pose asks for a frame itself, and that one shows the moved gizmo too.
    Drawing the gizmo before, with the splats still where they were, would
    only double the frames of a drag.

    Parameters
    ----------
    session : Session
    update : callable
        Asks the host for a frame.
    """

    def __init__(self, session: Session, update: Callable[[], None]) -> None:
        self._session = session
        self._update = update
        self._passed = 0.0
        session.state_changed.connect(update)

    def __call__(self) -> None:
        """Ask for a frame, now or with the pose to come."""
        now = perf_counter()
        if not self._session.awaits_drag or now - self._passed > PATIENCE_S:
            self._passed = now
            self._update()
