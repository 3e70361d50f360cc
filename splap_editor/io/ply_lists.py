"""Binary PLY files with list properties: read by plyfile, row by row."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from io import BytesIO

import numpy as np
from numpy.typing import NDArray

from splap_editor.io.ply_header import PlyError, PlyHeader
from splap_editor.io.ply_table import CellChanges, NewColumn, PlyTable, cast_values, field_types


@dataclass(frozen=True, eq=False)
class ListTable(PlyTable):
    """A binary PLY file with lists somewhere: its rows differ in size.

    Parameters
    ----------
    elements : dict of structured arrays
        Every element by name; list cells are arrays.
    tail : bytes
        What follows the last element, kept.
    """

    elements: dict[str, NDArray] = field(default_factory=dict)
    tail: bytes = b""

    def element(self, name: str) -> NDArray | None:
        """Return the rows of an element, None if there is none of that name."""
        return self.elements.get(name)

    def blocks(
        self, changes: Callable[[int, int], CellChanges], new_columns: list[NewColumn]
    ) -> Iterator[NDArray[np.uint8] | bytes]:
        """Yield the body with some cells replaced, in one piece."""
        changed = changes(0, self.n_rows)
        if not changed and not new_columns:
            yield self.body
            return
        rows = self.elements["vertex"].copy()
        for name, (where, values) in changed.items():
            rows[name][where] = cast_values(values, rows.dtype[name])
        yield _body(self.header, {**self.elements, "vertex": _with_columns(rows, new_columns)})
        yield self.tail


def list_table(name: str, header: PlyHeader, body: NDArray[np.uint8]) -> ListTable:
    """Parse a file whose rows differ in size.

    Raises
    ------
    PlyError
        If the rows end early or do not parse.
    """
    import plyfile

    plain = _plain_header(header)
    stream = BytesIO(plain + body.tobytes())
    try:
        ply = plyfile.PlyData.read(stream)
    except (plyfile.PlyParseError, ValueError, EOFError, OverflowError) as error:
        raise PlyError(f"{name} is damaged or cut short ({error}). Copy or export it again.") from error
    elements = {element.name: element.data for element in ply.elements}
    scalar = [p.name for p in header.vertex.properties if p.length_type is None]
    columns = {column: elements["vertex"][column] for column in scalar}
    tail = body[stream.tell() - len(plain) :].tobytes()
    return ListTable(name, header, body, columns, elements, tail)


def _plain_header(header: PlyHeader) -> bytes:
    """Header without comments and with plain line ends, which every reader takes."""
    lines = [line.strip() for line in header.raw.splitlines()]
    return b"\n".join(line for line in lines if line.split()[:1] not in ([b"comment"], [b"obj_info"], [])) + b"\n"


def _with_columns(rows: NDArray, new_columns: list[NewColumn]) -> NDArray:
    """Rows with float columns added after existing ones."""
    fields = []
    for name, dtype in field_types(rows.dtype).items():
        fields.append((name, dtype))
        fields += [(c.name, np.dtype("f4")) for c in new_columns if c.after == name]
    wide = np.empty(len(rows), fields)
    for name in field_types(rows.dtype):
        wide[name] = rows[name]
    for column in new_columns:
        wide[column.name] = column.values
    return wide


def _body(header: PlyHeader, elements: dict[str, NDArray]) -> bytes:
    """Bytes of the elements in the header's byte order, with its list types.

    plyfile writes scalars beside lists in the machine's byte order whatever
    the header says, so this does not go through it.
    """
    order = header.byte_order
    parts = []
    for element in header.elements:
        rows = elements[element.name]
        if not element.has_lists:
            fields = [(name, order + dtype.str[1:]) for name, dtype in field_types(rows.dtype).items()]
            parts.append(rows.astype(fields).tobytes())
            continue
        types = {p.name: (np.dtype(order + p.type), p.length_type) for p in element.properties}
        float_type = (np.dtype(order + "f4"), None)
        for row in rows:
            for name in field_types(rows.dtype):
                # Columns that the header does not have are added ones.
                dtype, length_type = types.get(name, float_type)
                if length_type is not None:
                    parts.append(np.array(len(row[name]), order + length_type).tobytes())
                parts.append(np.asarray(row[name], dtype).tobytes())
    return b"".join(parts)
