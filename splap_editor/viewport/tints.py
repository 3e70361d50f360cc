"""Colours laid over the splats: what handles and pins hold, and what cannot move."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.handle_nodes import region_nodes
from splap_editor.core.index_spaces import FileRows
from splap_editor.engine.bound_edit import BoundEdit
from splap_editor.engine.edit import PIN_COLOR, Pin
from splap_editor.session.scene import Scene

Rgba = tuple[int, int, int, int]

HANDLE_SHARE = 165
PIN_SHARE = 150
WIDE_PIN_SHARE = 60
"""Of a pin that is no disc but, as likely as not, most of the object: its own colours are to be seen."""

FIXED_TINTS: Mapping[str, Rgba | None] = {
    "auto": None,
    "darker": (46, 49, 58, 150),
    "lighter": (168, 178, 200, 130),
    "blue": (52, 84, 190, 140),
    "none": (0, 0, 0, 0),
}
"""Colour and its share over what cannot move, by name; ``auto`` takes the one that a scene shows best."""

_DARK = 70.0
"""Mean of the three channels below which half of a scene is too dark to be darkened: the tint itself has 51."""


def fixed_tint(name: str, colors: NDArray[np.uint8]) -> Rgba:
    """Colour of what cannot move, over splats of these colours (N, 4)."""
    known = {named: tint for named, tint in FIXED_TINTS.items() if tint is not None}
    if name in known:
        return known[name]
    seen = colors[colors[:, 3] > 100, :3]
    is_dark = len(seen) > 0 and float(np.median(seen.mean(axis=1))) < _DARK
    return known["lighter" if is_dark else "darker"]


def pin_rows(scene: Scene, pin: Pin) -> FileRows:
    """File rows of the active splats that a pin names."""
    return scene.ellipses.rows[region_nodes(pin.region, scene.ellipses)]


def edit_tints(scene: Scene, bound: BoundEdit | None, fixed: Rgba) -> NDArray[np.uint8]:
    """Colours (N, 4) uint8 over the splats, the fourth their share.

    Parameters
    ----------
    scene : Scene
    bound : BoundEdit, optional
        What handles hold and what cannot move; None while that is not known.
    fixed : (r, g, b, share)
        For what cannot move.
    """
    tints = np.zeros((scene.splats.n_splats, 4), np.uint8)
    if bound is not None:
        rows, labels = scene.ellipses.rows[bound.handles.indices], bound.handles.labels
        tints[rows[labels < 0]] = fixed
    for pin in scene.edit.pins:
        share = WIDE_PIN_SHARE if pin.reach is None else PIN_SHARE
        tints[pin_rows(scene, pin)] = (*rgb(PIN_COLOR), share)
    if bound is not None:
        palette = np.array([(*rgb(handle.color), HANDLE_SHARE) for handle in scene.edit.active_handles], np.uint8)
        tints[rows[labels >= 0]] = palette[labels[labels >= 0]]
    return tints


def rgb(color: str) -> tuple[int, int, int]:
    """Channels 0..255 of ``#rrggbb``."""
    return int(color[1:3], 16), int(color[3:5], 16), int(color[5:7], 16)
