import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from splap_editor.core.splats.spherical_harmonics import rotated_sh, sh_basis, sh_colors, view_colors
from tests.reference.spherical_harmonics import real_basis, turned_coefficients

DEGREES = [1, 2, 3, 4]


def directions(n, seed=0):
    vectors = np.random.default_rng(seed).normal(size=(n, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def coefficients(n, degree, seed=0):
    return np.random.default_rng(seed).normal(size=(n, (degree + 1) ** 2 - 1, 3))


def rotations(n, seed=0):
    return Rotation.random(n, random_state=seed).as_matrix()


@pytest.mark.parametrize("degree", DEGREES)
def test_the_basis_is_scipys(degree):
    np.testing.assert_allclose(sh_basis(directions(100), degree), real_basis(directions(100), degree), atol=1e-13)


def test_band_one_has_the_signs_of_3dgs():
    x, y, z = directions(20).T
    np.testing.assert_allclose(sh_basis(directions(20), 1), 0.4886025119029199 * np.stack([-y, z, -x], axis=1))


@pytest.mark.parametrize("degree", DEGREES)
def test_turning_then_looking_is_looking_from_the_turned_side(degree):
    sh0, shN, R, d = np.zeros((50, 3)) + 9.0, coefficients(50, degree), rotations(50), directions(50)
    at_rest = sh_colors(sh0, shN, np.einsum("nji,nj->ni", R, d))
    np.testing.assert_allclose(sh_colors(sh0, rotated_sh(shN, R), d), at_rest, atol=1e-12)


@pytest.mark.parametrize("degree", DEGREES)
def test_turning_is_the_twins_fit_to_samples(degree):
    shN, R = coefficients(5, degree), rotations(5)
    twin = [turned_coefficients(c, r) for c, r in zip(shN, R, strict=True)]
    np.testing.assert_allclose(rotated_sh(shN, R), twin, atol=1e-11)


@pytest.mark.parametrize("degree", DEGREES)
def test_two_turns_are_one_and_the_inverse_undoes_it(degree):
    shN, first, second = coefficients(50, degree), rotations(50, 1), rotations(50, 2)
    turned = rotated_sh(shN, first)
    np.testing.assert_allclose(rotated_sh(turned, second), rotated_sh(shN, second @ first), atol=1e-12)
    np.testing.assert_allclose(rotated_sh(turned, first.swapaxes(1, 2)), shN, atol=1e-12)


@pytest.mark.parametrize("degree", DEGREES)
def test_bands_keep_their_power(degree):
    shN = coefficients(20, degree)
    turned = rotated_sh(shN, rotations(20))
    for band in range(1, degree + 1):
        part = slice(band**2 - 1, band**2 + 2 * band)
        np.testing.assert_allclose(np.sum(turned[:, part] ** 2, axis=1), np.sum(shN[:, part] ** 2, axis=1))


def test_identity_and_unchanged_rows_are_kept_bit_for_bit():
    shN = coefficients(30, 3).astype(np.float32)
    R = rotations(30)
    R[::2] = np.eye(3)
    changed = np.arange(30) % 3 > 0
    turned = rotated_sh(shN, R, changed)
    kept = (np.arange(30) % 2 == 0) | ~changed
    assert turned.dtype == np.float32 and turned is not shN
    np.testing.assert_array_equal(turned[kept].view(np.uint32), shN[kept].view(np.uint32))
    assert (turned[~kept] != shN[~kept]).any(axis=(1, 2)).all()


def test_a_view_in_the_files_channel_order_turns_alike():
    shN = coefficients(10, 3)
    channel_major = np.ascontiguousarray(shN.transpose(0, 2, 1)).transpose(0, 2, 1)
    np.testing.assert_array_equal(rotated_sh(channel_major, rotations(10)), rotated_sh(shN, rotations(10)))


def test_nan_stays_in_its_band_and_channel():
    shN = coefficients(1, 2)
    shN[0, 4, 1] = np.nan
    turned = rotated_sh(shN, rotations(1))
    assert np.isnan(turned[0, 3:, 1]).all()
    assert np.isfinite(turned[0, :3]).all() and np.isfinite(turned[0, :, [0, 2]]).all()


def test_scenes_without_view_dependence_stay_so():
    assert rotated_sh(np.empty((4, 0, 3)), rotations(4)).shape == (4, 0, 3)
    np.testing.assert_allclose(sh_colors(np.zeros((4, 3)), np.empty((4, 0, 3)), directions(4)), 0.5)


def test_colours_do_not_fall_below_zero():
    assert (sh_colors(np.full((5, 3), -9.0), np.zeros((5, 3, 3)), directions(5)) == 0.0).all()


@pytest.mark.parametrize("degree", [0, *DEGREES])
def test_the_display_sees_the_turned_colours_without_turning_them(degree):
    sh0, shN, R = coefficients(40, 1)[:, 0], coefficients(40, degree), rotations(40)
    positions, camera = np.random.default_rng(3).normal(size=(40, 3)), np.array([0.3, -5.0, 2.0])
    toward = positions - camera
    toward /= np.linalg.norm(toward, axis=1, keepdims=True)
    expected = sh_colors(sh0, rotated_sh(shN, R), toward)
    # Single precision over up to 25 terms of size 1.
    np.testing.assert_allclose(view_colors(sh0, shN, positions, R, camera), expected, atol=1e-5)


def test_a_camera_inside_a_splat_sees_a_finite_colour():
    colors = view_colors(np.zeros((1, 3)), coefficients(1, 3), np.ones((1, 3)), np.eye(3)[None], np.ones(3))
    assert np.isfinite(colors).all()


def test_rejects_wrong_arguments():
    with pytest.raises(ValueError, match=r"K = 0, 3, 8, 15 or 24, got \(4, 7, 3\)"):
        rotated_sh(np.zeros((4, 7, 3)), rotations(4))
    with pytest.raises(ValueError, match=r"rotations must have shape \(4, 3, 3\), got \(5, 3, 3\)"):
        rotated_sh(np.zeros((4, 3, 3)), rotations(5))
    with pytest.raises(ValueError, match=r"directions must have shape \(N, 3\), got \(3,\)"):
        sh_basis(np.zeros(3), 1)
    with pytest.raises(ValueError, match="degree must be 0 to 4, got 5"):
        sh_basis(np.zeros((1, 3)), 5)
