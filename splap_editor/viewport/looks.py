"""Display options by name, as the panel, session files and the command line say them."""

from collections.abc import Mapping
from dataclasses import replace

from splap_editor.viewport.splat_actor import DisplayMode, SplatLook
from splap_editor.viewport.splat_scene import DEFAULT_LOOKS
from splap_editor.viewport.viewport import BACKGROUND

MODES = {"ellipses": DisplayMode.ELLIPSES, "splats": DisplayMode.SPLATS, "points": DisplayMode.POINTS}
BACKGROUNDS = {
    "dark": BACKGROUND,
    "grey": ((0.27, 0.27, 0.28), (0.36, 0.36, 0.37)),
    "light": ((0.80, 0.81, 0.82), (0.93, 0.93, 0.94)),
    "black": ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
}
"""Bottom and top of the gradient behind the scene."""

_LARGEST = {"size_factor": 4.0, "opacity_cut": 1.0}


def look_named(display: Mapping[str, object]) -> SplatLook:
    """How splats are drawn by options as a session file holds them; what is missing or odd is as usual."""
    mode = display.get("mode")
    look = DEFAULT_LOOKS[MODES[mode] if isinstance(mode, str) and mode in MODES else DisplayMode.SPLATS]
    sound: dict[str, float] = {}
    for name, largest in _LARGEST.items():
        value = display.get(name)
        if isinstance(value, int | float) and not isinstance(value, bool) and 0.0 <= value <= largest:
            sound[name] = float(value)
    return replace(
        look,
        size_factor=sound.get("size_factor", look.size_factor),
        opacity_cut=sound.get("opacity_cut", look.opacity_cut),
    )


def background_named(display: Mapping[str, object]) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Background of such options."""
    name = display.get("background")
    return BACKGROUNDS[name] if isinstance(name, str) and name in BACKGROUNDS else BACKGROUND
