"""Saving and opening sessions: dialogs, messages, and the look that belongs to the window."""

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike
from PySide6.QtCore import QSettings, Qt
from PySide6.QtWidgets import QFileDialog

from splap_editor.io.session_file import SUFFIX
from splap_editor.io.session_specs import Scalar, SessionFile, ViewSpec
from splap_editor.session.autosave import Autosave
from splap_editor.session.documents import Documents, MissingPlyError
from splap_editor.session.saved_state import Look
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.session.session import Session
from splap_editor.ui.actions.file_actions import folder_to_write, sample_path, sentence
from splap_editor.ui.actions.recent_files import RecentFiles
from splap_editor.ui.display import Display
from splap_editor.ui.widgets.toast import Toast
from splap_editor.viewport.camera import View
from splap_editor.viewport.viewport import Viewport

if TYPE_CHECKING:
    from splap_editor.ui.main_window import MainWindow

SESSION_FILTER = f"SpLap session (*{SUFFIX})"


class DocumentActions:
    """Everything that opens or saves a session.

    Parameters
    ----------
    window : MainWindow
        Parent of the dialogs.
    session : Session
    documents : Documents
    autosave : Autosave
    viewport : Viewport
        Its camera is saved and restored.
    display : Display
        Likewise.
    toast : Toast
    """

    def __init__(
        self,
        window: "MainWindow",
        session: Session,
        documents: Documents,
        autosave: Autosave,
        viewport: Viewport,
        display: Display,
        toast: Toast,
    ) -> None:
        self._window = window
        self._session = session
        self._documents = documents
        self._viewport = viewport
        self._display = display
        self._toast = toast
        self._after_save: Callable[[], None] | None = None
        self.recent = RecentFiles(lambda path: window.files.open_path(path), window)
        documents.look = self._look
        documents.opened.connect(self._on_opened)
        documents.saved.connect(self._on_saved)
        documents.failed.connect(self._on_failed)
        autosave.failed.connect(self._on_autosave_failed)
        SceneFollower(session, self._note_recent)

    def save(self) -> None:
        """Save to the session file; ask where to if there is none yet."""
        if self._documents.path is None:
            self.save_as()
        else:
            self._documents.save()

    def save_as(self) -> None:
        """Ask where to, and save there from now on."""
        source = self._documents.path or self._session.shown_scene.file.path
        suggested = folder_to_write(source) / f"{source.stem}{SUFFIX}"
        dialog = QFileDialog(self._window, "Save the session", str(suggested))
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.setAcceptMode(QFileDialog.AcceptMode.AcceptSave)
        dialog.setNameFilter(SESSION_FILTER)
        dialog.setDefaultSuffix(SUFFIX[1:])
        dialog.fileSelected.connect(lambda name: self.save_to(Path(name)))
        dialog.rejected.connect(self._forget_after_save)
        dialog.open()

    def save_to(self, path: Path) -> None:
        """Save to a file, and to it from now on."""
        QSettings().setValue("files/folder", str(path.parent))
        self._documents.save(path)

    def save_then(self, then: Callable[[], None]) -> None:
        """Save, and go on once that is done; not at all if it fails or is called off."""
        self._after_save = then
        self.save()

    # ---------------------------------------------------------------- look

    def _look(self) -> Look:
        camera, view = self._viewport.camera, self._viewport.camera.view
        spec = ViewSpec(
            _vector(view.position),
            _vector(view.focal_point),
            _vector(view.view_up),
            float(view.angle),
            view.is_parallel,
            camera.is_turntable,
            _vector(camera.world_up),
        )
        options = asdict(self._display.options)
        return Look(spec, {name: value for name, value in options.items() if isinstance(value, Scalar)})

    def _on_opened(self, session: SessionFile, notes: list[str]) -> None:
        if session.view is not None:
            spec, camera = session.view, self._viewport.camera
            eye, focus, up = (np.array(v, np.float64) for v in (spec.position, spec.focal_point, spec.view_up))
            self._session.shown_scene.set_up(_vector(spec.world_up))
            camera.is_turntable = spec.is_turntable
            camera.view = View(eye, focus, up, spec.angle, spec.is_parallel)
            self._viewport.camera_moved()
            self._window.actions_.check("view.orthographic", spec.is_parallel)
            self._window.actions_.check("view.turntable", spec.is_turntable)
        self._display.restore(session.display)
        if notes:
            self._toast.fail(" ".join(notes))

    # ---------------------------------------------------------------- results

    def _note_recent(self) -> None:
        path = self._documents.path or self._session.shown_scene.file.path
        if path.parent != sample_path().parent:
            self.recent.add(path)

    def _on_saved(self, path: Path) -> None:
        self.recent.add(path)
        self._toast.say(f"Saved {path.name}.")
        then, self._after_save = self._after_save, None
        if then is not None:
            then()

    def _on_failed(self, title: str, error: Exception) -> None:
        self._forget_after_save()
        text = f"{title} failed: {sentence(error)}"
        if isinstance(error, MissingPlyError):
            self._toast.fail(text, **{f"Find {error.name}…": lambda: self._ask_for_ply(error)})
        else:
            self._toast.fail(text)

    def _ask_for_ply(self, error: MissingPlyError) -> None:
        folder = str((error.document or Path(error.session.ply.path)).parent)
        dialog = QFileDialog(self._window, f"Find {error.name}", folder)
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.setFileMode(QFileDialog.FileMode.ExistingFile)
        dialog.setNameFilter("Splat PLY (*.ply);;All files (*)")
        dialog.fileSelected.connect(lambda name: error.open_with(Path(name)))
        dialog.open()

    def _on_autosave_failed(self, error: Exception) -> None:
        advice = "Save the session yourself now and then."
        self._toast.fail(f"The edit cannot be kept for recovery: {sentence(error)} {advice}")

    def _forget_after_save(self) -> None:
        self._after_save = None


def _vector(array: ArrayLike) -> tuple[float, float, float]:
    x, y, z = np.asarray(array, np.float64).tolist()
    return x, y, z
