"""Binary PLY files with list properties: rows differ in size, and their lists are passed over, not parsed."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.index_spaces import FileRow, FileRows
from splap_editor.core.progress import Progress, no_progress
from splap_editor.io.ply_header import PlyElement, PlyError, PlyHeader
from splap_editor.io.ply_table import CellChanges, NewColumn, PlyTable, replaced_cells

_MOST_ROWS = 1 << 13
_MOST_OFFSETS = 1 << 18
"""Rows, and their columns, that are looked at together."""


@dataclass(frozen=True, eq=False)
class ListTable(PlyTable):
    """A binary PLY file with lists somewhere: its rows differ in size.

    Parameters
    ----------
    start : int
        Where in ``body`` the vertex element begins.
    scalars : (N,) structured array
        The vertex columns that are no lists; ``columns`` are views into it.
    """

    start: int = 0
    scalars: NDArray = field(default_factory=lambda: np.zeros(0))

    def element(self, name: str) -> NDArray | None:
        """Return what is no list of the vertex element; the others are kept as bytes alone."""
        return self.scalars if name == "vertex" else None

    def with_copies(self, rows: FileRows) -> PlyTable:
        """The same file with copies of some rows (M,) of the vertex element, lists included, after its own."""
        blocks = list(_row_blocks(self.name, self.header, self.header.vertex, self.body, self.start))
        starts = np.concatenate([offsets[:, 0] for offsets in blocks])[rows]
        ends = np.concatenate([offsets[:, -1] for offsets in blocks])
        added = [self.body[start:end] for start, end in zip(starts.tolist(), ends[rows].tolist(), strict=True)]
        return list_table(self.name, *self._grown(rows, int(ends[-1]), np.concatenate(added)))

    def blocks(
        self,
        changes: Callable[[int, int], CellChanges],
        new_columns: list[NewColumn],
        kept: NDArray[np.bool_] | None = None,
    ) -> Iterator[NDArray[np.uint8] | bytes]:
        """Yield the body with some cells replaced; lists keep their bytes."""
        vertex, row, end = self.header.vertex, 0, self.start
        yield self.body[:end]
        for offsets in _row_blocks(self.name, self.header, vertex, self.body, end):
            start, end = int(offsets[0, 0]), int(offsets[-1, -1])
            block = self.body[start:end]
            changed = changes(row, row + len(offsets))
            if changed:
                block = block.copy()
            for name, (where, values) in changed.items():
                before = self.columns[name][row : row + len(offsets)][where]
                cells = replaced_cells(self.name, name, before, values, row + where)
                places = offsets[where, vertex.names.index(name)] - start
                size = cells.dtype.itemsize
                block[places[:, None] + np.arange(size)] = cells.view(np.uint8).reshape(-1, size)
            sizes = offsets[:, -1] - offsets[:, 0] + 4 * len(new_columns)
            if new_columns:
                block = self._widened_rows(block, offsets, row, new_columns)
            if kept is not None:
                block = block[np.repeat(kept[row : row + len(offsets)], sizes)]
            yield block
            row += len(offsets)
        yield self.body[end:]

    def _widened_rows(
        self, block: NDArray[np.uint8], offsets: NDArray[np.int64], row: FileRow, new_columns: list[NewColumn]
    ) -> NDArray[np.uint8]:
        """Rows with new columns spliced in."""
        names = self.header.vertex.names
        float_type = self.header.byte_order + "f4"
        places = [offsets[:, names.index(column.after) + 1] - offsets[0, 0] for column in new_columns]
        values = [
            column.values[row : row + len(offsets)].astype(float_type).view(np.uint8).reshape(-1, 4)
            for column in new_columns
        ]
        # Row by row, so that several columns at one place keep their order.
        at = np.repeat(np.stack(places, axis=1).reshape(-1), 4)
        return np.insert(block, at, np.stack(values, axis=1).reshape(-1))


def list_table(name: str, header: PlyHeader, body: NDArray[np.uint8], progress: Progress = no_progress) -> ListTable:
    """Find the rows of a file whose rows differ in size, and copy the numbers among its vertices' columns.

    Raises
    ------
    PlyError
        If the rows end early, or a list has a negative length.
    """
    place, vertex_start, row = 0, 0, 0
    vertex = header.vertex
    types = [(p.name, header.byte_order + p.type) for p in vertex.properties if p.length_type is None]
    scalars = np.empty(vertex.count, types)
    into = scalars.view(np.uint8).reshape(vertex.count, scalars.dtype.itemsize)
    for element in header.elements:
        if element is vertex:
            vertex_start = place
        for offsets in _row_blocks(name, header, element, body, place):
            if element is vertex:
                _copy_scalars(vertex, body, offsets, into[row : row + len(offsets)])
                row += len(offsets)
            place = int(offsets[-1, -1])
            progress(place / max(len(body), 1))
    columns = {column: scalars[column] for column, _ in types}
    return ListTable(name, header, body, columns, vertex_start, scalars)


def _copy_scalars(
    vertex: PlyElement, body: NDArray[np.uint8], offsets: NDArray[np.int64], into: NDArray[np.uint8]
) -> None:
    to = 0
    for k, p in enumerate(vertex.properties):
        if p.length_type is None:
            size = np.dtype(p.type).itemsize
            into[:, to : to + size] = body[offsets[:, k, None] + np.arange(size)]
            to += size


def _row_blocks(
    name: str, header: PlyHeader, element: PlyElement, body: NDArray[np.uint8], start: int
) -> Iterator[NDArray[np.int64]]:
    """Where in the body each column of some rows begins, and after the last where the row ends: (rows, columns + 1)."""
    # Only files with lists, which are few, wait for a compiler.
    from splap_editor.io.list_rows import NEGATIVE, list_rows

    sizes = np.array([np.dtype(p.type).itemsize for p in element.properties], np.int64)
    lengths = np.array([np.dtype(p.length_type).itemsize if p.length_type else 0 for p in element.properties], np.int64)
    is_signed = np.array([p.length_type is not None and p.length_type[0] == "i" for p in element.properties])
    most = max(min(_MOST_ROWS, _MOST_OFFSETS // (len(sizes) + 1)), 1)
    row = 0
    while row < element.count:
        offsets = np.empty((min(most, element.count - row), len(sizes) + 1), np.int64)
        bad, why = list_rows(body, start, sizes, lengths, is_signed, header.byte_order == ">", offsets)
        if bad >= 0:
            where = f"row {row + bad:,} of its element {element.name!r}"
            what = f"{where} has a list of negative length" if why == NEGATIVE else f"it ends in {where}"
            raise PlyError(f"{name} is damaged or cut short: {what}. Copy or export it again.")
        yield offsets
        row, start = row + len(offsets), int(offsets[-1, -1])
