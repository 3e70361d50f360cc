"""Bound scenes and smooth deformations of them, for the tests of adaptation."""

import numpy as np
from scipy.spatial.transform import Rotation

from splap_editor.core.adaptation.kernel_binding import KernelBinding
from splap_editor.core.deformer import Deformation
from splap_editor.core.graph.splat_graph import splat_graph
from splap_editor.core.splats.occupancy import occupancy_ellipses
from splap_editor.core.surface.geodesics import geodesic_neighbors

TURN = Rotation.from_rotvec([0.4, -1.1, 0.7])
SHIFT = np.array([0.3, -2.0, 5.0])


def bound(splats):
    ellipses = occupancy_ellipses(splats)
    graph = splat_graph(ellipses)
    return KernelBinding(splats, ellipses, geodesic_neighbors(graph, 30), graph=graph)


def deformation_by(binding, mapping, step=1e-6):
    """What a smooth map of space does to the nodes; rotations are the polar factors of its derivative."""
    rest = binding.ellipses.centers
    columns = [(mapping(rest + step * e) - mapping(rest - step * e)) / (2.0 * step) for e in np.eye(3)]
    left, _, right = np.linalg.svd(np.stack(columns, axis=2))
    return Deformation(mapping(rest), left @ right)


def rigid(binding, turn=TURN, shift=SHIFT, scale=1.0):
    rest = binding.ellipses.centers
    return Deformation(scale * turn.apply(rest) + shift, np.tile(turn.as_matrix(), (len(rest), 1, 1)))


def bent(radius):
    """Roll the plane z = 0 up around an axis along y."""

    def mapping(points):
        x, y, z = points.T
        return np.stack([(radius - z) * np.sin(x / radius), y, radius - (radius - z) * np.cos(x / radius)], axis=1)

    return mapping
