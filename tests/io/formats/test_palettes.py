"""Few values that stand for many: laws of the table of 256 numbers, and of the palette."""

import numpy as np
import pytest

from splap_editor.io.formats import bare_splats, palettes
from splap_editor.io.formats.palettes import codebook, palette


@pytest.mark.parametrize("low", [-1.0, 1e-45, 8388608.0, -3e38])
def test_two_neighbouring_numbers_keep_their_values(low):
    low = np.float32(low)
    values = np.array([low, np.nextafter(low, np.float32(np.inf))] * 5, np.float32)

    numbers, labels = codebook(values)

    np.testing.assert_array_equal(numbers[labels], values)


def test_the_ends_are_met_and_no_value_has_a_nearer_number():
    values = np.random.default_rng(0).normal(size=(400, 3)).astype(np.float32)

    numbers, labels = codebook(values)

    assert numbers[labels].min() == values.min()
    assert numbers[labels].max() == values.max()
    errors = np.abs(values[..., None] - numbers)
    np.testing.assert_allclose(np.abs(values - numbers[labels]), errors.min(axis=-1), atol=1e-6)


def test_a_palette_is_that_of_its_groups_however_many_rows_are_taken_at_a_time(monkeypatch):
    vectors = np.random.default_rng(1).normal(size=(900, 9)).astype(np.float32)
    entries, labels = palette(vectors, lambda share: None)
    for module in (bare_splats, palettes):
        monkeypatch.setattr(module, "BLOCK_ROWS", 37)
    shares: list[float] = []
    again, same = palette(vectors, shares.append)
    np.testing.assert_array_equal(labels, same)
    np.testing.assert_allclose(entries, again, atol=1e-7)
    assert shares == sorted(shares) and len(shares) > 200
    sizes = np.bincount(labels)
    # Halved nine times.
    assert len(entries) == 512 and sizes.min() >= 1 and sizes.max() <= 2
    for entry, rows in enumerate([np.flatnonzero(labels == k) for k in range(20)]):
        np.testing.assert_allclose(entries[entry], vectors[rows].mean(axis=0), atol=1e-6)
