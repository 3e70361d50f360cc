import numpy as np
import pytest
import scipy.sparse as sp

from splap_editor.core.linear_solvers import NotPositiveDefiniteError, SpdFactor


def _spd(n: int, seed: int) -> sp.csr_matrix:
    rng = np.random.default_rng(seed)
    A = sp.random(n, n, 0.1, random_state=rng)
    return sp.csr_matrix(A @ A.T + 0.1 * sp.eye(n))


@pytest.mark.parametrize("shape", [(60,), (60, 1), (60, 3), (60, 7)])
def test_solution_is_that_of_the_dense_twin(shape):
    A = _spd(60, 1)
    b = np.random.default_rng(2).standard_normal(shape)
    x = SpdFactor(A).solve(b)
    assert x.shape == shape
    np.testing.assert_allclose(x, np.linalg.solve(A.toarray(), b), atol=1e-10)


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5, 9, 40])
def test_dense_matrices_whose_columns_all_run_together_are_solved_too(n):
    A = np.random.default_rng(n).standard_normal((n, n))
    A = A @ A.T + np.eye(n)
    b = np.random.default_rng(0).standard_normal((n, 3))
    np.testing.assert_allclose(SpdFactor(sp.csr_matrix(A)).solve(b), np.linalg.solve(A, b), atol=1e-10)


def test_solving_leaves_the_right_hand_side_alone():
    b = np.ones((60, 3))
    SpdFactor(_spd(60, 1)).solve(b)
    assert (b == 1.0).all()


def test_any_memory_layout_and_sparse_format_is_taken():
    A = _spd(60, 1)
    b = np.asfortranarray(np.random.default_rng(2).standard_normal((60, 3)))
    expected = np.linalg.solve(A.toarray(), b)
    for matrix in (A.tocsc(), A.tocoo(), sp.csr_array(A)):
        np.testing.assert_allclose(SpdFactor(matrix).solve(b), expected, atol=1e-10)


def test_empty_system_has_the_empty_solution():
    factor = SpdFactor(sp.csr_matrix((0, 0)))
    assert factor.n == factor.nnz == 0
    assert factor.solve(np.empty((0, 3))).shape == (0, 3)


@pytest.mark.parametrize("A", [-sp.eye(4), sp.csr_matrix([[1.0, 2.0], [2.0, 1.0]]), sp.csr_matrix((3, 3))])
def test_rejects_what_is_not_positive_definite(A):
    with pytest.raises(NotPositiveDefiniteError, match="positive definite"):
        SpdFactor(A)


def test_rejects_bad_arguments():
    with pytest.raises(ValueError, match="sparse"):
        SpdFactor(np.eye(3))
    with pytest.raises(ValueError, match=r"square, got \(2, 3\)"):
        SpdFactor(sp.csr_matrix((2, 3)))
    with pytest.raises(ValueError, match="finite"):
        SpdFactor(sp.diags([1.0, np.nan]))
    with pytest.raises(ValueError, match=r"\(4,\)"):
        SpdFactor(sp.eye(4)).solve(np.ones(3))
