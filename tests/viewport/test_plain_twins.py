"""Each loop that stands in uncompiled on the first start gives what the compiled one gives."""

import inspect

import numpy as np
import pytest

from splap_editor.core.splats import spherical_harmonics
from splap_editor.core.twofold_loop import TwofoldLoop
from splap_editor.viewport import depth_order, picking, regions, splat_actor

N = 400


def scene(rng):
    """Splats in front of a camera at the origin that looks along +z, as arrays of an actor."""
    means = rng.uniform([-1, -1, 2], [1, 1, 4], (N, 3)).astype(np.float32)
    axes_u, axes_v = (0.1 * rng.standard_normal((2, N, 3))).astype(np.float32)
    axes_u[:3] = 0.0
    shape = np.stack([np.zeros(N), rng.uniform(-0.1, 3.0, N).clip(0.0)], 1).astype(np.float32)
    colors = rng.integers(0, 256, (N, 4)).astype(np.uint8)
    flags = rng.integers(0, 8, N).astype(np.uint8)
    return means, axes_u, axes_v, shape, colors, flags


@pytest.mark.parametrize("seed", range(6))
def test_a_ray_meets_the_same_splats(seed):
    rng = np.random.default_rng(seed)
    target = rng.uniform([-0.5, -0.5, 2.5], [0.5, 0.5, 3.5])
    direction = tuple(np.float32(target / np.linalg.norm(target)))
    arguments = (*scene(rng), np.float32(1.5), 20, tuple(np.zeros(3, np.float32)), direction)
    found = []
    for loop in (picking.ray_hits.compiled, picking.ray_hits.plain):
        rows, hits = np.full(N, -1), np.zeros((N, 2), np.float32)
        count = loop(*arguments, rows, hits)
        found.append((rows[:count], hits[:count]))
    assert len(found[0][0]) > 3
    np.testing.assert_array_equal(found[0][0], found[1][0])
    # Single precision, summed in another order; a ray that grazes a splat cancels most digits.
    np.testing.assert_allclose(found[0][1], found[1][1], rtol=1e-3, atol=1e-4)
    rows, hits = np.empty(2, np.int64), np.empty((2, 2), np.float32)
    assert picking.ray_hits.plain(*arguments, rows, hits) == len(found[0][0]), "how many there are, whatever has room"
    np.testing.assert_array_equal(rows, found[0][0][:2])


def test_tints_mix_to_the_same_bytes():
    colors, tints = np.random.default_rng(2).integers(0, 256, (2, 4 * N, 4)).astype(np.uint8)
    colors[:9], tints[:9, 3] = 255, 0
    mixed = np.zeros((2, 4 * N, 4), np.uint8)
    splat_actor.mix_colors.compiled(colors, tints, mixed[0])
    splat_actor.mix_colors.plain(colors, tints, mixed[1])
    np.testing.assert_array_equal(*mixed)


@pytest.mark.parametrize("is_perspective", [True, False])
def test_centres_fall_on_the_same_pixels(is_perspective):
    means, _, _, _, colors, flags = scene(np.random.default_rng(4))
    means[::9, 2] *= -1.0
    clip = np.eye(4, dtype=np.float32)
    if is_perspective:
        clip[3] = [0, 0, 1, 0]
    screens = np.zeros((2, N, 3), np.float32)
    for loop, screen in zip((regions.project.compiled, regions.project.plain), screens, strict=True):
        loop(means, colors, flags, 50, clip, np.float32(90), np.float32(60), screen)
    assert 9 < np.isnan(screens[0, :, 0]).sum() < N
    np.testing.assert_allclose(*screens, rtol=1e-4)


@pytest.mark.parametrize("n_points", [1, 2, 30])
def test_a_stroke_takes_the_same_points(n_points):
    rng = np.random.default_rng(0)
    screen = rng.uniform(0, 100, (N, 3)).astype(np.float32)
    screen[::10] = np.nan
    path = np.cumsum(rng.uniform(-8, 8, (n_points, 2)), axis=0) + 50
    inside = np.ones((2, N), bool)
    regions.near_path.compiled(screen, path, 15.0, inside[0])
    regions.near_path.plain(screen, path, 15.0, inside[1])
    assert inside[0].any() and not inside[0].all()
    np.testing.assert_array_equal(*inside)


