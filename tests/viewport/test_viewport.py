from dataclasses import replace

import numpy as np
import pytest
from vtkmodules.vtkRenderingCore import vtkRenderer

from splap_editor.viewport.edge_lines import edges_within_hops
from splap_editor.viewport.gizmo_parts import DOT
from splap_editor.viewport.overlays import Mark, circle
from splap_editor.viewport.screenshot import screenshot
from splap_editor.viewport.splat_actor import DisplayMode, SplatLook
from splap_editor.viewport.splat_scene import Compare
from splap_editor.viewport.viewport import Viewport
from tests.reference.rasterizer import psnr
from tests.viewport.canvas import BACKGROUND, VIEW, canvas, drawn, random_splats

pytestmark = pytest.mark.usefixtures("no_leaked_vtk")


def test_changes_ask_for_frames_and_never_draw_them():
    glyphs, rgba = random_splats(20)
    with canvas(glyphs, rgba) as viewport:
        drawn(viewport)
        frames, asked = [], []
        viewport.renderer.AddObserver("StartEvent", lambda *_: frames.append(1))
        viewport.request_render = viewport.splats.request_render = lambda: asked.append(1)
        changes = [
            lambda: viewport.splats.move(glyphs.means, glyphs.axes_u, glyphs.axes_v),
            lambda: viewport.splats.set_flags(np.ones(20, np.uint8)),
            lambda: viewport.splats.set_colors(np.zeros((20, 4), np.uint8)),
            lambda: viewport.splats.set_tints(None),
            lambda: viewport.show_disc([1, 2]),
            lambda: setattr(viewport.splats, "mode", DisplayMode.POINTS),
            lambda: setattr(viewport.splats, "compare", Compare.BOTH),
            lambda: viewport.set_background((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)),
            viewport.camera_moved,
            viewport.gizmo_changed,
            viewport.reset_camera,
        ]
        for change in changes:
            before = len(asked)
            change()
            assert len(asked) > before
        assert not frames
        drawn(viewport)
        assert len(frames) == 1


def test_host_is_told_when_the_view_turns_and_not_when_it_rests():
    glyphs, rgba = random_splats(20)
    with canvas(glyphs, rgba) as viewport:
        told = []
        viewport.splats.view_turned = told.append
        drawn(viewport)
        drawn(viewport)
        assert len(told) == 1
        viewport.camera.orbit(0.2, 0.0)
        drawn(viewport)
        assert len(told) == 1
        viewport.camera.orbit(5.0, 0.0)
        drawn(viewport)
        assert len(told) == 2
        np.testing.assert_allclose(told[-1].direction, viewport.projection.direction)


def test_screenshot_is_the_picture_on_the_screen_at_its_size():
    glyphs, rgba = random_splats(100)
    with canvas(glyphs, rgba) as viewport:
        viewport.splats.mode = DisplayMode.SPLATS
        np.testing.assert_allclose(screenshot(viewport, 240, 180)[..., :3] / 255.0, drawn(viewport), atol=1e-9)
        assert screenshot(viewport, 333, 97).shape == (97, 333, 4)
        # The window on the screen goes on as before.
        drawn(viewport)


def test_transparent_screenshot_over_a_colour_is_the_picture_on_it():
    glyphs, rgba = random_splats(100)
    with canvas(glyphs, rgba) as viewport:
        viewport.splats.mode = DisplayMode.SPLATS
        pixels = screenshot(viewport, 240, 180, is_transparent=True) / 255.0
        alpha = pixels[..., 3:]
        assert alpha.min() == 0.0
        over = pixels[..., :3] * alpha + (1.0 - alpha) * BACKGROUND
        # Both are rounded to bytes at each of many layers.
        assert psnr(over, drawn(viewport)) > 40.0


def test_screenshot_refuses_sizes_no_card_can_draw():
    with canvas() as viewport, pytest.raises(ValueError, match="16384"):
        screenshot(viewport, 0, 100)


def test_an_empty_viewport_draws_its_background():
    with canvas() as viewport:
        np.testing.assert_allclose(drawn(viewport), BACKGROUND[0], atol=0.5 / 255 + 1e-9)
        assert screenshot(viewport, 20, 10).shape == (10, 20, 4)
        viewport.show_disc(None)
        viewport.reset_camera()


def test_scenes_of_one_and_two_splats_and_none_load():
    for n in (1, 2, 0):
        glyphs, rgba = random_splats(n)
        with canvas(glyphs, rgba) as viewport:
            viewport.reset_camera()
            for mode in DisplayMode:
                viewport.splats.mode = mode
                assert (np.abs(drawn(viewport) - 0.1).max() > 0.05) == (n > 0)


