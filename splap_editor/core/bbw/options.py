"""How bounded biharmonic weights are found and used: their options."""

from dataclasses import dataclass

from splap_editor.core.options import Choice, check_options, option

BLENDINGS = {
    "dual-quaternion": Choice(
        "Keeps volume",
        "Dual quaternions: a joint bends as a hose does.",
    ),
    "linear": Choice(
        "Linear",
        "Linear blend skinning: a twisted joint gets thin.",
    ),
}
"""How turns of several handles mix."""


@dataclass(frozen=True)
class BbwOptions:
    """How bounded biharmonic weights are found and used.

    Parameters
    ----------
    blending : str
        One of `BLENDINGS`: how the handles' transforms are mixed at a drag. The weights do not depend on it.
    tolerance : float
        Change of the weights at which their solution stops, a tenth of it up to `weights.CHEAP_UNKNOWNS`. They are then
        a few times that from the optimum, farther only in fringes that hang on by a few weak links, where the energy
        hardly tells one value from another.
    max_factorisations : int
        Sparse factorisations per handle before the interior-point fallback.
    mass_floor : float
        Smallest mass in units of the median one; tiny areas would make ``M⁻¹`` explode.
    speck_size : int
        Components of fewer nodes, and without any constraint, follow their nearest neighbour instead of staying
        at rest.
    """

    blending: str = option("dual-quaternion", "How turns of several handles mix.", label="Blending", choices=BLENDINGS)
    tolerance: float = 2e-4
    max_factorisations: int = 60
    mass_floor: float = 0.1
    speck_size: int = 30

    def __post_init__(self) -> None:
        check_options(self)
