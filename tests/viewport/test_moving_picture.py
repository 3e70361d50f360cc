"""What is seen while something moves, against the picture at rest."""

import numpy as np
import pytest

from splap_editor.viewport import viewport as viewport_module
from splap_editor.viewport.frame_quality import FrameQuality
from splap_editor.viewport.gizmo_parts import PARTS
from splap_editor.viewport.glyphs import Glyphs
from splap_editor.viewport.splat_actor import DisplayMode, SplatFlag, SplatLook
from tests.reference.rasterizer import psnr
from tests.viewport.canvas import canvas, drawn, random_splats

pytestmark = pytest.mark.usefixtures("no_leaked_vtk")
LOOKS = [DisplayMode.SPLATS, DisplayMode.ELLIPSES]
SIZE = (360, 270)


def always(viewport, quality):
    """Let each moving frame be drawn in this quality."""
    viewport.quality.choose = lambda order, patience=1.0: quality


@pytest.mark.parametrize("mode", LOOKS)
@pytest.mark.parametrize("coarseness", [2, 3])
def test_the_moving_picture_is_nearly_that_at_rest(mode, coarseness):
    glyphs, rgba = random_splats(2000)
    with canvas(glyphs, rgba, size=SIZE) as viewport:
        viewport.splats.mode = mode
        full = drawn(viewport)
        always(viewport, FrameQuality(2000, coarseness))
        viewport.begin_motion()
        moving = drawn(viewport)
        assert viewport.drawn.coarseness == coarseness
        assert psnr(moving, full) >= (30.0 if mode is DisplayMode.SPLATS else 21.0)
        always(viewport, FrameQuality(1000, coarseness))
        thinned = drawn(viewport)
        assert viewport.splats.deformed.n_drawn == 1000
        assert psnr(thinned, full) >= 17.0
        viewport.end_motion()
        np.testing.assert_array_equal(drawn(viewport), full)


