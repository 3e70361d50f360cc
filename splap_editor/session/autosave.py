"""Autosave: the edit in the user's state folder, half a second behind what is on screen."""

import threading
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from time import monotonic

from splap_editor.io.session_file import write_session_file
from splap_editor.session.background_thread import BackgroundThread, joined
from splap_editor.session.documents import Documents
from splap_editor.session.jobs import Job, Post, Starter
from splap_editor.session.recovery import LeftBehind, Orphan, RecoverySlot, left_behind, new_slot, recovery_folder
from splap_editor.session.saved_state import SavedState
from splap_editor.session.signals import Signal

DELAY_S = 0.25
"""The write itself takes the rest of the half second after which an edit is safe."""

WRITE_TIMEOUT_S = 60.0
"""How long closing waits for a write to a disk that does not answer."""


class Autosave:
    """Keeps the newest state that is in no session file in one recovery file, and none when all is saved.

    The file is written on a thread of its own, whole or not at all. A process
    that ends by `close` removes it; one that dies, or is told to, leaves it
    for the next start, which finds it by `seek`.

    Parameters
    ----------
    documents : Documents
    post : callable
        Runs a callable on the main thread, soon.
    folder : Path, optional
        `recovery_folder` by default.
    delay_s : float
        The file is at most this much, and one write, behind.
    """

    def __init__(
        self, documents: Documents, post: Post, *, folder: Path | None = None, delay_s: float = DELAY_S
    ) -> None:
        self.written = Signal()
        self.failed = Signal()
        self._documents = documents
        self._post = post
        self._folder = folder or recovery_folder()
        self._delay_s = delay_s
        self._slot: RecoverySlot | None = None
        self._adopted: RecoverySlot | None = None
        self._wanted: SavedState | None = None
        self._document: Path | None = None
        self._due: float | None = None
        self._is_closing = False
        self._keeps = False
        self._has_failed = False
        self._wake = threading.Condition()
        self._seeking = Starter(post, name="splap-recovery")
        self._thread = BackgroundThread(self._run, name="splap-autosave", stop=partial(self._end, keep=True))
        self._thread.start()
        documents.changed.connect(self._on_changed)

    def seek(self, found: Callable[[LeftBehind], None]) -> None:
        """Find the edits that other processes left behind when they died, in the background; ``found`` is told."""
        self._seeking.submit(
            Job("recovery", "", lambda job: left_behind(self._folder, job.progress("looking for kept edits")), found)
        )

    def restore(self, orphan: Orphan) -> None:
        """Bring an edit back; its file becomes the recovery file of this process once it is on screen."""
        self._documents.recover(orphan.session, lambda: self._adopt(orphan.slot))

    def close(self, *, keep: bool = False) -> None:
        """End cleanly: nothing is left to recover.

        Parameters
        ----------
        keep : bool
            Write what is not written yet, and leave it for the next start: nobody was asked about it.
        """
        self._documents.changed.disconnect(self._on_changed)
        self._seeking.close()
        self._end(keep=keep)
        if not joined((self._thread,), WRITE_TIMEOUT_S):
            # It is in the middle of a write that blocks; the lock says so as long as the process lives.
            return
        for slot in (self._slot, self._adopted):
            if slot is not None and keep and slot.path.exists():
                slot.lock.release()
            elif slot is not None:
                slot.remove()
        self._slot = self._adopted = None

    def _end(self, *, keep: bool) -> None:
        with self._wake:
            # Once it is closed nothing else counts any more.
            if not self._is_closing:
                self._is_closing, self._keeps = True, keep
            self._wake.notify()

    def _adopt(self, slot: RecoverySlot) -> None:
        with self._wake:
            self._adopted = slot

    def _on_changed(self) -> None:
        documents = self._documents
        state = documents.state() if documents.is_dirty else None
        now = monotonic()
        with self._wake:
            is_waiting = self._due is not None and self._wanted is not None
            self._wanted, self._document = state, documents.path
            # A person who never stops is saved all the same: the delay counts from the first change.
            if not (is_waiting and state is not None):
                self._due = now if state is None else now + self._delay_s
            self._wake.notify()

    def _run(self) -> None:
        while True:
            with self._wake:
                while not self._is_closing and (self._due is None or self._due > monotonic()):
                    self._wake.wait(None if self._due is None else max(self._due - monotonic(), 0.0))
                is_last = self._is_closing
                if is_last and (self._due is None or not self._keeps):
                    return
                state, document, self._due = self._wanted, self._document, None
                adopted, self._adopted = self._adopted, None
            try:
                self._keep(state, document, adopted)
            except (OSError, ValueError) as error:
                self._tell_failure(error)
            else:
                self._has_failed = False
                self._post(partial(self.written.emit, state))
            if is_last:
                return

    def _keep(self, state: SavedState | None, document: Path | None, adopted: RecoverySlot | None) -> None:
        if adopted is not None:
            own, self._slot = self._slot, adopted
            if own is not None:
                own.remove()
        if state is None:
            if self._slot is not None:
                self._slot.clear()
            return
        if self._slot is None:
            self._slot = new_slot(self._folder)
        file = self._documents.file_of(state, None)
        write_session_file(self._slot.path, replace(file, document=str(document.absolute()) if document else ""))

    def _tell_failure(self, error: Exception) -> None:
        """Say once that nothing is kept; it is tried again at the next change."""
        if not self._has_failed:
            self._has_failed = True
            self._post(lambda: self.failed.emit(error))
