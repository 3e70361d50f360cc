"""Files that are replaced whole or not at all."""

import contextlib
import errno
import os
import re
import secrets
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from splap_editor.io.file_lock import FileLock, holds_lock

_PART = re.compile(r"\..+\.[0-9a-f]{12}\.part")

_WAYS_OUT = {errno.ENAMETOOLONG: "Choose a shorter name"}


@contextlib.contextmanager
def atomic_file(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """Open a file for writing that takes its name only once it is complete.

    The bytes go to a temporary file in the same directory. Leaving the block
    flushes them to the disk and renames the file over ``path``; leaving it by
    an exception removes the temporary file and leaves ``path`` as it was. A
    killed process can leave a ``.name.*.part`` file behind, never a broken
    ``path``; the next write to the directory clears it away.

    Parameters
    ----------
    path : path
        The file to create or replace. A symbolic link is followed, so the
        link stays and its target is replaced. An existing file keeps its
        permission bits; a new one gets the usual ones.

    Yields
    ------
    BinaryIO
        Where to write. It may be the file being read: whoever has the old one
        open or mapped keeps the old bytes.

    Raises
    ------
    OSError
        If the directory cannot be written to, the disk is full and so on.
    """
    target = Path(os.path.realpath(path))
    mode = _mode_to_keep(target)
    _clear_abandoned(target.parent)
    try:
        handle, temporary = _new_part(target)
    except OSError as error:
        error.filename = str(target)
        raise
    try:
        with os.fdopen(handle, "wb") as file:
            yield file
            file.flush()
            if mode is not None and hasattr(os, "fchmod"):
                os.fchmod(file.fileno(), mode)
            os.fsync(file.fileno())
        os.replace(temporary, target)
    except BaseException as error:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(temporary)
        if isinstance(error, OSError) and error.errno is not None:
            # A full disk names no file, and a rename names two.
            error.filename, error.filename2 = str(target), None
        raise
    _sync_directory(target.parent)


@contextlib.contextmanager
def whole_file(path: str | os.PathLike[str], refused: type[ValueError]) -> Iterator[BinaryIO]:
    """Open a file as `atomic_file` does, and say in a sentence for the user what keeps it from being written.

    Raises
    ------
    ValueError
        One of the given kind, that names the path and says what to do.
    """
    try:
        with atomic_file(path) as file:
            yield file
    except FileNotFoundError:
        # A link may lead into a directory that is gone.
        folder = Path(os.path.realpath(path)).parent
        raise refused(f"{path} cannot be written: the directory {folder} does not exist. Create it.") from None
    except OSError as error:
        raise refused(f"{not_written(path, error)}; what was there is unchanged.") from error


def not_written(path: str | os.PathLike[str], error: OSError) -> str:
    """Say that a file could not be written, why and what to do, without a full stop."""
    way_out = _WAYS_OUT.get(error.errno or 0, "Free some space or choose another place")
    return f"{path} cannot be written: {error.strerror or error}. {way_out}"


def _new_part(target: Path) -> tuple[int, Path]:
    """Make a temporary file beside a target, and lock it as long as its writer lives."""
    while True:
        temporary = target.with_name(f".{target.name[:80]}.{secrets.token_hex(6)}.part")
        # 0o666 is cut down by the umask, as for any new file.
        handle = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o666)
        if holds_lock(handle, temporary):
            return handle, temporary
        # Another process took it for abandoned in the moment between making and locking.
        os.close(handle)


def _clear_abandoned(directory: Path) -> None:
    """Remove the temporary files that dead processes left in a directory; those of living ones are locked."""
    with contextlib.suppress(OSError):
        with os.scandir(directory) as entries:
            names = [entry.name for entry in entries if _PART.fullmatch(entry.name)]
        for name in names:
            with contextlib.suppress(OSError):
                FileLock(directory / name).remove()


def _mode_to_keep(target: Path) -> int | None:
    """Permission bits of the file to be replaced, None if there is none yet.

    Renaming would put a plain file in the place of a device or a directory,
    and would ignore a write protection: both are refused here.
    """
    try:
        mode = target.stat().st_mode
    except FileNotFoundError:
        return None
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(target))
    if not stat.S_ISREG(mode):
        raise OSError(errno.EINVAL, "Not a regular file", str(target))
    if not os.access(target, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(target))
    return stat.S_IMODE(mode)


def _sync_directory(directory: Path) -> None:
    """Make the rename itself survive a power cut, where the system can."""
    if os.name != "posix":
        return
    with contextlib.suppress(OSError):
        handle = os.open(directory, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