def test_marks_are_drawn_over_the_splats_and_taken_away_again():
    glyphs, rgba = random_splats(200)
    with canvas(glyphs, rgba) as viewport:
        before = drawn(viewport)
        behind = np.array([-0.5, 3.0, -0.4])
        viewport.markers.show([Mark(behind, (255, 0, 255), is_chosen=True, is_active=True)])
        x, y = viewport.projection.pixel(behind).astype(int)
        np.testing.assert_allclose(drawn(viewport)[y, x], [1.0, 0.0, 1.0], atol=0.02)
        viewport.markers.clear()
        viewport.rings.show("free", [circle(np.zeros(3), [0.0, 0.0, 1.0], 0.8)], (0.0, 1.0, 1.0))
        viewport.gizmo.attach(np.eye(4))
        assert np.abs(drawn(viewport) - before).max() > 0.5
        viewport.rings.hide("free")
        viewport.gizmo.detach()
        np.testing.assert_array_equal(drawn(viewport), before)


def test_gizmo_is_drawn_where_it_is_hit():
    with canvas(size=(400, 300)) as viewport:
        viewport.gizmo.attach(np.eye(4))
        plain = np.abs(drawn(viewport) - 0.1).max(axis=-1) > 0.1
        hits = np.array(
            [[viewport.gizmo_part(x + 0.5, y + 0.5) is not None for x in range(0, 400, 5)] for y in range(0, 300, 5)]
        )
        assert hits[plain[::5, ::5]].all()
        assert viewport.hover_gizmo(viewport.projection.pixel([0.0, 0.0, 0.0])) == DOT


def test_edges_follow_the_splats_and_vanish():
    glyphs, rgba = random_splats(40, size=0.01)
    with canvas(glyphs, rgba) as viewport:
        viewport.splats.look = SplatLook(DisplayMode.POINTS)
        before = drawn(viewport)
        edges = np.array([[i, i + 1] for i in range(39)])
        viewport.splats.edges.show(edges, np.array([255, 0, 0], np.uint8))
        red = (drawn(viewport) - before)[..., 0] > 0.2
        assert red.sum() > 100
        viewport.splats.move(glyphs.means * 0.3, glyphs.axes_u, glyphs.axes_v)
        rows, columns = np.nonzero((drawn(viewport) * [1.0, -1.0, -1.0]).sum(axis=-1) > 0.1)
        assert columns.max() - columns.min() < 120 and rows.max() - rows.min() < 90
        viewport.splats.edges.hide()
        viewport.splats.move(glyphs.means, glyphs.axes_u, glyphs.axes_v)
        np.testing.assert_array_equal(drawn(viewport), before)


def test_edges_within_hops_grow_by_one_ring_a_hop():
    path = np.array([[i, i + 1] for i in range(9)])
    np.testing.assert_array_equal(np.nonzero(edges_within_hops(path, [4], 1, 10))[0], [3, 4])
    np.testing.assert_array_equal(np.nonzero(edges_within_hops(path, [4], 2, 10))[0], [2, 3, 4, 5])
    assert edges_within_hops(path, [4], 99, 10).all()
    assert not edges_within_hops(path, [], 3, 10).any()


def test_corner_axes_are_clicked_where_they_are_drawn():
    with canvas(size=(400, 300)) as viewport:
        viewport.triad.is_shown = True
        picture = drawn(viewport)
        ends = viewport.triad.ends(viewport.projection)
        for i, axis in enumerate((*np.eye(3), *-np.eye(3))):
            np.testing.assert_array_equal(viewport.hover_axes(tuple(ends[i, :2])), axis)
            x, y = ends[i, :2].astype(int)
            assert np.abs(picture[y - 5, x] - 0.1).max() > 0.1
        assert viewport.hover_axes((20.0, 280.0)) is None


def _with_floaters(n=400, share=0.3):
    """Splats of a ball of radius 1, then floaters up to 40 away; all opaque."""
    rng = np.random.default_rng(4)
    n_far = round(share / (1.0 - share) * n)
    glyphs, rgba = random_splats(n + n_far, size=0.1)
    away = rng.normal(size=(n + n_far, 3))
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    away[n:] *= rng.uniform(3.0, 40.0, (n_far, 1))
    rgba[:, 3] = 1.0
    return replace(glyphs, means=away), rgba, n


