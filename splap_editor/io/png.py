"""PNG files of 8-bit pictures."""

import os

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from splap_editor.io.atomic_file import whole_file


class PictureError(ValueError):
    """A picture that cannot be written; the message is one sentence that says what to do."""


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
    PictureError
        If the file cannot be written.
    """
    pixels = np.asarray(pixels)
    if pixels.ndim != 3 or pixels.dtype != np.uint8 or pixels.shape[2] not in (1, 3, 4) or not pixels.size:
        raise ValueError(f"pixels must be (H, W, 1, 3 or 4) uint8, got {pixels.shape} {pixels.dtype}")
    with whole_file(path, PictureError) as file:
        Image.fromarray(pixels[:, :, 0] if pixels.shape[2] == 1 else pixels).save(file, "PNG")
