"""One line for the background work: what, how far, Cancel; a sentence when it failed."""

from PySide6.QtCore import QTimer, Signal
from PySide6.QtWidgets import QHBoxLayout, QProgressBar, QPushButton, QWidget

from splap_editor.session.jobs import Job
from splap_editor.session.session import Session
from splap_editor.ui.theme import STEP
from splap_editor.ui.widgets.plain_text import PlainLabel

SHOW_AFTER_MS = 250
"""A job shorter than this is not worth a look."""

STAGES = {
    "reading": "reading the file",
    "occupancy": "measuring splats",
    "graph": "connecting splats",
    "contributions": "seeing which splats make the picture",
    "floaters": "weighing what floats",
    "geodesics": "measuring along the surface",
    "laplacian": "weighing neighbours",
    "kernels": "attaching splats",
    "binding": "getting ready to bend",
    "settling": "settling",
}
"""Stages of the session in the words of an artist."""


class JobBar(QWidget):
    """Shows the session's current job.

    A job in its stage fills the bar from the left; Cancel stops all
    background work, after which the line offers to resume.
    """

    shown = Signal(bool)
    """The line says something, or has fallen silent."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._job: Job | None = None
        self._text = PlainLabel()
        self._bar = QProgressBar(textVisible=False, maximum=1000)
        self._bar.setFixedSize(160, 6)
        self._button = QPushButton("Cancel")
        self._button.setFlat(True)
        self._button.clicked.connect(self._on_clicked)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(2 * STEP, 0, 2 * STEP, 0)
        layout.setSpacing(2 * STEP)
        layout.addWidget(self._bar)
        layout.addWidget(self._text)
        layout.addWidget(self._button)
        layout.addStretch(1)
        self._delay = QTimer(self, singleShot=True, interval=SHOW_AFTER_MS)
        self._delay.timeout.connect(self._show)
        session.told_job.changed.connect(self._on_job_changed)
        session.state_changed.connect(self._on_state_changed)
        self._hide()

    @property
    def text(self) -> str:
        """The line as shown."""
        return self._text.text() if self._text.isVisibleTo(self) else ""

    def _on_job_changed(self, job: Job | None) -> None:
        if job is None or not job.title or job.is_cancelled:
            self._forget_job()
            self._on_state_changed()
        else:
            is_new = job is not self._job
            self._job = job
            if self._bar.isVisibleTo(self):
                self._show()
            elif is_new or not self._delay.isActive():
                self._delay.start()

    def _on_state_changed(self) -> None:
        if self._session.state == "halted":
            self._forget_job()
            self._say("Background work stopped.", "Resume")
        elif self._session.state == "failed":
            self._forget_job()
            self._say("The last step failed; the edit is kept.", "Try again")
        elif self._job is None:
            self._hide()

    def _forget_job(self) -> None:
        self._job = None
        self._delay.stop()

    def _show(self) -> None:
        job = self._job
        if job is None:
            return
        stage = STAGES.get(job.stage, job.stage)
        # A stage that repeats the title says nothing new.
        words = f"{job.title} – {stage}" if stage and stage.lower() != job.title.lower() else job.title
        self._say(words, "Cancel")
        self._bar.setVisible(True)
        if job.share > 0.0:
            self._bar.setMaximum(1000)
            self._bar.setValue(round(1000 * min(job.share, 1.0)))
        else:
            self._bar.setMaximum(0)

    def _say(self, text: str, button: str) -> None:
        self._text.setText(text)
        self._button.setText(button)
        self._bar.setVisible(False)
        self._text.setVisible(True)
        self._button.setVisible(True)
        self.shown.emit(True)

    def _hide(self) -> None:
        for part in (self._bar, self._text, self._button):
            part.setVisible(False)
        self.shown.emit(False)

    def _on_clicked(self) -> None:
        if self._button.text() == "Cancel":
            self._session.halt()
        else:
            self._session.resume()
