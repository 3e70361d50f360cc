"""The session file behind the open scene: opened, saved, and compared with what is on screen."""

import os
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from splap_editor.core.progress import Progress, no_progress
from splap_editor.engine.removal import Finder
from splap_editor.io.content_hash import content_hash, has_content
from splap_editor.io.session_file import read_session_file, write_session_file
from splap_editor.io.session_specs import SessionFile
from splap_editor.session.jobs import Job, Post, Starter, Worker, close_all
from splap_editor.session.latest_job import LatestJob
from splap_editor.session.saved_state import Look, SavedState, restore_scene, saved_state, session_file_of
from splap_editor.session.scene import Scene
from splap_editor.session.scene_follower import SceneFollower
from splap_editor.session.session import Session
from splap_editor.session.signals import Signal

SAVE_TIMEOUT_S = 60.0


class MissingPlyError(ValueError):
    """The PLY that a session belongs to is not where the session says.

    Parameters
    ----------
    document : Path or None
        The session file; None for a recovery file.
    session : SessionFile

    Attributes
    ----------
    open_with : callable
        ``open_with(path)`` opens the session with the PLY found elsewhere.
    """

    def __init__(self, document: Path | None, session: SessionFile) -> None:
        self.name = Path(session.ply.path).name
        where = document.name if document is not None else "the recovered edit"
        super().__init__(f"{self.name} is not where {where} says ({session.ply.path}); find it, or put it back")
        self.document = document
        self.session = session
        self.open_with: Callable[[Path], None] = lambda ply: None


@dataclass(eq=False)
class _Arrival:
    """A session on its way in: what to put into the scene, and what to say about it."""

    session: SessionFile
    document: Path | None
    is_recovery: bool
    notes: list[str]
    arrived: Callable[[], None]
    scene: Scene | None = None


@dataclass(eq=False)
class _Source:
    """The PLY of the open scene and, once it is known, the hash of its bytes."""

    path: Path
    digest: str = ""


