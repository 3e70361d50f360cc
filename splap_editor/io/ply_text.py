"""Ascii PLY files: numbers are parsed, lines are kept."""

import contextlib
import itertools
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from io import BytesIO

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.index_spaces import FileRow, FileRows
from splap_editor.core.progress import Progress, no_progress, part_of
from splap_editor.io.ply_header import PlyElement, PlyError, PlyHeader
from splap_editor.io.ply_table import CellChanges, NewColumn, PlyTable, cast_values, field_types, replaced_cells

_BLOCK_ROWS = 1 << 13
_BLOCK_BYTES = 1 << 20
"""Text that is looked through, or parsed, at a time."""

_NUMBER_BYTES = b"0123456789+-.eEinfatyINFATY \t\r\n"


@dataclass(frozen=True, eq=False)
class TextTable(PlyTable):
    """An ascii PLY file in memory.

    Parameters
    ----------
    line_starts : (N + 1,) int
        Where in ``body`` the line of each row begins, and where the last one ends.
    numbers : (N,) structured array
        The vertex columns that are no lists; ``columns`` are views into it.
    """

    line_starts: NDArray[np.intp] = field(default_factory=lambda: np.zeros(1, np.intp))
    numbers: NDArray = field(default_factory=lambda: np.zeros(0))

    def element(self, name: str) -> NDArray | None:
        """Return the vertex element as a structured array; text holds no views of the others."""
        return self.numbers if name == "vertex" else None

    def with_copies(self, rows: FileRows) -> PlyTable:
        """The same file with copies of some lines (M,) of the vertex element after its own."""
        end = int(self.line_starts[-1])
        ends_open = end > 0 and self.body[end - 1] not in b"\r\n"
        newline = self.header.newline
        lines = (self.body[self.line_starts[row] : self.line_starts[row + 1]].tobytes() for row in rows.tolist())
        added = (newline if ends_open else b"") + b"".join(line.rstrip(b"\r\n") + newline for line in lines)
        return text_table(self.name, *self._grown(rows, end, np.frombuffer(added, np.uint8)))

    def blocks(
        self,
        changes: Callable[[int, int], CellChanges],
        new_columns: list[NewColumn],
        kept: NDArray[np.bool_] | None = None,
    ) -> Iterator[NDArray[np.uint8] | bytes]:
        """Yield the text of the body with some numbers replaced; untouched numbers keep their digits."""
        starts = self.line_starts
        yield self.body[: starts[0]]
        for lo in range(0, self.n_rows, _BLOCK_ROWS):
            hi = min(lo + _BLOCK_ROWS, self.n_rows)
            changed = changes(lo, hi)
            if changed or new_columns or kept is not None:
                lines = self._lines(lo, hi, changed, new_columns)
                yield b"".join(lines if kept is None else itertools.compress(lines, kept[lo:hi]))
            else:
                yield self.body[starts[lo] : starts[hi]]
        yield self.body[starts[-1] :]

    def _lines(self, lo: int, hi: int, changed: CellChanges, new_columns: list[NewColumn]) -> list[bytes]:
        """Lines of a block of rows, tokens replaced and added."""
        vertex = self.header.vertex
        replaced: dict[int, list[tuple[str, bytes]]] = {}
        for name, (rows, values) in changed.items():
            before = self.columns[name][lo:hi][rows]
            words = _words(replaced_cells(self.name, name, before, values, lo + rows))
            for row, word in zip(rows.tolist(), words, strict=True):
                replaced.setdefault(row, []).append((name, word))
        added = [(c.after, _words(c.values[lo:hi])) for c in new_columns]
        lines = []
        for row in range(hi - lo):
            line = self.body[self.line_starts[lo + row] : self.line_starts[lo + row + 1]].tobytes()
            if row in replaced or added:
                # Odd pieces are the numbers, even ones the blanks around them.
                pieces = re.split(rb"(\S+)", line)
                place = _last_words(vertex, pieces[1::2])
                for name, word in replaced.get(row, ()):
                    pieces[2 * place[name] + 1] = word
                for name, words in added:
                    pieces[2 * place[name] + 1] += b" " + words[row]
                line = b"".join(pieces)
            lines.append(line)
        return lines


