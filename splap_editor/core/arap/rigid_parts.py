"""Parts of a scene that move as one rigid body, and need no deformation energy to say how."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from splap_editor.core.arap.problem import Constraints, Pose
from splap_editor.core.arap.rotation_fit import nearest_rotations
from splap_editor.core.deformer import PIN
from splap_editor.core.index_spaces import Nodes

_ANCHORS = 16
"""At most so many neighbouring nodes tell a loose part how to move."""

_SAME = 1e-9
"""Two motions are the same if they agree to this, in units of the scene scale at the scene's far corners."""


class LooseParts:
    """Connected parts that no constraint holds: each follows the held parts nearest to it in space.

    A part moves by the one rotation and translation that best fit the motion of the nearest nodes of held parts, so a
    rigid motion of these comes through exactly. Their rotations have a say too, which decides where fewer than three
    nodes, or nodes in a line, would leave a turn open.

    Parameters
    ----------
    rest : (n, 3) float64
        Rest positions.
    constraints : Constraints
        At least one node is held.
    """

    def __init__(self, rest: NDArray[np.float64], constraints: Constraints) -> None:
        loose = constraints.loose
        self.nodes: Nodes = np.flatnonzero(loose)
        self._rest = rest
        if len(self.nodes) == 0:
            return
        _, self._part = np.unique(constraints.component[self.nodes], return_inverse=True)
        self._n_parts = int(self._part.max()) + 1
        others = np.flatnonzero(~loose)
        k = min(4, len(others))
        distances, nearest = cKDTree(rest[others]).query(rest[self.nodes], k=k)
        part = np.repeat(self._part, k)
        order = np.lexsort((distances.ravel(), part))
        part, anchor = part[order], others[nearest.ravel()[order]]
        _, first = np.unique(part * len(rest) + anchor, return_index=True)
        first.sort()
        part, anchor = part[first], anchor[first]
        rank = np.arange(len(part)) - np.searchsorted(part, part)
        self._anchor_part, self._anchors = part[rank < _ANCHORS], anchor[rank < _ANCHORS]

    def follow(self, pose: Pose) -> None:
        """Move the loose nodes, in place, after all others have been moved."""
        if len(self.nodes) == 0:
            return
        positions, rotations = pose.positions, pose.rotations
        counts = np.bincount(self._anchor_part, minlength=self._n_parts)[:, None]
        before, after = self._rest[self._anchors], positions[self._anchors]
        from_mean, to_mean = self._sum(before) / counts, self._sum(after) / counts
        before, after = before - from_mean[self._anchor_part], after - to_mean[self._anchor_part]
        spread = self._sum(np.square(before).sum(axis=1))
        turns = self._sum(rotations[self._anchors].reshape(-1, 9)).reshape(-1, 3, 3)
        covariances = self._sum(np.einsum("ci,cj->cij", after, before).reshape(-1, 9)).reshape(-1, 3, 3)
        # A tenth of the anchors' own moment: decides open turns, barely moves closed ones.
        share = 0.1 * spread / counts[:, 0]
        share = np.where(share > 0.0, share, 1.0)
        fitted = nearest_rotations(covariances + share[:, None, None] * turns)
        offsets = self._rest[self.nodes] - from_mean[self._part]
        positions[self.nodes] = to_mean[self._part] + np.einsum("nij,nj->ni", fitted[self._part], offsets)
        rotations[self.nodes] = fitted[self._part]

    def _sum(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Sum of per-anchor values over each part."""
        if values.ndim == 1:
            return np.asarray(np.bincount(self._anchor_part, values, minlength=self._n_parts), np.float64)
        return np.stack(
            [np.bincount(self._anchor_part, column, minlength=self._n_parts) for column in values.T], axis=1
        )


class RigidComponents:
    """Components whose constraints all move alike: they follow exactly, without solving.

    Parameters
    ----------
    rest : (n, 3) float64
        Rest positions.
    constraints : Constraints
        What is held.
    scene_scale : float
        Scene scale s in world units.
    """

    def __init__(self, rest: NDArray[np.float64], constraints: Constraints, scene_scale: float) -> None:
        self._rest = rest
        self._component = component = constraints.component
        self._free = np.flatnonzero(constraints.free)
        self._n_components = int(component.max(initial=-1)) + 1
        has_free = np.bincount(component[self._free], minlength=self._n_components) > 0
        n_labels = int(constraints.labels.max(initial=PIN)) + 2
        held = np.flatnonzero(constraints.held)
        # One number a pair: sorting rows is slow, and a new handle waits for this.
        pairs = np.unique(component[held].astype(np.int64) * n_labels + constraints.labels[held] + 1)
        components, labels = pairs // n_labels, pairs % n_labels - 1
        self._pairs = np.stack([components, labels], axis=1)[has_free[components]]
        low, high = rest.min(axis=0), rest.max(axis=0)
        corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
        self._corners = corners
        self._tolerance = _SAME * scene_scale

    def follow(self, transforms: NDArray[np.float64], pose: Pose) -> bool:
        """Move the free nodes of rigidly moved components, in place; True if that was all of them."""
        maps = np.concatenate([transforms, np.eye(4)[None]])
        images = np.einsum("hij,cj->hci", maps[:, :3, :3], self._corners) + maps[:, None, :3, 3]
        kind = np.arange(len(maps))
        for h in range(len(maps)):
            same = np.abs(images[: h + 1] - images[h]).max(axis=(1, 2)) <= self._tolerance
            kind[h] = np.argmax(same)
        polar = nearest_rotations(maps[:, :3, :3])
        is_rigid = np.abs(polar - maps[:, :3, :3]).max(axis=(1, 2)) <= _SAME
        component, kinds = self._pairs[:, 0], kind[self._pairs[:, 1]]
        least, most = np.full(self._n_components, len(maps)), np.full(self._n_components, -1)
        np.minimum.at(least, component, kinds)
        np.maximum.at(most, component, kinds)
        moved = (least == most) & (most >= 0)
        moved[moved] = is_rigid[most[moved]]
        whole = moved[self._component[self._free]]
        nodes = self._free[whole]
        which = most[self._component[nodes]]
        pose.positions[nodes] = np.einsum("nij,nj->ni", maps[which, :3, :3], self._rest[nodes]) + maps[which, :3, 3]
        pose.rotations[nodes] = polar[which]
        return bool(whole.all())
