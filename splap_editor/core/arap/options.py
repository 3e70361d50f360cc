"""How as-rigid-as-possible deformation is solved: its options."""

from dataclasses import dataclass

from splap_editor.core.options import Choice, check_options, option

ARAP_SOLVERS = {
    "converged": Choice(
        "Converged",
        "An accelerated solver, to the minimiser of the smooth-rotation energy.",
        "splap_editor.core.arap.converged_arap:ConvergedArap",
    ),
    "local-global": Choice(
        "Local/global steps",
        "Plain iterations of the spokes energy from the rest pose with the handles moved.",
        "splap_editor.core.arap.plain_arap:LocalGlobalArap",
    ),
    "libigl": Choice(
        "libigl (reference)",
        "The same iterations by libigl, on the triangles.",
        "splap_editor.core.arap.plain_arap:LibiglArap",
    ),
}
"""Solvers by name, each a class of its own."""


@dataclass(frozen=True)
class ArapOptions:
    """How as-rigid-as-possible deformation is solved.

    Parameters
    ----------
    kind : str
        One of `ARAP_SOLVERS`.
    tolerance : float
        Largest distance of a node from the minimiser, in units of the scene scale. "converged" only.
    iterations : int
        Iterations of the two plain kinds.
    smoothness : float
        α of the smooth-rotation term ``α A Σ w_ij |R_i - R_j|²``, A the total area: it makes the result depend on the
        shape rather than on how densely it is sampled. 0 gives the plain spokes energy. "converged" only.
    """

    kind: str = option(
        "converged",
        "Converged gives the settled shape; the others are the published iterations, for comparison.",
        label="Solver",
        choices=ARAP_SOLVERS,
        is_always_written=True,
    )
    tolerance: float = option(
        1e-4,
        "Settled once no splat moves by more than this share of the size.",
        label="Tolerance",
        above=0.0,
        unit="of s",
        step=1e-4,
        decimals=6,
        only_for=("kind", ("converged",)),
    )
    iterations: int = option(
        10, "Steps from rest.", label="Iterations", least=1, only_for=("kind", ("local-global", "libigl"))
    )
    smoothness: float = option(
        0.001,
        "How much neighbouring splats want to turn together.",
        label="Stiffness",
        least=0.0,
        step=0.001,
        decimals=4,
        only_for=("kind", ("converged",)),
    )

    def __post_init__(self) -> None:
        check_options(self)
