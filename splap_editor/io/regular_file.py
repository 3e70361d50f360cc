"""Files opened for reading only if they are plain files of a sensible size."""

import os
import stat
from io import FileIO
from pathlib import Path

from splap_editor.core.progress import Progress, no_progress

MOST_TEXT_BYTES = 64 << 20
"""Largest recipe or session that is read."""


def open_regular(path: str | os.PathLike[str], most_bytes: int | None = None) -> FileIO:
    """Open a file for reading, unbuffered; what is no regular file is refused before a byte is asked of it.

    A FIFO or a device would keep the reader waiting for ever, or never end.

    Parameters
    ----------
    path : path
        A link is followed.
    most_bytes : int, optional
        Largest size to accept.

    Raises
    ------
    OSError
        If it cannot be opened, is something else than a file, or is larger;
        ``strerror`` says which and ``filename`` names it.
    """
    # Without O_NONBLOCK, opening a FIFO waits for somebody to write to it.
    flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0) | getattr(os, "O_CLOEXEC", 0)
    # A directory is told apart first: Windows would call it a lack of permission.
    _require_regular(os.stat(path), path)
    handle = os.open(path, flags)
    try:
        held = os.fstat(handle)
        _require_regular(held, path)
        if most_bytes is not None and held.st_size > most_bytes:
            raise OSError(0, f"it has {held.st_size:,} bytes and at most {most_bytes:,} are read", str(path))
        return FileIO(handle, "rb")
    except BaseException:
        os.close(handle)
        raise


def regular_bytes(
    path: str | os.PathLike[str], most_bytes: int = MOST_TEXT_BYTES, progress: Progress = no_progress
) -> bytes:
    """All bytes of a regular file of at most that size; ``progress`` is told the share for each MiB, and may cancel.

    Raises
    ------
    OSError
        As `open_regular`.
    """
    with open_regular(path, most_bytes) as file:
        data, n_bytes = bytearray(), os.fstat(file.fileno()).st_size
        # A file may grow while it is read.
        while len(data) <= most_bytes and (chunk := file.read(1 << 20)):
            data += chunk
            progress(min(len(data) / max(n_bytes, 1), 1.0))
    if len(data) > most_bytes:
        raise OSError(0, f"it grew past {most_bytes:,} bytes while it was read", str(path))
    return bytes(data)


def _require_regular(held: os.stat_result, path: str | os.PathLike[str]) -> None:
    if stat.S_ISREG(held.st_mode):
        return
    kinds = {
        stat.S_IFDIR: "a directory",
        stat.S_IFIFO: "a pipe",
        stat.S_IFSOCK: "a socket",
        stat.S_IFCHR: "a device",
        stat.S_IFBLK: "a device",
    }
    kind = kinds.get(stat.S_IFMT(held.st_mode), "something else")
    raise OSError(0, f"it is {kind}, not a regular file", str(Path(path)))
