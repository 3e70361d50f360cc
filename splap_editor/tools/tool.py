"""What a tool is, and what it is told."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import ClassVar, Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from splap_editor.session.session import Session
from splap_editor.session.signals import Signal
from splap_editor.tools.bindings import Binding, answering, gesture_name, held_modifiers, hint_of, key_names
from splap_editor.tools.mover import Mover
from splap_editor.viewport.camera import View
from splap_editor.viewport.gizmo import Claim
from splap_editor.viewport.inspect_view import InspectView
from splap_editor.viewport.viewport import Viewport

CLICK_SLACK_PX = 5.0
"""A press that moves less before the release is a click."""

Options = TypeVar("Options")

_STEPS = {"press": "Press", "move": "Move", "release": "Release"}


@dataclass(frozen=True)
class PointerEvent:
    """One thing the pointer did.

    Parameters
    ----------
    kind : str
        ``"press"``, ``"move"``, ``"release"``, ``"wheel"``, ``"pinch"``, ``"double"`` or ``"leave"``.
    xy : 2 floats
        Device pixels from the top left of the viewport.
    button : str
        ``"left"``, ``"middle"``, ``"right"`` for press, release and double; otherwise empty.
    buttons : frozenset of str
        Buttons held down after the event.
    shift, ctrl, alt : bool
        Modifiers held.
    steps : float
        Wheel notches, away from the user positive.
    pan_px : 2 floats
        Two-finger trackpad movement in device pixels; zero for a wheel.
    """

    kind: str
    xy: tuple[float, float]
    button: str = ""
    buttons: frozenset[str] = frozenset()
    shift: bool = False
    ctrl: bool = False
    alt: bool = False
    steps: float = 0.0
    pan_px: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class KeyEvent:
    """A key pressed while the viewport has the keyboard.

    Parameters
    ----------
    key : str
        Qt's name without the prefix: ``"G"``, ``"Escape"``, ``"Return"``, ``"BracketLeft"``, ``"Period"``, ``"7"``.
    text : str
        What it would type.
    pressed : bool
        False for the release.
    """

    key: str
    text: str = ""
    shift: bool = False
    ctrl: bool = False
    alt: bool = False
    pressed: bool = True


class Hud:
    """What is drawn over the picture without rendering it: an outline, a cursor circle and a line of text."""

    def __init__(self) -> None:
        self.changed = Signal()
        self.outline: tuple[tuple[float, float], ...] = ()
        self.circle: tuple[float, float, float] | None = None
        self.text = ""

    def show(
        self,
        *,
        outline: tuple[tuple[float, float], ...] = (),
        circle: tuple[float, float, float] | None = None,
        text: str = "",
    ) -> None:
        """Replace all of it; coordinates and radius in device pixels."""
        if (outline, circle, text) != (self.outline, self.circle, self.text):
            self.outline, self.circle, self.text = outline, circle, text
            self.changed.emit()

    def clear(self) -> None:
        """Show nothing."""
        self.show()


class Held(Generic[Options]):
    """Options of one kind, in force for every tool that has them.

    `changed` tells of other ones, `entered` only of those that a tool does not say itself.
    """

    def __init__(self, value: Options) -> None:
        self.value = value
        self.changed = Signal()
        self.entered = Signal()

    def set(self, value: Options) -> None:
        """Put other options in force."""
        if value != self.value:
            self.show(value)
            self.entered.emit()

    def show(self, value: Options) -> None:
        """Say what a tool has come to: forms follow, the tool is not told."""
        if value != self.value:
            self.value = value
            self.changed.emit()


class Stroke(Protocol):
    """A drag under way, from the press to the release."""

    def move(self, event: PointerEvent) -> None:
        """Follow the pointer."""
        ...

    def end(self, event: PointerEvent) -> None:
        """The button was let go: take it."""
        ...

    def cancel(self) -> None:
        """Leave scene and edit as they were before it."""
        ...


@dataclass(eq=False)
class ToolContext:
    """What every tool works on.

    Parameters
    ----------
    session : Session
    viewport : Viewport
    inspected : InspectView
        The splat or edge looked at.
    hud : Hud
    orbit : callable
        ``orbit(press)`` begins a stroke of the camera: what a drag becomes that no tool wants.
    fly_to : callable
        Brings the camera to a view; a host that can animate it says how.
    paint : callable
        Lays colours (N, 4) uint8, the fourth their share, over the splats; None takes them off again.
    claim : callable
        Has the gizmo stand where the tool in use wants it; None: at the chosen handles.
    mover : Mover, optional
        What it then moves; None: the handles.
    left_orbits : bool
        A left drag without Shift or Ctrl is one too, except where it draws.
    """

    session: Session
    viewport: Viewport
    inspected: InspectView
    hud: Hud = field(default_factory=Hud)
    orbit: Callable[[PointerEvent], Stroke | None] = lambda press: None
    fly_to: Callable[[View], None] = field(init=False)
    paint: Callable[[NDArray[np.uint8] | None], None] = lambda colors: None
    claim: Callable[[Claim | None], None] = lambda claim: None
    mover: Mover | None = None
    left_orbits: bool = False
    _held: dict[type, Held] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.fly_to = self._jump

    def held(self, kind: type[Options]) -> Held[Options]:
        """The options of a kind, shared by all tools that have them."""
        return self._held.setdefault(kind, Held(kind()))

    def _jump(self, view: View) -> None:
        self.viewport.camera.view = view
        self.viewport.camera_moved()


class Tool:
    """Turns pointer and key events into previews and undo steps, as its table of bindings says.

    A press waits to be told a click from a drag, unless its binding is `at_once`; a drag that the table does not
    hold turns the camera. `pointer` and `key` return True for an event they used up: after such a press the tool
    gets every event until the button is released.

    A tool states its name, its table, while something is under way the `active_bindings`, and the classes of its
    options: option groups (`splap_editor.core.options`), shared through `ToolContext.held`.
    """

    name: ClassVar[str] = ""
    bindings: ClassVar[tuple[Binding, ...]] = ()
    active_bindings: ClassVar[tuple[Binding, ...]] = ()
    option_kinds: ClassVar[tuple[type, ...]] = ()
    needs_scene: ClassVar[bool] = True
    yields_to_orbit: ClassVar[bool] = False
    mutes_gizmo: ClassVar[bool] = False
    mover: Mover | None = None
    """What the gizmo moves while the tool is in use, if not handles."""

    def __init__(self, context: ToolContext) -> None:
        self.context = context
        self._waiting: list[PointerEvent] = []
        self._stroke: Stroke | None = None
        self._button = ""

    @property
    def is_active(self) -> bool:
        """Whether `active_bindings` hold."""
        return False

    @property
    def claim(self) -> Claim | None:
        """Where the gizmo stands while the tool is in use, if not at the chosen handles."""
        return None

    def taken_up(self) -> None:
        """Begin: the tool is in use from here on."""

    @property
    def hint(self) -> str:
        """What to do, for the status line."""
        return hint_of(self.active_bindings if self.is_active else self.bindings)

    def hover(self, event: PointerEvent) -> bool:
        """Take a move with no button held."""
        return False

    def left(self) -> None:
        """Forget what was under the pointer: it is elsewhere."""

    def pointer(self, event: PointerEvent) -> bool:
        """Take a pointer event."""
        if event.kind == "leave":
            self.left()
            return False
        if self.needs_scene and self.context.session.scene is None:
            return False
        if self.is_active:
            return self._step(event)
        if event.kind == "press":
            return self._press(event)
        if event.kind == "move":
            if self._waiting or self._stroke is not None:
                self._move(event)
                return True
            return not event.buttons and self.hover(event)
        if event.kind == "release":
            return self._release(event)
        if event.kind == "wheel":
            return self._perform(("Two fingers" if event.pan_px != (0.0, 0.0) else "Wheel",), event)
        return event.kind == "pinch" and self._perform(("Pinch",), event)

    def key(self, event: KeyEvent) -> bool:
        """Take a key event."""
        return event.pressed and self._perform(key_names(event), event)

    def cancel(self) -> None:
        """Drop what is under way, leaving scene and edit as they were before it."""
        stroke, self._stroke = self._stroke, None
        self._waiting = []
        if stroke is not None:
            stroke.cancel()

    def stroke(self, press: PointerEvent) -> Stroke | None:
        """Begin the drag that the table holds for a press."""
        name, held = gesture_name(press.button, "Drag"), held_modifiers(press)
        is_orbit = self.yields_to_orbit and self.context.left_orbits and not (press.shift or press.ctrl)
        for binding in () if is_orbit else answering(self.bindings, name, held):
            begun = binding.act(self, press)
            return None if isinstance(begun, bool) else begun
        return None

    def _perform(self, names: tuple[str, ...], event: PointerEvent | KeyEvent) -> bool:
        table = self.active_bindings if self.is_active else self.bindings
        held = held_modifiers(event)
        for name in names:
            for binding in answering(table, name, held):
                if binding.act(self, event) is not False:
                    return True
        return False

    def _step(self, event: PointerEvent) -> bool:
        if event.kind in _STEPS:
            step = _STEPS[event.kind]
            return self._perform((gesture_name(event.button, step) if event.button else step,), event)
        return False

    def _press(self, event: PointerEvent) -> bool:
        if self._waiting or self._stroke is not None:
            return True
        held = held_modifiers(event)
        names = [gesture_name(event.button, gesture) for gesture in ("Click", "Drag")]
        waits = False
        for binding in self.bindings:
            if not any(binding.answers(name, held) for name in names):
                continue
            if not binding.at_once:
                waits = True
                continue
            used = binding.act(self, event)
            if used is not None and used is not False:
                self._stroke, self._button = None if isinstance(used, bool) else used, event.button
                return True
        if waits:
            self._waiting, self._button = [event], event.button
        return waits

    def _move(self, event: PointerEvent) -> None:
        if self._stroke is not None:
            self._stroke.move(event)
            return
        self._waiting.append(event)
        press = self._waiting[0]
        if np.hypot(event.xy[0] - press.xy[0], event.xy[1] - press.xy[1]) > CLICK_SLACK_PX:
            moves, self._waiting = self._waiting[1:], []
            self.left()
            self._stroke = self.stroke(press) or self.context.orbit(press)
            # Where the pointer went before it was known to be a drag is part of it.
            if self._stroke is not None:
                for move in moves:
                    self._stroke.move(move)

    def _release(self, event: PointerEvent) -> bool:
        if event.button != self._button:
            return False
        if self._stroke is not None:
            stroke, self._stroke = self._stroke, None
            stroke.end(event)
            return True
        if not self._waiting:
            return False
        press, self._waiting = self._waiting[0], []
        for binding in answering(self.bindings, gesture_name(press.button, "Click"), held_modifiers(press)):
            binding.act(self, press)
            break
        return True
