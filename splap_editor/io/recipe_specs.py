"""What a recipe says: handles, pins, graph and solver as plain values."""

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from splap_editor.core.graph.options import GraphOptions

DEFAULT_RADIUS = math.nan
"""Stands for a radius that the recipe leaves to the program; always this very object, so that recipes compare."""

LARGEST_COORDINATE = 1e30
"""Largest coordinate, and largest move of a handle, in world units."""

SCALES = (1e-6, 1e6)
"""Least and largest scale of a handle. A coordinate times a scale stays well within single precision, 3.4e38."""

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


@dataclass(frozen=True)
class SolverSpec:
    """How as-rigid-as-possible deformation is solved.

    Parameters
    ----------
    kind : str
        ``"converged"``, ``"local-global"`` or ``"libigl"``.
    tolerance : float
        Of ``"converged"``, in units of the scene scale.
    iterations : int
        Of the other two.
    smoothness : float
        Of ``"converged"``: weight of the second-order term.
    """

    kind: Literal["converged", "local-global", "libigl"] = "converged"
    tolerance: float = 1e-4
    iterations: int = 10
    smoothness: float = 0.001


@dataclass(frozen=True)
class PinSpec:
    """Splats that stay put: within a ball, or by file row.

    Parameters
    ----------
    center : 3 floats, optional
        World units.
    radius : float, optional
        World units.
    rows : tuple of int, optional
        File rows, instead of center and radius.
    """

    center: Vector | None = None
    radius: float | None = None
    rows: tuple[int, ...] | None = None


@dataclass(frozen=True)
class PoseSpec:
    """How far a handle is moved, turned and scaled about its centre.

    Parameters
    ----------
    translate : 3 floats
        World units.
    rotate : 4 floats
        Unit quaternion, w x y z.
    scale : float or 3 floats
        Uniform, or along the world axes before the rotation; greater than 0.
    """

    translate: Vector = (0.0, 0.0, 0.0)
    rotate: Quaternion = (1.0, 0.0, 0.0, 0.0)
    scale: float | Vector = 1.0


@dataclass(frozen=True)
class HandleSpec:
    """Splats that are moved, and where to.

    Parameters
    ----------
    name : str
        As listed.
    center : 3 floats, optional
        Point about which the pose turns and scales, world units; with rows it
        may be left out and is then the mean of their positions.
    radius : float, optional
        Every active splat within it belongs; world units.
    rows : tuple of int, optional
        File rows, instead of radius.
    translate : 3 floats
        World units.
    rotate : 4 floats
        Unit quaternion, w x y z.
    scale : float or 3 floats
        Uniform, or along the world axes before the rotation; greater than 0.
    cage_radius : float, optional
        Reach of the handle's bounded biharmonic weight, world units; None for
        the whole object, `DEFAULT_RADIUS` for 0.3 of the scene scale.
    """

    name: str = ""
    center: Vector | None = None
    radius: float | None = None
    rows: tuple[int, ...] | None = None
    translate: Vector = (0.0, 0.0, 0.0)
    rotate: Quaternion = (1.0, 0.0, 0.0, 0.0)
    scale: float | Vector = 1.0
    cage_radius: float | None = DEFAULT_RADIUS

    def __post_init__(self) -> None:
        if self.cage_radius is not None and math.isnan(self.cage_radius):
            object.__setattr__(self, "cage_radius", DEFAULT_RADIUS)

    def transform(self, center: ArrayLike | None = None) -> NDArray[np.float64]:
        """World transform of the pose: ``x → c + t + R (s * (x - c))``.

        Parameters
        ----------
        center : (3,) float, optional
            Used where the handle has no center of its own.

        Returns
        -------
        (4, 4) float64

        Raises
        ------
        ValueError
            If there is no center at all.
        """
        center = self.center if self.center is not None else center
        if center is None:
            raise ValueError(f"handle {self.name!r} has rows and no center: give the mean of their positions")
        center = np.asarray(center, np.float64)
        w, x, y, z = np.asarray(self.rotate, np.float64) / math.hypot(*self.rotate)
        rotation = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )
        transform = np.eye(4)
        transform[:3, :3] = rotation * np.asarray(self.scale, np.float64)
        transform[:3, 3] = center + np.asarray(self.translate, np.float64) - transform[:3, :3] @ center
        return transform


@dataclass(frozen=True)
class Recipe:
    """An edit: which splats are moved where, what stays, and how the rest follows.

    Parameters
    ----------
    method : str
        ``"arap"`` or ``"bbw"``.
    graph : GraphOptions
    free_radius : float, optional
        World units; splats farther than this from every handle stay put. None
        frees everything not pinned, `DEFAULT_RADIUS` is half the scene scale.
    handles : tuple of HandleSpec
    pins : tuple of PinSpec
    solver : SolverSpec
    adaptation : str
        ``"surface"``, ``"affine"`` or ``"none"``.
    hops : int
        Neighbourhood of the affine adaptation, 1 to 3.
    blending : str
        ``"dual-quaternion"`` or ``"linear"``: how bounded biharmonic weights mix poses.
    """

    method: Literal["arap", "bbw"] = "arap"
    graph: GraphOptions = field(default_factory=GraphOptions)
    free_radius: float | None = DEFAULT_RADIUS
    handles: tuple[HandleSpec, ...] = ()
    pins: tuple[PinSpec, ...] = ()
    solver: SolverSpec = field(default_factory=SolverSpec)
    adaptation: Literal["surface", "affine", "none"] = "surface"
    hops: int = 1
    blending: Literal["dual-quaternion", "linear"] = "dual-quaternion"

    def __post_init__(self) -> None:
        if self.free_radius is not None and math.isnan(self.free_radius):
            object.__setattr__(self, "free_radius", DEFAULT_RADIUS)
