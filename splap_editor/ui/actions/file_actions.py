"""Opening, exporting, saving, and never losing an edit by it."""

import os
import traceback
from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QSettings, QStandardPaths, Qt, QUrl
from PySide6.QtGui import QDesktopServices
from PySide6.QtWidgets import QFileDialog, QMessageBox, QWidget

from splap_editor.core.adaptation.options import RepairOptions
from splap_editor.engine.export_report import ExportReport
from splap_editor.io.formats.table import stem_of
from splap_editor.io.session_file import SUFFIX
from splap_editor.io.splat_files import are_splats, name_filter
from splap_editor.resources import resource
from splap_editor.session.bound_edit import column_lacks
from splap_editor.session.documents import Documents
from splap_editor.session.edit_file import write_edit
from splap_editor.session.session import Session
from splap_editor.ui.dialogs.export_dialog import ExportDialog
from splap_editor.ui.dialogs.picture_dialog import PictureDialog
from splap_editor.ui.widgets.plain_text import PlainMessageBox
from splap_editor.ui.widgets.toast import Toast
from splap_editor.viewport.viewport import Viewport

OPEN_FILTER = f"Splats or session ({name_filter()} *.splap);;All files (*)"
EDIT_FILTER = "Edit (*.json);;All files (*)"
SAMPLE = "windmill_2dgs.ply"