def _last_words(vertex: PlyElement, words: list[bytes]) -> dict[str, int]:
    """Number of the word of each column in a line; the last one of a list.

    Raises
    ------
    ValueError, IndexError
        If the line is not such a row.
    """
    place, next_word = {}, 0
    for p in vertex.properties:
        if p.length_type is not None:
            length = int(words[next_word])
            if not 0 <= length <= len(words):
                raise ValueError(f"a list of {length} is not in {len(words)} words")
            next_word += length
        place[p.name] = next_word
        next_word += 1
    if next_word != len(words):
        raise ValueError(f"{next_word} words expected, got {len(words)}")
    return place


def _words(values: NDArray) -> list[bytes]:
    """Shortest texts that read back as the same numbers."""
    return [str(value).encode() for value in values]


def text_table(name: str, header: PlyHeader, body: NDArray[np.uint8], progress: Progress = no_progress) -> PlyTable:
    """Parse the vertex element of an ascii file.

    Raises
    ------
    PlyError
        If lines are missing or hold something else than the promised numbers.
    """
    first = 0
    for element in header.elements:
        if element.name == "vertex":
            break
        first += element.count
    starts, last = _line_starts(name, header, body, first, part_of(progress, 0.0, 0.2))
    _require_whole_last_line(name, header, last)
    vertex = header.vertex
    numbers = np.empty(vertex.count, [(p.name, p.type) for p in vertex.properties if p.length_type is None])
    columns = {column: numbers[column] for column in field_types(numbers.dtype)}
    parse = _parse_list_columns if vertex.has_lists else _parse_columns
    parse(name, vertex, body, starts, columns, part_of(progress, 0.2, 1.0))
    return TextTable(name, header, body, columns, starts, numbers)


def _line_starts(
    name: str, header: PlyHeader, body: NDArray[np.uint8], first: int, progress: Progress
) -> tuple[NDArray[np.intp], bytes]:
    """Where the lines of the vertices begin and the last one ends, and the last line that the header promises.

    Only the vertices' lines are kept note of, so that neither long faces nor a tail of blank lines takes memory.
    """
    n_vertices = header.vertex.count
    n_lines = sum(element.count for element in header.elements)
    starts = np.empty(n_vertices + 1, np.intp)
    # Line i begins where line i - 1 ends; line 0 at the start.
    starts[0] = last_start = last_end = 0
    n_ends = 0
    for lo in range(0, len(body), _BLOCK_BYTES):
        progress(lo / len(body))
        ends = lo + np.flatnonzero(body[lo : lo + _BLOCK_BYTES] == (13 if header.newline == b"\r" else 10)) + 1
        if lo + _BLOCK_BYTES >= len(body) and (ends[-1] if len(ends) else last_end) != len(body):
            ends = np.append(ends, len(body))
        ends = ends[: n_lines - n_ends]
        if not len(ends):
            continue
        # End number n_ends + k is the start of that line + 1; those of vertices begin at line `first`.
        a, b = max(first - 1 - n_ends, 0), max(min(first + n_vertices - n_ends, len(ends)), 0)
        if a < b:
            at = n_ends + a + 1 - first
            starts[at : at + b - a] = ends[a:b]
        last_start, last_end = (int(ends[-2]) if len(ends) > 1 else last_end), int(ends[-1])
        n_ends += len(ends)
        if n_ends == n_lines:
            break
    if n_ends < n_lines:
        if header.newline != b"\r" and np.count_nonzero(body == 13) >= n_lines:
            raise PlyError(
                f"{name} ends its rows with CR alone and its header otherwise, which no program reads. Save it with "
                "one kind of line end."
            )
        raise PlyError(
            f"{name} is cut short: its header promises {n_lines:,} rows, {n_ends:,} are there. Copy or export it again."
        )
    if last_end - last_start > _BLOCK_BYTES:
        raise _damage(name, n_lines - 1, f"within {_BLOCK_BYTES:,} bytes")
    return starts, body[last_start:last_end].tobytes()


