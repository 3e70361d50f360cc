"""How far handles reach: options of what is held, and of each handle."""

from dataclasses import dataclass

from splap_editor.core.options import Length, ShareOfSize, check_options, option


@dataclass(frozen=True)
class ReachOptions:
    """What stays put besides the pins.

    Parameters
    ----------
    free_radius : float, ShareOfSize or None
        World units; None frees everything that is not pinned.
    """

    free_radius: Length = option(
        ShareOfSize(0.5),
        "Splats farther than this from every handle stay put, in the file's units; null frees all that no pin holds.",
        label="Free radius",
        above=0.0,
        unit="world",
    )

    def __post_init__(self) -> None:
        check_options(self)


@dataclass(frozen=True)
class CageOptions:
    """How far one handle's weight reaches.

    Parameters
    ----------
    cage_radius : float, ShareOfSize or None
        World units; None for the whole object.
    """

    cage_radius: Length = option(
        ShareOfSize(0.3),
        "Splats farther than this from the handle's own do not follow it, in the file's units; null for all of them.",
        label="Cage",
        above=0.0,
        unit="world",
    )

    def __post_init__(self) -> None:
        check_options(self)
