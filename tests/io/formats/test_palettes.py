"""Few values that stand for many: laws of the table of 256 numbers."""

import numpy as np
import pytest

from splap_editor.io.formats.palettes import codebook


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
