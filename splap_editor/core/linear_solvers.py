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
    over columns, three right-hand sides and up to four columns at a time.

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
        self.nnz = 0
        if self.n == 0:
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
        factor.sort_indices()
        # Unsigned, so that compiled loops need not ask whether an index counts from the end: 40 % of a solve's time.
        self._indptr = factor.indptr.astype(np.uint32)
        self._indices = factor.indices.astype(np.uint32)
        self._data = np.ascontiguousarray(factor.data, np.float64)
        self._inverse_pivots = 1.0 / np.asarray(pivots, np.float64)
        self._order = np.ascontiguousarray(order, np.uint32)
        self._groups = _column_groups(self._indptr, self._indices)
        self.nnz = self.n + len(self._data)

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
        factor = self._indptr, self._indices, self._data, self._inverse_pivots, self._order
        if columns.shape[1] == 3:
            _solve_three(self._groups, *factor, columns, x)
        else:
            _solve_many(*factor, columns, x)
        return x.reshape(b.shape)


@nb.njit(nogil=True, cache=True)
def _column_groups(indptr, indices):
    """First columns of runs of one or four neighbours with the same pattern below them, and n at the end.

    Fill makes most of the factor consist of such runs; taken four at a time their row numbers are read once.
    """
    n = indptr.size - 1
    starts = np.empty(n + 1, np.uint32)
    count = 0
    j = 0
    while j < n:
        starts[count] = j
        count += 1
        width = 1
        while width < 4 and j + width < n:
            first, second = indptr[j + width - 1], indptr[j + width]
            length = indptr[j + width + 1] - second
            if second - first != length + 1 or indices[first] != j + width:
                break
            q = 0
            while q < length and indices[first + 1 + q] == indices[second + q]:
                q += 1
            if q < length:
                break
            width += 1
        j += 4 if width == 4 else 1
    starts[count] = n
    return starts[: count + 1].copy()


@nb.njit(nogil=True, cache=True, fastmath=True)
def _solve_three(groups, indptr, indices, data, inverse_pivots, order, b, x):
    """Solve for three right-hand sides, groups of like columns of the factor at a time."""
    n = order.size
    work = np.empty((n, 3))
    for k in range(n):
        row = order[k]
        work[k, 0] = b[row, 0]
        work[k, 1] = b[row, 1]
        work[k, 2] = b[row, 2]
    for g in range(groups.size - 1):
        j = groups[g]
        if groups[g + 1] - j == 4:
            _forward_four(j, indptr, indices, data, work)
            continue
        w0, w1, w2 = work[j, 0], work[j, 1], work[j, 2]
        for q in range(indptr[j], indptr[j + 1]):
            i = indices[q]
            value = data[q]
            work[i, 0] -= value * w0
            work[i, 1] -= value * w1
            work[i, 2] -= value * w2
    for g in range(groups.size - 2, -1, -1):
        j = groups[g]
        if groups[g + 1] - j == 4:
            _backward_four(j, indptr, indices, data, inverse_pivots, work)
            continue
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
    for k in range(n):
        row = order[k]
        x[row, 0] = work[k, 0]
        x[row, 1] = work[k, 1]
        x[row, 2] = work[k, 2]


