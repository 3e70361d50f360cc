"""The ways in which a PLY file may hold its rows, each with what reads it and writes it back."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.progress import Progress
from splap_editor.io.ply_header import PlyHeader
from splap_editor.io.ply_lists import list_table
from splap_editor.io.ply_table import PlyTable, binary_table
from splap_editor.io.ply_text import text_table


@dataclass(frozen=True)
class PlyCodec:
    """One encoding of rows.

    Parameters
    ----------
    name : str
        What people call it.
    suits : callable (header) → bool
        Whether a file with this header holds its rows so; the first codec that suits is taken.
    table : callable (name, header, body, progress) → PlyTable
        Parses the bytes after the header, told the share done. The table's ``blocks`` write them back.
    has_row_views : bool
        Whether rows can be looked at in the bytes themselves, before the file is complete.
    parsed_bytes : callable (header) → int
        Memory that the table takes beside the bytes, at most.
    """

    name: str
    suits: Callable[[PlyHeader], bool]
    table: Callable[[str, PlyHeader, NDArray[np.uint8], Progress], PlyTable]
    has_row_views: bool = False
    parsed_bytes: Callable[[PlyHeader], int] = lambda header: 0


CODECS = (
    PlyCodec(
        "ascii",
        lambda header: header.is_ascii,
        text_table,
        parsed_bytes=lambda header: sum(8 * e.count * len(e.properties) for e in header.elements),
    ),
    PlyCodec("binary with lists", lambda header: any(e.has_lists for e in header.elements), list_table),
    PlyCodec("binary", lambda header: True, binary_table, has_row_views=True),
)


def codec_of(header: PlyHeader) -> PlyCodec:
    """Return the codec of a file's rows."""
    return next(codec for codec in CODECS if codec.suits(header))
