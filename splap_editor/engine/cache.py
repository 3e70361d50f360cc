"""Stage results on disk, so that the same scene opens fast the second time."""

import hashlib
import os
import tempfile
import zipfile
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import platformdirs
from numpy.typing import NDArray

Arrays = dict[str, NDArray]


class StageCache:
    """A bounded folder of array bundles, each under the hash of what it was made from.

    Entries are written to a temporary file and renamed, so two processes may
    share the folder and a crash leaves no half entry. An entry that cannot
    be read (truncated, corrupt) is dropped and counts as missing. When the
    folder passes its bound the entries used longest ago go first. A folder
    that cannot be written is no error: nothing is kept then.

    Parameters
    ----------
    folder : Path, optional
        ``SPLAP_CACHE_DIR`` or the user's cache folder by default.
    max_bytes : int
        Bound on the folder's size.
    """

    def __init__(self, folder: Path | None = None, max_bytes: int = 4 << 30) -> None:
        self.folder = folder or default_cache_folder() / "scenes"
        self.max_bytes = max_bytes

    def load(self, key: str) -> Arrays | None:
        """Read the arrays kept under ``key``, or None."""
        path = self._path(key)
        try:
            with open(path, "rb") as file, np.load(file, allow_pickle=False) as bundle:
                arrays = {name: bundle[name] for name in bundle.files}  # reading each member checks its CRC
            os.utime(path)
        except (FileNotFoundError, NotADirectoryError):
            return None
        except (OSError, ValueError, KeyError, EOFError, TypeError, AttributeError, zipfile.BadZipFile):
            path.unlink(missing_ok=True)
            return None
        return arrays

    def store(self, key: str, arrays: Arrays) -> bool:
        """Keep arrays under ``key``; False when the disk did not take them."""
        path = self._path(key)
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            handle, name = tempfile.mkstemp(dir=self.folder, prefix=".writing-", suffix=".npz")
            try:
                with os.fdopen(handle, "wb") as file:
                    np.savez(file, **arrays)
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
            digest.update(np.ascontiguousarray(part))
        else:
            digest.update(repr(part).encode())
        digest.update(b"\0")
    return digest.hexdigest()