class FileActions:
    """Everything that reads or writes a file.

    Parameters
    ----------
    window : QWidget
        Parent of the dialogs.
    session : Session
    documents : Documents
    viewport : Viewport
        Its picture can be saved.
    toast : Toast
        Where results and refusals are said.
    save_then : callable
        ``save_then(then)`` saves the session and goes on once that is done.
    """

    def __init__(
        self,
        window: QWidget,
        session: Session,
        documents: Documents,
        viewport: Viewport,
        toast: Toast,
        save_then: Callable[[Callable[[], None]], None],
    ) -> None:
        self._window = window
        self._session = session
        self._documents = documents
        self._viewport = viewport
        self._save_then = save_then
        self._toast = toast
        self._after_export: Callable[[], None] | None = None
        session.exported.connect(self._on_exported)
        session.edit_opened.connect(lambda path: toast.say(f"Opened the edit {path.name}."))
        session.failed.connect(self._on_failed)

    # ---------------------------------------------------------------- open

    def open(self) -> None:
        """Ask for a PLY or a session and open it."""
        self._ask_to_read("Open a splat PLY or a session", OPEN_FILTER, self.open_path)

    def open_sample(self) -> None:
        """Open the bundled sample."""
        self.open_path(sample_path())

    def open_path(self, path: Path) -> None:
        """Open a PLY, a session or an edit, after asking about an edit that would be lost."""
        if path.suffix.lower() == ".json" and not are_splats(path):
            self._read_edit(path)
        elif path.suffix.lower() == SUFFIX:
            self.leave_edit(lambda: self._documents.open(path))
        else:
            self.leave_edit(lambda: self._session.open(path))

    def reread(self, layout: str | None) -> None:
        """Read the open file again, as another layout; None recognises it. Asks about an edit that would be lost."""
        path = self._session.shown_scene.file.path
        self.leave_edit(lambda: self._session.open(path, layout=layout))

    def open_edit(self) -> None:
        """Ask for a recipe and make it the edit."""
        self._ask_to_read("Open an edit", EDIT_FILTER, self._read_edit)

    def _read_edit(self, path: Path) -> None:
        if self._session.scene is None:
            self._toast.fail(f"{path.name} was not opened: open the splats that it is for first.")
        else:
            self._session.open_edit(path)

    # ---------------------------------------------------------------- write

    def export(self) -> None:
        """Ask where to, and write what is on screen."""
        scene = self._session.shown_scene
        suggested = folder_to_write(scene.file.path) / f"{stem_of(scene.file.path)}_edited.ply"
        lacks = column_lacks(scene, self._session.bound)
        dialog = ExportDialog(self._window, suggested, scene, lacks, self._session.detail_worker)
        dialog.accepted.connect(lambda: self._export(dialog))
        dialog.rejected.connect(self._forget_after_export)
        dialog.open()

    def _export(self, dialog: ExportDialog) -> None:
        QSettings().setValue("files/folder", str(dialog.path.parent))
        edit = self._session.shown_scene.edit
        if dialog.repair != edit.repair:
            title = "Split when exported" if dialog.repair else "Split nothing when exported"
            self._session.steps.change_edit(edit.with_options(RepairOptions(dialog.repair)), title)
        self._session.export(dialog.path, as_3dgs=dialog.as_3dgs, columns=dialog.column_names)

    def export_edit(self) -> None:
        """Ask where to, and write the edit as a recipe."""
        source = self._session.shown_scene.file.path
        dialog = QFileDialog(
            self._window, "Export the edit", str(folder_to_write(source) / f"{stem_of(source)}_edit.json")
        )
        dialog.setAcceptMode(QFileDialog.AcceptMode.AcceptSave)
        dialog.setNameFilter(EDIT_FILTER)
        dialog.setDefaultSuffix("json")
        self._open_dialog(dialog, self._write_edit)

    def _write_edit(self, path: Path) -> None:
        try:
            write_edit(path, self._session.shown_scene)
        except (OSError, ValueError) as error:
            self._toast.fail(f"The edit was not exported: {sentence(error)}")
        else:
            self._toast.say(f"Exported the edit as {path.name}.")

    def picture(self) -> None:
        """Ask for a size, and write the view as a PNG."""
        PictureDialog(self._window, self._viewport, self._session.shown_scene.file.path, self._toast).open()

    def quit(self) -> None:
        """Close the window."""
        self._window.close()

    # ---------------------------------------------------------------- losing nothing

    def leave_edit(self, then: Callable[[], None]) -> None:
        """Go on at once, or after the person has saved, exported or let go of an edit that would be lost."""
        if not self._documents.would_lose:
            then()
            return
        scene = self._session.shown_scene
        box = PlainMessageBox(
            QMessageBox.Icon.NoIcon,
            "Save the session?",
            f"Your work on {scene.file.path.name} has not been saved.",
            parent=self._window,
        )
        is_exported = not (scene.edit.is_identity or self._session.has_unexported_edit)
        box.setInformativeText(
            "An export keeps the shape, not what it was made by: handles, pins and keys are lost when another file is "
            "opened or the window is closed."
            if is_exported
            else "It is lost when another file is opened or the window is closed."
        )
        box.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        save = box.addButton("Save" if self._documents.path else "Save…", QMessageBox.ButtonRole.AcceptRole)
        export = box.addButton("Export…", QMessageBox.ButtonRole.AcceptRole)
        discard = box.addButton("Discard", QMessageBox.ButtonRole.DestructiveRole)
        box.addButton("Cancel", QMessageBox.ButtonRole.RejectRole)
        box.setDefaultButton(save)

        def answered(button: object) -> None:
            if button is save:
                self._save_then(then)
            elif button is export:
                self._after_export = then
                self.export()
            elif button is discard:
                then()

        box.buttonClicked.connect(answered)
        box.open()

    def _forget_after_export(self) -> None:
        self._after_export = None

    # ---------------------------------------------------------------- results

    def _on_exported(self, report: ExportReport) -> None:
        folder = QUrl.fromLocalFile(str(report.path.parent))
        self._toast.say(f"Exported {report}.", Show_folder=lambda: QDesktopServices.openUrl(folder))
        if self._after_export is not None:
            then, self._after_export = self._after_export, None
            then()

    def _on_failed(self, title: str, error: Exception) -> None:
        self._after_export = None
        buttons: dict[str, Callable[[], object]] = {}
        if self._session.state == "failed":
            buttons["Try_again"] = self._session.resume
        if not isinstance(error, (ValueError, OSError, MemoryError)):
            buttons["Details"] = lambda: self._show_details(title, error)
        self._toast.fail(f"{title} failed: {sentence(error)}", **buttons)

    def _show_details(self, title: str, error: Exception) -> None:
        box = PlainMessageBox(QMessageBox.Icon.NoIcon, title, f"{title} failed.", parent=self._window)
        box.setInformativeText("This is a fault of the program. The text below helps to mend it.")
        box.setDetailedText("".join(traceback.format_exception(error)))
        box.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        box.open()

    # ---------------------------------------------------------------- dialogs

    def _ask_to_read(self, title: str, name_filter: str, take: Callable[[Path], None]) -> None:
        folder = str(QSettings().value("files/folder", _documents(), type=str))
        dialog = QFileDialog(self._window, title, folder)
        dialog.setFileMode(QFileDialog.FileMode.ExistingFile)
        dialog.setNameFilter(name_filter)
        self._open_dialog(dialog, take)

    def _open_dialog(self, dialog: QFileDialog, take: Callable[[Path], None]) -> None:
        def chosen(name: str) -> None:
            QSettings().setValue("files/folder", str(Path(name).parent))
            take(Path(name))

        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.fileSelected.connect(chosen)
        dialog.open()


def sample_path() -> Path:
    """The capture that the program opens with."""
    return resource("samples", SAMPLE)


def sentence(error: BaseException) -> str:
    """What went wrong, for a person."""
    if isinstance(error, MemoryError):
        return "there is not enough memory; close other programs or use a smaller file."
    if isinstance(error, OSError) and error.strerror:
        name = f" ({Path(error.filename).name})" if error.filename else ""
        return f"{error.strerror.lower()}{name}."
    text = str(error) or type(error).__name__
    return text if text.endswith((".", "!", "?")) else f"{text}."


def _documents() -> str:
    return QStandardPaths.writableLocation(QStandardPaths.StandardLocation.DocumentsLocation)


def folder_to_write(source: Path) -> Path:
    """Folder to write to: the one used last, else the source's unless it is one of the program's own."""
    used = str(QSettings().value("files/folder", "", type=str))
    own = source.parent == sample_path().parent
    folders = [Path(used)] if used else []
    folders += [Path(_documents()), Path.home()] if own else [source.parent]
    return next((folder for folder in folders if folder.is_dir() and os.access(folder, os.W_OK)), Path.home())
