"""Locks that a process holds on a file until it ends, however it ends."""

import contextlib
import os
import sys
from pathlib import Path

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl


class FileLock:
    """An exclusive lock on a file of its own; the system lets go of it when the process dies.

    Parameters
    ----------
    path : Path
        The lock file; made if it is not there.

    Raises
    ------
    BlockingIOError
        If another process, or another lock of this one, holds it.
    OSError
        If the file cannot be made.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._handle: int | None = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)
        try:
            _lock(self._handle)
            # Whoever held it before may have removed the file between opening and locking.
            if os.name != "nt" and not _is_same(self._handle, path):
                raise BlockingIOError(f"{path} was removed")
        except OSError as error:
            self.release()
            if isinstance(error, BlockingIOError | PermissionError):
                raise BlockingIOError(f"{path} is locked") from None
            raise

    def remove(self) -> None:
        """Delete the lock file and let go of it."""
        # Windows deletes no open file; elsewhere deleting first leaves no moment for another to lock what is then gone.
        if os.name == "nt":
            self.release()
        self.path.unlink(missing_ok=True)
        self.release()

    def release(self) -> None:
        """Let go of the lock; the file stays."""
        if self._handle is not None:
            os.close(self._handle)
            self._handle = None


def holds_lock(handle: int, path: Path) -> bool:
    """Lock an open file until it is closed; whether that worked and the file is still there.

    Where the file system knows no locks it counts as locked. On Windows, where
    nobody removes an open file, none is needed.
    """
    if os.name == "nt":
        return True
    try:
        _lock(handle)
    except BlockingIOError:
        return False
    except OSError:
        return True
    return _is_same(handle, path)


def _lock(handle: int) -> None:
    if sys.platform == "win32":
        msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
    else:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _is_same(handle: int, path: Path) -> bool:
    with contextlib.suppress(FileNotFoundError):
        return os.path.samestat(os.fstat(handle), os.stat(path))
    return False
