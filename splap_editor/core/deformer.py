"""What every deformer takes and gives: handles in, a deformation out."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.index_spaces import NodeMask
from splap_editor.core.progress import Progress, no_progress

PIN = -1
"""Label of a node that stays where it is."""

FREE = -2
"""Label of a node that nothing holds."""


class UnconstrainedComponentError(ValueError):
    """A handle set that leaves a deformer nothing to hold on to; the message says what the user can do."""


@dataclass(frozen=True, eq=False)
class Handles:
    """Which nodes are constrained, and by which handle.

    Nodes are the active splats in the order of `Ellipses`.

    Parameters
    ----------
    indices : (C,) int64
        Constrained nodes, ascending, each once.
    labels : (C,) int32
        Handle that moves the node, 0 to H - 1; `PIN` for one that stays put.
    centers : (H, 3) float64
        Point about which each handle's pose turns, in world units.
    cage_radii : (H,) float64
        Reach of each handle's bounded biharmonic weight in world units; inf for the
        whole object. Ignored by as-rigid-as-possible deformation.
    """

    indices: NDArray[np.int64]
    labels: NDArray[np.int32]
    centers: NDArray[np.float64]
    cage_radii: NDArray[np.float64]

    @property
    def n_handles(self) -> int:
        """Number of handles H."""
        return len(self.centers)

    def resting(self, n_nodes: int) -> NodeMask:
        """(n,) nodes that are held at rest: the pins, and what lies outside the free region."""
        is_resting = np.zeros(n_nodes, np.bool_)
        is_resting[self.indices[self.labels < 0]] = True
        return is_resting

    def targets(self, rest: NDArray[np.float64], transforms: NDArray[np.float64]) -> NDArray[np.float64]:
        """Place the constrained nodes.

        Parameters
        ----------
        rest : (n, 3) float64
            Rest positions of all nodes.
        transforms : (H, 4, 4) float64
            World transform of each handle, rest → moved.

        Returns
        -------
        (C, 3) float64
            Target of each constrained node; a pin's is its rest position.
        """
        padded = np.concatenate([transforms, np.eye(4)[None]])[self.labels]
        points = rest[self.indices]
        return np.einsum("cij,cj->ci", padded[:, :3, :3], points) + padded[:, :3, 3]


@dataclass(frozen=True, eq=False)
class Deformation:
    """Where every node went and how its neighbourhood turned.

    Parameters
    ----------
    positions : (n, 3) float64
        Deformed node positions in world units.
    rotations : (n, 3, 3) float64
        Proper rotation of each node's neighbourhood, rest → deformed.
    residual : float
        Largest distance of any node from the settled result, as estimated by the solver, in units of
        the scene scale; 0 when the result is exact.
    n_iterations : int
        Solver iterations spent.
    resting : (n,) bool, optional
        Nodes that are held at rest: whatever moves beside them, their splats are the file's own. None where all may
        move.
    """

    positions: NDArray[np.float64]
    rotations: NDArray[np.float64]
    residual: float = 0.0
    n_iterations: int = 0
    resting: NDArray[np.bool_] | None = None


Shown = Callable[[Deformation], None]
"""Takes an intermediate result worth showing while a solve settles."""


class Deformer(Protocol):
    """A deformer bound to one scene and one handle set.

    Making it does the slow part (factorising, or solving for weights); posing is cheap.
    """

    def drag(self, transforms: NDArray[np.float64]) -> Deformation:
        """Deform quickly for the frame of a drag, continuing from the frame before."""
        ...

    def solve(
        self, transforms: NDArray[np.float64], *, progress: Progress = no_progress, shown: Shown | None = None
    ) -> Deformation:
        """Deform to the settled result, which depends on ``transforms`` alone and not on earlier calls."""
        ...
