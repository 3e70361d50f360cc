"""What a process that died left behind, offered back."""

from collections.abc import Callable
from datetime import datetime
from pathlib import Path

from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QPushButton, QWidget

from splap_editor.session.autosave import Autosave
from splap_editor.session.recovery import Orphan
from splap_editor.ui.theme import STEP, icon


class RecoveryBar(QFrame):
    """A line above the picture that stays until the edit is restored or discarded; hidden where there is none.

    Parameters
    ----------
    autosave : Autosave
    leave : callable
        ``leave(then)`` goes on at once, or after asking about an edit that would be lost.
    """

    def __init__(
        self, autosave: Autosave, leave: Callable[[Callable[[], None]], None], parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self.setObjectName("headerBar")
        self._autosave = autosave
        self._leave = leave
        self._orphans: list[Orphan] = []
        self._text = QLabel()
        self.restore_button = QPushButton("Restore")
        self.restore_button.clicked.connect(lambda: self._leave(self._restore))
        self.discard_button = QPushButton("Discard")
        self.discard_button.setFlat(True)
        self.discard_button.clicked.connect(self._discard)
        mark = QLabel()
        mark.setPixmap(icon("warning").pixmap(16, 16))
        layout = QHBoxLayout(self)
        layout.setContentsMargins(3 * STEP, STEP, 3 * STEP, STEP)
        layout.setSpacing(2 * STEP)
        layout.addWidget(mark)
        layout.addWidget(self._text)
        layout.addWidget(self.restore_button)
        layout.addWidget(self.discard_button)
        layout.addStretch(1)
        self.hide()

    @property
    def text(self) -> str:
        """What is offered; empty when there is nothing."""
        return self._text.text() if not self.isHidden() else ""

    def look(self) -> None:
        """Look for what was left behind, and offer the newest."""
        self._orphans = self._autosave.orphans()
        self._offer()

    def release(self) -> None:
        """Leave what was not answered for the next start."""
        for orphan in self._orphans:
            orphan.release()
        self._orphans = []
        self.hide()

    def _offer(self) -> None:
        self.setVisible(bool(self._orphans))
        if self._orphans:
            orphan = self._orphans[0]
            name = Path(orphan.session.document or orphan.session.ply.path).name
            when = datetime.fromtimestamp(orphan.saved_at)
            day = "" if when.date() == datetime.now().date() else f"{when:%d %B}, "
            self._text.setText(f"The program ended unexpectedly. Your edit of {name} ({day}{when:%H:%M}) was kept.")

    def _restore(self) -> None:
        self._autosave.restore(self._orphans.pop(0))
        self.release()

    def _discard(self) -> None:
        self._orphans.pop(0).slot.remove()
        self._offer()
