"""The compiled energy is the one that is written down, and its torques are its derivative."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from splap_editor.core.arap.local_kernels import energy_and_torques
from tests.core.arap.arap_scenes import strip

STEP = 1e-5


def twisted_strip():
    """Weights of either sign, every row out of place and turned; the rotations of the last two are given."""
    scene, rng = strip(5, 4), np.random.default_rng(2)
    graph, n = scene.graph, len(scene.rest)
    rows = np.repeat(np.arange(n), np.diff(graph.indptr))
    of_edge = rng.normal(1.0, 0.5, (n, n))
    weights = (of_edge + of_edge.T)[rows, graph.indices]
    positions = scene.rest + rng.normal(0.0, 0.05, scene.rest.shape)
    rotations = Rotation.from_rotvec(rng.normal(0.0, 0.5, (n, 3))).as_matrix()
    turn_index = np.append(np.arange(n - 2), [-1, -1]).astype(np.int32)
    return graph.indptr, graph.indices, weights, scene.rest, positions, rotations, turn_index


def written_energy(indptr, indices, weights, rest, positions, rotations, beta):
    total = 0.0
    for i in range(len(rest)):
        for m in range(indptr[i], indptr[i + 1]):
            j, w = indices[m], weights[m]
            stretch = positions[i] - positions[j] - rotations[i] @ (rest[i] - rest[j])
            total += 0.5 * w * stretch @ stretch + 0.25 * beta * w * ((rotations[i] - rotations[j]) ** 2).sum()
    return total


@pytest.mark.parametrize("beta", [0.0, 0.03])
def test_torques_are_the_derivative_of_the_energy_by_a_small_turn(beta):
    *arrays, rotations, turn_index = twisted_strip()
    n_turning = int(turn_index.max()) + 1
    torques = np.empty((n_turning, 3))
    energy = energy_and_torques(*arrays, rotations, turn_index, beta, torques)
    assert energy == pytest.approx(written_energy(*arrays, rotations, beta), rel=1e-12)
    differences, unused = np.empty((n_turning, 3)), np.empty((n_turning, 3))
    for row in range(n_turning):
        for axis in range(3):
            energies = []
            for step in (STEP, -STEP):
                turned = rotations.copy()
                turned[row] = Rotation.from_rotvec(step * np.eye(3)[axis]).as_matrix() @ rotations[row]
                energies.append(energy_and_torques(*arrays, turned, turn_index, beta, unused))
            differences[row, axis] = (energies[0] - energies[1]) / (2 * STEP)
    # Central differences leave STEP² of the third derivative, and the energies' roundoff over STEP.
    np.testing.assert_allclose(torques, differences, atol=1e-7)
