"""The bytes of a PLY file, brought into memory and handed to the codec of its rows."""

import os
from collections.abc import Callable
from io import FileIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.progress import Progress, no_progress, part_of
from splap_editor.io.ply_codecs import codec_of
from splap_editor.io.ply_header import LONGEST_HEADER, PlyError, PlyHeader, ply_header
from splap_editor.io.ply_table import PlyTable
from splap_editor.io.regular_file import open_regular

READ_BYTES = 1 << 20
"""Read at a time: little enough to be still in the cache when the rows are glanced at."""


def read_table(
    path: str | os.PathLike[str],
    *,
    accepts: Callable[[PlyHeader, str], None] = lambda header, name: None,
    glance: Callable[[NDArray], None] | None = None,
    progress: Progress = no_progress,
) -> PlyTable:
    """Read a PLY file without interpreting its columns.

    Parameters
    ----------
    path : path
        The file: binary of either byte order, or ascii.
    accepts : callable (header, name)
        Raises if a file with this header is not wanted; asked before anything
        of the file's size is allocated.
    glance : callable (rows), optional
        Shown the vertex rows of a binary file, block by block as structured
        arrays, while they are cheap to look at. Other files are not shown.
    progress : Progress
        Told the share of bytes read.

    Raises
    ------
    PlyError
        If the file is missing, unreadable, not a PLY, cut short, or larger
        than the memory.
    """
    path = Path(path)
    name = path.name
    try:
        if path.is_dir():
            raise PlyError(f"{path} is a directory. Choose the .ply file inside it.")
        with open_regular(path) as file:
            header = ply_header(file.read(LONGEST_HEADER), name)
            accepts(header, name)
            n_bytes = os.fstat(file.fileno()).st_size - len(header.raw)
            _require_room(header, n_bytes, name)
            file.seek(len(header.raw))
            body = np.empty(n_bytes, np.uint8)
            # Bytes of text are parsed far more slowly than they are read.
            share = 0.1 if header.is_ascii else 0.9
            _read_body(file, body, header, name, glance, part_of(progress, 0.0, share))
        return codec_of(header).table(name, header, body, part_of(progress, share, 1.0))
    except FileNotFoundError:
        raise PlyError(f"{path} does not exist. Check the path.") from None
    except PermissionError:
        raise PlyError(f"{path} may not be read. Ask for permission to read it.") from None
    except OSError as error:
        raise PlyError(f"{path} could not be read: {error.strerror or error}.") from error
    except MemoryError:
        raise PlyError(f"{name} does not fit in memory. Close other programs or crop the scene first.") from None


def _read_body(
    file: FileIO,
    body: NDArray[np.uint8],
    header: PlyHeader,
    name: str,
    glance: Callable[[NDArray], None] | None,
    progress: Progress,
) -> None:
    """Fill the body from the file, block by block."""
    rows, start = body[:0], 0
    if glance is not None and codec_of(header).has_row_views:
        table = PlyTable(name, header, body)
        rows = table.rows
        start = table.offset_of(rows)
    n_seen = 0
    for lo in range(0, len(body), READ_BYTES):
        wanted = body[lo : lo + READ_BYTES]
        if file.readinto(wanted.data) != len(wanted):
            raise PlyError(f"{name} became shorter while it was read. Open it again once it is written.")
        hi = lo + len(wanted)
        if glance is not None and len(rows):
            n_whole = min(max(hi - start, 0) // rows.dtype.itemsize, len(rows))
            glance(rows[n_seen:n_whole])
            n_seen = n_whole
        progress(hi / len(body))


def _require_room(header: PlyHeader, n_bytes: int, name: str) -> None:
    """Refuse a file that is shorter than its header says, or larger than the memory."""
    wanted = header.smallest_body()
    # The last line of a text file may lack its line end.
    if n_bytes + header.is_ascii < wanted:
        raise PlyError(
            f"{name} is cut short: its header promises at least {wanted:,} bytes of rows, {n_bytes:,} are there. "
            "Copy or export it again."
        )
    needed = n_bytes + codec_of(header).parsed_bytes(header)
    available = available_memory()
    if available is not None and needed > available:
        raise PlyError(
            f"{name} needs {needed / 2**30:.1f} GiB of memory, {available / 2**30:.1f} GiB are free. "
            "Close other programs or crop the scene first."
        )


def available_memory() -> int | None:
    """Bytes of memory that can be had without swapping, None where the system does not tell."""
    try:
        with open("/proc/meminfo", "rb") as file:
            for line in file:
                if line.startswith(b"MemAvailable:"):
                    return int(line.split()[1]) * 1024
    except OSError:
        pass
    try:
        return os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return None
