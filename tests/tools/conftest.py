"""Tools off screen: a session, a viewport that shows it, and a hand that tells tools what it does. No Qt."""

from collections.abc import Iterator
from functools import partial

import numpy as np
import pytest
from vtkmodules.vtkRenderingCore import vtkRenderWindow

from splap_editor.engine.cache import StageCache
from splap_editor.resources import resource
from splap_editor.session.session import Session
from splap_editor.tools.tool import KeyEvent, PointerEvent, ToolContext
from splap_editor.tools.tool_manager import ToolManager
from splap_editor.tools.tool_table import made_tools
from splap_editor.viewport.inspect_view import InspectView
from splap_editor.viewport.scene_view import SceneView
from splap_editor.viewport.viewport import Viewport
from tests.session.main_thread import MainThread

QT_KEYS = {"[": "BracketLeft", "]": "BracketRight", "Esc": "Escape", ".": "Period", "-": "Minus"}


class Hand:
    """Gestures in device pixels, keys by their names."""

    def __init__(self, tools: ToolManager, main: MainThread) -> None:
        self.tools = tools
        self.main = main
        self.context = tools.context
        self.session = tools.context.session
        self.viewport = tools.context.viewport

    @property
    def scene(self):
        return self.session.scene

    def tell(self, kind: str, xy, button: str = "", held: str = "", **more) -> bool:
        modifiers = {name.lower(): True for name in held.split("+") if name}
        down = frozenset(more.pop("buttons", {button} if kind == "press" else ()))
        return self.tools.pointer(PointerEvent(kind, tuple(map(float, xy)), button, down, **modifiers, **more))

    def hover(self, *points, held: str = "") -> None:
        for point in points:
            self.tell("move", point, held=held)

    def click(self, xy, held: str = "", button: str = "left") -> None:
        self.hover(xy, held=held)
        self.tell("press", xy, button, held)
        self.tell("release", xy, button, held)

    def drag(self, *points, held: str = "", button: str = "left") -> None:
        self.tell("press", points[0], button, held)
        for point in points[1:]:
            self.tell("move", point, held=held, buttons={button})
        self.tell("release", points[-1], button, held)

    def key(self, *names: str) -> bool:
        used = False
        for name in names:
            *held, key = name.split("+")
            modifiers = {each.lower(): True for each in held}
            used = self.tools.key(KeyEvent(QT_KEYS.get(key, key), key if len(key) == 1 else "", **modifiers))
        return used

    def settle(self) -> None:
        self.main.run_until(lambda: self.session.state in ("ready", "settled"))

    def surface(self) -> np.ndarray:
        """A pixel with splats under it, near the middle of the picture."""
        screen = self.viewport.screen_points()[:, :2]
        middle = np.array([self.viewport.projection.width, self.viewport.projection.height]) / 2.0
        for xy in screen[np.argsort(np.linalg.norm(screen - middle, axis=1))]:
            if self.viewport.pick(*xy) is not None:
                return xy
        raise AssertionError("no splat is in the picture")

    def placed(self):
        """A handle in the middle of the picture, bound."""
        self.tools.choose("handle")
        self.click(self.surface())
        self.settle()
        return self.scene.edit.handles[-1]


def two_places(hand) -> tuple[np.ndarray, np.ndarray]:
    """Two pixels far apart with splats under them."""
    screen = hand.viewport.screen_points()[:, :2]
    near = hand.surface()
    order = np.argsort(-np.linalg.norm(screen - near, axis=1))
    width, height = hand.viewport.projection.width, hand.viewport.projection.height
    for xy in screen[order]:
        inside = 0 <= xy[0] < width and 0 <= xy[1] < height
        if inside and hand.viewport.pick(*xy) is not None:
            return near, xy
    raise AssertionError("no second splat is in the picture")


@pytest.fixture(scope="session")
def stages(tmp_path_factory) -> StageCache:
    """Prepare the tube once for all tests."""
    return StageCache(tmp_path_factory.mktemp("stages"))


@pytest.fixture
def hand(stages, no_leaked_vtk, request) -> Iterator[Hand]:
    """A hand over the tube, prepared."""
    main = MainThread()
    session = Session(main.post, cache=stages)
    window = vtkRenderWindow()
    window.SetOffScreenRendering(True)
    window.SetMultiSamples(0)
    window.SetSize(600, 400)
    viewport = Viewport(window)
    view = SceneView(session, viewport)
    context = ToolContext(session, viewport, InspectView(session, view))
    context.paint = partial(view.paint, layer="tool")
    context.claim = view.claim_gizmo
    tools = made_tools(context)
    person = Hand(tools, main)
    session.open(resource("samples", "tube.ply"))
    person.settle()
    window.Render()
    yield person
    tools.cancel()
    session.close()
    view.close()
    window.Finalize()
    request.node.funcargs.pop("hand", None)
