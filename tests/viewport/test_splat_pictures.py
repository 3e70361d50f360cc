"""The shaders against slow pictures of the same splats."""

from dataclasses import replace

import numpy as np
import pytest

from splap_editor.viewport.splat_actor import DisplayMode, SplatFlag, SplatLook
from splap_editor.viewport.splat_scene import Compare
from tests.reference.rasterizer import ellipses_picture, points_picture, psnr, splats_picture
from tests.viewport.canvas import BACKGROUND, canvas, drawn, random_splats

pytestmark = pytest.mark.usefixtures("no_leaked_vtk")
PLAIN_ELLIPSES = SplatLook(DisplayMode.ELLIPSES, light=0.0, rim=0.0)


def expected_splats(viewport, glyphs, rgba):
    return splats_picture(
        viewport.projection,
        glyphs.means,
        glyphs.axes_u,
        glyphs.axes_v,
        glyphs.thickness,
        glyphs.cutoffs,
        rgba,
        BACKGROUND,
    )


@pytest.mark.parametrize("is_parallel", [False, True])
@pytest.mark.parametrize("is_sheared", [False, True])
def test_splats_match_the_reference(is_parallel, is_sheared):
    glyphs, rgba = random_splats(300, is_sheared=is_sheared)
    with canvas(glyphs, rgba) as viewport:
        viewport.camera.set_parallel(is_parallel)
        viewport.splats.mode = DisplayMode.SPLATS
        picture = drawn(viewport)
        # A frame buffer of 8 bits rounds at every layer: about 49 dB is what remains.
        assert psnr(picture, expected_splats(viewport, glyphs, rgba)) >= 40.0


def test_splats_from_within_the_scene_match_the_reference():
    glyphs, rgba = random_splats(200, size=0.05)
    with canvas(glyphs, rgba) as viewport:
        viewport.camera.view = replace(viewport.camera.view, position=np.array([0.1, -1.6, 0.2]))
        viewport.splats.mode = DisplayMode.SPLATS
        assert psnr(drawn(viewport), expected_splats(viewport, glyphs, rgba)) >= 40.0


@pytest.mark.parametrize("is_parallel", [False, True])
@pytest.mark.parametrize("is_sheared", [False, True])
def test_ellipses_are_the_occupancy_ellipses(is_parallel, is_sheared):
    glyphs, rgba = random_splats(200, is_sheared=is_sheared)
    with canvas(glyphs, rgba) as viewport:
        viewport.camera.set_parallel(is_parallel)
        viewport.splats.look = PLAIN_ELLIPSES
        viewport.renderer.GetRenderWindow().Render()
        viewport.begin_motion()  # without the smoothing of the picture at rest
        viewport.quality.target_s = np.inf
        picture = drawn(viewport)
        reference, _ = ellipses_picture(
            viewport.projection, glyphs.means, glyphs.axes_u, glyphs.axes_v, glyphs.cutoffs, rgba[:, :3], BACKGROUND
        )
        # Only pixels on an outline may fall to the other side.
        assert (np.abs(picture - reference).max(axis=-1) > 0.01).mean() < 2e-3


def test_points_are_discs_of_constant_size():
    glyphs, rgba = random_splats(300)
    with canvas(glyphs, rgba) as viewport:
        viewport.splats.look = SplatLook(DisplayMode.POINTS, point_size_px=3.0)
        viewport.begin_motion()
        viewport.quality.target_s = np.inf
        picture = drawn(viewport)
        reference, _ = points_picture(viewport.projection, glyphs.means, rgba[:, :3], 3.0, BACKGROUND)
        assert (np.abs(picture - reference).max(axis=-1) > 0.01).mean() < 2e-3


@pytest.mark.parametrize("mode", list(DisplayMode))
def test_hidden_and_faint_splats_leave_no_trace(mode):
    glyphs, rgba = random_splats(100)
    with canvas(glyphs, rgba) as viewport:
        viewport.splats.look = SplatLook(mode, opacity_cut=0.5)
        viewport.splats.set_flags(np.where(rgba[:, 3] >= 0.5, SplatFlag.HIDDEN, 0).astype(np.uint8))
        np.testing.assert_allclose(drawn(viewport), 0.1, atol=0.5 / 255.0 + 1e-9)


@pytest.mark.parametrize("mode", list(DisplayMode))
def test_a_move_far_from_zero_and_back_gives_the_same_picture(mode):
    glyphs, rgba = random_splats(100)
    with canvas(glyphs, rgba) as viewport:
        viewport.splats.mode = mode
        before = drawn(viewport)
        viewport.splats.move(glyphs.means + 0.5, glyphs.axes_v, glyphs.axes_u)
        assert np.abs(drawn(viewport) - before).max() > 0.1
        viewport.splats.move(glyphs.means, glyphs.axes_u, glyphs.axes_v)
        np.testing.assert_array_equal(drawn(viewport), before)


def test_a_scene_far_from_zero_looks_as_sharp():
    glyphs, rgba = random_splats(100)
    shift = np.array([3e6, -2e6, 1e6])
    with canvas(glyphs, rgba) as viewport:
        viewport.splats.mode = DisplayMode.SPLATS
        near = drawn(viewport)
        view = viewport.camera.view
        viewport.splats.load(replace(glyphs, means=glyphs.means + shift), viewport.splats.deformed.base_colors.copy())
        viewport.camera.view = replace(view, position=view.position + shift, focal_point=view.focal_point + shift)
        # Three million units away a float64 still resolves 1e-9 of them: a rounded byte here and there.
        assert np.abs(drawn(viewport) - near).max() <= 2.0 / 255.0


def test_selection_tints_and_clears():
    glyphs, rgba = random_splats(100)
    with canvas(glyphs, rgba) as viewport:
        before = drawn(viewport)
        viewport.splats.set_flags(np.full(100, SplatFlag.SELECTED, np.uint8))
        selected = drawn(viewport)
        strongest = int(np.argmax(viewport.splats.look.select_tint[:3]))
        assert selected[..., strongest].sum() > before[..., strongest].sum()
        viewport.splats.set_flags(np.zeros(100, np.uint8))
        np.testing.assert_array_equal(drawn(viewport), before)


def test_tints_mix_into_colors_and_clear():
    glyphs, rgba = random_splats(50)
    with canvas(glyphs, rgba) as viewport:
        actor = viewport.splats.deformed
        plain = actor.colors.copy()
        viewport.splats.set_tints(np.tile(np.array([255, 0, 0, 255], np.uint8), (50, 1)))
        np.testing.assert_array_equal(actor.colors[:, :3], [[255, 0, 0]] * 50)
        np.testing.assert_array_equal(actor.colors[:, 3], plain[:, 3])
        viewport.splats.set_tints(None)
        np.testing.assert_array_equal(actor.colors, plain)


def test_original_alone_is_the_picture_at_rest_and_both_shows_a_ghost():
    glyphs, rgba = random_splats(60)
    with canvas(glyphs, rgba) as viewport:
        rest = drawn(viewport)
        viewport.splats.move(glyphs.means + np.array([0.4, 0.0, 0.3]), glyphs.axes_u, glyphs.axes_v)
        moved = drawn(viewport)
        viewport.splats.compare = Compare.ORIGINAL
        np.testing.assert_array_equal(drawn(viewport), rest)
        viewport.splats.compare = Compare.BOTH
        assert np.abs(drawn(viewport) - moved).max() > 0.02
        viewport.splats.compare = Compare.DEFORMED
        np.testing.assert_array_equal(drawn(viewport), moved)
