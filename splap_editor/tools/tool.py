"""What a tool is, what it is told, and who is told first."""

from dataclasses import dataclass, field
from typing import Protocol

from splap_editor.session.session import Session
from splap_editor.session.signals import Signal
from splap_editor.viewport.viewport import Viewport

CLICK_SLACK_PX = 5.0
"""A press that moves less before the release is a click."""


@dataclass(frozen=True)
class PointerEvent:
    """One thing the pointer did.

    Parameters
    ----------
    kind : str
        ``"press"``, ``"move"``, ``"release"``, ``"wheel"``, ``"double"`` or ``"leave"``.
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
    """A key pressed while the pointer is over the viewport.

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


@dataclass(eq=False)
class ToolContext:
    """What every tool works on; ``navigate`` takes over a drag that turns out to be one of the camera.

    With ``left_orbits`` a left drag without Shift or Ctrl is one, except where it draws.
    """

    session: Session
    viewport: Viewport
    hud: Hud = field(default_factory=Hud)
    navigate: "Tool | None" = None
    left_orbits: bool = False


class Tool(Protocol):
    """Turns pointer and key events into previews and commands.

    A method that returns True has used the event up. After a press that was used, the tool gets every event until
    the button is released.
    """

    name: str
    hint: str

    def pointer(self, event: PointerEvent) -> bool:
        """Take a pointer event."""
        ...

    def key(self, event: KeyEvent) -> bool:
        """Take a key event."""
        ...

    def cancel(self) -> None:
        """Drop what is under way, leaving scene and edit as they were before it."""
        ...


class ToolManager:
    """Passes events to whoever holds the pointer, else to the standing tools, the chosen tool and navigation.

    Parameters
    ----------
    context : ToolContext
    tools : dict
        The tools that can be chosen, by name; the first is chosen at the start.
    standing : sequence of Tool
        Asked before the chosen tool, in order: the gizmo.
    navigation : Tool
        Asked last, and first for the middle button and the wheel.
    """

    def __init__(self, context: ToolContext, tools: dict[str, Tool], standing: tuple[Tool, ...], navigation: Tool):
        self.context = context
        context.navigate = navigation
        self.tools = tools
        self.chosen_changed = Signal()
        self._standing = standing
        self._navigation = navigation
        self._chosen = next(iter(tools))
        self._holder: Tool | None = None

    @property
    def chosen(self) -> Tool:
        """The tool in use."""
        return self.tools[self._chosen]

    def choose(self, name: str) -> None:
        """Change the tool in use; what is under way is cancelled."""
        if name != self._chosen:
            self.cancel()
            self._chosen = name
            self.chosen_changed.emit()

    def stand(self, tool: Tool) -> None:
        """Ask another tool before all others."""
        self._standing = (tool, *self._standing)

    def cancel(self) -> None:
        """Cancel what is under way in every tool."""
        self._holder = None
        for tool in self._everyone():
            tool.cancel()
        self.context.hud.clear()

    def pointer(self, event: PointerEvent) -> bool:
        """Offer a pointer event; True when it was used."""
        if self._holder is not None:
            holder = self._holder
            if event.kind == "release" and not event.buttons:
                self._holder = None
            holder.pointer(event)
            return True
        for tool in self._asked(event):
            if tool.pointer(event):
                if event.kind == "press":
                    self._holder = tool
                return True
        return False

    def key(self, event: KeyEvent) -> bool:
        """Offer a key event; True when it was used. Escape cancels whatever is under way."""
        used = any(tool.key(event) for tool in (*self._standing, self.chosen, self._navigation))
        if not used and event.pressed and event.key == "Escape" and self._holder is not None:
            self.cancel()
            return True
        return used

    def _asked(self, event: PointerEvent) -> tuple[Tool, ...]:
        if event.button == "middle":
            return (self._navigation,)
        return (*self._standing, self.chosen, self._navigation)

    def _everyone(self) -> tuple[Tool, ...]:
        return (*self._standing, *self.tools.values(), self._navigation)
