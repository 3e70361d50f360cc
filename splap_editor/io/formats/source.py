"""A file to be decoded: its name and its bytes, errors as sentences."""

import os
import struct
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from splap_editor.core.progress import Progress, no_progress
from splap_editor.io.ply_reader import available_memory
from splap_editor.io.regular_file import open_regular, regular_bytes

LARGEST_FILE = 1 << 36
"""More bytes than this are not read."""


class FormatError(ValueError):
    """A file that cannot be read or written in a format; the message is one sentence for the user and what to do."""


@dataclass(frozen=True, eq=False)
class Source:
    """A file to be decoded.

    Parameters
    ----------
    path : Path
    progress : Progress
        Told the share of its bytes that are read; may cancel.
    """

    path: Path
    progress: Progress = field(default=no_progress, repr=False)

    @property
    def name(self) -> str:
        """What messages call it."""
        return self.path.name

    def head(self, n_bytes: int) -> bytes:
        """The first bytes.

        Raises
        ------
        OSError
            If it cannot be read, or is no regular file.
        """
        with open_regular(self.path) as file:
            return file.read(n_bytes) or b""

    @cached_property
    def data(self) -> bytes:
        """All bytes.

        Raises
        ------
        FormatError
            If they cannot be read, or do not fit in memory.
        """
        try:
            self.require_room(os.stat(self.path).st_size)
            return regular_bytes(self.path, LARGEST_FILE, self.progress)
        except OSError as error:
            raise FormatError(f"{self.path} could not be read: {error.strerror or error}.") from error

    def beside(self, name: str, most_bytes: int, progress: Progress = no_progress) -> bytes:
        """All bytes of a file in the same folder, which this one names.

        Raises
        ------
        FormatError
            If the name or a link leads elsewhere, or what is there cannot be read or has more bytes.
        """
        advice = "Export it again as one file."
        # Half of a surrogate pair, which JSON can hold, is part of no name.
        is_name = all(mark not in "\\\0:" and not "\ud800" <= mark <= "\udfff" for mark in name)
        if name in ("", "..") or Path(name).name != name or not is_name:
            raise self.refused(f"keeps its numbers in {name[:80]!r}, which is not beside it", advice)
        path = os.path.realpath(self.path.with_name(name))
        if os.path.dirname(path) != os.path.realpath(self.path.parent):
            raise self.refused(f"keeps its numbers in {name[:80]!r}, a link that leads out of its folder", advice)
        try:
            self.require_room(os.stat(path).st_size)
            return regular_bytes(path, most_bytes, progress)
        except OSError as error:
            raise self.refused(
                f"keeps its numbers in {name[:80]!r}, which cannot be read ({error.strerror or error})",
                "Put that file beside it.",
            ) from error

    def unpack(self, form: str, at: int) -> tuple[Any, ...]:
        """Numbers at a place, as `struct.unpack_from`.

        Raises
        ------
        FormatError
            If the file ends before them.
        """
        try:
            return struct.unpack_from(form, self.data, at)
        except struct.error:
            raise self.cut_short() from None

    def piece(self, start: int, n_bytes: int) -> memoryview:
        """Bytes from a place on.

        Raises
        ------
        FormatError
            If the file does not hold so many.
        """
        if start < 0 or n_bytes < 0 or start + n_bytes > len(self.data):
            raise self.cut_short()
        return memoryview(self.data)[start : start + n_bytes]

    def require_room(self, n_bytes: int) -> None:
        """Refuse what would take more memory than there is."""
        available = available_memory()
        if available is not None and n_bytes > available:
            raise FormatError(
                f"{self.name} needs {n_bytes / 2**30:.1f} GiB of memory, {available / 2**30:.1f} GiB are free. "
                "Close other programs or crop the scene first."
            )

    def damaged(self, what: str) -> FormatError:
        """Make the error of a file whose bytes make no sense; ``what`` is a clause."""
        return FormatError(f"{self.name} is damaged: {what}. Export it again.")

    def cut_short(self) -> FormatError:
        """Make the error of a file that ends too early."""
        return FormatError(
            f"{self.name} is cut short: it ends before what its header promises. Copy or export it again."
        )

    def refused(self, what: str, advice: str) -> FormatError:
        """Make the error of a sound file that cannot be read; ``what`` is a clause, ``advice`` says what to do."""
        return FormatError(f"{self.name} {what}. {advice}")
