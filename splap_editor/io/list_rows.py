"""Where the rows of a binary PLY element with lists begin: the one loop that goes from list to list."""

import numba as nb

SHORT, NEGATIVE = 1, 2
"""Why a row is none: the bytes end in it, or a list has less than no items."""


@nb.njit(nogil=True, cache=True)
def list_rows(data, start, sizes, lengths, is_signed, is_big_endian, offsets):
    """Find where the columns of rows begin.

    Parameters
    ----------
    data : (B,) uint8
    start : int
        Where the first row begins.
    sizes : (K,) int64
        Bytes of a number, or of an item of a list.
    lengths : (K,) int64
        Bytes that say how long a list is, 0 for a number.
    is_signed : (K,) bool
        Whether these are signed.
    is_big_endian : bool
    offsets : (R, K + 1) int64
        Filled; the last is the end of the row.

    Returns
    -------
    int, int
        The first row that is none and why, or -1 and 0.
    """
    place = start
    for row in range(offsets.shape[0]):
        for k in range(len(sizes)):
            offsets[row, k] = place
            count, width = 1, lengths[k]
            if width > 0:
                if place + width > len(data):
                    return row, SHORT
                count = 0
                for b in range(width):
                    count = count * 256 + nb.int64(data[place + (b if is_big_endian else width - 1 - b)])
                if is_signed[k] and count >= 1 << (8 * width - 1):
                    return row, NEGATIVE
                place += width
            place += count * sizes[k]
            if place > len(data):
                return row, SHORT
        offsets[row, len(sizes)] = place
    return -1, 0
