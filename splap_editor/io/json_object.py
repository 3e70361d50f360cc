"""JSON objects read key by key: each wrong value is refused with its path and what to put there."""

import json
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from difflib import get_close_matches
from typing import Any, Literal, TypeVar, overload

from splap_editor.core.index_spaces import FileRow
from splap_editor.core.options import Option, options_of
from splap_editor.core.splats.splats import LARGEST_COORDINATE

Error = Callable[[str], ValueError]
Group = TypeVar("Group")

Look = Callable[[], None]
"""Called now and then while a long document is read; raises `splap_editor.core.progress.Cancelled` to stop that."""

ITEMS = 1 << 12
"""Numbers, or items of a list, from one look to the next."""

_MOST_DIGITS = 400
"""Digits of a whole number: more than the largest float has."""

MOST_VALUES = 4_000_000
"""Lists, texts, flags and nulls in a document, an object counting for four: each takes up to 60 bytes of memory."""


_MARKS = {b"[": 1, b'"': 0.5, b"{": 4, b"null": 1, b"true": 1, b"false": 1}
"""What gives values away that are counted, and for how many of them each stands."""

MOST_KEYS = 1 << 12
"""Keys and other colons for each object."""


def no_look() -> None:
    """Never stop."""


class JsonObject:
    """One object of a JSON document and where it stands in it.

    Parameters
    ----------
    value : object
        What ``json`` made of it.
    path : str
        Where it is, as ``handles[0]``; empty for the document itself.
    keys : tuple of str
        The keys it may have; any other is refused with the nearest of them.
    error : callable (sentence) → exception
        Exception to raise.
    look : Look
        Called before each object and some items of long lists.
    """

    def __init__(self, value: Any, path: str, keys: tuple[str, ...], error: Error, look: Look = no_look) -> None:
        look()
        self._path = path
        self._error = error
        self._look = look
        if not isinstance(value, dict):
            raise error(f"{path or 'the document'} must be an object in braces, got {shown(value)}")
        self._value = value
        for key in value:
            if key not in keys:
                near = get_close_matches(key[:60], keys, 1)
                hint = f"did you mean {near[0]!r}?" if near else f"the keys are {', '.join(keys)}"
                raise error(f"{self.at(shown(key)[1:-1])} is not known: {hint}")

    def __contains__(self, key: str) -> bool:
        return key in self._value

    def at(self, key: str) -> str:
        """Path of a key."""
        return f"{self._path}.{key}" if self._path else str(key)

    def is_null(self, key: str) -> bool:
        """Whether the key is there and null."""
        return key in self._value and self._value[key] is None

    def refuse(self, key: str, wanted: str) -> ValueError:
        """Exception for a value of a key that is not what is wanted."""
        got = f"got {shown(self._value[key])}" if key in self._value else "it is missing"
        return self._error(f"{self.at(key)} must be {wanted}, {got}")

    def text(self, key: str, default: str) -> str:
        """A string."""
        value = self._value.get(key, default)
        if not isinstance(value, str):
            raise self.refuse(key, "text in quotes")
        return value

    def flag(self, key: str, default: bool) -> bool:
        """True or false."""
        value = self._value.get(key, default)
        if not isinstance(value, bool):
            raise self.refuse(key, "true or false")
        return value

    def choice(self, key: str, choices: tuple[str, ...], default: str) -> str:
        """One of some strings."""
        value = self._value.get(key, default)
        if not isinstance(value, str) or value not in choices:
            raise self.refuse(key, " or ".join(f'"{choice}"' for choice in choices))
        return value

    def integer(self, key: str, default: int, *, low: int, high: int = 2**31 - 1) -> int:
        """A whole number between bounds."""
        value = self._value.get(key, default)
        if not _is_integer(value) or not low <= value <= high:
            raise self.refuse(key, f"a whole number, {low} " + (f"to {high}" if high < 2**31 - 1 else "or more"))
        return int(value)

    def number(
        self,
        key: str,
        default: float | None = None,
        *,
        above: float = -math.inf,
        least: bool = False,
        most: float = math.inf,
    ) -> float:
        """A finite number above a bound, or at least it, and not beyond another; without a default it must be there."""
        number = _finite(self._value.get(key, default))
        if number is None or number < above or (number == above and not least) or number > most:
            bound = "" if above == -math.inf else f" of at least {above:g}" if least else f" greater than {above:g}"
            bound += "" if most == math.inf else f" and at most {most:g}" if bound else f" of at most {most:g}"
            raise self.refuse(key, f"a finite number{bound}")
        return number

    @overload
    def vector(
        self, key: str, size: Literal[3], default: tuple[float, ...] | None = None, *, most: float = math.inf
    ) -> tuple[float, float, float]: ...
    @overload
    def vector(
        self, key: str, size: Literal[4], default: tuple[float, ...] | None = None, *, most: float = math.inf
    ) -> tuple[float, float, float, float]: ...

    def vector(
        self, key: str, size: int, default: tuple[float, ...] | None = None, *, most: float = math.inf
    ) -> tuple[float, ...]:
        """A list of finite numbers of at most that size; without a default it must be there."""
        value = self._value.get(key, default)
        # A list of any other length is not looked at further.
        items = value if isinstance(value, list | tuple) and len(value) == size else []
        numbers = [number for number in map(_finite, items) if number is not None and abs(number) <= most]
        if len(numbers) != size:
            bound = "" if most == math.inf else f" between {-most:g} and {most:g}"
            raise self.refuse(key, f"a list of {size} finite numbers{bound}")
        return tuple(numbers)

    def options(self, group: type[Group], usual: Group | None = None) -> Group:
        """An option group, each option under its name; a missing one is as in ``usual``, or takes its default."""
        said = {name: self._option(name, known) for name, known in options_of(group).items() if name in self}
        try:
            return group(**said) if usual is None else replace(usual, **said)  # type: ignore[type-var]
        except ValueError as error:
            # What no single option tells: values that do not go together, or a gap in their range.
            raise self._error(str(error)) from None

    def _option(self, key: str, known: Option) -> Any:
        if known.kind == "pairs":
            return self.row_pairs(key)
        if known.strokes is not None:
            return self.strokes(key, known.strokes)
        value = self._value[key]
        if not known.accepts(value):
            raise self.refuse(key, known.wanted)
        return float(value) if known.kind in ("number", "length") and value is not None else value

    def strokes(self, key: str, kind: Callable[..., Group]) -> tuple[Group, ...]:
        """A list, perhaps empty, of strokes over two parts ``a`` and ``b``, with options of their own."""
        own = options_of(kind)
        found = []
        for item in self.objects(key, ("a", "b", *own)):
            for name, known in own.items():
                if name not in item and not known.accepts(known.default):
                    raise item.refuse(name, known.wanted)
            said = {name: item._option(name, known) for name, known in own.items() if name in item}
            found.append(kind(a=item.points("a"), b=item.points("b"), **said))
        return tuple(found)

    def points(self, key: str) -> tuple[tuple[float, float, float], ...]:
        """A list of points with at least one in it, which must be there."""
        value = self._value.get(key)
        if not isinstance(value, list | tuple) or not value:
            raise self.refuse(key, "a list of [x, y, z] points with at least one in it")
        found = []
        for i, point in self._looked_at(value):
            numbers = [_finite(part) for part in point] if isinstance(point, list | tuple) and len(point) == 3 else []
            fine = [number for number in numbers if number is not None and abs(number) <= LARGEST_COORDINATE]
            if len(fine) != 3:
                raise self._error(
                    f"{self.at(key)}[{i}] must be a point of 3 finite numbers between {-LARGEST_COORDINATE:g} and "
                    f"{LARGEST_COORDINATE:g}, got {shown(point)}"
                )
            found.append((fine[0], fine[1], fine[2]))
        return tuple(found)

    def rows(self, key: str) -> tuple[FileRow, ...]:
        """A list of file rows with at least one in it."""
        value = self._value.get(key)
        if not isinstance(value, list | tuple) or not value:
            raise self.refuse(key, "a list of row numbers with at least one in it")
        for i, row in self._looked_at(value):
            if not _is_integer(row) or not 0 <= row < 2**31:
                raise self._error(f"{self.at(key)}[{i}] must be a row number, 0 or more, got {shown(row)}")
        return tuple(value)

    def row_pairs(self, key: str) -> tuple[tuple[int, int], ...]:
        """A list, perhaps empty, of pairs of different file rows."""
        value = self._value.get(key, ())
        if not isinstance(value, list | tuple):
            raise self.refuse(key, "a list of [row, row] pairs")
        found = []
        for i, pair in self._looked_at(value):
            fine = isinstance(pair, list | tuple) and len(pair) == 2 and all(_is_integer(row) for row in pair)
            if not fine or not all(0 <= row < 2**31 for row in pair) or pair[0] == pair[1]:
                raise self._error(f"{self.at(key)}[{i}] must be a pair of different row numbers, got {shown(pair)}")
            found.append((pair[0], pair[1]))
        return tuple(found)

    def _looked_at(self, items: Sequence[Any]) -> Iterator[tuple[int, Any]]:
        """Items with their numbers; it may be stopped between them."""
        for i, item in enumerate(items):
            if i % ITEMS == 0:
                self._look()
            yield i, item

    def objects(self, key: str, keys: tuple[str, ...]) -> "Iterator[JsonObject]":
        """Yield the objects of a list, which may be missing."""
        value = self._value.get(key, ())
        if not isinstance(value, list | tuple):
            raise self.refuse(key, "a list of objects")
        for i, item in enumerate(value):
            yield JsonObject(item, f"{self.at(key)}[{i}]", keys, self._error, self._look)

    def one_or_more(self, key: str, keys: tuple[str, ...]) -> "Iterator[JsonObject]":
        """Yield an object, or those of a list, which may be missing."""
        if isinstance(self._value.get(key), dict):
            yield self.object(key, keys)
        else:
            yield from self.objects(key, keys)

    def wrong(self, sentence: str) -> ValueError:
        """Exception that says what is wrong with the object itself."""
        return self._error(f"{self._path} {sentence}")

    def object(self, key: str, keys: tuple[str, ...]) -> "JsonObject":
        """An object; a missing one is empty."""
        return JsonObject(self._value.get(key, {}), self.at(key), keys, self._error, self._look)


