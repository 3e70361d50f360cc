"""Ascii PLY files: numbers are parsed, lines are kept."""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from io import BytesIO

import numpy as np
from numpy.typing import NDArray

from splap_editor.io.ply_header import PlyElement, PlyError, PlyHeader
from splap_editor.io.ply_table import CellChanges, NewColumn, PlyTable, cast_values

_BLOCK_ROWS = 1 << 13


@dataclass(frozen=True, eq=False)
class TextTable(PlyTable):
    """An ascii PLY file in memory.

    Parameters
    ----------
    line_starts : (N + 1,) int
        Where in ``body`` the line of each row begins, and where the last one ends.
    """

    line_starts: NDArray[np.intp] | None = None

    def element(self, name: str) -> NDArray | None:
        """Return the vertex element as a structured array; text holds no views of the others."""
        if name != "vertex":
            return None
        rows = np.empty(self.n_rows, [(column, values.dtype) for column, values in self.columns.items()])
        for column, values in self.columns.items():
            rows[column] = values
        return rows

    def blocks(
        self, changes: Callable[[int, int], CellChanges], new_columns: list[NewColumn]
    ) -> Iterator[NDArray[np.uint8] | bytes]:
        """Yield the text of the body with some numbers replaced; untouched numbers keep their digits."""
        starts = self.line_starts
        yield self.body[: starts[0]]
        for lo in range(0, self.n_rows, _BLOCK_ROWS):
            hi = min(lo + _BLOCK_ROWS, self.n_rows)
            changed = changes(lo, hi)
            if changed or new_columns:
                yield b"".join(self._lines(lo, hi, changed, new_columns))
            else:
                yield self.body[starts[lo] : starts[hi]]
        yield self.body[starts[-1] :]

    def _lines(self, lo: int, hi: int, changed: CellChanges, new_columns: list[NewColumn]) -> list[bytes]:
        """Lines of a block of rows, tokens replaced and added."""
        position = {name: i for i, name in enumerate(self.columns)}
        replaced: dict[int, list[tuple[int, bytes]]] = {}
        for name, (rows, values) in changed.items():
            words = _words(cast_values(values, self.columns[name].dtype))
            for row, word in zip(rows.tolist(), words, strict=True):
                replaced.setdefault(row, []).append((position[name], word))
        added = [(position[c.after], _words(c.values[lo:hi])) for c in new_columns]
        lines = []
        for row in range(hi - lo):
            line = self.body[self.line_starts[lo + row] : self.line_starts[lo + row + 1]].tobytes()
            if row in replaced or added:
                # Odd pieces are the numbers, even ones the blanks around them.
                pieces = re.split(rb"(\S+)", line)
                for column, word in replaced.get(row, ()):
                    pieces[2 * column + 1] = word
                for column, words in added:
                    pieces[2 * column + 1] += b" " + words[row]
                line = b"".join(pieces)
            lines.append(line)
        return lines


def _words(values: NDArray) -> list[bytes]:
    """Shortest texts that read back as the same numbers."""
    return [str(value).encode() for value in values]


def text_table(name: str, header: PlyHeader, body: NDArray[np.uint8]) -> PlyTable:
    """Parse the vertex element of an ascii file.

    Raises
    ------
    PlyError
        If lines are missing or hold something else than the promised numbers.
    """
    ends = np.flatnonzero(body == (13 if header.newline == b"\r" else 10)) + 1
    if len(body) and (len(ends) == 0 or ends[-1] != len(body)):
        ends = np.append(ends, len(body))
    n_lines = sum(element.count for element in header.elements)
    if len(ends) < n_lines:
        raise PlyError(
            f"{name} is cut short: its header promises {n_lines:,} rows, {len(ends):,} are there. "
            "Copy or export it again."
        )
    bounds = np.concatenate([[0], ends])
    first = 0
    for element in header.elements:
        if element.name == "vertex":
            break
        first += element.count
    vertex = header.element("vertex")
    if vertex.has_lists:
        from splap_editor.io.ply_lists import list_table

        return list_table(name, header, body)
    starts = bounds[first : first + vertex.count + 1]
    columns = _parsed_columns(name, vertex, body, starts)
    return TextTable(name, header, body, columns, starts)


def _parsed_columns(
    name: str, vertex: PlyElement, body: NDArray[np.uint8], starts: NDArray[np.intp]
) -> dict[str, NDArray]:
    """Parse the numbers of the vertex lines, in blocks so that memory stays bounded."""
    columns = {p.name: np.empty(vertex.count, p.type) for p in vertex.properties}
    for lo in range(0, vertex.count, _BLOCK_ROWS):
        hi = min(lo + _BLOCK_ROWS, vertex.count)
        text = body[starts[lo] : starts[hi]].tobytes()
        try:
            numbers = np.loadtxt(BytesIO(text), dtype=np.float64, comments=None, ndmin=2)
        except ValueError:
            numbers = None
        if numbers is None or numbers.shape != (hi - lo, len(columns)):
            row = _first_bad_line(text, lo, len(columns))
            raise PlyError(
                f"{name} is damaged or cut short: the line of row {row:,} is not {len(columns)} numbers. "
                "Copy or export it again."
            )
        for column, values in zip(columns.values(), numbers.T, strict=True):
            column[lo:hi] = cast_values(values, column.dtype)
    return columns


def _first_bad_line(text: bytes, row: int, n_columns: int) -> int:
    """Row whose line does not hold that many numbers."""
    for line in text.splitlines():
        words = line.split()
        try:
            if len([float(word) for word in words]) != n_columns:
                break
        except ValueError:
            break
        row += 1
    return row
