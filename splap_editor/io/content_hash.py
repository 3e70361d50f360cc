"""What a splat file holds, as a short text that a session or a recipe can name it by."""

import errno
import hashlib
import os
from pathlib import Path

from splap_editor.core.progress import Progress, no_progress, part_of
from splap_editor.io.formats.source import LARGEST_FILE, FormatError, Source
from splap_editor.io.formats.table import GLANCE, format_of
from splap_editor.io.regular_file import open_regular

_CHUNK = 1 << 20
_ALONE, _WITH_OTHERS = "blake2b", "blake2b-all"
"""Of the bytes of one file, and of those of the files that it names too."""


def content_hash(path: str | os.PathLike[str], progress: Progress = no_progress) -> str:
    """Hash of a file's bytes, ``"blake2b:…"``; the name and date do not count.

    Of a file that keeps its numbers in others beside it, a SOG's ``meta.json`` or a ``.gltf``, theirs count too:
    ``"blake2b-all:…"``.

    Parameters
    ----------
    path : path
    progress : Progress
        Told the share done for each MiB; may cancel.

    Raises
    ------
    OSError
        If the file, or one that it names, cannot be read.
    """
    try:
        return _hash(path, progress)
    except FormatError as error:
        raise OSError(errno.ENOENT, str(error), str(path)) from error


def has_content(path: str | os.PathLike[str], known: str, progress: Progress = no_progress) -> bool:
    """Whether a file holds what it did when a hash was taken; one of the file alone says nothing of those it names.

    Raises
    ------
    OSError
        If the file cannot be read.
    """
    if known.startswith(f"{_ALONE}:"):
        return f"{_ALONE}:{_digest(path, progress).hexdigest()}" == known
    try:
        return _hash(path, progress) == known
    except FormatError:
        # What it names is gone.
        return False


def _hash(path: str | os.PathLike[str], progress: Progress) -> str:
    others = _named_by(Path(path))
    if not others:
        return f"{_ALONE}:{_digest(path, progress).hexdigest()}"
    digest = _digest(path, part_of(progress, 0.0, 1 / (len(others) + 1)))
    source = Source(Path(path))
    for number, name in enumerate(others, 1):
        told = part_of(progress, number / (len(others) + 1), (number + 1) / (len(others) + 1))
        data = source.beside(name, LARGEST_FILE, told)
        # What ends one and begins the next is no part of either.
        digest.update(f"\0{len(data)}\0".encode())
        for lo in range(0, len(data), _CHUNK):
            digest.update(data[lo : lo + _CHUNK])
            told(1.0)
    return f"{_WITH_OTHERS}:{digest.hexdigest()}"


def _digest(path: str | os.PathLike[str], progress: Progress) -> "hashlib.blake2b":
    digest = hashlib.blake2b(digest_size=16)
    with open_regular(path) as file:
        n_bytes, done = os.fstat(file.fileno()).st_size, 0
        while chunk := file.read(_CHUNK):
            digest.update(chunk)
            done += len(chunk)
            progress(min(done / max(n_bytes, 1), 1.0))
    return digest


def _named_by(path: Path) -> list[str]:
    """Names of the files beside a file that hold its numbers, each once."""
    source = Source(path)
    start = source.head(GLANCE)
    row = format_of(path, start)
    if not row.names_others or not row.is_begun_by(start):
        return []
    try:
        return list(dict.fromkeys(row.others(source)))
    except FormatError:
        # What is wrong with it, its reader says.
        return []