def parsed_json(data: bytes, error: Error, look: Look = no_look) -> Any:
    """Parse a JSON text, keys that stand twice refused.

    The parser calls back for each number and object, so that it can be stopped and other threads have their turn:
    alone it would hold Python's lock for seconds.

    Parameters
    ----------
    data : bytes
        UTF-8, a byte-order mark allowed.
    error : callable (sentence) → exception
        Exception to raise.
    look : Look
        Called now and then.
    """
    n_seen = 0

    def seen_one() -> None:
        nonlocal n_seen
        n_seen += 1
        if n_seen % ITEMS == 0:
            look()

    def distinct(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        seen_one()
        found = dict(pairs)
        if len(found) < len(pairs):
            seen: set[str] = set()
            for key, _ in pairs:
                if key in seen:
                    raise error(f"the key {key[:60]!r} stands twice: remove one")
                seen.add(key)
        return found

    def whole(digits: str) -> int:
        seen_one()
        if len(digits) > _MOST_DIGITS:
            raise error(f"it has a whole number of {len(digits):,} digits: {_MOST_DIGITS} are the most")
        return int(digits)

    def real(digits: str) -> float:
        seen_one()
        return float(digits)

    n_values = 0
    for mark, n_each in _MARKS.items():
        look()
        n_values += int(data.count(mark) * n_each)
    # A long object is parsed in one go, and no document here has one.
    if data.count(b":") > MOST_KEYS * (1 + data.count(b"{")):
        raise error(f"it holds objects of more than {MOST_KEYS:,} keys")
    if n_values > MOST_VALUES:
        raise error(f"it holds more than {MOST_VALUES:,} lists, objects, texts, flags and nulls")
    try:
        return json.loads(data.decode("utf-8-sig"), object_pairs_hook=distinct, parse_int=whole, parse_float=real)
    except json.JSONDecodeError as problem:
        raise error(f"it is not JSON: {problem.msg} in line {problem.lineno}, column {problem.colno}") from None
    except UnicodeDecodeError:
        raise error("it is not text in UTF-8") from None
    except RecursionError:
        raise error("it is nested too deeply") from None


def json_lines(value: dict[str, Any]) -> str:
    """JSON of an object, with a line for each key and for each item of its lists."""

    def line(item: Any) -> str:
        return json.dumps(item, ensure_ascii=False, allow_nan=False)

    lines = []
    for key, item in value.items():
        parts = ",\n  ".join(line(part) for part in item) if isinstance(item, list) else ""
        lines.append(f' "{key}": ' + (f"[\n  {parts}\n ]" if parts else line(item)))
    return "{\n" + ",\n".join(lines) + "\n}\n"


def shown(value: Any) -> str:
    """A value as JSON, cut to a glance."""
    # Of long lists and texts only the beginning is looked at.
    if isinstance(value, list | tuple | str):
        value = value[:60]
    text = json.dumps(value, default=str)
    return text if len(text) <= 60 else text[:57] + "..."


def _is_integer(value: Any) -> bool:
    """Whether a value is a whole number; ``true`` is none."""
    return isinstance(value, int) and not isinstance(value, bool)


def _finite(value: Any) -> float | None:
    """Value as a float, None if it is no finite number; ``true`` is none."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if math.isfinite(number) else None
