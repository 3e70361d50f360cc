"""Stage results on disk, so that the same scene opens fast the second time."""

import contextlib
import hashlib
import os
import struct
import tempfile
import zlib
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, BinaryIO, TypeVar

import numpy as np
import platformdirs

from splap_editor.core.kept_arrays import Arrays, CacheEntryError
from splap_editor.io.npz import NpzError, NpzFile
from splap_editor.io.regular_file import open_regular

T = TypeVar("T")

HEAD = struct.Struct("<16sQI")
MAGIC = b"SpLap cache 2\r\n\0"
"""What stands before an entry's archive: the mark of the format, then length and check sum of the archive."""

_CHUNK = 1 << 20


class StageCache:
    """A bounded folder of array bundles, each under the hash of what it was made from.

    An entry is a check sum, then an ``.npz``. Entries are written to a
    temporary file and renamed, so two processes may share the folder and a
    crash leaves no half entry. Nothing of an entry is parsed before its bytes
    are known to be those that were written, nothing of it is used before its
    maker has looked at its shapes and indices; one that fails is dropped and
    counts as missing. When the folder passes its bound the entries used
    longest ago go first. A folder that cannot be written is no error: nothing
    is kept then.

    Parameters
    ----------
    folder : Path, optional
        ``SPLAP_CACHE_DIR`` or the user's cache folder by default.
    max_bytes : int
        Bound on the folder's size.
    say : callable (sentence), optional
        Told, once, that an entry was damaged; on the thread that loads.
    """

    def __init__(
        self, folder: Path | None = None, max_bytes: int = 4 << 30, say: Callable[[str], None] | None = None
    ) -> None:
        self.folder = folder or default_cache_folder() / "scenes"
        self.max_bytes = max_bytes
        self.say = say
        # Taking the one item is atomic, so that of two threads one says it.
        self._unsaid = [True]

    def kept(
        self, key: str, make: Callable[[], T], packed: Callable[[T], Arrays], unpacked: Callable[[Arrays], T]
    ) -> T:
        """Make something of the arrays kept under ``key``; where there are none, make it anew and keep its arrays."""
        found = self.load(key, unpacked)
        if found is None:
            found = make()
            self.store(key, packed(found))
        return found

    def load(self, key: str, made: Callable[[Arrays], T]) -> T | None:
        """Make something of the arrays kept under ``key``; None where there are none.

        Parameters
        ----------
        key : str
        made : callable
            ``made(arrays)`` raises `CacheEntryError` or KeyError where they are not what it needs.
        """
        path = self._path(key)
        try:
            with open_regular(path) as file:
                found = made(_checked_arrays(file))
        except (FileNotFoundError, NotADirectoryError):
            return None
        except (OSError, NpzError, CacheEntryError, KeyError, MemoryError) as error:
            self._drop(path, error)
            return None
        with contextlib.suppress(OSError):
            os.utime(path)
        return found

    def _drop(self, path: Path, error: Exception) -> None:
        """Remove an entry, and say so the first time."""
        with contextlib.suppress(OSError):
            path.unlink(missing_ok=True)
        if self.say is not None and not isinstance(error, _EarlierFormatError):
            with contextlib.suppress(IndexError):
                self._unsaid.pop()
                self.say(f"A prepared scene in {self.folder} was damaged: it is made again.")

    def store(self, key: str, arrays: Arrays) -> bool:
        """Keep arrays under ``key``; False when the disk did not take them."""
        path = self._path(key)
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            handle, name = tempfile.mkstemp(dir=self.folder, prefix=".writing-", suffix=".npz")
            try:
                with os.fdopen(handle, "w+b") as file:
                    file.write(bytes(HEAD.size))
                    # Newer numpy has a parameter among the names of arrays, which none of ours is.
                    named: dict[str, Any] = arrays
                    np.savez(file, **named)
                    head = HEAD.pack(MAGIC, *_length_and_sum(file))
                    file.seek(0)
                    file.write(head)
                os.replace(name, path)
            except BaseException:
                Path(name).unlink(missing_ok=True)
                raise
        except OSError:
            return False
        self._evict(keep=path)
        return True

    @property
    def nbytes(self) -> int:
        """Size of all entries on disk, in bytes."""
        return sum(size for _, size, _ in self._entries())

    def set_max_bytes(self, max_bytes: int) -> None:
        """Change the bound; what no longer fits goes at once."""
        self.max_bytes = max_bytes
        self._evict()

    def clear(self) -> None:
        """Drop every entry."""
        for path in self.folder.glob("*.npz"):
            path.unlink(missing_ok=True)

    def _path(self, key: str) -> Path:
        return self.folder / f"{key}.npz"

    def _entries(self) -> list[tuple[float, int, Path]]:
        entries = []
        for path in self.folder.glob("*.npz"):
            try:
                stat = path.stat()
            except OSError:
                continue  # another process dropped it meanwhile
            entries.append((stat.st_mtime, stat.st_size, path))
        return entries

    def _evict(self, keep: Path | None = None) -> None:
        entries = self._entries()
        total = sum(size for _, size, _ in entries)
        for _, size, path in sorted(entries, key=lambda entry: entry[0]):
            if total <= self.max_bytes:
                return
            if path != keep:
                path.unlink(missing_ok=True)
                total -= size


class _EarlierFormatError(CacheEntryError):
    """An entry of an earlier version of the program, which is no damage."""


def _checked_arrays(file: BinaryIO) -> Arrays:
    """Arrays of an entry whose bytes are those that were written."""
    head = file.read(HEAD.size)
    if head[:4] == b"PK\3\4":
        raise _EarlierFormatError
    if len(head) < HEAD.size or head != HEAD.pack(MAGIC, *(found := _length_and_sum(file))):
        raise CacheEntryError("its check sum is wrong")
    archive = NpzFile(file, most_bytes=found[0])
    return {name: archive.array(name) for name in archive.names}


def _length_and_sum(file: BinaryIO) -> tuple[int, int]:
    """Number of bytes after the head, and their check sum."""
    file.seek(HEAD.size)
    n_bytes = total = 0
    while chunk := file.read(_CHUNK):
        n_bytes += len(chunk)
        total = zlib.crc32(chunk, total)
    return n_bytes, total


def default_cache_folder() -> Path:
    """Folder that the program may fill and the user may empty."""
    named = os.environ.get("SPLAP_CACHE_DIR")
    return Path(named) if named else Path(platformdirs.user_cache_dir("splap-editor"))


def content_key(parts: Iterable[object]) -> str:
    """Hash arrays, numbers and strings to a file name; the order counts, and so do dtype and shape."""
    digest = hashlib.blake2b(digest_size=20)
    for part in parts:
        if isinstance(part, np.ndarray):
            digest.update(f"{part.dtype.str}{part.shape}".encode())
            digest.update(np.ascontiguousarray(part).data)
        else:
            digest.update(repr(part).encode())
        digest.update(b"\0")
    return digest.hexdigest()
