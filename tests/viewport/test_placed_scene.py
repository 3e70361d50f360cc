"""A placed scene in view: the same picture as one of the splats that are written."""

from dataclasses import replace

import numpy as np
import pytest

from splap_editor.core.place import Place, placed_points, placed_splats
from splap_editor.core.splats.splats import Splats
from splap_editor.resources import resource
from splap_editor.session.session import Session
from splap_editor.viewport.camera import View
from splap_editor.viewport.scene_view import SceneView
from splap_editor.viewport.splat_actor import DisplayMode, SplatLook
from splap_editor.viewport.studio import Studio
from tests.session.main_thread import MainThread
from tests.viewport.canvas import canvas, drawn

PLACE = Place((0.3, -0.1, 0.2), (1.0, 2.0, -0.5), (0.8, 0.2, -0.4, 0.4), 2.5)
VIEW = View(np.array([2.6, -3.4, 1.9]), np.zeros(3), np.array([0.0, 0.0, 1.0]))


def splats(n_scales, n=400):
    rng = np.random.default_rng(6)
    return Splats(
        rng.uniform(-0.8, 0.8, (n, 3)),
        rng.normal(-2.5, 0.4, (n, n_scales)),
        rng.normal(size=(n, 4)),
        rng.normal(1.0, 1.0, size=n),
        rng.normal(size=(n, 3)),
        rng.normal(0.0, 0.3, (n, 8, 3)),
    )


def picture(held, view, place=None):
    studio = Studio(held, SplatLook(mode=DisplayMode.SPLATS), 240, 180)
    if place is not None:
        studio.viewport.show_place(place)
    try:
        return studio.picture(view).astype(int)
    finally:
        studio.close()


@pytest.mark.parametrize("n_scales", [2, 3])
def test_the_camera_sees_view_dependent_colour_as_it_is_written(n_scales):
    rest = splats(n_scales)
    ends = placed_points(np.stack([VIEW.position, VIEW.focal_point]), PLACE)
    there = replace(VIEW, position=ends[0], focal_point=ends[1], view_up=PLACE.rotation @ VIEW.view_up)
    here, written = picture(rest, VIEW, PLACE), picture(placed_splats(rest, PLACE), there)
    # The corner axes stand as the written scene's do in both, since the one camera knows of the place.
    far = np.abs(here - written).max(axis=2)
    assert np.mean(far > 3) < 1e-3
    assert here[..., :3].std() > 10.0


@pytest.fixture
def shown():
    main = MainThread()
    session = Session(main.post)
    with canvas() as viewport:
        view = SceneView(session, viewport)
        session.scene_changed.connect(session.halt)
        session.open(resource("samples", "tube.ply"))
        main.run_until(lambda: session.scene is not None)
        yield session, view
        session.close()
        view.close()


def test_a_dragged_place_moves_before_the_camera_and_a_step_takes_the_camera_along(shown):
    session, view = shown
    viewport, scene = view.viewport, session.scene
    center = scene.ellipses.subject.center[None]
    before = viewport.projection.pixels(center)
    moved = Place(translate=(0.1, 0.0, 0.05))
    session.drag.preview_place(moved)
    assert np.linalg.norm(viewport.projection.pixels(center) - before) > 3.0
    session.drag.cancel()
    np.testing.assert_allclose(viewport.projection.pixels(center), before, atol=1e-6)
    session.steps.change_place(moved, "Move object")
    np.testing.assert_allclose(viewport.projection.pixels(center), before, atol=1e-6)
    session.history.undo()
    assert viewport.camera.place == Place()
    np.testing.assert_allclose(viewport.projection.pixels(center), before, atol=1e-6)


def test_another_up_axis_turns_the_object_and_not_the_picture(shown):
    session, view = shown
    camera = view.viewport.camera
    before = drawn(view.viewport)
    up, standing = camera.up, session.scene.up
    session.steps.stand_up((1.0, 0.0, 0.0))
    np.testing.assert_allclose(session.scene.edit.place.rotation @ np.array(standing), (1.0, 0.0, 0.0), atol=1e-9)
    np.testing.assert_allclose(camera.up, up, atol=1e-9)
    np.testing.assert_allclose(drawn(view.viewport), before, atol=0.02)
    session.history.undo()
    assert session.scene.up == standing and session.scene.edit.place.is_identity
    np.testing.assert_allclose(camera.world_up, standing)


def test_what_hangs_on_the_place_is_not_made_anew(shown):
    session, view = shown
    scene, viewport = session.scene, view.viewport
    shown_means = viewport.splats.shown.means
    moves = viewport.splats.deformed.n_moves
    session.steps.change_place(PLACE, "Move object")
    assert viewport.splats.shown.means is shown_means and viewport.splats.deformed.n_moves == moves
    assert scene.kernels is None and scene.edit.removed is None
