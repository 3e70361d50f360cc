"""The composition root: every part of the window is made and wired here."""

import ctypes
import os
import sys
import traceback
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import TracebackType

os.environ.setdefault("QT_API", "pyside6")

from PySide6.QtCore import QCoreApplication, QObject, Qt, QTimer, Signal
from PySide6.QtWidgets import QApplication

from splap_editor.core.progress import no_progress
from splap_editor.engine.cache import StageCache
from splap_editor.first_start import FirstStart
from splap_editor.installation.desktop_entry import APP_ID
from splap_editor.session.autosave import Autosave
from splap_editor.session.background_thread import leave
from splap_editor.session.crash_report import CrashReport
from splap_editor.session.documents import Documents
from splap_editor.session.jobs import Job
from splap_editor.session.session import Session
from splap_editor.tools.tool import ToolContext
from splap_editor.tools.tool_table import made_tools
from splap_editor.ui.actions.file_actions import sample_path
from splap_editor.ui.collector import MainThreadCollector
from splap_editor.ui.display import Display
from splap_editor.ui.end_signals import EndSignals
from splap_editor.ui.main_window import MainWindow
from splap_editor.ui.theme import apply_theme
from splap_editor.ui.viewport_widget import ViewportWidget, ask_of_qt
from splap_editor.viewport.frame_pacer import FramePacer
from splap_editor.viewport.inspect_view import InspectView
from splap_editor.viewport.scene_view import SceneView
from splap_editor.viewport.viewport import Viewport
from splap_editor.warm_up import is_warm, load_view_loops


class Mailbox(QObject):
    """Runs callables on the thread it was made on, in the order they were posted from any thread."""

    _posted = Signal(object)

    def __init__(self) -> None:
        super().__init__()
        self._posted.connect(self._run, Qt.ConnectionType.QueuedConnection)

    def post(self, call: Callable[[], None]) -> None:
        """Run a callable on the mailbox's thread, soon."""
        self._posted.emit(call)

    @staticmethod
    def _run(call: Callable[[], None]) -> None:
        call()


def run(path: Path | None = None, *, tell: Callable[[float], None] = no_progress) -> int:
    """Open the editor on a file, or on the bundled sample, and stay until it is closed.

    Parameters
    ----------
    path : Path, optional
    tell : callable
        Given the share of the loops that is compiled, on the first start.

    Returns
    -------
    int
        Exit code.
    """
    ask_of_qt()
    _tell_taskbar()
    running = QApplication.instance()
    app = running if isinstance(running, QApplication) else QApplication([APP_ID])
    app.setDesktopFileName(APP_ID)
    QCoreApplication.setOrganizationName(APP_ID)
    QCoreApplication.setApplicationName("SpLap Editor")
    apply_theme(app)
    window = make_window()
    MainThreadCollector(window)
    # A worker in a Python loop must not keep the window from its turn for the usual 5 ms.
    sys.setswitchinterval(0.0005)
    sys.excepthook = _shows_in(window)
    window.show()
    window.recovery_bar.look()
    crash_report = CrashReport()
    told: list[int] = []

    def end(number: int) -> None:
        told.append(number)
        window.leave_at_once()
        app.quit()

    signals = EndSignals(end, window)
    QTimer.singleShot(0, lambda: open_first(window, path or sample_path(), tell))
    code = app.exec()
    signals.close()
    crash_report.close()
    # The window is still there: a thread that has something to tell it must not outlive it.
    return leave(128 + told[0] if told else code)


def _tell_taskbar() -> None:
    """Let Windows show this program's icon and group its windows, rather than Python's."""
    if sys.platform == "win32":
        ctypes.windll.shell32.SetCurrentProcessExplicitAppUserModelID(APP_ID)


def make_window(cache: StageCache | None = None) -> MainWindow:
    """Make the window and everything in it, nothing open yet."""
    mailbox = Mailbox()
    cache = cache or StageCache()
    session = Session(mailbox.post, cache=cache)
    widget = ViewportWidget()
    scale = widget.devicePixelRatioF()
    pacer = FramePacer(session, widget.update, lambda: widget.isVisible() and not widget.window().isMinimized())
    widget.frame_drawn.connect(lambda milliseconds: mailbox.post(pacer.drawn))
    render_window = widget.render_window
    assert render_window is not None  # there is one until the widget is closed
    viewport = Viewport(render_window, pacer, renderer=widget.renderer, scale=scale)
    viewport.refine_in = widget.render_in
    view = SceneView(session, viewport)
    documents = Documents(session, mailbox.post)
    autosave = Autosave(documents, mailbox.post)
    context = ToolContext(session, viewport, InspectView(session, view))
    context.paint = partial(view.paint, layer="tool")
    context.claim = view.claim_gizmo
    tools = made_tools(context)
    widget.connect_tools(tools.pointer, tools.key)
    window = MainWindow(session, documents, autosave, widget, view, context, tools, Display())
    context.fly_to = window.view_actions.fly_to
    cache.say = lambda text: mailbox.post(lambda: window.toast.say(text))
    mailbox.setParent(window)
    return window


def open_first(window: MainWindow, path: Path, tell: Callable[[float], None] = no_progress) -> FirstStart | None:
    """Open the first file; gives what compiles the loops meanwhile, if that has not been done yet."""
    session = window.session
    first = None if is_warm() else FirstStart(window, path.name, tell)
    window.files.open_path(path)
    if first is None:
        session.view_worker.submit(Job("load", "", lambda job: load_view_loops()))
    return first


def _shows_in(window: MainWindow) -> Callable[[type[BaseException], BaseException, TracebackType | None], None]:
    def hook(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        traceback.print_exception(kind, error, trace)
        if not issubclass(kind, KeyboardInterrupt):
            window.toast.fail(f"Something went wrong here: {error}. The edit is kept; undo if the picture looks odd.")

    return hook