@pytest.mark.parametrize("mode", list(DisplayMode))
def test_nothing_is_larger_in_the_moving_picture(mode):
    rng = np.random.default_rng(0)
    n = 40
    frames = np.linalg.qr(rng.normal(size=(n, 3, 3)))[0]
    needles = Glyphs(
        rng.uniform(-1.0, 1.0, (n, 3)), 0.2 * frames[:, 0], 0.0005 * frames[:, 1], np.full(n, 5e-4), np.full(n, 3.0)
    )
    with canvas(needles, np.ones((n, 4)), size=SIZE) as viewport:
        viewport.splats.look = SplatLook(mode, light=0.0, rim=0.0)
        viewport.begin_motion()

        def ink(quality):
            always(viewport, quality)
            return (drawn(viewport) - 0.1).sum()

        full = ink(FrameQuality(n))
        for coarseness in (2, 3):
            assert ink(FrameQuality(n, coarseness)) <= 1.06 * full
            assert ink(FrameQuality(n // 2, coarseness)) <= 0.85 * full


@pytest.mark.parametrize("mode", LOOKS)
def test_splats_left_out_are_those_that_give_least_and_the_others_do_not_change(mode):
    glyphs, rgba = random_splats(600)
    with canvas(glyphs, rgba, size=SIZE) as viewport:
        viewport.splats.mode = mode
        actor = viewport.splats.deformed
        rows = np.sort(actor.by_contribution.rows[:200])
        viewport.begin_motion()
        always(viewport, FrameQuality(200))
        thinned = drawn(viewport)
        few = Glyphs(*(getattr(glyphs, name)[rows] for name in ("means", "axes_u", "axes_v", "thickness", "cutoffs")))
        with canvas(few, rgba[rows], size=SIZE) as other:
            other.splats.mode = mode
            other.begin_motion()
            # The origins of the buffers differ: a rounded byte here and there, a pixel on an outline.
            assert (np.abs(drawn(other) - thinned).max(axis=-1) > 2.5 / 255.0).mean() < 2e-3


@pytest.mark.parametrize("mode", LOOKS)
def test_a_drag_moves_the_splats_that_are_drawn_and_then_all(mode):
    glyphs, rgba = random_splats(600)
    shift = np.array([0.3, 0.1, 0.2])
    with canvas(glyphs, rgba, size=SIZE) as viewport:
        viewport.splats.mode = mode
        viewport.splats.move(glyphs.means + shift, glyphs.axes_v, glyphs.axes_u)
        viewport.begin_motion()
        always(viewport, FrameQuality(200))
        expected_few = drawn(viewport)
        viewport.end_motion()
        expected_all = drawn(viewport)
        viewport.splats.move(glyphs.means, glyphs.axes_u, glyphs.axes_v)
        viewport.begin_motion()
        drawn(viewport)
        viewport.splats.move(glyphs.means + shift, glyphs.axes_v, glyphs.axes_u)
        np.testing.assert_array_equal(drawn(viewport), expected_few)
        np.testing.assert_allclose(
            viewport.splats.deformed.means + viewport.splats.deformed.origin, glyphs.means + shift, atol=1e-6
        )
        viewport.end_motion()
        np.testing.assert_array_equal(drawn(viewport), expected_all)


@pytest.mark.parametrize("mode", LOOKS)
def test_what_is_hidden_or_too_faint_takes_no_place_among_the_few(mode):
    glyphs, rgba = random_splats(600)
    with canvas(glyphs, rgba, size=SIZE) as viewport:
        viewport.splats.look = SplatLook(mode, opacity_cut=0.3)
        rows = viewport.splats.deformed.by_contribution.rows
        flags = np.zeros(600, np.uint8)
        flags[rows[:400]] = SplatFlag.HIDDEN
        viewport.splats.set_flags(flags)
        full = drawn(viewport)
        viewport.begin_motion()
        always(viewport, FrameQuality(200))
        few = drawn(viewport)
        actor = viewport.splats.deformed
        assert actor.n_drawn == (actor.base_colors[rows[400:], 3] >= actor.cut_byte).sum() > 50
        if mode is DisplayMode.SPLATS:
            np.testing.assert_array_equal(few, full)
        viewport.splats.set_flags(np.zeros(600, np.uint8))
        assert psnr(drawn(viewport), full) < 30.0


def test_colours_and_flags_reach_a_thinned_picture():
    glyphs, rgba = random_splats(600)
    with canvas(glyphs, rgba, size=SIZE) as viewport:
        viewport.splats.mode = DisplayMode.ELLIPSES
        viewport.begin_motion()
        always(viewport, FrameQuality(200))
        before = drawn(viewport)
        viewport.splats.set_flags(np.ones(600, np.uint8))
        assert psnr(drawn(viewport), before) < 30.0
        viewport.splats.set_flags(np.zeros(600, np.uint8))
        np.testing.assert_array_equal(drawn(viewport), before)
        viewport.splats.set_tints(np.full((600, 4), 255, np.uint8))
        assert psnr(drawn(viewport), before) < 30.0


@pytest.mark.parametrize("scale", [1.0, 2.0])
def test_gizmo_and_axes_stay_as_sharp_as_at_rest(scale):
    with canvas(*random_splats(50, size=0.01), size=(401, 283)) as viewport:
        viewport.set_scale(scale)
        viewport.triad.is_shown = True
        viewport.gizmo.attach(np.eye(4))
        viewport.gizmo.hovered = PARTS[0]
        viewport.splats.mode = DisplayMode.SPLATS
        viewport.splats.deformed.actor.VisibilityOff()
        full = drawn(viewport)
        assert np.ptp(full) > 0.3
        viewport.begin_motion()
        always(viewport, FrameQuality(50, 3))
        np.testing.assert_array_equal(drawn(viewport), full)


def test_the_picture_of_a_window_resized_while_moving_fills_it():
    with canvas(*random_splats(50), size=(200, 160)) as viewport:
        viewport.set_background((0.5, 0.2, 0.1), (0.5, 0.2, 0.1))
        viewport.splats.deformed.actor.VisibilityOff()
        viewport.begin_motion()
        always(viewport, FrameQuality(50, 3))
        window = viewport.renderer.GetRenderWindow()
        for size in ((200, 160), (301, 223), (97, 64)):
            window.SetSize(*size)
            picture = drawn(viewport)
            assert picture.shape[:2] == size[::-1]
            np.testing.assert_allclose(picture, np.broadcast_to([0.5, 0.2, 0.1], picture.shape), atol=0.5 / 255 + 1e-9)


class Clock:
    now = 0.0


def test_a_picture_at_rest_gets_finer_frame_by_frame_until_it_is_full(monkeypatch):
    clock, asked = Clock(), []
    monkeypatch.setattr(viewport_module, "perf_counter", lambda: clock.now)
    glyphs, rgba = random_splats(1000)
    with canvas(glyphs, rgba) as viewport:
        window = viewport.renderer.GetRenderWindow()

        def slow(*_):  # a machine on which a picture takes ten milliseconds for each splat
            clock.now += 0.01 * viewport.drawn.n_drawn

        tag = viewport.renderer.AddObserver("EndEvent", slow)
        viewport.quality.least_drawn = 1
        viewport.refine_in = asked.append
        full = drawn(viewport)
        viewport.begin_motion()
        counts = []
        for _ in range(12):
            viewport.camera.orbit(3.0, 0.0)
            drawn(viewport)
            counts.append(viewport.drawn.n_drawn)
        assert counts[-1] <= 5 and asked[-1] == viewport_module.RESTS_AFTER_S
        # The hand rests with the button down: one step finer, and no more.
        clock.now += 1.0
        drawn(viewport)
        assert counts[-1] < viewport.drawn.n_drawn <= 20
        asked.clear()
        drawn(viewport)
        assert viewport.drawn.n_drawn <= 20 and not asked
        viewport.end_motion()
        at_rest = []
        while not at_rest or asked:
            asked.clear()
            picture = drawn(viewport)
            at_rest.append(viewport.drawn.n_drawn)
        assert at_rest == sorted(at_rest) and at_rest[-1] == 1000 and 2 < len(at_rest) < 10
        assert viewport.drawn == FrameQuality(1000)
        viewport.camera.orbit(-36.0, 0.0)
        viewport.refine_in = None
        assert np.abs(drawn(viewport) - full).max() <= 2.0 / 255.0 and psnr(picture, full) < 40.0
        viewport.renderer.RemoveObserver(tag)
        assert window.GetSize() == (240, 180)