def test_home_frames_the_subject_and_frame_everything_all_that_floats():
    glyphs, rgba, n = _with_floaters()
    with canvas(glyphs, rgba) as viewport:
        viewport.reset_camera()
        width, height = viewport.renderer.GetSize()
        subject = viewport.projection.pixels(glyphs.means[:n])
        assert (subject > 0).all() and (subject < (width, height)).all()
        assert np.ptp(subject, axis=0).max() > 0.6 * height
        assert np.linalg.norm(viewport.camera.view.focal_point) < 0.1
        viewport.camera.view = viewport.frame_everything()
        pixels = viewport.projection.pixels(glyphs.means)
        assert (pixels > 0).all() and (pixels < (width, height)).all()
        viewport.splats.move(glyphs.means + np.array([5.0, 0, 0]), glyphs.axes_u, glyphs.axes_v)
        np.testing.assert_allclose(viewport.frame().focal_point, [5.0, 0, 0], atol=0.1)


def test_home_shows_a_sparse_part_beside_the_subject_whole():
    # A strap, and the see-through thing that hangs on it.
    rng = np.random.default_rng(6)
    rod = np.column_stack([rng.uniform(-0.5, 0.5, 3000), rng.normal(size=(3000, 2)) * 0.01])
    sheet = np.column_stack([rng.uniform(-0.4, 0.4, 700), np.zeros(700), rng.uniform(0.02, 0.82, 700)])
    glyphs, rgba = random_splats(3700, size=0.01)
    rgba[:, 3] = np.repeat([0.9, 0.4], [3000, 700])
    means = np.concatenate([rod, sheet])
    with canvas(replace(glyphs, means=means), rgba) as viewport:
        viewport.reset_camera()
        width, height = viewport.renderer.GetSize()
        pixels = viewport.projection.pixels(means)
        assert (pixels > 0).all() and (pixels < (width, height)).all()
        assert np.ptp(pixels[:, 1]) > 0.5 * height


def test_how_near_the_eye_may_come_follows_from_the_subject():
    glyphs, rgba, _ = _with_floaters()
    glyphs.means[-1] = [0.0, 1e5, 0.0]
    with canvas(glyphs, rgba) as viewport:
        viewport.camera.view = replace(VIEW, position=np.array([0.0, -1.1, 0.0]))
        drawn(viewport)
        near, far = viewport.camera.vtk.GetClippingRange()
        assert near < 0.01 and far > 1e5


def test_reset_camera_shows_the_scene_upright_from_its_front():
    glyphs, rgba = random_splats(200)
    with canvas(glyphs, rgba) as viewport:
        for up in (np.array([0.0, 0.0, 1.0]), np.array([0.0, -1.0, 0.0])):
            viewport.camera.world_up = up
            viewport.reset_camera()
            assert viewport.projection.up @ up > 0.8
            pixels = viewport.projection.pixels(glyphs.means)
            assert (pixels > 0).all() and (pixels < viewport.renderer.GetSize()).all()


def test_home_looks_along_its_direction_however_far_away_the_scene_is():
    glyphs, rgba = random_splats(50)
    with canvas(glyphs, rgba) as viewport:
        viewport.reset_camera()
        direction = viewport.camera.view.direction
    with canvas(replace(glyphs, means=glyphs.means + np.array([1e26, 0.0, -3e20])), rgba) as viewport:
        viewport.reset_camera()
        np.testing.assert_allclose(viewport.camera.view.direction, direction, atol=1e-6)


def test_closing_gives_the_host_its_window_back():
    with canvas() as viewport:
        window, renderer = viewport.renderer.GetRenderWindow(), vtkRenderer()
        renderers = window.GetRenderers().GetNumberOfItems()
        other = Viewport(window, renderer=viewport.renderer)
        other.camera.view = VIEW
        other.close()
        assert window.GetRenderers().GetNumberOfItems() == renderers
        assert not renderer.HasObserver("StartEvent")


def test_too_many_edges_are_thinned_and_a_near_view_shows_all_of_its_own(monkeypatch):
    monkeypatch.setattr("splap_editor.viewport.edge_lines.MOST_DRAWN", 500)
    glyphs, rgba = random_splats(2000, size=0.01)
    edges = np.array([[i, i + 1] for i in range(1999)])
    with canvas(glyphs, rgba) as viewport:
        lines = viewport.splats.edges
        lines.show(edges, np.array([255, 0, 0], np.uint8))
        drawn(viewport)
        # A fixed random choice: within three standard deviations of the wanted number.
        assert lines.n_edges == 1999 and abs(lines.n_drawn - 500) < 60
        viewport.camera.zoom(6.0)
        drawn(viewport)
        pixels = viewport.projection.pixels(glyphs.means)
        is_in = ((pixels >= 0) & (pixels <= viewport.renderer.GetSize())).all(axis=1)
        assert lines.n_drawn == is_in[edges].any(axis=1).sum() < 500
        lines.show(edges[:10], np.array([255, 0, 0], np.uint8))
        drawn(viewport)
        assert lines.n_drawn == 10
