"""Options, each defined once: default, bounds, choices, unit and a sentence beside the field that holds them.

An option group is a frozen dataclass whose fields are made by `option`. Recipes, their JSON Schema, error sentences,
flags of the command line and forms in the window are all made from it.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, fields
from importlib import import_module
from numbers import Integral, Real
from typing import Any, TypeVar, overload

Group = TypeVar("Group")

_KEY = "option"


@dataclass(frozen=True)
class ShareOfSize:
    """A length left to the program: so many times the scene's size s, whatever that is."""

    share: float


Length = float | ShareOfSize | None
"""World units, a share of the scene's size, or None for no bound."""


@overload
def world_length(length: float | ShareOfSize, size: float) -> float: ...
@overload
def world_length(length: None, size: float) -> None: ...
@overload
def world_length(length: Length, size: float) -> float | None: ...
def world_length(length: Length, size: float) -> float | None:
    """Length in world units, in a scene of size s; None stays None."""
    return length.share * size if isinstance(length, ShareOfSize) else length


def loaded(function: str) -> Callable[..., Any]:
    """Import what ``"module:name"`` names."""
    module, _, name = function.partition(":")
    return getattr(import_module(module), name)


@dataclass(frozen=True)
class Choice:
    """One value that an option may have: a row of a table.

    Parameters
    ----------
    label : str
        Words for it in a form.
    sentence : str
        What it does.
    function : str
        ``"module:name"`` of what does it, imported by `load` alone.
    """

    label: str
    sentence: str = ""
    function: str = ""

    @property
    def module(self) -> str:
        """Module of the function."""
        return self.function.partition(":")[0]

    def load(self) -> Callable[..., Any]:
        """Import the function."""
        return loaded(self.function)


@dataclass(frozen=True)
class Option:
    """What is known of one option besides its default.

    Parameters
    ----------
    sentence : str
        What it does, for a tooltip, the command line's help and the schema.
    label : str
        In front of its field in a form.
    above, least, most : float
        Bounds of a number: greater than, at least, at most.
    choices : mapping of str to Choice
        Empty where it is no choice.
    unit : str
        ``"world"``: the file's units; ``"of s"``: units of the scene's size; ``"px"``: pixels of the
        screen; empty for a bare number.
    is_percent : bool
        A form shows a hundred times the value.
    step, decimals
        Of the value, which a form may show as percent: 0.01 and 2 are steps of 1 % without decimals.
    only_for : (str, tuple), optional
        Name and values of another option of the group without which this one means nothing.
    is_always_written : bool
        A recipe says it even where it is at its default.
    strokes : type, optional
        Class of each item of a list of strokes: parts ``a`` and ``b``, and options of its own.
    default : object
        Filled in by `options_of`.
    """

    sentence: str
    label: str = ""
    above: float = -math.inf
    least: float = -math.inf
    most: float = math.inf
    choices: Mapping[str, Choice] = field(default_factory=dict)
    unit: str = ""
    is_percent: bool = False
    step: float = 1.0
    decimals: int = 3
    only_for: tuple[str, tuple[str, ...]] | None = None
    is_always_written: bool = False
    strokes: type | None = None
    default: Any = None

    @property
    def kind(self) -> str:
        """``"choice"``, ``"flag"``, ``"integer"``, ``"number"``, ``"length"``, ``"pairs"`` or ``"strokes"``."""
        if self.choices:
            return "choice"
        if self.strokes is not None:
            return "strokes"
        kinds = ((bool, "flag"), (int, "integer"), (float, "number"), (ShareOfSize, "length"), (tuple, "pairs"))
        return next(kind for held, kind in kinds if isinstance(self.default, held))

    @property
    def wanted(self) -> str:
        """What a value must be, in words that go after "must be"."""
        if self.kind == "choice":
            return " or ".join(f'"{choice}"' for choice in self.choices)
        if self.kind == "flag":
            return "true or false"
        if self.kind == "pairs":
            return "a list of [row, row] pairs"
        if self.kind == "strokes":
            return "a list of strokes over two parts"
        if self.kind == "integer":
            return f"a whole number, {self.least:g} " + (f"to {self.most:g}" if self.most < math.inf else "or more")
        low = f" greater than {self.above:g}" if self.above > -math.inf else ""
        low = f" of at least {self.least:g}" if self.least > -math.inf else low
        return f"a finite number{low}" + (f" and at most {self.most:g}" if self.most < math.inf else "")

    def accepts(self, value: Any) -> bool:
        """Whether a value is one that the option may have."""
        if self.kind == "choice":
            return isinstance(value, str) and value in self.choices
        if self.kind == "flag":
            return isinstance(value, bool)
        if self.kind == "pairs":
            return isinstance(value, tuple | list)
        if self.strokes is not None:
            return isinstance(value, tuple | list) and all(isinstance(item, self.strokes) for item in value)
        if self.kind == "length" and (value is None or isinstance(value, ShareOfSize)):
            return value is None or self.accepts(value.share)
        if isinstance(value, bool) or not isinstance(value, Integral if self.kind == "integer" else Real):
            return False
        try:
            number = float(value)
        except OverflowError:
            return False
        return math.isfinite(number) and number > self.above and self.least <= number <= self.most


def option(default: Any, sentence: str, **known: Any) -> Any:
    """Make the field of an option; for the arguments see `Option`."""
    return field(default=default, metadata={_KEY: Option(sentence, default=default, **known)})


def options_of(group: Any) -> dict[str, Option]:
    """Options of a group, or of its class, by name in their order."""
    return {each.name: each.metadata[_KEY] for each in fields(group) if _KEY in each.metadata}


def default_of(group: type, name: str) -> Any:
    """Default of one option of a group."""
    return options_of(group)[name].default


_USUAL: dict[type, Any] = {}


def _usual(kind: type[Group]) -> Group:
    """Group with every option at its default."""
    if kind not in _USUAL:
        _USUAL[kind] = kind()
    usual: Group = _USUAL[kind]
    return usual


class OptionSet:
    """Option groups, one of a class at most, as one immutable value; a class that is not in it is at its defaults.

    Parameters
    ----------
    *groups
        The later of two of a class counts.
    """

    def __init__(self, *groups: Any) -> None:
        held = {type(group): group for group in groups}
        self._held = {kind: group for kind, group in held.items() if group != _usual(kind)}

    def __getitem__(self, kind: type[Group]) -> Group:
        group: Group = self._held.get(kind, _usual(kind))
        return group

    def __iter__(self) -> Iterator[Any]:
        return iter(self._held.values())

    def with_groups(self, *groups: Any) -> "OptionSet":
        """Replace some groups."""
        return OptionSet(*self._held.values(), *groups)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, OptionSet) and self._held == other._held

    def __hash__(self) -> int:
        return hash(frozenset(self._held.values()))

    def __repr__(self) -> str:
        return f"OptionSet({', '.join(map(repr, self._held.values()))})"


def check_options(group: Any) -> None:
    """Raise a ValueError that names the first option of a group whose value is none; for ``__post_init__``."""
    for name, known in options_of(group).items():
        if not known.accepts(getattr(group, name)):
            raise ValueError(f"{name} must be {known.wanted}, got {getattr(group, name)!r}")
