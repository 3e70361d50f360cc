"""Colour maps keep order, ends and what is undefined."""

import numpy as np
import pytest

from splap_editor.viewport.colormaps import (
    COLORMAPS,
    LABEL_COLORS,
    TWO_SIDED,
    UNDEFINED,
    label_colors,
    mapped_colors,
    shares,
)


def lightness(rgb: np.ndarray) -> np.ndarray:
    """CIE L* of (K, 3) sRGB bytes."""
    linear = np.where(rgb / 255.0 <= 0.04045, rgb / 255.0 / 12.92, ((rgb / 255.0 + 0.055) / 1.055) ** 2.4)
    y = linear @ [0.2126, 0.7152, 0.0722]
    return np.where(y > 0.008856, 116.0 * np.cbrt(y) - 16.0, 903.3 * y)


@pytest.mark.parametrize("name", [name for name in COLORMAPS if name != TWO_SIDED])
def test_maps_brighten_steadily_so_that_order_shows_without_hue(name):
    # Table steps are bytes, so neighbours may be equally light to within a byte.
    assert (np.diff(lightness(COLORMAPS[name].astype(float))) > -0.3).all()
    assert np.ptp(lightness(COLORMAPS[name].astype(float))) > 60.0


def test_the_two_sided_map_is_lightest_in_the_middle():
    light = lightness(COLORMAPS[TWO_SIDED].astype(float))
    assert 112 <= np.argmax(light) <= 144


def test_shares_run_from_0_to_1_and_clip():
    np.testing.assert_allclose(shares(np.array([0.0, 1.0, 2.0, 3.0, 9.0]), 1.0, 3.0), [0, 0, 0.5, 1, 1])
    np.testing.assert_allclose(
        shares(np.array([-1.0, 0.0, 1.0, 10.0, 100.0]), 1.0, 100.0, is_log=True), [0, 0, 0, 0.5, 1]
    )


def test_an_empty_range_has_two_sides():
    np.testing.assert_array_equal(shares(np.array([0.0, 1.0, 2.0]), 1.0, 1.0), [0, 1, 1])


def test_what_is_undefined_is_grey():
    places = shares(np.array([np.nan, 0.0]), 0.0, 1.0)
    assert tuple(mapped_colors(places, "viridis")[0]) == UNDEFINED
    assert tuple(shares(np.array([np.nan, 1.0]), 1.0, 10.0, is_log=True)[1:]) == (0.0,)
    assert tuple(label_colors(np.array([np.nan, 9.0]))[0]) == UNDEFINED
    assert tuple(label_colors(np.array([np.nan, 9.0]))[1]) == tuple(LABEL_COLORS[1])
