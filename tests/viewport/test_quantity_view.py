"""A shown quantity: its range, histogram and colours agree with its values."""

import numpy as np
import pytest

from splap_editor.core.splats.occupancy import occupancy_ellipses
from splap_editor.engine.quantities import QUANTITIES, Snapshot
from splap_editor.io.ply import read_ply
from splap_editor.resources import resource
from splap_editor.viewport.colormaps import COLORMAPS
from splap_editor.viewport.quantity_view import QuantityOptions, shown_quantity, value_text


@pytest.fixture(scope="module")
def snapshot() -> Snapshot:
    splats = read_ply(resource("samples", "tube.ply")).splats
    return Snapshot(splats, occupancy_ellipses(splats))


@pytest.mark.parametrize("is_log", [False, True])
def test_every_splat_is_counted_once(snapshot, is_log):
    shown = shown_quantity(QuantityOptions("size", is_log=is_log), snapshot)
    assert shown.counts.sum() == np.isfinite(shown.values).sum()
    first, last = shown.edges[[0, -1]]
    assert shown.within(first, last).sum() == shown.counts.sum()
    assert (np.diff(shown.edges) > 0).all()


def test_a_bins_range_selects_what_it_counts(snapshot):
    shown = shown_quantity(QuantityOptions("size"), snapshot)
    inside = (shown.values >= shown.edges[10]) & (shown.values < shown.edges[30])
    assert inside.sum() == shown.counts[10:30].sum()


def test_values_past_the_ends_have_the_colours_of_the_ends(snapshot):
    values = QUANTITIES["size"].values(snapshot)
    low, high = np.quantile(values, (0.3, 0.6))
    shown = shown_quantity(QuantityOptions("size", "cividis", low=low, high=high), snapshot)
    assert (shown.tints[values <= low, :3] == COLORMAPS["cividis"][0]).all()
    assert (shown.tints[values >= high, :3] == COLORMAPS["cividis"][-1]).all()
    assert (shown.low, shown.high) == (low, high)


def test_no_change_is_in_the_middle_of_the_two_sided_map(snapshot):
    shown = shown_quantity(QuantityOptions("stretch", "purple-orange"), snapshot)
    assert shown.high - 1.0 == pytest.approx(1.0 - shown.low)
    middle = COLORMAPS["purple-orange"][127:129].astype(int)
    np.testing.assert_allclose(shown.tints[0, :3].astype(int), middle.mean(axis=0), atol=2)


def test_one_value_for_all_has_a_histogram_too(snapshot):
    shown = shown_quantity(QuantityOptions("displacement"), snapshot)
    assert shown.counts.sum() == snapshot.splats.n_splats and shown.counts.max() == snapshot.splats.n_splats


def test_a_logarithmic_scale_leaves_zeros_uncounted(snapshot):
    shown = shown_quantity(QuantityOptions("displacement", is_log=True), snapshot)
    assert shown.counts.sum() == 0 and len(shown.tints) == snapshot.splats.n_splats


def test_values_are_written_with_their_units():
    assert value_text(QUANTITIES["rotation"], 12.3456) == "12.35°"
    assert value_text(QUANTITIES["stretch"], 1.5) == "1.5 ×"
    assert value_text(QUANTITIES["component"], 1234.0) == "1,234"
    assert value_text(QUANTITIES["free"], 2.0) == "free"
    assert value_text(QUANTITIES["size"], np.nan) == "not defined"
