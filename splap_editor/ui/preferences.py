"""What a person likes: kept between runs, in force at once."""

from dataclasses import dataclass, fields, replace
from typing import Any

from PySide6.QtCore import QSettings

from splap_editor.session.session import Session
from splap_editor.session.signals import Signal
from splap_editor.tools.tool import ToolContext
from splap_editor.viewport.scene_view import SceneView

MB, GB = 1 << 20, 1 << 30
UPS = {"auto": None, "z": (0.0, 0.0, 1.0), "y": (0.0, 1.0, 0.0), "-y": (0.0, -1.0, 0.0)}
"""World directions that may be up in a newly opened scene; None: guessed from the file."""

CHOICES = {"navigation": ("blender", "left"), "up": tuple(UPS)}
RANGES = {"undo_mb": (16, 16_384), "n_threads": (1, 64), "cache_gb": (0.1, 1000.0)}


@dataclass(frozen=True)
class Preferences:
    """Everything on the preferences page.

    Parameters
    ----------
    navigation : str
        ``"blender"``, or ``"left"``: a left drag orbits with the rectangle tool too unless Shift or Ctrl is held.
    up : str
        Key of `UPS`.
    undo_mb : int
        Memory in MiB that undo may keep.
    n_threads : int
        Handles whose weights are solved for at a time.
    cache_gb : float
        Room in GiB on disk for prepared scenes.
    """

    navigation: str = "blender"
    up: str = "auto"
    undo_mb: int = 256
    n_threads: int = 4
    cache_gb: float = 4.0


class PreferenceStore:
    """The preferences in force.

    Parameters
    ----------
    session : Session
    view : SceneView
    context : ToolContext
        What they act on.
    """

    def __init__(self, session: Session, view: SceneView, context: ToolContext) -> None:
        self.changed = Signal()
        self._session, self._view, self._context = session, view, context
        self.held = kept_preferences()
        self._apply()

    def set(self, held: Preferences) -> None:
        """Put other preferences in force, and remember them."""
        if held == self.held:
            return
        self.held = held
        settings = QSettings()
        for field in fields(held):
            settings.setValue(f"preferences/{field.name}", getattr(held, field.name))
        self._apply()
        self.changed.emit()

    def reset(self) -> None:
        """Go back to what the program comes with."""
        self.set(Preferences())

    @property
    def cache_bytes(self) -> int:
        """What prepared scenes take on disk."""
        return self._session.cache.nbytes if self._session.cache is not None else 0

    def clear_cache(self) -> None:
        """Drop all prepared scenes; the one on screen stays as it is."""
        if self._session.cache is not None:
            self._session.cache.clear()

    def _apply(self) -> None:
        held, session = self.held, self._session
        session.history.set_max_bytes(held.undo_mb * MB)
        session.n_threads = held.n_threads
        if session.cache is not None:
            session.cache.set_max_bytes(round(held.cache_gb * GB))
        self._context.left_orbits = held.navigation == "left"
        self._view.preferred_up = UPS[held.up]


def kept_preferences() -> Preferences:
    """What was remembered; anything that makes no sense is left at its default."""
    settings, held = QSettings(), Preferences()
    for field in fields(held):
        usual = getattr(held, field.name)
        value: Any = settings.value(f"preferences/{field.name}", usual)
        try:
            value = type(usual)(value)
        except (TypeError, ValueError):
            continue
        low, high = RANGES.get(field.name, (None, None))
        if value in CHOICES.get(field.name, (value,)) and (low is None or low <= value <= high):
            held = replace(held, **{field.name: value})
    return held
