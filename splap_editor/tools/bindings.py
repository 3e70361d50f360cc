"""What pointer and keys do in a tool, as a table: dispatch, status line, help sheet and README read the same rows."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

if TYPE_CHECKING:
    from splap_editor.tools.tool import Stroke

Used: TypeAlias = "Stroke | bool | None"
"""What an act gives: whether the event was used, or the drag that it began."""

MODIFIERS = ("Shift", "Ctrl", "Alt")
_QT_NAMES = {"[": "BracketLeft", "]": "BracketRight", "Esc": "Escape"}
_BUTTONS = {"left": "", "middle": "Middle ", "right": "Right "}
_SHOWN = {"Press": "click", "Right press": "right click", "Any+Number": "a number"}
_TYPED = frozenset("0123456789.-")


class Chord(NamedTuple):
    """A gesture or key, and the modifiers held with it; None: with whatever modifiers.

    Gestures of the left button are ``"Click"`` and ``"Drag"``, of the others ``"Middle drag"`` and so on; ``"Press"``,
    ``"Move"`` and ``"Release"`` tell the steps of one; ``"Wheel"``, ``"Two fingers"`` and ``"Pinch"`` have no button.
    Keys are named as Qt does, ``"Number"`` is whatever types one.
    """

    name: str
    modifiers: frozenset[str] | None


@cache
def chord(text: str) -> Chord:
    """Read ``"Shift+Ctrl+Drag"``, ``"["``, ``"Any+Wheel"``.

    Raises
    ------
    ValueError
        A modifier is not one.
    """
    *held, name = text.split("+")
    if held == ["Any"]:
        return Chord(name, None)
    unknown = set(held) - set(MODIFIERS)
    if unknown:
        raise ValueError(f"{text!r} holds {', '.join(unknown)}; modifiers are {', '.join(MODIFIERS)}, or Any")
    return Chord(_QT_NAMES.get(name, name), frozenset(held))


@dataclass(frozen=True)
class Binding:
    """One row: these chords do this.

    Parameters
    ----------
    chords : tuple of str
        As `chord` reads them.
    act : callable
        ``act(tool, event)``; what it gives tells whether the event was used. A drag gives its `Stroke`.
    sentence : str
        What it does, for the help sheet; empty for a row that needs no telling.
    brief : str
        The same in two or three words for the status line; empty: not told there.
    on : str
        Where the pointer has to be, if not anywhere.
    at_once : bool
        A click or drag that begins with the press, and does not wait to be told from the other.
    """

    chords: tuple[str, ...]
    act: Callable[[Any, Any], Used]
    sentence: str = ""
    brief: str = ""
    on: str = ""
    at_once: bool = False
    _read: tuple[Chord, ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_read", tuple(chord(text) for text in self.chords))

    def answers(self, name: str, held: frozenset[str]) -> bool:
        """Whether one of the chords has this name and these modifiers."""
        return any(each.name == name and each.modifiers in (None, held) for each in self._read)

    @property
    def keys(self) -> str:
        """The chords for a person: ``"Ctrl + wheel, [ ]"``, ``"click on the surface"``."""
        signs = [text for text in self.chords if len(text) == 1]
        words = [_words(text) for text in self.chords if len(text) > 1]
        shown = ", ".join([*words, " ".join(signs)] if signs else words)
        return f"{shown} on {self.on}" if self.on else shown


def _words(text: str) -> str:
    """A chord for a person; a move with modifiers is the modifiers, held."""
    if text.removeprefix("Any+") in _SHOWN or text in _SHOWN:
        return _SHOWN.get(text, _SHOWN.get(text.removeprefix("Any+"), ""))
    *held, name = text.removeprefix("Any+").split("+")
    if name == "Move":
        return " + ".join(held)
    is_gesture = len(name) > 1 and any(name.endswith(word) for word in ("lick", "rag", "heel", "ingers", "inch"))
    return " + ".join([*held, name.lower() if is_gesture else name])


def answering(bindings: Iterable[Binding], name: str, held: frozenset[str]) -> Iterator[Binding]:
    """Rows for a chord, in the order of the table."""
    return (binding for binding in bindings if binding.answers(name, held))


def gesture_name(button: str, gesture: str) -> str:
    """Name of what a button does: ``("middle", "Drag")`` is a ``"Middle drag"``."""
    before = _BUTTONS[button]
    return before + gesture.lower() if before else gesture


def key_names(event: Any) -> tuple[str, ...]:
    """Names that a key event goes by."""
    types = bool(event.text) and event.text in _TYPED and not (event.ctrl or event.alt)
    return (event.key, "Number") if types else (event.key,)


def held_modifiers(event: Any) -> frozenset[str]:
    """Modifiers of a pointer or key event."""
    return frozenset(name for name in MODIFIERS if getattr(event, name.lower()))


def capitalised(text: str) -> str:
    """The text with a capital at its start."""
    return text[:1].upper() + text[1:]


@cache
def hint_of(bindings: tuple[Binding, ...]) -> str:
    """The table in a line: ``"Click: place a handle  ·  Ctrl + wheel, [ ]: reach"``."""
    return "  ·  ".join(f"{capitalised(binding.keys)}: {binding.brief}" for binding in bindings if binding.brief)
