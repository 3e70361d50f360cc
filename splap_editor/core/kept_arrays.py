"""Arrays that were kept elsewhere, and are looked at before compiled loops follow them."""

import numpy as np
from numpy.typing import NDArray

Arrays = dict[str, NDArray]


class CacheEntryError(ValueError):
    """An entry whose arrays are not what they should be."""


def require_rows(kept: Arrays, name: str, n_rows: int, n_columns: int) -> None:
    """Check compressed sparse rows ``name_indptr`` and ``name_indices`` before compiled loops follow them.

    Raises
    ------
    CacheEntryError
        If they are not ``n_rows`` rows of columns 0 to ``n_columns - 1``.
    """
    indptr, indices = kept[f"{name}_indptr"], kept[f"{name}_indices"]
    require_array(indptr, f"{name}_indptr", (n_rows + 1,), np.int32)
    require_array(indices, f"{name}_indices", (None,), np.int32, (0, n_columns))
    if indptr[0] != 0 or indptr[-1] != len(indices) or (np.diff(indptr) < 0).any():
        raise CacheEntryError(f"{name}_indptr does not part {name}_indices into rows")


def require_array(
    array: NDArray,
    name: str,
    shape: tuple[int | None, ...],
    dtype: type[np.generic],
    span: tuple[int, int] | None = None,
) -> None:
    """Check shape, type and values of an array from the cache.

    Parameters
    ----------
    array : array
    name : str
        What to call it.
    shape : tuple of int or None
        None for any number.
    dtype : type
        Its type, to the bit.
    span : (int, int), optional
        Least value and the first that is too large; without it all must be finite.

    Raises
    ------
    CacheEntryError
        If it is not so.
    """
    fits = array.ndim == len(shape) and all(
        want is None or want == got for want, got in zip(shape, array.shape, strict=True)
    )
    if not fits or array.dtype != dtype:
        raise CacheEntryError(f"{name} has shape {array.shape} and type {array.dtype}")
    if span is None:
        is_fine = bool(np.isfinite(array).all())
    else:
        is_fine = not array.size or (array.min() >= span[0] and array.max() < span[1])
    if not is_fine:
        raise CacheEntryError(f"{name} has values out of range")
