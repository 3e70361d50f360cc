"""Sparse symmetric positive definite systems: factor once, solve for many right-hand sides.

The only module that knows which factorisation is underneath.
"""

import numba as nb
import numpy as np
import qdldl
import scipy.sparse as sp
from numpy.typing import NDArray


class NotPositiveDefiniteError(ValueError):
    """A matrix that was meant to be positive definite is not."""


class SpdFactor:
    """L D Lᵀ factor of a sparse symmetric positive definite matrix.

    Factoring and solving release the GIL. Solving is a pair of triangular sweeps
    over columns, three right-hand sides at a time.

    Parameters
    ----------
    A : (n, n) scipy sparse, float64
        Symmetric matrix; only its upper triangle is read. An empty matrix is allowed.

    Raises
    ------
    ValueError
        If A is not sparse, not square or not finite.
    NotPositiveDefiniteError
        If a pivot is zero or negative: some unknown is not held by anything.
    """

    def __init__(self, A: sp.spmatrix | sp.sparray) -> None:
        if not sp.issparse(A):
            raise ValueError(f"A must be a scipy sparse matrix, got {type(A).__name__}")
        if A.shape[0] != A.shape[1]:
            raise ValueError(f"A must be square, got {A.shape}")
        A = sp.csc_matrix(A)
        if not np.isfinite(A.data).all():
            raise ValueError("A must be finite")
        self.n: int = A.shape[0]
        if self.n == 0:
            self.nnz = 0
            return
        if not (A.diagonal() > 0).all():
            raise NotPositiveDefiniteError("A must be positive definite: it has a zero or negative diagonal entry")
        try:
            factor, pivots, order = qdldl.Solver(A).factors()
        except (ValueError, RuntimeError) as error:
            raise NotPositiveDefiniteError(f"A must be positive definite: {error}") from error
        if not (pivots > 0).all():
            row = int(order[np.argmin(pivots)])
            raise NotPositiveDefiniteError(f"A must be positive definite: the pivot of row {row} is not positive")
        self._indptr = factor.indptr.astype(np.int32)
        self._indices = factor.indices.astype(np.int32)
        self._data = np.ascontiguousarray(factor.data, np.float64)
        self._inverse_pivots = 1.0 / np.asarray(pivots, np.float64)
        self._order = np.ascontiguousarray(order, np.int64)
        self.nnz: int = self.n + len(self._data)

    def solve(self, b: NDArray[np.float64]) -> NDArray[np.float64]:
        """Solve ``A x = b``.

        Parameters
        ----------
        b : (n,) or (n, k) float64
            Right-hand sides.

        Returns
        -------
        same shape as ``b``, float64
            The solution, in a new array.

        Raises
        ------
        ValueError
            If ``b`` has another number of rows.
        """
        b = np.asarray(b, np.float64)
        if b.ndim not in (1, 2) or len(b) != self.n:
            raise ValueError(f"b must have shape ({self.n},) or ({self.n}, k), got {b.shape}")
        if self.n == 0 or b.size == 0:
            return b.copy()
        columns = np.ascontiguousarray(b.reshape(self.n, -1))
        x = np.empty_like(columns)
        solve = _solve_three if columns.shape[1] == 3 else _solve_many
        solve(self._indptr, self._indices, self._data, self._inverse_pivots, self._order, columns, x)
        return x.reshape(b.shape)


@nb.njit(nogil=True, cache=True, fastmath=True)
def _solve_three(indptr, indices, data, inverse_pivots, order, b, x):
    n = order.size
    work = np.empty((n, 3))
    for k in range(n):
        row = order[k]
        work[k, 0] = b[row, 0]
        work[k, 1] = b[row, 1]
        work[k, 2] = b[row, 2]
    for j in range(n):
        w0, w1, w2 = work[j, 0], work[j, 1], work[j, 2]
        for q in range(indptr[j], indptr[j + 1]):
            i = indices[q]
            value = data[q]
            work[i, 0] -= value * w0
            work[i, 1] -= value * w1
            work[i, 2] -= value * w2
    for j in range(n - 1, -1, -1):
        scale = inverse_pivots[j]
        w0, w1, w2 = work[j, 0] * scale, work[j, 1] * scale, work[j, 2] * scale
        for q in range(indptr[j], indptr[j + 1]):
            i = indices[q]
            value = data[q]
            w0 -= value * work[i, 0]
            w1 -= value * work[i, 1]
            w2 -= value * work[i, 2]
        work[j, 0] = w0
        work[j, 1] = w1
        work[j, 2] = w2
        row = order[j]
        x[row, 0] = w0
        x[row, 1] = w1
        x[row, 2] = w2


@nb.njit(nogil=True, cache=True, fastmath=True)
def _solve_many(indptr, indices, data, inverse_pivots, order, b, x):
    n = order.size
    n_columns = b.shape[1]
    work = np.empty((n, n_columns))
    for k in range(n):
        for c in range(n_columns):
            work[k, c] = b[order[k], c]
    for j in range(n):
        for q in range(indptr[j], indptr[j + 1]):
            i = indices[q]
            for c in range(n_columns):
                work[i, c] -= data[q] * work[j, c]
    for j in range(n - 1, -1, -1):
        for c in range(n_columns):
            work[j, c] *= inverse_pivots[j]
        for q in range(indptr[j], indptr[j + 1]):
            i = indices[q]
            for c in range(n_columns):
                work[j, c] -= data[q] * work[i, c]
        for c in range(n_columns):
            x[order[j], c] = work[j, c]
