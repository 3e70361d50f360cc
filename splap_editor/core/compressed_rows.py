"""Rows of compressed arrays: gathered, and put in place of others, without touching the rest."""

import numpy as np
from numpy.typing import NDArray


def gathered(
    indptr: NDArray[np.integer], which: NDArray[np.integer]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.integer]]:
    """Find where the entries of some rows stand.

    Parameters
    ----------
    indptr : (n + 1,) int
        Starts of n rows.
    which : (m,) int
        Rows.

    Returns
    -------
    starts : (m + 1,) int64
        Starts of the rows in ``places``.
    places : (e,) int64
        Of each entry of the rows, one row after the other.
    owners : (e,) int
        Row that each is of.
    """
    starts, places = run_places(indptr[which], indptr[np.asarray(which) + 1])
    return starts, places, np.repeat(which, np.diff(starts))


def run_places(firsts: NDArray[np.integer], ends: NDArray[np.integer]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """(m + 1,) starts of runs, and the places in them: from each of ``firsts`` (m,) to before its end."""
    firsts = firsts.astype(np.int64)
    counts = ends - firsts
    starts = np.concatenate([np.zeros(1, np.int64), np.cumsum(counts)])
    return starts, np.arange(starts[-1]) + np.repeat(firsts - starts[:-1], counts)


def with_rows(
    indptr: NDArray[np.integer],
    arrays: tuple[NDArray, ...],
    which: NDArray[np.integer],
    new_starts: NDArray[np.integer],
    new_arrays: tuple[NDArray, ...],
) -> tuple[NDArray[np.int32], tuple[NDArray, ...]]:
    """Put other entries in place of those of some rows.

    Parameters
    ----------
    indptr : (n + 1,) int
        Starts of n rows.
    arrays : tuple of (nnz, …) arrays
        Entries.
    which : (m,) int
        Rows, ascending, each once.
    new_starts : (m + 1,) int
        Starts of these rows in ``new_arrays``.
    new_arrays : tuple of (e, …) arrays
        Their new entries, one array for each of ``arrays`` and of its type.

    Returns
    -------
    indptr : (n + 1,) int32
    arrays : tuple of arrays
        Of the same types as those given.
    """
    counts = np.diff(indptr)
    counts[which] = np.diff(new_starts)
    starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
    firsts, ends = indptr[which], indptr[np.asarray(which) + 1]
    return starts, tuple(
        with_runs(old, firsts, ends, new, new_starts) for old, new in zip(arrays, new_arrays, strict=True)
    )


def with_runs(
    old: NDArray,
    firsts: NDArray[np.integer],
    ends: NDArray[np.integer],
    new: NDArray,
    new_starts: NDArray[np.integer],
) -> NDArray:
    """Put runs of one array in place of runs of another.

    Parameters
    ----------
    old : (nnz, …) array
    firsts, ends : (m,) int
        First and last + 1 of each run that goes; none overlaps the one before.
    new : (e, …) array
    new_starts : (m + 1,) int
        Starts of the runs that come.
    """
    # What lies between two runs is copied as one piece: as quick as memory, however few runs there are.
    borders = np.concatenate([[0], ends]).tolist(), np.concatenate([firsts, [len(old)]]).tolist()
    bounds = new_starts.tolist()
    parts = [old[: borders[1][0]]]
    for run in range(len(firsts)):
        parts.append(new[bounds[run] : bounds[run + 1]])
        parts.append(old[borders[0][run + 1] : borders[1][run + 1]])
    return np.concatenate(parts)