@pytest.mark.parametrize("is_perspective", [True, False])
def test_the_depth_grid_is_the_same(is_perspective):
    rng = np.random.default_rng(1)
    means, axes_u, axes_v, shape, colors, flags = scene(rng)
    clip = np.eye(4, dtype=np.float32)
    if is_perspective:
        clip[3] = [0, 0, 1, 0]
    screen = np.empty((N, 3), np.float32)
    size = np.array([90, 60], np.float32)
    regions.project(means, colors, flags, 10, clip, *size, screen)
    arguments = (screen, axes_u, axes_v, shape, colors, clip, size, np.float32(1.0), np.float32(1.2), 30)
    grids = np.full((2, 15, 20), np.inf, np.float32)
    for loop, grid in zip((regions.depth_grid.compiled, regions.depth_grid.plain), grids, strict=True):
        loop(*arguments, np.float32(10.0), np.float32(8.0), grid)
    covered = np.isfinite(grids[0])
    assert covered.sum() > 50
    # A cell whose centre lies on the rim of an ellipse may fall to either side.
    np.testing.assert_allclose(grids[0], grids[1], rtol=1e-4)


@pytest.mark.parametrize("degree", range(5))
def test_a_view_has_the_same_colours(degree):
    rng = np.random.default_rng(degree)
    K = (degree + 1) ** 2 - 1
    sh0, shN = rng.standard_normal((N, 3)).astype(np.float32), rng.standard_normal((N, K, 3)).astype(np.float32)
    rotations = np.linalg.qr(rng.standard_normal((N, 3, 3)))[0]
    positions = rng.standard_normal((N, 3))
    positions[0] = camera = rng.standard_normal(3)
    colors = np.empty((2, N, 3), np.float32)
    loop = spherical_harmonics.write_view_colors
    for each, into in zip((loop.compiled, loop.plain), colors, strict=True):
        each(sh0, shN, positions, rotations, camera, degree, into)
    # The compiled loop sums in single precision.
    np.testing.assert_allclose(*colors, atol=2e-5)


@pytest.mark.parametrize("spoil", [0.0, 3e38, np.inf, -np.inf, np.nan])
def test_the_order_is_the_same(spoil):
    means = np.random.default_rng(3).standard_normal((5000, 3)).astype(np.float32)
    means[::7] = means[0]
    direction = np.array([0.1, 0.2, -0.9], np.float32)
    orders = np.full((2, len(means)), -1, np.int32)
    loop = depth_order.counting_sort
    for each, order in zip((loop.compiled, loop.plain), orders, strict=True):
        each(means, direction, order)
    depths = [means[order] @ direction for order in orders]
    bin_width = np.ptp(means @ direction) / ((1 << 16) - 1)
    # Splats of one bin may be told apart by the last digit of their depth.
    np.testing.assert_allclose(*depths, atol=1.01 * bin_width)
    if spoil:
        means[3] = spoil
        loop.plain(means, direction, orders[1])
        np.testing.assert_array_equal(np.sort(orders[1]), np.arange(len(means)))


def test_a_loop_and_its_twin_take_the_same_arguments():
    loops = [
        depth_order.counting_sort,
        picking.ray_hits,
        regions.near_path,
        regions.depth_grid,
        spherical_harmonics.write_view_colors,
    ]
    for loop in loops:
        assert inspect.signature(loop.compiled.py_func) == inspect.signature(loop.plain)


def test_the_twin_stands_in_only_until_the_loops_are_compiled():
    loop = TwofoldLoop(lambda x: ("compiled", x), lambda x: ("plain", x))
    assert loop(1) == ("compiled", 1)
    try:
        TwofoldLoop.use_compiled(False)
        assert loop(2) == ("plain", 2)
    finally:
        TwofoldLoop.use_compiled(True)
