"""Listening to the scene on screen, whichever that is."""

from collections.abc import Callable
from typing import Protocol, TypedDict, Unpack

from splap_editor.session.scene import Scene
from splap_editor.session.signals import Signal

Handler = Callable[[], object]


class SceneHandlers(TypedDict, total=False):
    """What to call for each signal of a `Scene`, by the signal's name."""

    surface_changed: Handler
    edit_changed: Handler
    preview_changed: Handler
    pose_changed: Handler
    check_changed: Handler
    selection_changed: Handler
    hidden_changed: Handler
    removed_changed: Handler
    selection_sets_changed: Handler
    active_handles_changed: Handler
    pivot_changed: Handler
    picked_changed: Handler
    up_changed: Handler


class ShowsScene(Protocol):
    """What can be followed: one scene at a time, and a signal for another."""

    scene_changed: Signal

    @property
    def scene(self) -> Scene | None:
        """The scene on screen."""
        ...


class SceneFollower:
    """Calls handlers for what changes in the scene on screen, and lets go of the scene before.

    Parameters
    ----------
    shows : ShowsScene
        The session.
    shown : callable, optional
        Called whenever another scene is on screen, once the handlers listen to it.
    **handlers
        Name of a scene's signal = what to call for it.
    """

    def __init__(self, shows: ShowsScene, shown: Handler | None = None, **handlers: Unpack[SceneHandlers]) -> None:
        unknown = handlers.keys() - SceneHandlers.__annotations__.keys()
        if unknown:
            raise ValueError(
                f"a scene has no signal {min(unknown)!r}; it has {', '.join(SceneHandlers.__annotations__)}"
            )
        self._shows = shows
        self._shown = shown
        self._handlers = handlers
        self._scene: Scene | None = None
        shows.scene_changed.connect(self._on_scene_changed)
        self._follow(shows.scene)

    def close(self) -> None:
        """Follow no longer."""
        self._shows.scene_changed.disconnect(self._on_scene_changed)
        self._follow(None)

    def _on_scene_changed(self) -> None:
        self._follow(self._shows.scene)
        if self._shown is not None:
            self._shown()

    def _follow(self, scene: Scene | None) -> None:
        before, self._scene = self._scene, scene
        for name, handler in self._handlers.items():
            if before is not None:
                getattr(before, name).disconnect(handler)
            if scene is not None:
                getattr(scene, name).connect(handler)
