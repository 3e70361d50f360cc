"""Files dropped on the window."""

from pathlib import Path

from PySide6.QtGui import QDragEnterEvent, QDragLeaveEvent, QDropEvent

from splap_editor.io.formats.table import can_be_opened
from splap_editor.io.splat_files import file_meant
from splap_editor.ui.actions.file_actions import FileActions
from splap_editor.ui.widgets.overlay import Overlay


class FileDrop:
    """The part of a window that takes files: it has an ``overlay`` to say so, and ``files`` that open them."""

    overlay: Overlay
    files: FileActions

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:
        """Frame the picture when the file is one that opens."""
        path = _dropped_path(event)
        if path is not None:
            event.acceptProposedAction()
            what = {".json": "edit", ".splap": "session"}.get(path.suffix.lower(), "capture")
            what = "capture" if can_be_opened(path) else what
            self.overlay.show_drop(f"Drop to open the {what} {path.name}")

    def dragLeaveEvent(self, event: QDragLeaveEvent) -> None:
        """Take the frame away."""
        self.overlay.show_drop("")

    def dropEvent(self, event: QDropEvent) -> None:
        """Open the file."""
        self.overlay.show_drop("")
        path = _dropped_path(event)
        if path is not None:
            event.acceptProposedAction()
            self.files.open_path(path)


def _can_be_opened(path: Path) -> bool:
    return can_be_opened(path) or path.suffix.lower() in (".splap", ".json") or file_meant(path) != path


def _dropped_path(event: QDropEvent) -> Path | None:
    paths = [Path(url.toLocalFile()) for url in event.mimeData().urls() if url.isLocalFile()]
    return next((path for path in paths if _can_be_opened(path)), None)
