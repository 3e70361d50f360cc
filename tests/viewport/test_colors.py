"""Handle, pin, selection and hover are told apart by everyone; what is fixed is seen on any object."""

from itertools import combinations

import numpy as np
import pytest

from splap_editor.engine.edit import HANDLE_COLORS, PIN_COLOR
from splap_editor.viewport.splat_actor import SplatLook
from splap_editor.viewport.tints import FIXED_TINTS, HANDLE_SHARE, PIN_SHARE, fixed_tint, rgb

# Machado, Oliveira and Fernandes, "A Physiologically-based Model for Simulation of Color Vision Deficiency",
# TVCG 2009, severity 1; on linear RGB.
SEEN_BY = {
    "all three cones": np.eye(3),
    "protanopia": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    "deuteranopia": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
    "tritanopia": np.array(
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]]
    ),
}
XYZ_OF_RGB = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.119192, 0.9503041]]
)
WHITE = XYZ_OF_RGB @ np.ones(3)
GROUNDS = {
    "black leather": (0.05, 0.045, 0.04),
    "wood": (0.45, 0.3, 0.18),
    "grey": (0.5, 0.5, 0.5),
    "paper": (0.95, 0.94, 0.9),
}


def cielab(color, matrix):
    color = np.asarray(color, np.float64)
    linear = np.where(color <= 0.04045, color / 12.92, ((color + 0.055) / 1.055) ** 2.4)
    ratio = XYZ_OF_RGB @ np.clip(matrix @ linear, 0.0, 1.0) / WHITE
    f = np.where(ratio > 216 / 24389, np.cbrt(ratio), (24389 / 27 * ratio + 16) / 116)
    return np.array((116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])))


def difference(a, b, matrix):
    return float(np.linalg.norm(cielab(a, matrix) - cielab(b, matrix)))


def laid_over(ground, tint):
    *color, share = tint
    return (1.0 - share) * np.asarray(ground) + share * np.array(color)


def unit(color, share):
    return (*(np.array(rgb(color)) / 255.0), share / 255.0)


MARKS = {
    "selection": [SplatLook().select_tint],
    "hover": [SplatLook().hover_tint],
    "handle": [unit(color, HANDLE_SHARE) for color in HANDLE_COLORS],
    "pin": [unit(PIN_COLOR, PIN_SHARE)],
}


@pytest.mark.parametrize("eyes", SEEN_BY)
def test_selection_handle_hover_and_pin_are_four_colours_to_everyone(eyes):
    for one, other in combinations(MARKS, 2):
        for a in MARKS[one]:
            for b in MARKS[other]:
                # Twice what is easily told apart side by side.
                assert difference(a[:3], b[:3], SEEN_BY[eyes]) > 20.0, (one, other, a, b)


@pytest.mark.parametrize("eyes", SEEN_BY)
@pytest.mark.parametrize("ground", GROUNDS)
def test_they_are_told_apart_where_they_are_laid_over_an_object(eyes, ground):
    for one, other in combinations(MARKS, 2):
        for a in MARKS[one]:
            for b in MARKS[other]:
                seen = [laid_over(GROUNDS[ground], tint) for tint in (a, b)]
                assert difference(*seen, SEEN_BY[eyes]) > 10.0, (one, other, a, b)


@pytest.mark.parametrize("ground", GROUNDS)
def test_what_is_fixed_is_seen_on_any_object(ground):
    color = np.array(GROUNDS[ground])
    colors = np.tile(np.array((*np.rint(255.0 * color), 255), np.uint8), (100, 1))
    tint = np.array(fixed_tint("auto", colors)) / 255.0
    for matrix in SEEN_BY.values():
        assert difference(color, laid_over(color, tint), matrix) > 15.0


def test_the_tint_of_what_is_fixed_is_a_choice():
    colors = np.full((10, 4), 255, np.uint8)
    assert {fixed_tint(name, colors) for name in FIXED_TINTS if name != "auto"} == {
        tint for tint in FIXED_TINTS.values() if tint is not None
    }
    # Faint splats, as in a haze, do not count.
    haze = np.vstack([np.full((100, 4), (255, 255, 255, 20), np.uint8), np.full((10, 4), (5, 5, 5, 255), np.uint8)])
    assert fixed_tint("auto", haze) == FIXED_TINTS["lighter"]
