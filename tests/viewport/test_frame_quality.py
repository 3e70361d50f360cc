import numpy as np
import pytest

from splap_editor.viewport.contribution import Contribution, contribution
from splap_editor.viewport.frame_quality import MOST_COARSE, FrameQuality, QualityChooser
from splap_editor.viewport.glyphs import Glyphs


def order_of(n: int) -> Contribution:
    """Splats that all cover the same."""
    return Contribution(np.arange(n, dtype=np.int32), np.arange(1, n + 1, dtype=np.float32) / n)


def chosen_over_time(chooser, order, cost, n_frames=40):
    """What is chosen for each of many frames that cost as told."""
    chosen = []
    for _ in range(n_frames):
        chosen.append(chooser.choose(order))
        chooser.note(cost(chosen[-1]), chosen[-1])
    return chosen


def cost_of(*, alone=0.0, splat=0.0, picture=0.0, n=1):
    """Seconds of a frame: alone, for each splat, and for the pixels of a full picture."""
    return lambda quality: alone + splat * quality.n_drawn + picture * quality.n_drawn / n / quality.coarseness**2


@pytest.mark.parametrize("seed", range(20))
def test_a_machine_that_holds_the_target_is_never_degraded(seed):
    rng = np.random.default_rng(seed)
    order = order_of(1_000_000)
    costs = lambda quality: rng.uniform(0.001, 0.049)  # noqa: E731
    assert set(chosen_over_time(QualityChooser(), order, costs)) == {FrameQuality(1_000_000)}


def test_one_slow_frame_while_shaders_are_compiled_degrades_nothing_for_long():
    chooser, order = QualityChooser(), order_of(1_000_000)
    chooser.note(2.0, FrameQuality(1_000_000))
    chosen = chosen_over_time(chooser, order, cost_of(splat=1e-8, picture=0.002, n=1_000_000))
    assert set(chosen[20:]) == {FrameQuality(1_000_000)}


def test_where_pixels_are_dear_they_get_larger_and_no_splat_is_left_out():
    n = 90_000
    chosen = chosen_over_time(QualityChooser(), order_of(n), cost_of(alone=0.005, picture=0.12, n=n))
    assert {quality.n_drawn for quality in chosen} == {n}
    assert chosen[-1].coarseness == 2


def test_where_splats_are_dear_too_some_are_left_out_until_the_target_is_met():
    n = 1_000_000
    cost = cost_of(alone=0.01, splat=5e-7, picture=0.3, n=n)
    chosen = chosen_over_time(QualityChooser(), order_of(n), cost)
    assert all(cost(quality) <= 0.05 for quality in chosen[20:])
    # No more than the steps between qualities and the room against flicker ask for.
    assert cost(chosen[-1]) >= 0.5 * 0.05
    assert len(set(chosen[20:])) == 1


def test_leaving_out_splats_that_buys_no_time_is_taken_back():
    n = 1_000_000
    chosen = chosen_over_time(QualityChooser(), order_of(n), cost_of(alone=0.2, splat=1e-8, picture=0.001, n=n))
    assert chosen[-1].n_drawn == n


def test_enough_splats_to_be_recognised_and_pixels_not_too_large():
    chooser = QualityChooser(target_s=1e-9)
    chosen = chosen_over_time(chooser, order_of(90_000), cost_of(splat=1e-3))
    assert 20_000 <= chosen[-1].n_drawn < 30_000 and chosen[-1].coarseness == MOST_COARSE
    fine = chosen_over_time(QualityChooser(target_s=1e-9, scale=2.0), order_of(10_000), cost_of(picture=1e3))
    assert fine[-1] == FrameQuality(10_000, 2 * MOST_COARSE)


def test_what_is_drawn_is_what_gives_most_wherever_it_lies():
    rng = np.random.default_rng(0)
    n = 500
    u, v = rng.normal(size=(2, n, 3))
    glyphs = Glyphs(rng.normal(size=(n, 3)), u, v, np.zeros(n), np.ones(n))
    colors = rng.integers(1, 255, (n, 4)).astype(np.uint8)
    order = contribution(glyphs, colors)
    gives = colors[order.rows, 3] * np.linalg.norm(np.cross(u, v), axis=1)[order.rows]
    assert (np.diff(gives) <= 1e-5 * gives[0]).all()
    assert sorted(order.rows) == list(range(n))
    assert order.share(0) == 0.0 and order.share(n) == pytest.approx(1.0)


def test_splats_as_large_as_may_be_read_have_their_share_too():
    u, v = np.array([[1e30, 0.0, 0.0], [1e35, 0.0, 0.0]]), np.array([[0.0, 1e30, 0.0], [0.0, 1e35, 0.0]])
    order = contribution(Glyphs(np.zeros((2, 3)), u, v, np.zeros(2), np.ones(2)), np.full((2, 4), 255, np.uint8))
    assert list(order.rows) == [1, 0]
    assert order.share(1) == pytest.approx(1.0) and order.share(2) == 1.0
