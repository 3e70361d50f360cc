"""How the scene is shown: one value that panel, menu and keys change and the viewport follows."""

from dataclasses import dataclass, fields, replace
from typing import Any

from PySide6.QtCore import QSettings

from splap_editor.session.signals import Signal


@dataclass(frozen=True)
class DisplayOptions:
    """What the Display panel holds.

    Parameters
    ----------
    mode : str
        ``"ellipses"``, ``"splats"`` or ``"points"``.
    shown : str
        ``"deformed"``, ``"original"`` or ``"both"``.
    size_factor : float
        1 draws splats at their true size.
    opacity_cut : float
        Fainter splats are not drawn.
    backface : float
        Share of the tint on ellipses seen from behind.
    background : str
        ``"dark"``, ``"grey"``, ``"light"`` or ``"black"``.
    """

    mode: str = "ellipses"
    shown: str = "deformed"
    size_factor: float = 1.0
    opacity_cut: float = 0.0
    backface: float = 0.0
    background: str = "dark"


BACKGROUNDS = {
    "dark": (0.118, 0.122, 0.133),
    "grey": (0.32, 0.33, 0.34),
    "light": (0.86, 0.87, 0.88),
    "black": (0.0, 0.0, 0.0),
}
"""Display colours as sRGB shares."""


class Display:
    """The options in force, remembered between runs (all but what is shown)."""

    def __init__(self) -> None:
        self.changed = Signal()
        settings = QSettings()
        default = DisplayOptions()
        kept = {}
        for field in fields(DisplayOptions):
            held = getattr(default, field.name)
            if field.name != "shown":
                kept[field.name] = settings.value(f"display/{field.name}", held, type=type(held))
        self.options = replace(default, **kept)
        self._held: str | None = None

    def set(self, **values: Any) -> None:
        """Change some options."""
        self.set_options(replace(self.options, **values))

    def set_options(self, options: DisplayOptions) -> None:
        """Replace all options."""
        if options != self.options:
            self.options = options
            self.changed.emit()

    def hold_original(self, is_held: bool) -> None:
        """Show the original while a key is held, and what was shown before when it is let go."""
        if is_held and self._held is None:
            self._held = self.options.shown
            self.set(shown="original")
        elif not is_held and self._held is not None:
            shown, self._held = self._held, None
            self.set(shown=shown)

    def save(self) -> None:
        """Remember the options for the next run."""
        settings = QSettings()
        for field in fields(DisplayOptions):
            if field.name != "shown":
                settings.setValue(f"display/{field.name}", getattr(self.options, field.name))
