"""A ``.usdz``: a zip that stores a layer as it is, its bytes at a multiple of 64, so that they can be mapped."""

import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

from splap_editor.core.progress import Progress, part_of
from splap_editor.io.formats.source import FormatError

_ALIGNMENT = 64
LARGEST_LAYER = (1 << 32) - (1 << 16)
"""Of a package without zip's longer numbers, which USD does not read."""

_HEADER, _CENTRAL, _END = "<IHHHHHIIIHH", "<IHHHHHHIIIHHHHHII", "<IHHHHIIH"
_VERSION, _NO_FLAGS, _STORED, _NO_TIME = 10, 0, 0, 0
_DATE = 33
"""The first of January 1980: the same splats give the same bytes."""

_PADDING = 0x1986
"""Kind of an extra field that pads, as USD writes it."""


def write_package(out: BinaryIO, layer: Path, progress: Progress) -> None:
    """Write the package of one layer.

    Parameters
    ----------
    out : BinaryIO
        At its start.
    layer : Path
        A ``.usdc``.
    progress : Progress
        Told for each MiB, of two passes: a zip names the checksum of what follows before it.

    Raises
    ------
    FormatError
        The layer is larger than a package may be.
    """
    n_bytes = layer.stat().st_size
    if n_bytes > LARGEST_LAYER:
        raise FormatError(
            f"a .usdz holds at most 4 GiB and these splats take {n_bytes / 2**30:.1f}: save fewer frames or a .usdc."
        )
    checksum = 0

    def take(chunk: bytes) -> None:
        nonlocal checksum
        checksum = zlib.crc32(chunk, checksum)

    name = layer.name.encode()
    before = struct.calcsize(_HEADER) + len(name) + 4
    padding = struct.pack("<HH", _PADDING, -before % _ALIGNMENT) + bytes(-before % _ALIGNMENT)
    with layer.open("rb") as file:
        copy_bytes(file, take, n_bytes, part_of(progress, 0.0, 0.4))
        file.seek(0)
        facts = (_VERSION, _NO_FLAGS, _STORED, _NO_TIME, _DATE, checksum, n_bytes, n_bytes, len(name))
        out.write(struct.pack(_HEADER, 0x04034B50, *facts, len(padding)) + name + padding)
        copy_bytes(file, out.write, n_bytes, part_of(progress, 0.4, 1.0))
    central = struct.pack(_CENTRAL, 0x02014B50, _VERSION, *facts, 0, 0, 0, 0, 0, 0) + name
    at = before + -before % _ALIGNMENT + n_bytes
    out.write(central + struct.pack(_END, 0x06054B50, 0, 0, 1, 1, len(central), at, 0))


def copy_bytes(file: BinaryIO, take: Callable[[bytes], object], n_bytes: int, progress: Progress) -> None:
    """Hand on the rest of a file of so many bytes, a MiB at a time."""
    done = 0
    while chunk := file.read(1 << 20):
        take(chunk)
        done += len(chunk)
        progress(min(done / max(n_bytes, 1), 1.0))
