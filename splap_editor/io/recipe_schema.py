"""JSON Schema of recipes, made from the same tables as their reader.

``python -m splap_editor.io.recipe_schema`` prints it; the copy in ``resources/schemas`` travels in the wheel.
"""

import json
import math
from typing import Any

from splap_editor.core.deformers import method_titles
from splap_editor.core.grade_options import GradeOptions
from splap_editor.core.options import Option, ShareOfSize, options_of
from splap_editor.core.pose import SCALES
from splap_editor.core.presets import PRESETS
from splap_editor.core.reach_options import CageOptions
from splap_editor.core.splats.splats import LARGEST_COORDINATE
from splap_editor.io.recipe import VERSION, recipe_groups
from splap_editor.io.recipe_camera import camera_schema
from splap_editor.io.recipe_removal import OUTSIDE, picked_properties, place_schema, removal_schema

_ROW = {"type": "integer", "minimum": 0, "exclusiveMaximum": 2**31}
_PAIR = {"type": "array", "items": _ROW, "minItems": 2, "maxItems": 2, "uniqueItems": True}
_POINT = {"type": "number", "minimum": -LARGEST_COORDINATE, "maximum": LARGEST_COORDINATE}
_SCALE = {"type": "number", "minimum": SCALES[0], "maximum": SCALES[1]}
_ROWS_OF = "Content hash of the file that rows are meant of, where its format has an order of rows of its own."
_POSITIVE = {"type": "number", "exclusiveMinimum": 0}


FREES = "Whether the free radius is measured from it too; false: it holds splats where they have gone, as a pin does."


def recipe_schema() -> dict[str, Any]:
    """Make the schema, draft 2020-12.

    It accepts what `read_recipe` accepts, but for what JSON Schema does not tell apart or the reader does not mind: 3.0
    is a whole number, numbers beyond float64 are numbers, a key that stands twice stands once, and a camera may look
    along its upward vector, at itself, and have its frames in any order.
    """
    properties: dict[str, Any] = {
        "version": {"const": VERSION},
        "preset": {
            "enum": list(PRESETS),
            "description": "Options that the other keys start from. "
            + " ".join(f"{name}: {preset.sentence}" for name, preset in PRESETS.items()),
        },
        "method": {"enum": list(method_titles()), "default": next(iter(method_titles()))},
        "rows_of": {"type": "string", "default": "", "description": _ROWS_OF},
        "handles": {"type": "array", "items": _placed(_handle_properties())},
        "pins": {"type": "array", "items": _placed({"name": {"type": "string", "default": ""}})},
    }
    for key, group in recipe_groups():
        options = {name: _option(known) for name, known in options_of(group).items()}
        properties.update({key: _object(options)} if key else options)
    properties |= {"remove": removal_schema(), "grade": grade_schema()}
    properties |= {"place": place_schema(), "camera": camera_schema()}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "SpLap recipe",
        "description": "An edit of a splat PLY: which splats are moved where, what stays, and how the rest follows.",
        **_object(properties, ["version"]),
    }


def grade_schema() -> dict[str, Any]:
    """JSON Schema of the key ``grade``."""
    picked = picked_properties()
    options = {name: _option(known) for name, known in options_of(GradeOptions).items()}
    of_some = [{"required": [key]} for key in picked]
    of_all = {"not": {"anyOf": of_some}, "properties": {"outside": {"const": False}}}
    step = {**_object({**picked, "outside": OUTSIDE, **options}), "oneOf": [of_all, *of_some]}
    return {
        "anyOf": [step, {"type": "array", "items": step}],
        "description": "Colour grades, each over those before: of what is picked at rest, or of all splats.",
    }


def _object(properties: dict[str, Any], required: list[str] | None = None) -> dict[str, Any]:
    needed = {"required": required} if required else {}
    return {"type": "object", "properties": properties, **needed, "additionalProperties": False}


def _placed(properties: dict[str, Any]) -> dict[str, Any]:
    """Splats by centre and radius, or by file rows, and what else is said of them."""
    rows = {"type": "array", "items": _ROW, "minItems": 1}
    both = _object({"center": _vector(3, _POINT), "radius": _POSITIVE, "rows": rows, **properties})
    ways = [
        {"required": ["rows"], "not": {"required": ["radius"]}},
        {"required": ["center", "radius"], "not": {"required": ["rows"]}},
    ]
    return {**both, "oneOf": ways}


def _handle_properties() -> dict[str, Any]:
    scales = [_SCALE, _vector(3, _SCALE)]
    return {
        "name": {"type": "string"},
        "translate": {**_vector(3, _POINT), "description": "In the file's units."},
        "rotate": {
            **_vector(4, {"type": "number"}),
            "contains": {"not": {"const": 0}},
            "description": "Quaternion w, x, y, z, about the center; normalised when read.",
        },
        "scale": {"anyOf": scales, "description": "About the center: uniform, or along the world axes."},
        **{name: _option(known) for name, known in options_of(CageOptions).items()},
        "frees": {"type": "boolean", "default": True, "description": FREES},
    }


def _vector(size: int, item: dict[str, Any]) -> dict[str, Any]:
    return {"type": "array", "items": item, "minItems": size, "maxItems": size}


def _option(known: Option) -> dict[str, Any]:
    """What one option may be, what it does and what it is without."""
    said: dict[str, Any] = {"description": known.sentence}
    if known.kind == "choice":
        said |= {"enum": list(known.choices), "default": known.default}
    elif known.kind == "flag":
        said |= {"type": "boolean", "default": known.default}
    elif known.strokes is not None:
        own = options_of(known.strokes)
        parts = {"type": "array", "items": _vector(3, _POINT), "minItems": 1}
        needed = ["a", "b", *(name for name, each in own.items() if not each.accepts(each.default))]
        stroke = _object({"a": parts, "b": parts, **{name: _option(each) for name, each in own.items()}}, needed)
        said |= {"type": "array", "items": stroke, "default": []}
    elif known.kind == "pairs":
        said |= {"type": "array", "items": _PAIR, "default": []}
    else:
        said["type"] = {"integer": "integer", "number": "number", "length": ["number", "null"]}[known.kind]
        bounds = (("exclusiveMinimum", known.above), ("minimum", known.least), ("maximum", known.most))
        said |= {name: bound for name, bound in bounds if math.isfinite(bound)}
        if isinstance(known.default, ShareOfSize):
            said["description"] += f" By default {known.default.share:g} times the size of the scene."
        elif known.accepts(known.default):
            said["default"] = known.default
    return said


def schema_text() -> str:
    """The schema as it is published."""
    return json.dumps(recipe_schema(), indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    print(schema_text(), end="")
