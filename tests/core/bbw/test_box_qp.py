import numpy as np
import pytest
import scipy.sparse as sp

from splap_editor.core.bbw.box_qp import box_qp
from splap_editor.core.progress import Cancelled
from tests.reference.bbw import box_qp_dense


def random_problem(n, seed):
    rng = np.random.default_rng(seed)
    G = sp.random_array((n, n), density=4 / n, rng=rng, dtype=np.float64) + sp.eye_array(n)
    A = sp.csr_array(G.T @ G + 0.01 * sp.eye_array(n))
    lower = -rng.uniform(0, 0.5, n)
    return A, rng.normal(size=n), lower, lower + rng.uniform(0, 1, n)


@pytest.mark.parametrize("seed", range(5))
def test_active_set_finds_the_dense_reference_optimum(seed):
    A, c, lower, upper = random_problem(120, seed)
    solution = box_qp(A, c, lower, upper)
    assert not solution.report.fallback
    np.testing.assert_allclose(solution.w, box_qp_dense(A.toarray(), c, lower, upper), atol=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_solution_satisfies_the_kkt_conditions(seed):
    A, c, lower, upper = random_problem(200, seed)
    solution = box_qp(A, c, lower, upper)
    w, g = solution.w, solution.multipliers
    assert np.all(w >= lower)
    assert np.all(w <= upper)
    np.testing.assert_allclose(g, A @ w + c, atol=1e-12)
    inner = solution.active == 0
    assert np.abs(g[inner]).max() < 1e-9
    assert g[solution.active < 0].min() > -1e-9
    assert g[solution.active > 0].max() < 1e-9
    assert solution.report.kkt_residual < 1e-9
    assert solution.report.bound_violation < 1e-9


def test_a_cap_of_zero_factorisations_falls_back_to_the_interior_point_solver():
    A, c, lower, upper = random_problem(120, 7)
    solution = box_qp(A, c, lower, upper, max_factorisations=0)
    assert solution.report.fallback
    assert solution.report.n_factorisations == 0
    # The interior point approaches the bounds from inside.
    np.testing.assert_allclose(solution.w, box_qp_dense(A.toarray(), c, lower, upper), atol=1e-6)
    assert np.all((solution.w >= lower) & (solution.w <= upper))


def test_the_optimal_active_set_as_start_needs_one_factorisation():
    A, c, lower, upper = random_problem(200, 3)
    cold = box_qp(A, c, lower, upper)
    warm = box_qp(A, c, lower, upper, start=cold.active)
    assert warm.report.n_factorisations == 1
    np.testing.assert_allclose(warm.w, cold.w, atol=1e-12)


def test_a_wrong_start_does_not_change_the_optimum():
    A, c, lower, upper = random_problem(200, 3)
    cold = box_qp(A, c, lower, upper)
    wrong = np.random.default_rng(0).integers(-1, 2, 200).astype(np.int8)
    warm = box_qp(A, c, lower, upper, start=wrong)
    np.testing.assert_allclose(warm.w, cold.w, atol=1e-9)


def test_a_start_that_violates_no_bound_is_not_taken_for_the_optimum():
    # With everything held at zero nothing leaves the box, yet the optimum is inside.
    A = sp.csr_array(sp.diags_array([2.0, 2.0, 2.0]))
    solution = box_qp(A, np.full(3, -1.0), np.zeros(3), np.ones(3), start=np.full(3, -1, np.int8), tolerance=0.5)
    np.testing.assert_allclose(solution.w, 0.5)


def test_scaling_the_energy_leaves_the_minimiser_alone():
    A, c, lower, upper = random_problem(100, 1)
    np.testing.assert_allclose(box_qp(A, c, lower, upper).w, box_qp(A * 1e9, c * 1e9, lower, upper).w, atol=1e-12)


def test_equal_bounds_fix_the_unknown():
    A, c, lower, upper = random_problem(60, 2)
    upper[:10] = lower[:10]
    np.testing.assert_array_equal(box_qp(A, c, lower, upper).w[:10], lower[:10])


def test_no_unknowns_have_an_empty_solution():
    solution = box_qp(sp.csr_array((0, 0)), np.zeros(0), np.zeros(0), np.zeros(0))
    assert solution.w.shape == (0,)


def test_progress_can_cancel_between_factorisations():
    A, c, lower, upper = random_problem(60, 2)

    def cancel(share):
        raise Cancelled

    with pytest.raises(Cancelled):
        box_qp(A, c, lower, upper, progress=cancel)


def test_rejects_crossed_bounds_and_wrong_shapes():
    A, c, lower, upper = random_problem(20, 0)
    with pytest.raises(ValueError, match="lower must not exceed upper"):
        box_qp(A, c, upper + 1, lower)
    with pytest.raises(ValueError, match="must agree"):
        box_qp(A, c[:-1], lower, upper)


def test_a_start_that_holds_far_too_much_is_dropped():
    """A bar that hangs on by weak links: the pocket held at the start must open although each layer moves little."""
    n = 400
    stiffness = np.where(np.arange(n - 1) % 40 == 39, 1e-4, 1.0)
    L = sp.diags_array([-stiffness, -stiffness], offsets=[-1, 1], shape=(n, n)).tocsr()
    L = sp.csr_array(L - sp.diags_array(L.sum(axis=1)))
    energy = sp.csr_array(L.T @ L + 1e-12 * sp.eye_array(n))
    unknowns = np.arange(2, n - 2)
    A, c = energy[unknowns][:, unknowns], energy[unknowns][:, [0, 1]].sum(axis=1)
    start = np.zeros(n - 4, np.int8)
    start[60:] = -1
    bounds = np.zeros(n - 4), np.ones(n - 4)
    exact = box_qp(A, c, *bounds, tolerance=1e-10)
    rough = box_qp(A, c, *bounds, start=start, tolerance=2e-4)
    assert not rough.report.fallback
    assert np.abs(rough.w - exact.w).max() < 2e-3
