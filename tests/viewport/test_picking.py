from itertools import pairwise

import numpy as np
import pytest

from splap_editor.viewport.glyphs import Glyphs
from splap_editor.viewport.picking import surface_hit
from splap_editor.viewport.regions import in_brush, in_lasso, in_rectangle
from splap_editor.viewport.splat_actor import DisplayMode, SplatFlag, SplatLook
from tests.reference.rasterizer import ellipses_picture
from tests.viewport.canvas import BACKGROUND, canvas, random_splats

pytestmark = pytest.mark.usefixtures("no_leaked_vtk")
SIZE = (120, 90)


def reference_rows(viewport, glyphs, rgba):
    return ellipses_picture(
        viewport.projection, glyphs.means, glyphs.axes_u, glyphs.axes_v, glyphs.cutoffs, rgba[:, :3], BACKGROUND
    )[1]


@pytest.mark.parametrize("is_parallel", [False, True])
@pytest.mark.parametrize("is_sheared", [False, True])
def test_pick_equals_brute_force(is_parallel, is_sheared):
    glyphs, rgba = random_splats(150, is_sheared=is_sheared)
    with canvas(glyphs, rgba, SIZE) as viewport:
        viewport.camera.set_parallel(is_parallel)
        viewport.splats.look = SplatLook(DisplayMode.ELLIPSES)
        viewport.camera.fit_clipping(viewport.splats.bounds())
        rows = reference_rows(viewport, glyphs, rgba)
        assert len(np.unique(rows[::3, ::3])) > 20, "there is something to hit, and something to miss"
        for y in range(0, SIZE[1], 3):
            for x in range(0, SIZE[0], 3):
                hit = viewport.pick(x + 0.5, y + 0.5)
                assert (hit.row if hit else -1) == rows[y, x]


def test_hit_lies_on_the_ellipse_and_faces_the_eye():
    glyphs, rgba = random_splats(150)
    with canvas(glyphs, rgba, SIZE) as viewport:
        viewport.splats.look = SplatLook(DisplayMode.ELLIPSES)
        hit = viewport.pick(60.5, 45.5)
        u, v = glyphs.axes_u[hit.row], glyphs.axes_v[hit.row]
        # The buffers are float32.
        assert abs((hit.point - glyphs.means[hit.row]) @ hit.normal) < 1e-5
        assert abs(hit.normal @ u) < 1e-6 and abs(hit.normal @ v) < 1e-6
        assert hit.normal @ viewport.projection.direction < 0
        np.testing.assert_allclose(viewport.projection.pixel(hit.point), [60.5, 45.5], atol=1e-3)


def test_pick_looks_through_hidden_and_faint_splats():
    glyphs, rgba = random_splats(150)
    with canvas(glyphs, rgba, SIZE) as viewport:
        viewport.splats.look = SplatLook(DisplayMode.ELLIPSES)
        seen = []
        while (hit := viewport.pick(60.5, 45.5)) is not None:
            seen.append(hit.row)
            flags = np.zeros(150, np.uint8)
            flags[seen] = SplatFlag.HIDDEN
            viewport.splats.set_flags(flags)
        assert len(set(seen)) == len(seen) > 1
        viewport.splats.set_flags(np.zeros(150, np.uint8))
        viewport.splats.look = SplatLook(DisplayMode.ELLIPSES, opacity_cut=0.6)
        assert rgba[viewport.pick(60.5, 45.5).row, 3] >= 0.6 - 0.5 / 255.0


def stack(opacities):
    """Discs one behind the other along -y, seen from the front."""
    n = len(opacities)
    means = np.column_stack([np.zeros(n), np.linspace(-0.5, 0.5, n), np.zeros(n)])
    u, v = np.tile([0.3, 0.0, 0.0], (n, 1)), np.tile([0.0, 0.0, 0.3], (n, 1))
    rgba = np.column_stack([np.full((n, 3), 0.5), opacities])
    return Glyphs(means, u, v, np.zeros(n), np.full(n, 3.0)), rgba


def test_blended_pick_takes_the_splat_that_stops_half_of_the_light():
    glyphs, rgba = stack([0.1, 0.2, 0.6, 1.0])
    with canvas(glyphs, rgba, SIZE) as viewport:
        viewport.camera.view = viewport.camera.look_from([0.0, -1.0, 0.0])
        viewport.splats.mode = DisplayMode.SPLATS
        assert viewport.pick(60, 45).row == 2
        viewport.splats.look = SplatLook(DisplayMode.ELLIPSES)
        assert viewport.pick(60, 45).row == 0


def test_blended_pick_of_thin_haze_takes_what_shows_most():
    glyphs, rgba = stack([0.05, 0.2, 0.1])
    with canvas(glyphs, rgba, SIZE) as viewport:
        viewport.camera.view = viewport.camera.look_from([0.0, -1.0, 0.0])
        viewport.splats.mode = DisplayMode.SPLATS
        assert viewport.pick(60, 45).row == 1


def test_nothing_under_the_cursor_is_none():
    glyphs, rgba = stack([1.0])
    with canvas(glyphs, rgba, SIZE) as viewport:
        assert viewport.pick(1, 1) is None
    with canvas(size=SIZE) as viewport:
        assert viewport.pick(60, 45) is None


