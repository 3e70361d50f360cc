"""What every edit says, whether of a scene on screen or in plain values."""

from dataclasses import dataclass, field
from typing import Generic, TypeVar

from splap_editor.core.deformers import DeformerRow, deformer_row
from splap_editor.core.options import OptionSet
from splap_editor.core.place import Place

HandleT = TypeVar("HandleT")
PinT = TypeVar("PinT")


@dataclass(frozen=True, eq=False)
class BaseEdit(Generic[HandleT, PinT]):
    """Which splats are moved where, what stays, and how the rest follows.

    Parameters
    ----------
    handles : tuple
    pins : tuple
    method : str
        One of those in `DEFORMERS`.
    options : OptionSet
        `GraphOptions`, `ReachOptions`, `AdaptationOptions`, and those of every deformer; any iterable of such groups
        will do.
    place : Place
        How what comes of all that is moved, turned and scaled as one body on its way into a file.

    Raises
    ------
    ValueError
        There is no such method.
    """

    handles: tuple[HandleT, ...] = ()
    pins: tuple[PinT, ...] = ()
    method: str = "arap"
    options: OptionSet = OptionSet()
    place: Place = field(default_factory=Place)

    def __post_init__(self) -> None:
        object.__setattr__(self, "handles", tuple(self.handles))
        object.__setattr__(self, "pins", tuple(self.pins))
        object.__setattr__(self, "options", OptionSet(*self.options))
        deformer_row(self.method, self.options)

    @property
    def deformer(self) -> DeformerRow:
        """What is known of the deformer that is named."""
        return deformer_row(self.method, self.options)
