"""Recovery files: where the edit of each running process is kept, and those that dead processes left behind."""

import contextlib
import os
import secrets
from dataclasses import dataclass
from pathlib import Path

import platformdirs

from splap_editor.core.progress import Cancelled, Progress, no_progress
from splap_editor.io.file_lock import FileLock
from splap_editor.io.session_file import SUFFIX, read_session_file
from splap_editor.io.session_specs import SessionFile


def state_folder() -> Path:
    """Folder for what outlives a process: the user's state folder, or ``SPLAP_STATE_DIR``."""
    named = os.environ.get("SPLAP_STATE_DIR")
    return Path(named) if named else Path(platformdirs.user_state_dir("splap-editor"))


def recovery_folder() -> Path:
    """Where recovery files are kept."""
    return state_folder() / "recovery"


@dataclass(frozen=True, eq=False)
class RecoverySlot:
    """A recovery file and the lock that says that a process is alive behind it."""

    path: Path
    lock: FileLock

    def remove(self) -> None:
        """Delete both."""
        self.clear()
        self.lock.remove()

    def clear(self) -> None:
        """Delete the recovery file and what a write cut short may have left beside it."""
        for path in (self.path, *self.path.parent.glob(f".{self.path.name}.*.part")):
            path.unlink(missing_ok=True)


def new_slot(folder: Path) -> RecoverySlot:
    """Take a recovery file for this process; it is not written yet.

    Raises
    ------
    OSError
        If the folder cannot be made or written to.
    """
    folder.mkdir(parents=True, exist_ok=True)
    while True:
        path = folder / f"{os.getpid()}-{secrets.token_hex(4)}{SUFFIX}"
        with contextlib.suppress(BlockingIOError):
            return RecoverySlot(path, FileLock(_lock_path(path)))


@dataclass(frozen=True, eq=False)
class Orphan:
    """An edit that a process which is gone left behind; held until it is restored, discarded or released.

    Parameters
    ----------
    slot : RecoverySlot
    session : SessionFile
        What the file holds.
    saved_at : float
        When, in seconds since 1970.
    """

    slot: RecoverySlot
    session: SessionFile
    saved_at: float

    def release(self) -> None:
        """Leave it for the next start."""
        self.slot.lock.release()


@dataclass(frozen=True, eq=False)
class LeftBehind:
    """What dead processes left in a folder.

    Parameters
    ----------
    orphans : list of Orphan
        The newest first.
    set_aside : list of Path
        Files that no edit could be read from, by the names they have now.
    """

    orphans: list[Orphan]
    set_aside: list[Path]


def left_behind(folder: Path, progress: Progress = no_progress) -> LeftBehind:
    """Find the edits that dead processes left in a folder.

    Files of living processes are left alone. One that cannot be read gets
    another name, under which no later start looks at it; locks and
    half-written files without an edit are cleared away. ``progress`` is called
    while long ones are read; where it cancels, all are left for the next start.
    """
    found: list[Orphan] = []
    set_aside: list[Path] = []
    try:
        for path in sorted(folder.glob(f"*{SUFFIX}")):
            orphan = _orphan(path, progress)
            if isinstance(orphan, Orphan):
                found.append(orphan)
            elif orphan is not None:
                set_aside.append(orphan)
    except Cancelled:
        for orphan in found:
            orphan.release()
        raise
    for path in folder.glob("*.lock"):
        with contextlib.suppress(OSError):
            slot = RecoverySlot(path.with_suffix(SUFFIX), FileLock(path))
            if slot.path.exists():
                slot.lock.release()
            else:
                slot.remove()
    return LeftBehind(sorted(found, key=lambda orphan: -orphan.saved_at), set_aside)


def _orphan(path: Path, progress: Progress) -> Orphan | Path | None:
    """The edit in a file, or the name the file was given since there is none; None if another process has it."""
    try:
        lock = FileLock(_lock_path(path))
    except OSError:
        return None
    try:
        return Orphan(RecoverySlot(path, lock), read_session_file(path, progress), path.stat().st_mtime)
    except Cancelled:
        lock.release()
        raise
    # Whatever is wrong with one file, the program must start and offer the others.
    except Exception:
        aside = path.with_name(path.name + ".unreadable")
        try:
            path.rename(aside)
        except OSError:
            lock.release()
            return None
        lock.remove()
        return aside


def _lock_path(path: Path) -> Path:
    return path.with_suffix(".lock")
