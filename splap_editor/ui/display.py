"""How the scene is shown: one value that panel, menu and keys change and the viewport follows."""

from collections.abc import Container, Mapping
from dataclasses import dataclass, replace
from typing import Any

from PySide6.QtCore import QSettings

from splap_editor.session.signals import Signal
from splap_editor.viewport.looks import BACKGROUNDS, MODES
from splap_editor.viewport.scene_view import SceneView
from splap_editor.viewport.splat_scene import DEFAULT_LOOKS, Compare
from splap_editor.viewport.tints import FIXED_TINTS


@dataclass(frozen=True)
class DisplayOptions:
    """What the Display panel holds.

    Parameters
    ----------
    mode : str
        Key of `MODES`.
    shown : str
        ``"deformed"``, ``"original"`` or ``"both"``.
    size_factor, opacity_cut : float
        Of the mode shown: 1 draws splats at their true size; fainter splats are not drawn.
    backface : float
        Share of the tint on ellipses seen from behind.
    background : str
        Key of `BACKGROUNDS`.
    tints : bool
        Handles and pins in their colours, and what cannot move tinted.
    fixed : str
        How what cannot move is tinted: key of `FIXED_TINTS`.
    weights : bool
        The chosen handle's bounded biharmonic weights in bands of colour instead.
    """

    mode: str = "splats"
    shown: str = "deformed"
    size_factor: float = 1.0
    opacity_cut: float = 0.0
    backface: float = 0.0
    background: str = "dark"
    tints: bool = True
    fixed: str = "auto"
    weights: bool = False


LARGEST = 4.0
"""Bound of every number among the options."""

KEPT = ("mode", "backface", "background", "tints", "fixed")
"""Options remembered between runs."""


class Display:
    """The options in force; each mode keeps its own size and opacity cut."""

    def __init__(self) -> None:
        self.changed = Signal()
        settings, default = QSettings(), DisplayOptions()
        kept: dict[str, Any] = {}
        for name in KEPT:
            held = getattr(default, name)
            kept[name] = settings.value(f"display/{name}", held, type=type(held))
        if kept["mode"] not in MODES:
            kept["mode"] = default.mode
        if kept["background"] not in BACKGROUNDS:
            kept["background"] = default.background
        if kept["fixed"] not in FIXED_TINTS:
            kept["fixed"] = default.fixed
        self._sizes = {name: (DEFAULT_LOOKS[m].size_factor, DEFAULT_LOOKS[m].opacity_cut) for name, m in MODES.items()}
        size_factor, opacity_cut = self._sizes[kept["mode"]]
        self.options = replace(default, size_factor=size_factor, opacity_cut=opacity_cut, **kept)
        self._held: str | None = None

    def set(self, **values: Any) -> None:
        """Change some options; a change of mode brings that mode's size and cut."""
        before = self.options
        if values.get("mode", before.mode) != before.mode:
            self._sizes[before.mode] = (before.size_factor, before.opacity_cut)
            values["size_factor"], values["opacity_cut"] = self._sizes[values["mode"]]
        options = replace(before, **values)
        if options != before:
            self.options = options
            self.changed.emit()

    def restore(self, held: Mapping[str, Any]) -> None:
        """Take options from a session file; what is unknown, of another kind or out of bounds is left as it is."""
        shown = [compare.value for compare in Compare]
        choices: dict[str, Container[str]] = {
            "mode": MODES,
            "background": BACKGROUNDS,
            "fixed": FIXED_TINTS,
            "shown": shown,
        }
        values = {}
        for name, usual in vars(DisplayOptions()).items():
            value = held.get(name)
            if name in choices:
                fits = isinstance(value, str) and value in choices[name]
            elif isinstance(usual, bool):
                fits = isinstance(value, bool)
            else:
                fits = isinstance(value, int | float) and not isinstance(value, bool) and 0.0 <= value <= LARGEST
            if fits:
                values[name] = value
        # The mode first, since it brings its own size and cut.
        self.set(mode=values.pop("mode", self.options.mode))
        self.set(**values)

    def hold_original(self, is_held: bool) -> None:
        """Show the original while a key is held, and what was shown before when it is let go."""
        if is_held and self._held is None:
            self._held = self.options.shown
            self.set(shown="original")
        elif not is_held and self._held is not None:
            shown, self._held = self._held, None
            self.set(shown=shown)

    def apply(self, view: SceneView) -> None:
        """Make a view look like this."""
        options = self.options
        mode = MODES[options.mode]
        look = DEFAULT_LOOKS[mode]
        view.viewport.splats.look = replace(
            look,
            size_factor=options.size_factor,
            opacity_cut=options.opacity_cut,
            backface_tint=(*look.backface_tint[:3], options.backface),
        )
        view.viewport.splats.compare = Compare(options.shown)
        view.viewport.set_background(*BACKGROUNDS[options.background])
        if view.shows_tints != options.tints:
            view.shows_tints = options.tints
        if view.fixed_tint != options.fixed:
            view.fixed_tint = options.fixed
        if view.weights.is_on != options.weights:
            view.weights.is_on = options.weights

    def save(self) -> None:
        """Remember the options for the next run."""
        settings = QSettings()
        for name in KEPT:
            settings.setValue(f"display/{name}", getattr(self.options, name))
