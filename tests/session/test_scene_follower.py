"""A follower hears the scene on screen, and no other."""

from types import SimpleNamespace

import pytest

from splap_editor.core.splats.occupancy import occupancy_ellipses
from splap_editor.io.ply import read_ply
from splap_editor.resources import resource
from splap_editor.session.scene import Scene
from splap_editor.session.scene_follower import SceneFollower, SceneHandlers
from splap_editor.session.signals import Signal


@pytest.fixture(scope="module")
def file():
    return read_ply(resource("samples", "tube.ply"))


@pytest.fixture
def new_scene(file):
    ellipses = occupancy_ellipses(file.splats)
    return lambda: Scene(file, ellipses)


class Screen:
    """Shows one scene after the other."""

    def __init__(self):
        self.scene = None
        self.scene_changed = Signal()

    def show(self, scene):
        self.scene = scene
        self.scene_changed.emit()


def signals_of(scene):
    return {name: value for name, value in vars(scene).items() if isinstance(value, Signal)}


def listeners_of(scene):
    return [listener for signal in signals_of(scene).values() for listener in signal.listeners]


def test_every_signal_of_a_scene_can_be_followed(new_scene):
    assert set(SceneHandlers.__annotations__) == set(signals_of(new_scene()))


def test_the_scene_on_screen_is_heard_and_the_one_before_is_not(new_scene):
    screen, heard = Screen(), []
    SceneFollower(screen, lambda: heard.append("shown"), picked_changed=lambda: heard.append("picked"))
    first, second = new_scene(), new_scene()
    screen.show(first)
    first.set_picked(3)
    screen.show(second)
    first.set_picked(4)
    assert heard == ["shown", "picked", "shown"]
    second.set_picked(5)
    assert heard == ["shown", "picked", "shown", "picked"]


def test_no_connection_to_a_closed_scene_is_left_behind(new_scene):
    screen, first = Screen(), new_scene()
    handlers = dict.fromkeys(SceneHandlers.__annotations__, lambda: None)
    follower = SceneFollower(screen, **handlers)
    screen.show(first)
    assert len(listeners_of(first)) == len(handlers)
    second = new_scene()
    screen.show(second)
    assert listeners_of(first) == []
    follower.close()
    assert listeners_of(second) == [] and screen.scene_changed.listeners == ()


def test_the_scene_on_screen_is_followed_from_the_start_and_none_is_no_scene(new_scene):
    heard = []
    screen = SimpleNamespace(scene=new_scene(), scene_changed=Signal())
    SceneFollower(screen, edit_changed=lambda: heard.append("edit"))
    screen.scene.set_edit(screen.scene.edit)
    assert heard == ["edit"]
    screen.scene, before = None, screen.scene
    screen.scene_changed.emit()
    assert listeners_of(before) == []


def test_a_signal_that_no_scene_has_is_refused():
    with pytest.raises(ValueError, match="no signal 'colour_changed'; it has surface_changed"):
        SceneFollower(Screen(), colour_changed=lambda: None)
