"""How each splat's ellipse follows the deformed surface, and what becomes of one drawn out far: options."""

from dataclasses import dataclass

from splap_editor.core.options import Choice, check_options, option

ADAPTATIONS = {
    "surface": Choice("Follows the surface", "The ellipse's inscribed triangle follows the surface."),
    "affine": Choice("Stretches with it", "The least-squares affine map of rings of neighbours, the paper's baseline."),
    "paper": Choice(
        "As in the paper", "The triangle's corners move by the displacements of the nearest along the graph."
    ),
    "none": Choice("Moves only", "Centres move and nothing else."),
}


@dataclass(frozen=True)
class AdaptationOptions:
    """How kernels follow the surface.

    Parameters
    ----------
    adaptation : str
        One of `ADAPTATIONS`.
    hops : int
        Rings of neighbours of the affine adaptation.
    """

    adaptation: str = option(
        "surface",
        "How each ellipse follows the bent surface.",
        label="Splat shape",
        choices=ADAPTATIONS,
        is_always_written=True,
    )
    hops: int = option(
        1,
        "Rings of neighbours that the stretch is taken from.",
        label="Neighbours",
        least=1,
        most=3,
        only_for=("adaptation", ("affine",)),
    )

    def __post_init__(self) -> None:
        check_options(self)


@dataclass(frozen=True)
class RepairOptions:
    """What becomes of drawn-out splats in a file that is written.

    Parameters
    ----------
    repair : float
        Stretch beyond which a splat is written as several, see `splap_editor.core.adaptation.repair`; 0 for none.

    Raises
    ------
    ValueError
        If it is above 0 and not above 1: nothing is drawn out less than not at all.
    """

    repair: float = option(
        0.0,
        "Splats drawn out to more than so many times their length are split when a file is written; 0 for none.",
        label="Split beyond",
        least=0.0,
        most=100.0,
    )

    def __post_init__(self) -> None:
        check_options(self)
        if 0.0 < self.repair <= 1.0:
            raise ValueError(f"repair must be above 1, or 0 to split nothing, got {self.repair!r}")


USUAL_REPAIR = 2.0
"""Limit of a repair that nobody gives one."""
