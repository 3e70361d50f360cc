import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from splap_editor.core.splats.rotations import matrices_to_quats, quat_products, quats_to_matrices


def random_quats(n, seed=0):
    return np.random.default_rng(seed).normal(size=(n, 4))


def test_matrices_are_scipys_whatever_the_quaternions_length_and_sign():
    quats = random_quats(200)
    expected = Rotation.from_quat(quats[:, [1, 2, 3, 0]]).as_matrix()
    for factor in (1.0, -1.0, 1e-30, -1e150):
        np.testing.assert_allclose(quats_to_matrices(factor * quats), expected, atol=1e-14)


def test_quaternions_survive_the_way_through_matrices():
    quats = np.concatenate([random_quats(200), np.eye(4), [[0, 1, 1, 0], [1e-9, 0, 1, 0], [1e-9, 1, 0, -1]]])
    quats /= np.linalg.norm(quats, axis=1, keepdims=True)
    back = matrices_to_quats(quats_to_matrices(quats))
    signs = np.sign(np.sum(back * quats, axis=1, keepdims=True))
    np.testing.assert_allclose(signs * back, quats, atol=1e-14)
    assert (back[:, 0] >= 0.0).all()


def test_products_of_quaternions_are_products_of_rotations_and_of_lengths():
    left, right = random_quats(50, 1), random_quats(50, 2)
    product = quat_products(left, right)
    np.testing.assert_allclose(
        quats_to_matrices(product), quats_to_matrices(left) @ quats_to_matrices(right), atol=1e-14
    )
    lengths = [np.linalg.norm(q, axis=1) for q in (product, left, right)]
    np.testing.assert_allclose(lengths[0], lengths[1] * lengths[2], rtol=1e-14)


def test_quaternions_without_a_direction_give_nan():
    matrices = quats_to_matrices([[0.0, 0.0, 0.0, 0.0], [np.nan, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 0.0]])
    assert np.isnan(matrices[:2]).all(axis=(1, 2)).all()
    np.testing.assert_array_equal(matrices[2], np.eye(3))


def test_no_rotations_at_all_are_fine():
    assert quats_to_matrices(np.empty((0, 4))).shape == (0, 3, 3)
    assert matrices_to_quats(np.empty((0, 3, 3))).shape == (0, 4)


def test_rejects_wrong_shapes():
    with pytest.raises(ValueError, match=r"quats must have shape \(N, 4\), got \(3, 3\)"):
        quats_to_matrices(np.eye(3))
    with pytest.raises(ValueError, match=r"matrices must have shape \(N, 3, 3\), got \(3, 3\)"):
        matrices_to_quats(np.eye(3))
