import numpy as np
import pytest
import scipy.sparse as sp

from splap_editor.core.bbw.blending import blended_dual_quaternion, blended_linear
from tests.reference.bbw import rigid


def random_weights(n, n_handles, seed, whole=False):
    rng = np.random.default_rng(seed)
    weights = rng.uniform(size=(n, n_handles)) * (rng.uniform(size=(n, n_handles)) < 0.7)
    weights /= np.maximum(weights.sum(axis=1, keepdims=True), 1.0 if not whole else 1e-12)
    return sp.csr_array(weights)


def random_points(n=150, seed=3):
    return np.random.default_rng(seed).normal(size=(n, 3))


def random_rigids(n_handles, seed, most=3.0):
    rng = np.random.default_rng(seed)
    return np.stack([rigid(rng.normal(size=3), rng.uniform(-most, most), rng.normal(size=3)) for _ in range(n_handles)])


def polar_rotation(A):
    U, _, Vt = np.linalg.svd(A)
    return U @ np.diag([1, 1, np.linalg.det(U @ Vt)]) @ Vt


def quat_product(a, b):
    w = a[0] * b[0] - a[1:] @ b[1:]
    return np.concatenate([[w], a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])])


def screw_mean(p, weights, transforms):
    """One point by the textbook: mean dual quaternion, normalised, applied. Rigid transforms, rest last."""
    from scipy.spatial.transform import Rotation

    duals = []
    for T in transforms:
        x, y, z, w = Rotation.from_matrix(T[:3, :3]).as_quat()
        q = np.array([w, x, y, z])
        duals.append(np.concatenate([q, 0.5 * quat_product(np.concatenate([[0.0], T[:3, 3]]), q)]))
    pivot = duals[int(np.argmax(weights))]
    mean = sum(w * d * (1 if d[:4] @ pivot[:4] >= 0 else -1) for w, d in zip(weights, duals, strict=True))
    mean /= np.linalg.norm(mean[:4])
    conjugate = mean[:4] * [1, -1, -1, -1]
    rotation = Rotation.from_quat([*mean[1:4], mean[0]]).as_matrix()
    return rotation @ p + 2 * quat_product(mean[4:], conjugate)[1:], rotation


def test_linear_blending_is_the_weighted_mean_of_the_maps():
    points = random_points()
    weights = random_weights(len(points), 4, 0)
    transforms = random_rigids(4, 1, most=1.0)
    transforms[2, :3, :3] *= 1.7
    positions, rotations = blended_linear(points, weights, transforms)
    W = weights.toarray()
    maps = np.einsum("nh,hij->nij", W, transforms) + (1 - W.sum(axis=1))[:, None, None] * np.eye(4)
    expected = np.einsum("nij,nj->ni", maps[:, :3, :3], points) + maps[:, :3, 3]
    np.testing.assert_allclose(positions, expected, atol=1e-12)
    for R, A in zip(rotations, maps[:, :3, :3], strict=True):
        np.testing.assert_allclose(R, polar_rotation(A), atol=1e-10)


def test_dual_quaternion_blending_equals_the_textbook_mean():
    points = random_points()
    weights = random_weights(len(points), 4, 0)
    transforms = random_rigids(4, 1)
    positions, rotations = blended_dual_quaternion(points, weights, transforms, np.zeros((4, 3)))
    W = weights.toarray()
    for i, p in enumerate(points):
        expected, R = screw_mean(p, np.append(W[i], 1 - W[i].sum()), [*transforms, np.eye(4)])
        np.testing.assert_allclose(positions[i], expected, atol=1e-12)
        np.testing.assert_allclose(rotations[i], R, atol=1e-12)


@pytest.mark.parametrize("angle", [0.3, np.pi - 1e-6, np.pi, 3.5, 2 * np.pi])
def test_one_rigid_motion_comes_through_whatever_the_weights(angle):
    points = random_points()
    weights = random_weights(len(points), 3, 2, whole=True)
    weights = weights[np.flatnonzero(weights.sum(axis=1) > 0)]
    points = points[: weights.shape[0]]
    T = rigid([1, 1, -2], angle, [2, 0, 5])
    transforms = np.tile(T, (3, 1, 1))
    expected = points @ T[:3, :3].T + T[:3, 3]
    for positions, rotations in (
        blended_linear(points, weights, transforms),
        blended_dual_quaternion(points, weights, transforms, np.ones((3, 3))),
    ):
        np.testing.assert_allclose(positions, expected, atol=1e-11)
        np.testing.assert_allclose(rotations, np.broadcast_to(T[:3, :3], rotations.shape), atol=1e-11)


