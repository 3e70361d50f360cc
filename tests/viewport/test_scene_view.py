"""A session in a viewport: order and colours are made aside, the newest view wins, and a closed scene is let go of."""

from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest

from splap_editor.resources import resource
from splap_editor.session.session import Session
from splap_editor.session.signals import Signal
from splap_editor.viewport import scene_view
from splap_editor.viewport.depth_order import depth_order
from splap_editor.viewport.scene_view import SceneView
from splap_editor.viewport.splat_scene import Compare
from tests.session.main_thread import MainThread
from tests.viewport.canvas import canvas, drawn

TUBE = resource("samples", "tube.ply")


@contextmanager
def shown_tube():
    """A session that shows the tube off screen; nothing is prepared for handles."""
    main = MainThread()
    session = Session(main.post)
    with canvas() as viewport:
        view = SceneView(session, viewport)
        try:
            session.scene_changed.connect(session.halt)
            session.open(TUBE)
            main.run_until(lambda: session.scene is not None)
            yield main, session, view
        finally:
            session.close()
            view.close()


def turn(viewport, angle):
    camera = viewport.camera
    offset = 3.0 * np.array([np.cos(angle), np.sin(angle), 0.4])
    camera.view = replace(camera.view, position=camera.view.focal_point + offset)
    drawn(viewport)


def settle(main, session):
    """Run what is posted until the view's worker rests."""
    rested = []
    main.run_until(lambda: not session.view_worker.is_busy())
    main.post(lambda: rested.append(True))
    main.run_until(lambda: rested)


def test_while_a_view_is_being_made_the_newest_one_waits(monkeypatch):
    with shown_tube() as (main, session, view):
        turn(view.viewport, 0.0)
        settle(main, session)
        directions, make = [], scene_view.presented

        def noted(depicted, kernels, seen):
            directions.append(seen.direction)
            return make(depicted, kernels, seen)

        monkeypatch.setattr(scene_view, "presented", noted)
        for angle in (0.5, 1.0, 1.5, 2.0):
            turn(view.viewport, angle)
        last = view.viewport.projection.direction.astype(np.float32)
        main.run_until(lambda: len(directions) == 2)
        settle(main, session)
        assert len(directions) == 2, "the first, and of those made meanwhile the newest"
        np.testing.assert_array_equal(directions[-1], last)


@pytest.mark.parametrize("compare", [Compare.DEFORMED, Compare.BOTH])
def test_a_turned_view_is_sorted_by_the_worker(compare):
    with shown_tube() as (main, session, view):
        splats = view.viewport.splats
        splats.compare = compare
        turn(view.viewport, 0.0)
        settle(main, session)
        before = [actor.order for actor in splats.shown_actors()]
        turn(view.viewport, 2.0)
        after = [actor.order for actor in splats.shown_actors()]
        assert all(a is b for a, b in zip(after, before, strict=True)), "not by the frame that is drawn"
        settle(main, session)
        direction = view.viewport.projection.direction.astype(np.float32)
        for actor in splats.shown_actors():
            np.testing.assert_array_equal(actor.order, depth_order(actor.means, direction))


def test_a_closed_scene_and_a_closed_view_are_let_go_of():
    with shown_tube() as (main, session, view):
        first = session.scene
        session.open(TUBE)
        main.run_until(lambda: session.scene is not first)
        assert listeners_of(first) == []
        assert view.viewport.splats.deformed.n_splats == session.scene.splats.n_splats
        view.close()
        assert all(getattr(each, "__self__", None) is not view for each in listeners_of(session.scene))


def listeners_of(scene):
    return [each for signal in vars(scene).values() if isinstance(signal, Signal) for each in signal.listeners]
