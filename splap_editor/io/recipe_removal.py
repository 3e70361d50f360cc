"""What a recipe says of splats that are removed, and of the place that a scene is put in."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from splap_editor.core.place import Place
from splap_editor.core.pose import SCALES
from splap_editor.core.removal import (
    LARGEST_SIZE,
    Picked,
    PickedBall,
    PickedBox,
    PickedFloaters,
    PickedRange,
    PickedRows,
    PickedSide,
    RemovalStep,
)
from splap_editor.core.splats.splats import LARGEST_COORDINATE
from splap_editor.io.json_object import JsonObject

_POINT = {"type": "number", "minimum": -LARGEST_COORDINATE, "maximum": LARGEST_COORDINATE}
_POSITIVE = {"type": "number", "exclusiveMinimum": 0, "maximum": LARGEST_SIZE}
_ROW = {"type": "integer", "minimum": 0, "exclusiveMaximum": 2**31}
_TURN = {
    "type": "array",
    "items": {"type": "number"},
    "minItems": 4,
    "maxItems": 4,
    "contains": {"not": {"const": 0}},
    "description": "Quaternion w, x, y, z; normalised when read.",
}


def _three(item: dict[str, Any]) -> dict[str, Any]:
    return {"type": "array", "items": item, "minItems": 3, "maxItems": 3}


@dataclass(frozen=True)
class PickedKind:
    """One way of picking splats, as recipes have it.

    Parameters
    ----------
    key : str
        Of a step.
    made : type
        What it becomes.
    properties : dict
        JSON Schema of what an object under the key may hold; empty where it is a list of rows.
    required : tuple of str
        What it must hold.
    read : callable (object) → Picked
    said : callable (Picked) → plain objects
    sentence : str
        What it picks.
    """

    key: str
    made: type
    properties: dict[str, Any]
    required: tuple[str, ...]
    read: Callable[[JsonObject], Picked]
    said: Callable[[Any], Any]
    sentence: str


def _box(box: JsonObject) -> PickedBox:
    size = box.vector("size", 3, most=LARGEST_SIZE)
    if min(size) <= 0.0:
        raise box.refuse("size", "three numbers greater than 0")
    return PickedBox(box.vector("center", 3, most=LARGEST_COORDINATE), size, turn(box, "rotate"))


def _side(plane: JsonObject) -> PickedSide:
    normal = plane.vector("normal", 3, most=LARGEST_COORDINATE)
    if not any(normal):
        raise plane.refuse("normal", "a vector that is not zero")
    return PickedSide(plane.vector("point", 3, most=LARGEST_COORDINATE), normal)


def _range(within: JsonObject) -> PickedRange:
    name = within.text("name", "")
    if not name:
        raise within.refuse("name", "the name of a quantity")
    least = within.number("least", least=True) if "least" in within else -math.inf
    most = within.number("most", least=True) if "most" in within else math.inf
    if least > most:
        raise within.refuse("most", f"at least {least:g}")
    return PickedRange(name, least, most)


def _floaters(found: JsonObject) -> PickedFloaters:
    return PickedFloaters(found.number("strength", PickedFloaters.strength, above=0.0, least=True, most=0.99))


def _ball(ball: JsonObject) -> PickedBall:
    radius = ball.number("radius", above=0.0, most=LARGEST_SIZE)
    return PickedBall(ball.vector("center", 3, most=LARGEST_COORDINATE), radius)


def _said_box(box: PickedBox) -> dict[str, Any]:
    said = {"center": list(box.center), "size": list(box.size)}
    return said if box.rotate == PickedBox.rotate else {**said, "rotate": list(box.rotate)}


def _said_range(within: PickedRange) -> dict[str, Any]:
    bounds = {"least": within.least, "most": within.most}
    return {"name": within.quantity, **{name: bound for name, bound in bounds.items() if math.isfinite(bound)}}


PICKED_KINDS = (
    PickedKind(
        "box",
        PickedBox,
        {"center": _three(_POINT), "size": _three(_POSITIVE), "rotate": _TURN},
        ("center", "size"),
        _box,
        _said_box,
        "Splats whose centre lies in a box, which its rotation turns about its center.",
    ),
    PickedKind(
        "sphere",
        PickedBall,
        {"center": _three(_POINT), "radius": _POSITIVE},
        ("center", "radius"),
        _ball,
        lambda ball: {"center": list(ball.center), "radius": ball.radius},
        "Splats whose centre lies in a sphere.",
    ),
    PickedKind(
        "plane",
        PickedSide,
        {"point": _three(_POINT), "normal": {**_three(_POINT), "contains": {"not": {"const": 0}}}},
        ("point", "normal"),
        _side,
        lambda side: {"point": list(side.point), "normal": list(side.normal)},
        "Splats whose centre lies on the side of a plane that its normal points to.",
    ),
    PickedKind(
        "quantity",
        PickedRange,
        {"name": {"type": "string", "minLength": 1}, "least": {"type": "number"}, "most": {"type": "number"}},
        ("name",),
        _range,
        _said_range,
        "Splats for which a quantity is within bounds, both included.",
    ),
    PickedKind(
        "floaters",
        PickedFloaters,
        {"strength": {"type": "number", "minimum": 0, "maximum": 0.99, "default": PickedFloaters.strength}},
        (),
        _floaters,
        lambda found: {"strength": found.strength},
        "Splats that float about the subject: haze, clumps and far specks.",
    ),
)
"""Ways of picking splats beside by row; each replays on a capture that was trained anew."""

PICKED_KEYS = ("rows", *(kind.key for kind in PICKED_KINDS))
_STEP_KEYS = (*PICKED_KEYS, "outside", "restore")


def turn(held: JsonObject, key: str) -> tuple[float, float, float, float]:
    """A quaternion, normalised; no turn where it is missing."""
    rotate = held.vector(key, 4, (1.0, 0.0, 0.0, 0.0))
    length = math.hypot(*rotate)
    if not 0 < length < math.inf:
        raise held.refuse(key, "a quaternion w, x, y, z that is not zero")
    if abs(length - 1) > 1e-12:
        # Twice, since the length of very short ones is imprecise.
        w, x, y, z = (part / length for part in rotate)
        length = math.hypot(w, x, y, z)
        rotate = (w / length, x / length, y / length, z / length)
    return rotate


def removal_from_json(recipe: JsonObject, key: str) -> tuple[RemovalStep, ...]:
    """Steps of a removal: one object, or a list of them in the order in which they are taken."""
    return tuple(_step(step) for step in recipe.one_or_more(key, _STEP_KEYS))


def _step(step: JsonObject) -> RemovalStep:
    picked = picked_from_json(step)
    if picked is None:
        raise step.wrong(f"must have one of the keys {', '.join(PICKED_KEYS)}")
    return RemovalStep(picked, step.flag("outside", False), step.flag("restore", False))


def picked_from_json(step: JsonObject) -> Picked | None:
    """Read the one way of picking splats that a step has; None where it has none."""
    named = [key for key in PICKED_KEYS if key in step]
    if not named:
        return None
    if len(named) > 1:
        raise step.wrong(f"must have one of the keys {', '.join(PICKED_KEYS)}")
    if named == ["rows"]:
        return PickedRows(np.unique(np.array(step.rows("rows"), np.int32)))
    kind = next(kind for kind in PICKED_KINDS if kind.key == named[0])
    return kind.read(step.object(kind.key, tuple(kind.properties)))


def removal_to_json(steps: tuple[RemovalStep, ...]) -> Any:
    """Plain objects of the steps of a removal; of a single one, the object itself."""
    said = [_said_step(step) for step in steps]
    return said[0] if len(said) == 1 else said


def _said_step(step: RemovalStep) -> dict[str, Any]:
    flags = {"outside": step.outside, "restore": step.restores}
    said = {name: True for name, is_set in flags.items() if is_set}
    return {**picked_to_json(step.picked), **said}


def picked_to_json(picked: Picked) -> dict[str, Any]:
    """Plain objects of a way of picking splats."""
    if isinstance(picked, PickedRows):
        return {"rows": np.asarray(picked.rows).tolist()}
    kind = next(kind for kind in PICKED_KINDS if isinstance(picked, kind.made))
    return {kind.key: kind.said(picked)}


def place_from_json(place: JsonObject) -> Place:
    """A place, each part at rest where it is missing."""
    scale = place.number("scale", 1.0, above=SCALES[0], least=True, most=SCALES[1])
    center, translate = (place.vector(key, 3, (0.0, 0.0, 0.0), most=LARGEST_COORDINATE) for key in PLACE_KEYS[:2])
    return Place(center, translate, turn(place, "rotate"), scale)


PLACE_KEYS = ("center", "translate", "rotate", "scale")


def place_to_json(place: Place) -> dict[str, Any]:
    """Plain objects of a place; what is at rest is left out."""
    if place.is_identity:
        return {}
    held = {key: getattr(place, key) for key in PLACE_KEYS}
    return {
        key: list(value) if isinstance(value, tuple) else value
        for key, value in held.items()
        if value != getattr(Place, key)
    }


OUTSIDE = {"type": "boolean", "default": False, "description": "Everything else is meant."}


def picked_properties() -> dict[str, Any]:
    """JSON Schema of each way of picking splats, by key."""
    rows = {"type": "array", "items": _ROW, "minItems": 1, "description": "File rows."}
    properties: dict[str, Any] = {"rows": rows}
    for kind in PICKED_KINDS:
        properties[kind.key] = {
            "type": "object",
            "properties": kind.properties,
            **({"required": list(kind.required)} if kind.required else {}),
            "additionalProperties": False,
            "description": kind.sentence,
        }
    return properties


def removal_schema() -> dict[str, Any]:
    """JSON Schema of the key ``remove``."""
    properties = picked_properties()
    step = {
        "type": "object",
        "properties": {
            **properties,
            "outside": OUTSIDE,
            "restore": {"type": "boolean", "default": False, "description": "Brought back rather than removed."},
        },
        "additionalProperties": False,
        "oneOf": [{"required": [key]} for key in properties],
    }
    return {
        "anyOf": [step, {"type": "array", "items": step}],
        "description": "Splats that are left out of everything, in the order of the steps; before anything else.",
    }


def place_schema() -> dict[str, Any]:
    """JSON Schema of the key ``place``."""
    return {
        "type": "object",
        "properties": {
            "center": _three(_POINT),
            "translate": _three(_POINT),
            "rotate": _TURN,
            "scale": {"type": "number", "minimum": SCALES[0], "maximum": SCALES[1], "default": 1},
        },
        "additionalProperties": False,
        "description": "How all of it is scaled, turned about the center and moved as one body; after all else.",
    }
