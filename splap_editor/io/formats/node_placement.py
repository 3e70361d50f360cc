"""How the node of a scene puts the splats that it holds."""

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.splats.splats import LARGEST_COORDINATE

_EVEN = 1e-4
"""Off a rotation, entry by entry, from which on a node counts as stretching its splats."""


def is_in_bounds(world: NDArray[np.float64]) -> bool:
    """Whether every number of a node's matrix, (4, 4), is a coordinate that may be read."""
    return bool(np.abs(world).max() <= LARGEST_COORDINATE)


def turn_and_factor(world: NDArray[np.float64]) -> tuple[NDArray[np.float64], float] | None:
    """Rotation, (3, 3), and even scale of a node.

    Parameters
    ----------
    world : (4, 4) array
        Where the node puts what it holds; acts on columns.

    Returns
    -------
    tuple or None
        None where it is out of bounds, mirrors or scales unevenly, which splats cannot follow.
    """
    if not is_in_bounds(world):
        return None
    factor = float(np.cbrt(np.linalg.det(world[:3, :3])))
    if not factor > 0:
        return None
    turn = world[:3, :3] / factor
    return None if np.abs(turn @ turn.T - np.eye(3)).max() > _EVEN else (turn, factor)
