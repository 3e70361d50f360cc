"""PNG files as other programs read them."""

import numpy as np
import pytest
from PySide6.QtGui import QImage

from splap_editor.io.png import write_png

FORMATS = {1: QImage.Format.Format_Grayscale8, 3: QImage.Format.Format_RGB888, 4: QImage.Format.Format_RGBA8888}


@pytest.mark.parametrize("n_channels", [1, 3, 4])
@pytest.mark.parametrize("size", [(1, 1), (7, 5), (64, 129)])
def test_pixels_come_back(tmp_path, n_channels, size):
    pixels = np.random.default_rng(1).integers(0, 256, (*size, n_channels), np.uint8)
    write_png(tmp_path / "a.png", pixels)
    image = QImage(str(tmp_path / "a.png")).convertToFormat(FORMATS[n_channels])
    lines = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), image.bytesPerLine())
    np.testing.assert_array_equal(lines[:, : size[1] * n_channels].reshape(pixels.shape), pixels)


@pytest.mark.parametrize("pixels", [np.zeros((3, 3), np.uint8), np.zeros((3, 3, 4)), np.zeros((0, 3, 4), np.uint8)])
def test_what_is_no_picture_is_refused(tmp_path, pixels):
    with pytest.raises(ValueError, match="pixels must be"):
        write_png(tmp_path / "a.png", pixels)
