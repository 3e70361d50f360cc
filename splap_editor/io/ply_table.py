"""PLY bytes ↔ table of columns: the file stays as it is, columns are views into it."""

import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.progress import Progress, no_progress
from splap_editor.io.ply_header import LONGEST_HEADER, PlyError, PlyHeader, ply_header

CellChanges = dict[str, tuple[NDArray[np.intp], NDArray]]
"""Column name → rows (counted from the first row of the block) and the values to put there."""

_READ_BYTES = 1 << 20
"""Read at a time: little enough to be still in the cache when the rows are glanced at."""

_BLOCK_ROWS = 1 << 15


@dataclass(frozen=True)
class NewColumn:
    """A float column to add to the vertex element, after an existing one.

    Parameters
    ----------
    after : str
        Existing column that it follows.
    name : str
        Its name.
    values : (N,) float32
        One value per row.
    """

    after: str
    name: str
    values: NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class PlyTable:
    """A binary PLY file in memory, its rows of equal size.

    Subclasses hold text files and files whose rows differ in size.

    Parameters
    ----------
    name : str
        File name, for messages.
    header : PlyHeader
        The parsed header with its bytes.
    body : (B,) uint8
        Every byte after the header. Never write to it.
    columns : dict of (N,) arrays
        The vertex element by column name, in file order, with the file's own
        types and byte order. Views into ``body``, possibly unaligned.
    """

    name: str
    header: PlyHeader
    body: NDArray[np.uint8]
    columns: dict[str, NDArray] = field(default_factory=dict)

    @property
    def n_rows(self) -> int:
        """Number of rows N of the vertex element."""
        return self.header.element("vertex").count

    def element(self, name: str) -> NDArray | None:
        """Return the rows of an element as a structured view, None if there is none of that name."""
        start = 0
        for element in self.header.elements:
            dtype = element.dtype(self.header.byte_order)
            if element.name == name:
                return self.body[start : start + element.count * dtype.itemsize].view(dtype)
            start += element.count * dtype.itemsize
        return None

    def blocks(
        self, changes: Callable[[int, int], CellChanges], new_columns: list[NewColumn]
    ) -> Iterator[NDArray[np.uint8] | bytes]:
        """Yield the bytes of the body with some cells replaced.

        Parameters
        ----------
        changes : callable (lo, hi) → CellChanges
            What differs in rows ``lo`` to ``hi - 1``.
        new_columns : list of NewColumn
            Columns to add.
        """
        rows = self.element("vertex")
        start = _distance(rows, self.body)
        yield self.body[:start]
        for lo in range(0, len(rows), _BLOCK_ROWS):
            hi = min(lo + _BLOCK_ROWS, len(rows))
            block = rows[lo:hi]
            changed = changes(lo, hi)
            if changed:
                block = block.copy()
                for name, (where, values) in changed.items():
                    block[name][where] = cast_values(values, block.dtype[name])
            yield self._widened(block, lo, hi, new_columns)
        yield self.body[start + rows.nbytes :]

    def _widened(self, block: NDArray, lo: int, hi: int, new_columns: list[NewColumn]) -> NDArray[np.uint8]:
        """Bytes of the block with the new columns spliced into each row."""
        old = block.view(np.uint8).reshape(len(block), block.dtype.itemsize)
        pieces, start = [], 0
        ends = {name: offset + dtype.itemsize for name, (dtype, offset) in block.dtype.fields.items()}
        for column in sorted(new_columns, key=lambda c: ends[c.after]):
            pieces.append(old[:, start : ends[column.after]])
            values = column.values[lo:hi].astype(self.header.byte_order + "f4")
            pieces.append(values.view(np.uint8).reshape(-1, 4))
            start = ends[column.after]
        pieces.append(old[:, start:])
        return np.concatenate(pieces, axis=1) if new_columns else old


def cast_values(values: NDArray, dtype: np.dtype) -> NDArray:
    """Values in a column's own type: integers are rounded and clipped, floats rounded."""
    if dtype.kind in "iu":
        limits = np.iinfo(dtype)
        values = np.clip(np.rint(np.nan_to_num(values)), limits.min, limits.max)
    with np.errstate(over="ignore"):
        return np.asarray(values).astype(dtype)


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
        if path.exists() and not path.is_file():
            raise PlyError(f"{path} is not a regular file. Choose a .ply file.")
        with open(path, "rb", buffering=0) as file:
            header = ply_header(file.read(LONGEST_HEADER), name)
            accepts(header, name)
            n_bytes = os.fstat(file.fileno()).st_size - len(header.raw)
            _require_room(header, n_bytes, name)
            file.seek(len(header.raw))
            body = np.empty(n_bytes, np.uint8)
            _read_body(file, body, header, name, glance, progress)
        return _table(name, header, body)
    except FileNotFoundError:
        raise PlyError(f"{path} does not exist. Check the path.") from None
    except PermissionError:
        raise PlyError(f"{path} may not be read. Ask for permission to read it.") from None
    except OSError as error:
        raise PlyError(f"{path} could not be read: {error.strerror or error}.") from error
    except MemoryError:
        raise PlyError(f"{name} does not fit in memory. Close other programs or crop the scene first.") from None


def _read_body(
    file: BinaryIO,
    body: NDArray[np.uint8],
    header: PlyHeader,
    name: str,
    glance: Callable[[NDArray], None] | None,
    progress: Progress,
) -> None:
    """Fill the body from the file, block by block."""
    rows, start = None, 0
    if glance is not None and not header.is_ascii and not any(element.has_lists for element in header.elements):
        rows = PlyTable(name, header, body).element("vertex")
        start = _distance(rows, body)
    n_seen, next_report = 0, 0.0
    for lo in range(0, len(body), _READ_BYTES):
        wanted = body[lo : lo + _READ_BYTES]
        if file.readinto(wanted) != len(wanted):
            raise PlyError(f"{name} became shorter while it was read. Open it again once it is written.")
        hi = lo + len(wanted)
        if rows is not None:
            n_whole = min(max(hi - start, 0) // rows.dtype.itemsize, len(rows))
            glance(rows[n_seen:n_whole])
            n_seen = n_whole
        if hi >= next_report * len(body):
            progress(hi / len(body))
            next_report += 0.05


def _distance(rows: NDArray, body: NDArray[np.uint8]) -> int:
    """Offset of a view in the body."""
    return rows.__array_interface__["data"][0] - body.__array_interface__["data"][0]


def _table(name: str, header: PlyHeader, body: NDArray[np.uint8]) -> PlyTable:
    """Choose the kind of table that the header calls for."""
    if header.is_ascii:
        from splap_editor.io.ply_text import text_table

        return text_table(name, header, body)
    if any(element.has_lists for element in header.elements):
        from splap_editor.io.ply_lists import list_table

        return list_table(name, header, body)
    table = PlyTable(name, header, body)
    rows = table.element("vertex")
    table.columns.update({column: rows[column] for column in rows.dtype.names})
    return table


def _require_room(header: PlyHeader, n_bytes: int, name: str) -> None:
    """Refuse a file that is shorter than its header says, or larger than the memory."""
    wanted = header.smallest_body()
    # The last line of a text file may lack its line end.
    if n_bytes + header.is_ascii < wanted:
        raise PlyError(
            f"{name} is cut short: its header promises at least {wanted:,} bytes of rows, {n_bytes:,} are there. "
            "Copy or export it again."
        )
    needed = n_bytes
    if header.is_ascii:
        needed += sum(8 * element.count * len(element.properties) for element in header.elements)
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
