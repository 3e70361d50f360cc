"""The very first start: the file is shown at once; what works on it is compiled elsewhere meanwhile."""

from collections.abc import Callable

from PySide6.QtCore import QObject, Signal

from splap_editor.core.twofold_loop import TwofoldLoop
from splap_editor.session.jobs import Job
from splap_editor.ui.main_window import MainWindow
from splap_editor.warm_up import Compilation, load_view_loops


class FirstStart(QObject):
    """Compiles what the program is made of, beside a window that stays alive, and says how far that is.

    Until a drag finds its loops compiled, the camera moves, splats are
    selected and handles placed, but no surface is prepared. The others follow
    while the window is used; what needs one of them sooner compiles it itself.
    Until the last is done the picture is drawn by the loops' plain twins. Ends
    by itself, or with the window.

    Parameters
    ----------
    window : MainWindow
        Nothing is open in it yet.
    name : str
        The file that will be.
    tell : callable
        Given the share done, for the terminal.
    """

    _loop_done = Signal()

    def __init__(self, window: MainWindow, name: str, tell: Callable[[float], None]) -> None:
        super().__init__(window)
        self._session, self._viewport, self._view = window.session, window.viewport, window.view
        self._tell = tell
        self._can_drag = False
        self._loop_done.connect(self._on_loop_done)
        self.compilation = Compilation(self._loop_done.emit)
        self.job = Job("compile", f"Getting ready for {name}, once on this computer", lambda job: None)
        window.closing.connect(self.close)
        TwofoldLoop.use_compiled(False)
        self._session.hold()
        # The first picture has a core to itself.
        self.compilation.start(1)
        self._viewport.frame_drawn.connect(self._on_frame_drawn)
        self._show()

    def close(self) -> None:
        """Leave the rest to the next start."""
        self.compilation.close()

    def _on_frame_drawn(self) -> None:
        if self._view.viewport.splats.deformed is not None:
            self._viewport.frame_drawn.disconnect(self._on_frame_drawn)
            self.compilation.start()

    def _on_loop_done(self) -> None:
        session, compilation = self._session, self.compilation
        if not self._can_drag:
            self._show()
            if compilation.can_drag:
                self._can_drag = True
                session.told_job.set_elsewhere(None)
                session.release()
        if compilation.is_done:
            compilation.close()
            compilation.keep()
            session.view_worker.submit(Job("load", "", lambda job: load_view_loops()))

    def _show(self) -> None:
        share = self.compilation.share
        self._tell(share)
        # An empty share would look like work of unknown length.
        self.job.share = max(share, 1e-3)
        self.job.stage = f"{share:.0%}"
        if not self.compilation.can_drag and self._session.state != "halted":
            self._session.told_job.set_elsewhere(self.job)
