"""What a coarse model misses, remembered from the last settled pose."""

import numba as nb
import numpy as np
from numpy.typing import NDArray

from splap_editor.core.arap.problem import Pose
from splap_editor.core.index_spaces import Nodes


class SettledOffset:
    """Difference between a settled pose and the coarse model's idea of it, carried along while dragging on.

    Without it a settled pose would jump back to the coarse one at the first frame of the next drag. It turns with
    each node, and fades out as the handles leave the settled pose by as much as that pose left rest.

    Parameters
    ----------
    rest : (n, 3) float64
        Rest positions of all nodes.
    nodes : (k,) int64
        Nodes that the coarse model moves.
    coarse, settled : Pose
        Both of all nodes, for the same transforms.
    transforms : (H, 4, 4) float64
        The handles' when settled.
    """

    def __init__(
        self,
        rest: NDArray[np.float64],
        nodes: Nodes,
        coarse: Pose,
        settled: Pose,
        transforms: NDArray[np.float64],
    ) -> None:
        self._nodes = nodes
        back = np.swapaxes(coarse.rotations[nodes], 1, 2)
        self._shifts = (back @ (settled.positions[nodes] - coarse.positions[nodes])[:, :, None])[:, :, 0]
        self._turns = back @ settled.rotations[nodes]
        low, high = rest.min(axis=0), rest.max(axis=0)
        corners = np.stack(np.meshgrid(*zip(low, high, strict=True)), axis=-1).reshape(-1, 3)
        self._corners = np.concatenate([corners, np.ones((8, 1))], axis=1)
        self._transforms = transforms
        self._reach = self._distance(np.eye(4))

    def _distance(self, transforms: NDArray[np.float64]) -> float:
        """How far transforms are from the settled ones, by what they do to the corners of the scene."""
        return float(np.linalg.norm((transforms - self._transforms) @ self._corners.T))

    def add(self, transforms: NDArray[np.float64], pose: Pose) -> None:
        """Add the offset, as far as it still counts, to a coarse pose of all nodes, in place."""
        share = 1.0 - self._distance(transforms) / self._reach if self._reach > 0.0 else 0.0
        if share > 0.0:
            _add_offsets(self._nodes, self._shifts, self._turns, share, pose.positions, pose.rotations)


@nb.njit(nogil=True, cache=True, fastmath=True)
def _add_offsets(nodes, shifts, turns, share, positions, rotations):
    """Shift by ``share · R shift`` and turn by about ``share`` of each turn, a small one."""
    for k in range(nodes.size):
        R = rotations[nodes[k]]
        x = positions[nodes[k]]
        s0, s1, s2 = share * shifts[k, 0], share * shifts[k, 1], share * shifts[k, 2]
        T = turns[k]
        # Half the axial vector is the sine of the angle times the axis; for the small turns here, the rotation vector.
        half = 0.25 * share
        a, b, c = half * (T[2, 1] - T[1, 2]), half * (T[0, 2] - T[2, 0]), half * (T[1, 0] - T[0, 1])
        for row in range(3):
            x[row] += R[row, 0] * s0 + R[row, 1] * s1 + R[row, 2] * s2
        w = np.sqrt(max(0.0, 1.0 - (a * a + b * b + c * c)))
        for row in range(3):
            r0, r1, r2 = R[row, 0], R[row, 1], R[row, 2]
            R[row, 0] = r0 * (1 - 2 * (b * b + c * c)) + r1 * 2 * (a * b + w * c) + r2 * 2 * (a * c - w * b)
            R[row, 1] = r0 * 2 * (a * b - w * c) + r1 * (1 - 2 * (a * a + c * c)) + r2 * 2 * (b * c + w * a)
            R[row, 2] = r0 * 2 * (a * c + w * b) + r1 * 2 * (b * c - w * a) + r2 * (1 - 2 * (a * a + b * b))
