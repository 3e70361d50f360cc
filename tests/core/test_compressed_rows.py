"""Rows put in place of others leave all the rest as it is."""

import numpy as np
import pytest

from splap_editor.core.compressed_rows import gathered, with_rows


def compressed(rows: list[list[int]]) -> tuple[np.ndarray, np.ndarray]:
    counts = [len(row) for row in rows]
    return np.concatenate([[0], np.cumsum(counts)]).astype(np.int32), np.array(
        [entry for row in rows for entry in row], np.int32
    )


ROWS = [[3, 4], [], [7], [1, 2, 5], [], [9]]


@pytest.mark.parametrize(
    "asked, new",
    [([1, 3], [[6, 8], []]), ([0, 1, 2, 3, 4, 5], [[], [], [1], [2], [3], [4, 4]]), ([5], [[]]), ([], [])],
)
def test_rows_are_replaced_and_the_others_stay(asked, new):
    starts, values = compressed(ROWS)
    new_starts, new_values = compressed(new)
    rows = np.array(asked, np.int64)
    arrays = (values, 0.5 * values)
    found_starts, (found, halves) = with_rows(starts, arrays, rows, new_starts, (new_values, 0.5 * new_values))
    expected = list(ROWS)
    for row, entries in zip(asked, new, strict=True):
        expected[row] = entries
    for made, wanted in zip((found_starts, found), compressed(expected), strict=True):
        np.testing.assert_array_equal(made, wanted)
        assert made.dtype == wanted.dtype
    np.testing.assert_array_equal(halves, 0.5 * found)


def test_entries_of_rows_are_gathered_in_the_order_asked_for():
    starts, values = compressed(ROWS)
    found_starts, places, owners = gathered(starts, np.array([3, 1, 0]))
    assert values[places].tolist() == [1, 2, 5, 3, 4]
    assert owners.tolist() == [3, 3, 3, 0, 0] and found_starts.tolist() == [0, 3, 3, 5]
