"""PLY bytes ↔ table of columns: the file stays as it is, columns are views into it."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.index_spaces import FileRows
from splap_editor.core.progress import Progress, no_progress
from splap_editor.io.ply_header import PlyError, PlyHeader, ply_header

CellChanges = dict[str, tuple[NDArray[np.intp], NDArray]]
"""Column name → rows (counted from the first row of the block) and the values to put there."""

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
        return self.header.vertex.count

    @property
    def rows(self) -> NDArray:
        """The vertex element as a structured view."""
        rows = self.element("vertex")
        assert rows is not None
        return rows

    def element(self, name: str) -> NDArray | None:
        """Return the rows of an element as a structured view, None if there is none of that name."""
        start = 0
        for element in self.header.elements:
            dtype = element.dtype(self.header.byte_order)
            if element.name == name:
                return self.body[start : start + element.count * dtype.itemsize].view(dtype)
            start += element.count * dtype.itemsize
        return None

    def offset_of(self, rows: NDArray) -> int:
        """Bytes before a view into the body."""
        return rows.__array_interface__["data"][0] - self.body.__array_interface__["data"][0]

    def with_copies(self, rows: FileRows) -> "PlyTable":
        """The same file with copies of some rows (M,) of the vertex element after its own."""
        held = self.rows
        end = self.offset_of(held) + held.nbytes
        return binary_table(self.name, *self._grown(rows, end, held[rows].view(np.uint8)))

    def _grown(self, rows: FileRows, end: int, added: NDArray[np.uint8]) -> tuple[PlyHeader, NDArray[np.uint8]]:
        """Header and body with the bytes of so many more rows where the file's own end."""
        header = ply_header(self.header.with_columns([], self.n_rows + len(rows)), self.name)
        return header, np.concatenate([self.body[:end], added, self.body[end:]])

    def blocks(
        self,
        changes: Callable[[int, int], CellChanges],
        new_columns: list[NewColumn],
        kept: NDArray[np.bool_] | None = None,
    ) -> Iterator[NDArray[np.uint8] | bytes]:
        """Yield the bytes of the body with some cells replaced.

        Parameters
        ----------
        changes : callable (lo, hi) → CellChanges
            What differs in rows ``lo`` to ``hi - 1``.
        new_columns : list of NewColumn
            Columns to add.
        kept : (N,) bool, optional
            Rows to write; all of them without.
        """
        rows = self.rows
        start = self.offset_of(rows)
        yield self.body[:start]
        for lo in range(0, len(rows), _BLOCK_ROWS):
            hi = min(lo + _BLOCK_ROWS, len(rows))
            block = rows[lo:hi]
            changed = changes(lo, hi)
            if changed:
                block = block.copy()
                for name, (where, values) in changed.items():
                    block[name][where] = replaced_cells(self.name, name, block[name][where], values, lo + where)
            written = self._widened(block, lo, hi, new_columns)
            yield written if kept is None else written[kept[lo:hi]]
        yield self.body[start + rows.nbytes :]

    def _widened(self, block: NDArray, lo: int, hi: int, new_columns: list[NewColumn]) -> NDArray[np.uint8]:
        """Bytes of the block with the new columns spliced into each row."""
        old = block.view(np.uint8).reshape(len(block), block.dtype.itemsize)
        pieces, start = [], 0
        widths = [dtype.itemsize for dtype in field_types(block.dtype).values()]
        ends = dict(zip(field_types(block.dtype), np.cumsum(widths).tolist(), strict=True))
        for column in sorted(new_columns, key=lambda c: ends[c.after]):
            pieces.append(old[:, start : ends[column.after]])
            values = column.values[lo:hi].astype(self.header.byte_order + "f4")
            pieces.append(values.view(np.uint8).reshape(-1, 4))
            start = ends[column.after]
        pieces.append(old[:, start:])
        return np.concatenate(pieces, axis=1) if new_columns else old


def binary_table(name: str, header: PlyHeader, body: NDArray[np.uint8], progress: Progress = no_progress) -> PlyTable:
    """Name the columns of binary rows of equal size; nothing is copied."""
    table = PlyTable(name, header, body)
    rows = table.rows
    table.columns.update({column: rows[column] for column in field_types(rows.dtype)})
    return table


def field_types(record: np.dtype) -> dict[str, np.dtype]:
    """Columns of a packed record with their types, in order."""
    return {name: record[name] for name in record.names or ()}


def cast_values(values: NDArray, dtype: np.dtype) -> NDArray:
    """Values in a column's own type: integers are rounded and clipped, floats rounded."""
    if dtype.kind in "iu":
        limits = np.iinfo(dtype)
        values = np.clip(np.rint(np.nan_to_num(values)), limits.min, limits.max)
    with np.errstate(over="ignore"):
        return np.asarray(values).astype(dtype)


def replaced_cells(name: str, column: str, before: NDArray, values: NDArray, rows: FileRows) -> NDArray:
    """Values in a column's own type, on their way into the file.

    Parameters
    ----------
    name, column : str
        File and column, for the message.
    before : (n,) array
        What the cells hold, in the column's type.
    values : (n,) float
        What to put there.
    rows : (n,) int
        File rows of the cells.

    Raises
    ------
    PlyError
        If a number that the file holds would become one that its column cannot hold.
    """
    cells = cast_values(values, before.dtype)
    if before.dtype.kind in "iu":
        # Half a step beyond the limits still rounds to them.
        lost = ~(np.abs(values - cells) <= 0.5 + 1e-6 * np.abs(values))
    else:
        lost = ~np.isfinite(cells) & np.isfinite(before)
    if lost.any():
        at = int(np.argmax(lost))
        raise PlyError(
            f"{name} cannot hold the result: {column} of row {rows[at]:,} would be {values[at]:g}, which its column of "
            f"type {before.dtype.name} has no number for. Move the handles less far; nothing was written."
        )
    return cells
