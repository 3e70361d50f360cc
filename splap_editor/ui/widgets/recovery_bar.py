"""What a process that died left behind: its edit offered back, its report named."""

from collections.abc import Callable
from datetime import datetime
from pathlib import Path

from PySide6.QtWidgets import QFrame, QHBoxLayout, QPushButton, QWidget

from splap_editor.session.autosave import Autosave
from splap_editor.session.crash_report import new_crash_reports
from splap_editor.session.recovery import LeftBehind, Orphan
from splap_editor.ui.theme import STEP, icon
from splap_editor.ui.widgets.plain_text import PlainLabel


class RecoveryBar(QFrame):
    """A line above the picture that stays until it is answered; hidden where there is nothing to say.

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
        self._notes: list[str] = []
        self._text = PlainLabel(wordWrap=True)
        self.restore_button = QPushButton("Restore")
        self.restore_button.clicked.connect(lambda: self._leave(self._restore))
        self.discard_button = QPushButton("Discard")
        self.discard_button.setFlat(True)
        self.discard_button.clicked.connect(self._discard)
        self.close_button = QPushButton("Close")
        self.close_button.setFlat(True)
        self.close_button.clicked.connect(self.release)
        mark = PlainLabel()
        mark.setPixmap(icon("warning").pixmap(16, 16))
        layout = QHBoxLayout(self)
        layout.setContentsMargins(3 * STEP, STEP, 3 * STEP, STEP)
        layout.setSpacing(STEP)
        layout.addWidget(mark)
        layout.addWidget(self._text, 1)
        layout.addWidget(self.restore_button)
        layout.addWidget(self.discard_button)
        layout.addWidget(self.close_button)
        self.hide()

    @property
    def text(self) -> str:
        """What is offered; empty when there is nothing."""
        return self._text.text() if not self.isHidden() else ""

    def look(self) -> None:
        """Look for what was left behind, in the background; then say what happened, and offer the newest edit."""
        self._autosave.seek(self._show)

    def _show(self, found: LeftBehind) -> None:
        self._orphans = found.orphans
        self._notes = [f"The program crashed; what is known of it is in {path}." for path in new_crash_reports()[:1]]
        self._notes += [f"A kept edit could not be read and is set aside as {path}." for path in found.set_aside]
        self._offer()

    def release(self) -> None:
        """Leave what was not answered for the next start."""
        for orphan in self._orphans:
            orphan.release()
        self._orphans, self._notes = [], []
        self.hide()

    def _offer(self) -> None:
        words = list(self._notes)
        if self._orphans:
            orphan = self._orphans[0]
            name = Path(orphan.session.document or orphan.session.ply.path).name
            when = datetime.fromtimestamp(orphan.saved_at)
            day = "" if when.date() == datetime.now().date() else f"{when:%d %B}, "
            ended = "" if self._notes else "The program ended unexpectedly. "
            words.append(f"{ended}Your edit of {name} ({day}{when:%H:%M}) was kept.")
        self._text.setText(" ".join(words))
        for button in (self.restore_button, self.discard_button):
            button.setVisible(bool(self._orphans))
        self.close_button.setVisible(not self._orphans)
        self.setVisible(bool(words))

    def _restore(self) -> None:
        self._autosave.restore(self._orphans.pop(0))
        self.release()

    def _discard(self) -> None:
        self._orphans.pop(0).slot.remove()
        self._notes = []
        self._offer()
