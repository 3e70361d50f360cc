"""PNG files of 8-bit pictures."""

import os
import struct
import zlib

import numpy as np
from numpy.typing import NDArray

from splap_editor.io.atomic_file import atomic_file

_UP = 2
_COLOR_TYPES = {1: 0, 3: 2, 4: 6}


def write_png(path: str | os.PathLike[str], pixels: NDArray[np.uint8]) -> None:
    """Write a picture, whole or not at all.

    Parameters
    ----------
    path : path
    pixels : (H, W, C) uint8
        Top row first; grey, RGB or RGBA with colours that are not premultiplied.

    Raises
    ------
    ValueError
        If ``pixels`` is no such array.
    OSError
        If the file cannot be written.
    """
    pixels = np.asarray(pixels)
    if pixels.ndim != 3 or pixels.dtype != np.uint8 or pixels.shape[2] not in _COLOR_TYPES or not pixels.size:
        raise ValueError(f"pixels must be (H, W, 1, 3 or 4) uint8, got {pixels.shape} {pixels.dtype}")
    height, width, n_channels = pixels.shape
    # Each row as its difference to the one above, which in pictures is mostly small.
    lines = np.empty((height, 1 + width * n_channels), np.uint8)
    lines[:, 0] = _UP
    lines[:, 1:] = pixels.reshape(height, -1)
    lines[1:, 1:] -= pixels.reshape(height, -1)[:-1]
    header = struct.pack(">IIBBBBB", width, height, 8, _COLOR_TYPES[n_channels], 0, 0, 0)
    with atomic_file(path) as file:
        file.write(b"\x89PNG\r\n\x1a\n")
        for kind, data in ((b"IHDR", header), (b"IDAT", zlib.compress(lines, 6)), (b"IEND", b"")):
            file.write(struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)))
