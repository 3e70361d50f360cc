"""The files opened last, in a menu."""

from collections.abc import Callable
from pathlib import Path
from typing import cast

from PySide6.QtCore import QSettings
from PySide6.QtWidgets import QMenu, QWidget

from splap_editor.ui.widgets.plain_text import set_plain_tip

N_RECENT = 10


class RecentFiles(QMenu):
    """A menu of captures and sessions, the newest first.

    Parameters
    ----------
    open_path : callable
        Opens one of them.
    """

    def __init__(self, open_path: Callable[[Path], None], parent: QWidget | None = None) -> None:
        super().__init__("Open &recent", parent)
        self._open_path = open_path
        self._fill()

    @property
    def paths(self) -> list[Path]:
        """The files, the newest first; some may be gone by now."""
        return [Path(name) for name in cast("list[str]", QSettings().value("files/recent", [], type=list))]

    def add(self, path: Path) -> None:
        """Make a file the newest."""
        path = path.absolute()
        kept = [path, *(other for other in self.paths if other != path)][:N_RECENT]
        QSettings().setValue("files/recent", [str(other) for other in kept])
        self._fill()

    def _fill(self) -> None:
        self.clear()
        for path in self.paths:
            action = self.addAction(path.name.replace("&", "&&"))
            set_plain_tip(action, str(path))
            action.triggered.connect(lambda checked=False, path=path: self._open_path(path))
        self.setToolTipsVisible(True)
        if not self.isEmpty():
            self.addSeparator()
            self.addAction("&Clear").triggered.connect(self._forget)
        self.setEnabled(not self.isEmpty())

    def _forget(self) -> None:
        QSettings().remove("files/recent")
        self._fill()