class Documents:
    """Opens and saves session files, and knows whether anything would be lost.

    Hashing and writing happen on a worker of its own, so that a save never
    waits behind a scene that is being prepared; each session file is read at
    once, whatever becomes of the one before.

    Parameters
    ----------
    session : Session
    post : callable
        Runs a callable on the main thread, soon.
    """

    def __init__(self, session: Session, post: Post) -> None:
        self.path: Path | None = None
        self.look: Callable[[], Look] = Look
        self.worker = Worker(post, name="splap-files")
        self.changed = Signal()
        self.saved = Signal()
        self.opened = Signal()
        self.failed = Signal()
        self._session = session
        self._openings = Starter(post, name="splap-sessions")
        self._reading = LatestJob(self._openings, "open", abandons=True)
        self._hashing = LatestJob(self.worker, "hash", cancels=True)
        self._is_written = threading.Event()
        self._is_written.set()
        self._arrival: _Arrival | None = None
        self._source = _Source(Path())
        self._kept: SavedState | None = None
        # Of files that are asked for one after another the newest is opened, be they PLY or session.
        session.opening.connect(self._reading.drop)
        SceneFollower(
            session,
            self._on_scene_changed,
            edit_changed=self.changed.emit,
            hidden_changed=self.changed.emit,
            selection_changed=self.changed.emit,
            selection_sets_changed=self.changed.emit,
        )

    def close(self) -> None:
        """Finish saving and join the workers, as far as they come to an end in time."""
        self._openings.stop()
        self._is_written.wait(SAVE_TIMEOUT_S)
        close_all((self._openings, self.worker))

    # ---------------------------------------------------------------- state

    def state(self) -> SavedState | None:
        """All that a session file would keep of the scene as it is; None without a scene."""
        return self._state() if self._session.scene is not None else None

    def _state(self) -> SavedState:
        return saved_state(self._session.shown_scene, self.look())

    @property
    def is_dirty(self) -> bool:
        """Whether the scene holds something that no session file has."""
        if self._session.scene is None:
            return False
        return self._kept is None or not self._kept.keeps_like(self._state())

    @property
    def would_lose(self) -> bool:
        """Whether leaving the scene now would lose work: handles, pins, keys or a changed object that no session has.

        An export keeps the shape and not what it was made by: it is no reason to let go of that without a word.
        """
        if not self.is_dirty:
            return False
        held = [self._session.shown_scene.edit] + ([self._kept.edit] if self._kept is not None else [])
        return any(edit.has_work for edit in held)

    def file_of(self, state: SavedState, folder: Path | None) -> SessionFile:
        """Session file of a state, with the hash of the PLY as far as it is known."""
        return session_file_of(state, folder, self._source.digest if self._source.path == state.source else "")

    # ---------------------------------------------------------------- open

    def open(self, path: Path) -> None:
        """Open a session file and the PLY it belongs to."""

        def read(job: Job) -> _Arrival:
            session = read_session_file(path, job.progress("reading the session"))
            return _Arrival(session, path, False, [], lambda: None)

        self._open(f"Opening {path.name}", read, path.parent)

    def recover(self, session: SessionFile, arrived: Callable[[], None] = lambda: None) -> None:
        """Open the edit of a recovery file; it counts as not saved. ``arrived`` is called once it is on screen."""
        document = Path(session.document) if session.document else None
        self._open(
            "Restoring the edit",
            lambda job: _Arrival(session, document, True, [], arrived),
            document.parent if document is not None else Path(),
        )

    def _open(self, title: str, read: Callable[[Job], _Arrival], folder: Path, ply: Path | None = None) -> None:
        def located(job: Job) -> tuple[_Arrival, Path]:
            arrival = read(job)
            return arrival, _located(arrival, folder, ply, job.progress("checking the PLY"))

        def done(found: tuple[_Arrival, Path]) -> None:
            arrival, source = found

            def restore(scene: Scene, find: Finder) -> None:
                restore_scene(scene, arrival.session, find, find.stages("restoring the edit"))
                arrival.scene = scene

            self._arrival = arrival
            self._session.open(source, layout=arrival.session.ply.layout, restore=restore)

        def failed(error: Exception) -> None:
            if isinstance(error, MissingPlyError):
                error.open_with = lambda found: self._open(title, read, folder, found)
            self.failed.emit(title, error)

        self._session.stop_opening()
        self._reading.ask(located, done, failed=failed, title=title)

    def _on_scene_changed(self) -> None:
        scene = self._session.shown_scene
        arrival, self._arrival = self._arrival, None
        self._source = source = _Source(scene.file.path)
        self._hashing.ask(lambda job: _take_digest(source, job.report), lambda done: None)
        if arrival is None or arrival.scene is not scene:
            self.path = None
            self._kept = self.state()
        else:
            self.path = arrival.document
            self._kept = None if arrival.is_recovery else self.state()
            arrival.arrived()
            self.opened.emit(arrival.session, arrival.notes)
        self.changed.emit()

    # ---------------------------------------------------------------- save

    def save(self, path: Path | None = None) -> None:
        """Save to the session file, or to another that takes its place.

        Raises
        ------
        ValueError
            There is no session file yet and none is given.
        """
        path = path or self.path
        if path is None:
            raise ValueError("the scene has no session file yet: give one")
        state, scene, source = self._state(), self._session.shown_scene, self._source

        def write(job: Job) -> None:
            try:
                _take_digest(source, job.report)
                write_session_file(path, session_file_of(state, path.parent, source.digest))
            finally:
                self._is_written.set()

        def done(_: None) -> None:
            if self._session.scene is scene:
                self.path, self._kept = path, state
            self.saved.emit(path)
            self.changed.emit()

        title = f"Saving {path.name}"
        self._is_written.clear()
        self.worker.submit(Job("save", title, write, done, lambda error: self.failed.emit(title, error)))


def _take_digest(source: _Source, progress: Progress = no_progress) -> None:
    """Hash the PLY unless that is done; a file that is gone by now has none."""
    if not source.digest:
        try:
            source.digest = content_hash(source.path, progress)
        except OSError:
            source.digest = ""


def _located(arrival: _Arrival, folder: Path, ply: Path | None, progress: Progress) -> Path:
    """Find the PLY: where it is said to be, by its old place seen from the session file, or beside that."""
    spec = arrival.session.ply
    named = Path(spec.path)
    places = [ply] if ply is not None else [folder / named, folder / named.name]
    source = next((place for place in places if place.is_file()), None)
    if source is None:
        raise MissingPlyError(arrival.document, arrival.session)
    if spec.content_hash and not has_content(source, spec.content_hash, progress):
        arrival.notes.append(f"{source.name} has changed since this was saved; the edit may not fit it any more.")
    return Path(os.path.abspath(source))
