"""PNG files as other programs read them."""

import numpy as np
import pytest
from PIL import Image

from splap_editor.io.png import PictureError, write_png

MODES = {1: "L", 3: "RGB", 4: "RGBA"}


@pytest.mark.parametrize("n_channels", [1, 3, 4])
@pytest.mark.parametrize("size", [(1, 1), (7, 5), (64, 129)])
def test_pixels_come_back(tmp_path, n_channels, size):
    pixels = np.random.default_rng(1).integers(0, 256, (*size, n_channels), np.uint8)
    write_png(tmp_path / "a.png", pixels)
    with Image.open(tmp_path / "a.png") as image:
        assert (image.format, image.mode) == ("PNG", MODES[n_channels])
        np.testing.assert_array_equal(np.asarray(image).reshape(pixels.shape), pixels)


@pytest.mark.parametrize("pixels", [np.zeros((3, 3), np.uint8), np.zeros((3, 3, 4)), np.zeros((0, 3, 4), np.uint8)])
def test_what_is_no_picture_is_refused(tmp_path, pixels):
    with pytest.raises(ValueError, match="pixels must be"):
        write_png(tmp_path / "a.png", pixels)


def test_a_picture_that_cannot_be_written_is_refused_in_a_sentence(tmp_path):
    with pytest.raises(PictureError, match=r"\.png cannot be written: File name too long. Choose a shorter name"):
        write_png(tmp_path / f"{'a' * 300}.png", np.zeros((2, 2, 3), np.uint8))
    assert list(tmp_path.iterdir()) == []
