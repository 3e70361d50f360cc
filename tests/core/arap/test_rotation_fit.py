import numpy as np
import pytest

from splap_editor.core.arap.rotation_fit import fit_rotations, nearest_rotations


def _fit_by_svd(covariances):
    U, _, Vt = np.linalg.svd(covariances)
    U[:, :, 2] *= np.sign(np.linalg.det(U @ Vt))[:, None]
    return np.swapaxes(U @ Vt, 1, 2)


def _quality(rotations, covariances):
    return np.einsum("nij,nji->n", rotations, covariances) / np.linalg.norm(covariances, axis=(1, 2)).clip(1e-300)


def _assert_proper(rotations):
    np.testing.assert_allclose(
        rotations @ np.swapaxes(rotations, 1, 2), np.tile(np.eye(3), (len(rotations), 1, 1)), atol=1e-12
    )
    np.testing.assert_allclose(np.linalg.det(rotations), 1.0, atol=1e-12)


def _products(rng, n, rank, values):
    left, right = rng.standard_normal((2, n, 3, rank))
    return np.einsum("nik,k,njk->nij", left, values, right)


CASES = {
    "full rank": lambda rng: rng.standard_normal((500, 3, 3)),
    "flat": lambda rng: _products(rng, 500, 2, np.ones(2)),
    "nearly flat": lambda rng: _products(rng, 500, 3, np.array([1.0, 0.7, 1e-6])),
    "a line": lambda rng: _products(rng, 500, 1, np.ones(1)),
    "nearly a line": lambda rng: _products(rng, 500, 3, np.array([1.0, 1e-5, 1e-8])),
    "reflections": lambda rng: np.diag([1.0, 0.8, -0.5]) + 0.1 * rng.standard_normal((500, 3, 3)),
    "all inverted": lambda rng: -np.eye(3) + 1e-4 * rng.standard_normal((500, 3, 3)),
    "tiny": lambda rng: 1e-100 * rng.standard_normal((500, 3, 3)),
    "huge": lambda rng: 1e100 * rng.standard_normal((500, 3, 3)),
    "rotations": lambda rng: _fit_by_svd(rng.standard_normal((500, 3, 3))),
}


@pytest.mark.parametrize("case", CASES)
def test_no_rotation_fits_better_than_the_fitted_one(case):
    covariances = CASES[case](np.random.default_rng(3))
    rotations = fit_rotations(covariances)
    _assert_proper(rotations)
    np.testing.assert_allclose(
        _quality(rotations, covariances), _quality(_fit_by_svd(covariances), covariances), atol=1e-13
    )


@pytest.mark.parametrize("case", ["full rank", "flat", "nearly flat", "rotations"])
def test_fit_is_that_of_the_svd_twin(case):
    covariances = CASES[case](np.random.default_rng(4))
    values = np.linalg.svd(covariances, compute_uv=False)
    gap = (values[:, 1] + np.sign(np.linalg.det(covariances)) * values[:, 2]) / values[:, 0]
    error = np.abs(fit_rotations(covariances) - _fit_by_svd(covariances)).max(axis=(1, 2))
    # Rounding in the covariance is amplified by the inverse of the gap, for the twin as well.
    assert (error * gap).max() < 1e-12


def test_zero_covariance_gives_the_identity():
    assert (fit_rotations(np.zeros((2, 3, 3))) == np.eye(3)).all()


def test_a_rotation_comes_back_transposed_from_fit_and_as_it_is_from_nearest():
    rotations = _fit_by_svd(np.random.default_rng(5).standard_normal((50, 3, 3)))
    np.testing.assert_allclose(fit_rotations(rotations), np.swapaxes(rotations, 1, 2), atol=1e-13)
    np.testing.assert_allclose(nearest_rotations(2.0 * rotations), rotations, atol=1e-13)


def test_rejects_other_shapes():
    with pytest.raises(ValueError, match=r"\(N, 3, 3\), got \(3, 3\)"):
        fit_rotations(np.eye(3))