@nb.njit(nogil=True, cache=True, fastmath=True)
def _forward_four(j, indptr, indices, data, work):
    """Eliminate columns j to j + 3, which share their rows from j + 4 on."""
    p, q, r, s = indptr[j], indptr[j + 1], indptr[j + 2], indptr[j + 3]
    n_rows = indptr[j + 4] - s
    a0, a1, a2 = work[j, 0], work[j, 1], work[j, 2]
    u = data[p]
    b0, b1, b2 = work[j + 1, 0] - u * a0, work[j + 1, 1] - u * a1, work[j + 1, 2] - u * a2
    u, v = data[p + 1], data[q]
    c0 = work[j + 2, 0] - u * a0 - v * b0
    c1 = work[j + 2, 1] - u * a1 - v * b1
    c2 = work[j + 2, 2] - u * a2 - v * b2
    u, v, t = data[p + 2], data[q + 1], data[r]
    d0 = work[j + 3, 0] - u * a0 - v * b0 - t * c0
    d1 = work[j + 3, 1] - u * a1 - v * b1 - t * c1
    d2 = work[j + 3, 2] - u * a2 - v * b2 - t * c2
    work[j + 1, 0], work[j + 1, 1], work[j + 1, 2] = b0, b1, b2
    work[j + 2, 0], work[j + 2, 1], work[j + 2, 2] = c0, c1, c2
    work[j + 3, 0], work[j + 3, 1], work[j + 3, 2] = d0, d1, d2
    for m in range(n_rows):
        i = indices[s + m]
        u, v, t, z = data[p + 3 + m], data[q + 2 + m], data[r + 1 + m], data[s + m]
        work[i, 0] -= u * a0 + v * b0 + t * c0 + z * d0
        work[i, 1] -= u * a1 + v * b1 + t * c1 + z * d1
        work[i, 2] -= u * a2 + v * b2 + t * c2 + z * d2


@nb.njit(nogil=True, cache=True, fastmath=True)
def _backward_four(j, indptr, indices, data, inverse_pivots, work):
    """Substitute back into rows j to j + 3, which share their columns from j + 4 on."""
    p, q, r, s = indptr[j], indptr[j + 1], indptr[j + 2], indptr[j + 3]
    n_rows = indptr[j + 4] - s
    u, v, t, z = inverse_pivots[j], inverse_pivots[j + 1], inverse_pivots[j + 2], inverse_pivots[j + 3]
    a0, a1, a2 = u * work[j, 0], u * work[j, 1], u * work[j, 2]
    b0, b1, b2 = v * work[j + 1, 0], v * work[j + 1, 1], v * work[j + 1, 2]
    c0, c1, c2 = t * work[j + 2, 0], t * work[j + 2, 1], t * work[j + 2, 2]
    d0, d1, d2 = z * work[j + 3, 0], z * work[j + 3, 1], z * work[j + 3, 2]
    for m in range(n_rows):
        i = indices[s + m]
        u, v, t, z = data[p + 3 + m], data[q + 2 + m], data[r + 1 + m], data[s + m]
        w0, w1, w2 = work[i, 0], work[i, 1], work[i, 2]
        a0 -= u * w0
        a1 -= u * w1
        a2 -= u * w2
        b0 -= v * w0
        b1 -= v * w1
        b2 -= v * w2
        c0 -= t * w0
        c1 -= t * w1
        c2 -= t * w2
        d0 -= z * w0
        d1 -= z * w1
        d2 -= z * w2
    t = data[r]
    c0, c1, c2 = c0 - t * d0, c1 - t * d1, c2 - t * d2
    u, v = data[q], data[q + 1]
    b0, b1, b2 = b0 - u * c0 - v * d0, b1 - u * c1 - v * d1, b2 - u * c2 - v * d2
    u, v, t = data[p], data[p + 1], data[p + 2]
    a0, a1, a2 = a0 - u * b0 - v * c0 - t * d0, a1 - u * b1 - v * c1 - t * d1, a2 - u * b2 - v * c2 - t * d2
    work[j, 0], work[j, 1], work[j, 2] = a0, a1, a2
    work[j + 1, 0], work[j + 1, 1], work[j + 1, 2] = b0, b1, b2
    work[j + 2, 0], work[j + 2, 1], work[j + 2, 2] = c0, c1, c2
    work[j + 3, 0], work[j + 3, 1], work[j + 3, 2] = d0, d1, d2


@nb.njit(nogil=True, cache=True, fastmath=True)
def _solve_many(indptr, indices, data, inverse_pivots, order, b, x):
    """Solve for any number of right-hand sides, column by column of the factor."""
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