@pytest.mark.parametrize("reflected", [False, True])
def test_an_affine_handle_with_full_weight_comes_through_exactly(reflected):
    rng = np.random.default_rng(4)
    T = np.eye(4)
    T[:3] = rng.normal(size=(3, 4))
    if (np.linalg.det(T[:3, :3]) < 0) != reflected:
        T[0, :3] *= -1
    points = random_points()
    weights = sp.csr_array(np.ones((len(points), 1)))
    positions, rotations = blended_dual_quaternion(points, weights, T[None], np.array([[1.0, -2.0, 0.5]]))
    np.testing.assert_allclose(positions, points @ T[:3, :3].T + T[:3, 3], atol=1e-11)
    np.testing.assert_allclose(rotations[0], polar_rotation(T[:3, :3]), atol=1e-11)


def test_scaling_about_the_centre_is_blended_linearly():
    points = random_points()
    weights = random_weights(len(points), 1, 5)
    center = np.array([0.3, -0.2, 0.7])
    T = np.diag([2.0, 2.0, 2.0, 1.0])
    T[:3, 3] = center - 2 * center
    positions, rotations = blended_dual_quaternion(points, weights, T[None], center[None])
    np.testing.assert_allclose(positions, points + weights.toarray() * (points - center), atol=1e-12)
    np.testing.assert_array_equal(rotations, np.broadcast_to(np.eye(3), rotations.shape))


@pytest.mark.parametrize("blend", ["linear", "dual-quaternion"])
def test_rotations_are_proper_even_where_opposite_turns_cancel(blend):
    # Equal shares of a half turn and of rest: the mean linear map is singular.
    transforms = np.stack([rigid([0, 0, 1], np.pi), rigid([1, 0, 0], -np.pi), np.diag([1.0, 1, -1, 1])])
    W = np.array([[0.5, 0, 0], [0, 0.5, 0], [0.4, 0.4, 0.2], [0, 0, 0.5], [0, 0, 1], [0.25, 0.25, 0.25]])
    points = random_points(len(W))
    if blend == "linear":
        positions, rotations = blended_linear(points, sp.csr_array(W), transforms)
    else:
        positions, rotations = blended_dual_quaternion(points, sp.csr_array(W), transforms, np.zeros((3, 3)))
    assert np.isfinite(positions).all()
    np.testing.assert_allclose(rotations @ np.swapaxes(rotations, 1, 2), np.tile(np.eye(3), (len(W), 1, 1)), atol=1e-10)
    np.testing.assert_allclose(np.linalg.det(rotations), 1.0, atol=1e-10)


def test_nodes_without_weight_do_not_move_a_bit():
    points = random_points(10)
    transforms = random_rigids(2, 0)
    for positions, rotations in (
        blended_linear(points, sp.csr_array((10, 2)), transforms),
        blended_dual_quaternion(points, sp.csr_array((10, 2)), transforms, np.zeros((2, 3))),
    ):
        np.testing.assert_array_equal(positions, points)
        np.testing.assert_array_equal(rotations, np.broadcast_to(np.eye(3), (10, 3, 3)))


def test_dual_quaternion_blending_does_not_depend_on_where_the_origin_is():
    points = random_points()
    weights = random_weights(len(points), 3, 8)
    transforms = random_rigids(3, 9)
    shift = np.array([10.0, -7.0, 3.0])
    moved = transforms.copy()
    moved[:, :3, 3] += shift - transforms[:, :3, :3] @ shift
    here, _ = blended_dual_quaternion(points, weights, transforms, np.zeros((3, 3)))
    there, _ = blended_dual_quaternion(points + shift, weights, moved, np.tile(shift, (3, 1)))
    np.testing.assert_allclose(there - shift, here, atol=1e-12)


@pytest.mark.parametrize("angle", [0.0, 1e-7, 0.3, 1.5, 3.0, np.pi])
@pytest.mark.parametrize("scale", [0.4, 1.0, 2.5])
def test_one_even_turn_mixed_with_rest_gives_the_nearest_rotation(angle, scale):
    axis = np.array([1.0, -2.0, 0.5]) / np.sqrt(5.25)
    transform = rigid(axis, angle, np.zeros(3))[None].copy()
    transform[0, :3, :3] *= scale
    shares = np.linspace(0.02, 1.0, 25)
    weights = sp.csr_array(shares[:, None])
    _, rotations = blended_linear(np.zeros((25, 3)), weights, transform)
    means = (1.0 - shares)[:, None, None] * np.eye(3) + shares[:, None, None] * transform[0, :3, :3]
    # Half a turn mixed half and half collapses: no rotation is nearest.
    clear = np.linalg.svd(means)[1][:, 1] > 1e-6
    assert clear.sum() >= 24
    nearest = [polar_rotation(mean) for mean in means[clear]]
    np.testing.assert_allclose(rotations[clear], nearest, atol=1e-12)
