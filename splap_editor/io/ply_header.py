"""The header of a PLY file: what it says, kept as the bytes that say it."""

import re
from dataclasses import dataclass

import numpy as np

LONGEST_HEADER = 1 << 16
"""Bytes within which a header must end."""

MOST_ELEMENTS = 64
MOST_PROPERTIES = 4096
"""Of all elements together."""

_SCALAR_TYPES = {
    **{name: "i1" for name in ("char", "int8")},
    **{name: "u1" for name in ("uchar", "uint8")},
    **{name: "i2" for name in ("short", "int16")},
    **{name: "u2" for name in ("ushort", "uint16")},
    **{name: "i4" for name in ("int", "int32")},
    **{name: "u4" for name in ("uint", "uint32")},
    **{name: "f4" for name in ("float", "float32")},
    **{name: "f8" for name in ("double", "float64")},
}
_LENGTH_TYPES = ("i1", "u1", "i2", "u2", "i4", "u4")
_BYTE_ORDERS = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}


class PlyError(ValueError):
    """A PLY file that cannot be read or written; the message says why and what to do."""


@dataclass(frozen=True)
class PlyProperty:
    """One column of an element: its name, numpy type code (``"f4"``) and, for a list, the type of its length."""

    name: str
    type: str
    length_type: str | None = None


@dataclass(frozen=True)
class PlyElement:
    """One table of a PLY file: its name, its number of rows and its columns in file order."""

    name: str
    count: int
    properties: tuple[PlyProperty, ...]

    @property
    def has_lists(self) -> bool:
        """Whether rows differ in size."""
        return any(p.length_type for p in self.properties)

    @property
    def names(self) -> tuple[str, ...]:
        """Column names in file order."""
        return tuple(p.name for p in self.properties)

    def dtype(self, byte_order: str) -> np.dtype[np.void]:
        """Packed record of one row; elements with lists have none."""
        return np.dtype([(p.name, byte_order + p.type) for p in self.properties])

    def smallest_row(self, *, ascii_: bool) -> int:
        """Fewest bytes a row can take, lists empty."""
        if ascii_:
            return max(2 * len(self.properties), 1)
        return sum(np.dtype(p.length_type or p.type).itemsize for p in self.properties)


@dataclass(frozen=True)
class PlyHeader:
    """A parsed header.

    Parameters
    ----------
    raw : bytes
        The header as it stands in the file, ``end_header`` and its line end included.
    format : str
        ``"ascii"``, ``"binary_little_endian"`` or ``"binary_big_endian"``.
    elements : tuple of PlyElement
        In file order.
    comments : tuple of str
        Texts of the ``comment`` and ``obj_info`` lines.
    newline : bytes
        Line end of the first line.
    """

    raw: bytes
    format: str
    elements: tuple[PlyElement, ...]
    comments: tuple[str, ...]
    newline: bytes

    @property
    def is_ascii(self) -> bool:
        """Whether the rows are lines of text."""
        return self.format == "ascii"

    @property
    def byte_order(self) -> str:
        """Numpy byte-order character of the columns in memory."""
        return _BYTE_ORDERS[self.format]

    def element(self, name: str) -> PlyElement | None:
        """Return the element of that name, or None."""
        return next((e for e in self.elements if e.name == name), None)

    @property
    def vertex(self) -> PlyElement:
        """The element that holds the splats; a header without one has been refused."""
        vertex = self.element("vertex")
        assert vertex is not None
        return vertex

    def smallest_body(self) -> int:
        """Fewest bytes that must follow the header for it to be true."""
        return sum(e.count * e.smallest_row(ascii_=self.is_ascii) for e in self.elements)

    def with_columns(self, columns: list[tuple[str, str]], n_rows: int) -> bytes:
        """Raw header with float properties added to the vertex element, and its number of rows.

        Parameters
        ----------
        columns : list of (after, name)
            Each new column and the existing column it follows.
        n_rows : int
            Rows of the vertex element.
        """
        lines = self.raw.splitlines(keepends=True)
        inside = False
        out = []
        for line in lines:
            words = _words(line)
            if words[:2] == [b"element", b"vertex"] and int(words[2]) != n_rows:
                at = line.rindex(words[2])
                line = line[:at] + str(n_rows).encode() + line[at + len(words[2]) :]
            out.append(line)
            if words[:1] == [b"element"]:
                inside = words[1] == b"vertex"
            elif inside and words[:1] == [b"property"]:
                float_word = words[-2] if words[-2] in (b"float", b"float32") else b"float"
                for after, name in columns:
                    if words[-1] == after.encode():
                        out.append(b"property " + float_word + b" " + name.encode() + self.newline)
        return b"".join(out)