def _require_whole_last_line(name: str, header: PlyHeader, line: bytes) -> None:
    """Refuse a file that ends in the middle of a line; elements other than vertices are not looked at otherwise."""
    last = next(element for element in reversed(header.elements) if element.count)
    try:
        _last_words(last, line.split())
    except (ValueError, IndexError):
        raise _damage(name, last.count - 1, f"whole (element {last.name!r})") from None


def _parse_columns(
    name: str,
    vertex: PlyElement,
    body: NDArray[np.uint8],
    starts: NDArray[np.intp],
    columns: dict[str, NDArray],
    progress: Progress,
) -> None:
    """Parse the numbers of the vertex lines, in blocks so that memory stays bounded."""
    lo = 0
    while lo < vertex.count:
        progress(lo / vertex.count)
        hi = int(np.searchsorted(starts, starts[lo] + _BLOCK_BYTES, side="right")) - 1
        hi = min(max(hi, lo + 1), lo + _BLOCK_ROWS, vertex.count)
        if starts[hi] - starts[lo] > _BLOCK_BYTES:
            raise _damage(name, lo, f"within {_BLOCK_BYTES:,} bytes")
        text = body[starts[lo] : starts[hi]].tobytes()
        if b"\n" not in text:
            text = text.replace(b"\r", b"\n")
        numbers = None
        # Bytes that only some parsers take for blanks would split a line differently when it is written.
        if not text.translate(None, _NUMBER_BYTES):
            with contextlib.suppress(ValueError):
                numbers = np.loadtxt(BytesIO(text), dtype=np.float64, comments=None, ndmin=2)
        if numbers is None or numbers.shape != (hi - lo, len(columns)):
            raise _damage(name, _first_bad_line(text, lo, len(columns)), f"{len(columns)} numbers")
        for column, values in zip(columns.values(), numbers.T, strict=True):
            column[lo:hi] = cast_values(values, column.dtype)
        lo = hi


def _parse_list_columns(
    name: str,
    vertex: PlyElement,
    body: NDArray[np.uint8],
    starts: NDArray[np.intp],
    columns: dict[str, NDArray],
    progress: Progress,
) -> None:
    """Parse the scalar numbers of vertex lines that also hold lists, line by line."""
    for row in range(vertex.count):
        if row % 256 == 0:
            progress(row / vertex.count)
        if starts[row + 1] - starts[row] > _BLOCK_BYTES:
            raise _damage(name, row, f"within {_BLOCK_BYTES:,} bytes")
        words = body[starts[row] : starts[row + 1]].tobytes().split()
        try:
            place = _last_words(vertex, words)
            for column, values in columns.items():
                values[row] = cast_values(np.array(float(words[place[column]])), values.dtype)
        except (ValueError, IndexError):
            raise _damage(name, row, "the promised numbers and lists") from None


def _damage(name: str, row: FileRow, wanted: str) -> PlyError:
    """Exception for a line that holds something else than it should."""
    return PlyError(
        f"{name} is damaged or cut short: the line of row {row:,} is not {wanted}. Copy or export it again."
    )


def _first_bad_line(text: bytes, row: FileRow, n_columns: int) -> int:
    """Row whose line does not hold that many numbers."""
    for line in text.splitlines():
        words = line.split()
        try:
            if line.translate(None, _NUMBER_BYTES) or len([float(word) for word in words]) != n_columns:
                break
        except ValueError:
            break
        row += 1
    return row