def test_screen_points_are_the_projection_and_nan_where_not_drawn():
    glyphs, rgba = random_splats(100)
    with canvas(glyphs, rgba, SIZE) as viewport:
        viewport.splats.look = SplatLook(DisplayMode.ELLIPSES)
        viewport.splats.set_flags(np.where(np.arange(100) < 10, SplatFlag.HIDDEN, 0).astype(np.uint8))
        screen = viewport.screen_points()
        # float32 in pixels.
        np.testing.assert_allclose(screen[10:, :2], viewport.projection.pixels(glyphs.means[10:]), atol=1e-3)
        np.testing.assert_allclose(screen[10:, 2], viewport.projection.depths(glyphs.means[10:]), atol=1e-5)
        assert np.isnan(screen[:10]).all()


def screen_cloud():
    rng = np.random.default_rng(3)
    screen = np.empty((2000, 3), np.float32)
    screen[:, :2] = rng.uniform(-20, 140, (2000, 2))
    screen[:, 2] = 1.0
    screen[::50] = np.nan
    return screen


def test_rectangle_takes_corners_in_any_order():
    screen = screen_cloud()
    expected = (screen[:, 0] >= 10) & (screen[:, 0] <= 90) & (screen[:, 1] >= 20) & (screen[:, 1] <= 60)
    np.testing.assert_array_equal(in_rectangle(screen, 10, 20, 90, 60), expected)
    np.testing.assert_array_equal(in_rectangle(screen, 90, 60, 10, 20), expected)


def test_lasso_is_even_odd_to_a_pixel():
    screen = screen_cloud()
    star = 60 + 50 * np.array([[np.cos(a), np.sin(a)] for a in 4 * np.pi / 5 * np.arange(5)])
    inside = in_lasso(screen, star)
    n_told = 0
    for i in range(0, 2000, 7):
        x, y = screen[i, :2]
        ends = zip(star, np.roll(star, -1, axis=0), strict=True)
        crossings = sum(
            (a[1] <= y) != (b[1] <= y) and x < a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]) for a, b in ends
        )
        edge = np.roll(star, -1, axis=0) - star
        normal = np.stack([-edge[:, 1], edge[:, 0]], 1) / np.linalg.norm(edge, axis=1, keepdims=True)
        if np.abs(np.sum((screen[i, :2] - star) * normal, axis=1)).min() > 1.5:
            assert inside[i] == (crossings % 2 == 1)
            n_told += 1
    assert n_told > 200 and inside.any()
    assert not inside[::50].any()


def test_lasso_of_two_points_holds_nothing_and_odd_shapes_are_rejected():
    assert not in_lasso(screen_cloud(), [[0, 0], [50, 50]]).any()
    with pytest.raises(ValueError, match=r"\(K, 2\)"):
        in_lasso(screen_cloud(), np.zeros((4, 3)))


def test_brush_is_the_distance_to_the_stroke():
    screen = screen_cloud()
    path = np.array([[10.0, 10.0], [80.0, 30.0], [60.0, 90.0]])
    near = np.full(2000, np.inf)
    for a, b in pairwise(path):
        t = np.clip((screen[:, :2] - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
        near = np.fmin(near, np.linalg.norm(screen[:, :2] - a - t[:, None] * (b - a), axis=1))
    np.testing.assert_array_equal(in_brush(screen, path, 12.0), near <= 12.0)
    one = np.linalg.norm(screen[:, :2] - path[0], axis=1) <= 12.0
    np.testing.assert_array_equal(in_brush(screen, path[0], 12.0), one)


@pytest.mark.parametrize("is_parallel", [False, True])
@pytest.mark.parametrize("mode", list(DisplayMode))
def test_visible_only_keeps_the_front_of_two_sheets(mode, is_parallel):
    grid = np.stack(np.meshgrid(np.linspace(-1, 1, 21), np.linspace(-1, 1, 21)), -1).reshape(-1, 2)
    n = len(grid)
    means = np.vstack([np.column_stack([grid[:, 0], np.full(n, y), grid[:, 1]]) for y in (-0.5, 0.5)])
    u, v = np.tile([0.12, 0.0, 0.0], (2 * n, 1)), np.tile([0.0, 0.0, 0.12], (2 * n, 1))
    glyphs = Glyphs(means, u, v, np.zeros(2 * n), np.full(2 * n, 2.0))
    with canvas(glyphs, np.full((2 * n, 4), 0.9)) as viewport:
        viewport.camera.set_parallel(is_parallel)
        viewport.camera.view = viewport.camera.look_from([0.0, -1.0, 0.0])
        viewport.splats.look = SplatLook(mode)
        screen = viewport.screen_points()
        inside = in_rectangle(screen, 60, 40, 180, 140)
        visible = viewport.visible_only(screen, inside)
        assert inside[:n].any() and inside[n:].any()
        np.testing.assert_array_equal(visible[:n], inside[:n])
        assert not visible[n:].any()


def test_surface_hit_at_an_edge_on_splat_is_none():
    glyphs, rgba = stack([1.0])
    with canvas(glyphs, rgba, SIZE) as viewport:
        viewport.splats.look = SplatLook(DisplayMode.ELLIPSES)
        viewport.camera.view = viewport.camera.look_from([0.0, 0.0, 1.0])
        assert surface_hit(viewport.splats.deformed, viewport.projection, 30.0, 10.0) is None