def ply_header(start: bytes, name: str) -> PlyHeader:
    """Parse the header at the beginning of a file.

    Parameters
    ----------
    start : bytes
        The first `LONGEST_HEADER` bytes of the file, or all of it.
    name : str
        What to call the file in messages.

    Raises
    ------
    PlyError
        If these bytes do not begin with a complete and meaningful PLY header.
    """
    first = re.match(rb"ply[ \t]*(\r\n|\n|\r)", start)
    if first is None:
        raise PlyError(f"{name} is not a PLY file: it does not begin with 'ply'. Choose a .ply that a trainer wrote.")
    newline = first[1]
    line_end = rb"\r" if newline == b"\r" else rb"\r?\n"
    end = re.search(rb"(?:\n|\r)end_header[ \t]*(?:" + line_end + rb")", start)
    if end is None:
        cut = "the file is cut short or damaged" if len(start) < LONGEST_HEADER else "no longer header is read"
        raise PlyError(f"{name} has no 'end_header' line within {LONGEST_HEADER:,} bytes: {cut}. Export it again.")
    raw = start[: end.end()]
    format_ = None
    comments: list[str] = []
    elements: list[tuple[str, int, list[PlyProperty]]] = []
    for line in raw.splitlines()[1:-1]:
        keyword, *words = (word.decode("ascii", "replace") for word in _words(line) or [b""])
        if keyword in ("comment", "obj_info"):
            comments.append(line.decode("utf-8", "replace").strip()[len(keyword) :].strip())
            continue
        # Other bytes are blanks to some readers and parts of a name to others.
        if line.translate(None, _PLAIN):
            raise PlyError(f"{name} has a header line that is not plain ASCII: {_shown(line)}. Export the file again.")
        if keyword == "format" and words and words[0] in _BYTE_ORDERS:
            format_ = words[0]
        elif keyword == "element" and len(words) == 2 and words[1].isdecimal() and len(words[1]) < 16:
            elements.append((words[0], int(words[1]), []))
        elif keyword == "property" and elements:
            elements[-1][2].append(_property(words, line, name))
        elif keyword:
            raise PlyError(f"{name} has a header line that means nothing: {_shown(line)}. Export the file again.")
    if format_ is None:
        raise PlyError(f"{name} does not say its format (ascii or binary). Export the file again.")
    parsed = tuple(PlyElement(n, count, tuple(properties)) for n, count, properties in elements)
    _require_sound_elements(parsed, name)
    return PlyHeader(raw, format_, parsed, tuple(comments), newline)


_PLAIN = bytes([9, *range(32, 127)])


def _words(line: bytes) -> list[bytes]:
    """Words of a header line: what spaces and tabs part, and line ends."""
    return re.findall(rb"[^ \t\r\n]+", line)


def _shown(line: bytes) -> str:
    """A header line for a message, cut to a glance."""
    text = repr(line.decode("utf-8", "replace").strip())
    return text if len(text) <= 80 else text[:77] + "..."


def _property(words: list[str], line: bytes, name: str) -> PlyProperty:
    """Parse the words after ``property``."""
    if len(words) == 2 and words[0] in _SCALAR_TYPES:
        return PlyProperty(words[1], _SCALAR_TYPES[words[0]])
    if len(words) == 4 and words[0] == "list" and words[2] in _SCALAR_TYPES:
        length_type = _SCALAR_TYPES.get(words[1], "")
        if length_type in _LENGTH_TYPES:
            return PlyProperty(words[3], _SCALAR_TYPES[words[2]], length_type)
    raise PlyError(f"{name} has a property of unknown type: {_shown(line)}. Export it with float properties.")


def _require_sound_elements(elements: tuple[PlyElement, ...], name: str) -> None:
    """Refuse too many elements or columns, two of the same name, and rows without a column."""
    n_properties = sum(len(element.properties) for element in elements)
    for what, count, most in (("elements", len(elements), MOST_ELEMENTS), ("columns", n_properties, MOST_PROPERTIES)):
        if count > most:
            raise PlyError(f"{name} has {count:,} {what}; {most:,} are the most that are read. Export it with fewer.")
    for what, names in [("elements", [e.name for e in elements])] + [("columns", list(e.names)) for e in elements]:
        seen: set[str] = set()
        for each in names:
            if each in seen:
                raise PlyError(f"{name} has two {what} named {each!r}. Export the file again.")
            seen.add(each)
    for element in elements:
        if element.count and not element.properties:
            raise PlyError(
                f"{name} promises {element.count:,} rows of an element {element.name!r} without a column. "
                "Export the file again."
            )
