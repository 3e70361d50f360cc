"""Recipes: an edit as JSON, for scripts and for the window alike."""

import os
from pathlib import Path
from typing import Any

import numpy as np

from splap_editor.core.adaptation.options import AdaptationOptions, RepairOptions
from splap_editor.core.deformers import DEFORMERS, method_titles
from splap_editor.core.graph.options import GraphOptions, Joint, Separation
from splap_editor.core.options import OptionSet, ShareOfSize, options_of
from splap_editor.core.pose import SCALES, Pose
from splap_editor.core.presets import PRESETS, with_preset
from splap_editor.core.progress import Progress, no_progress, part_of
from splap_editor.core.reach_options import CageOptions, ReachOptions
from splap_editor.core.splats.splats import LARGEST_COORDINATE
from splap_editor.io.atomic_file import whole_file
from splap_editor.io.json_object import JsonObject, Look, json_lines, no_look, parsed_json, shown
from splap_editor.io.plain_edit import Edit, Handle, Pin, Vector
from splap_editor.io.recipe_camera import camera_from_json, camera_to_json
from splap_editor.io.recipe_grade import grade_from_json, grade_to_json
from splap_editor.io.recipe_removal import (
    PLACE_KEYS,
    place_from_json,
    place_to_json,
    removal_from_json,
    removal_to_json,
    turn,
)
from splap_editor.io.regular_file import regular_bytes

__all__ = [
    "Edit",
    "Handle",
    "Pin",
    "RecipeError",
    "pose_from_json",
    "pose_to_json",
    "read_recipe",
    "recipe_from_json",
    "recipe_groups",
    "recipe_to_json",
    "write_recipe",
]

VERSION = 1

REGION_KEYS = ("center", "radius", "rows")
PIN_KEYS = (*REGION_KEYS, "name")
HANDLE_KEYS = ("name", *REGION_KEYS, "translate", "rotate", "scale", *options_of(CageOptions), "frees")


def recipe_groups() -> tuple[tuple[str, type], ...]:
    """Option groups in the order of their keys; an empty key for those whose options are keys of the recipe itself."""
    groups = [("graph", GraphOptions), ("", ReachOptions), ("", AdaptationOptions), ("", RepairOptions)]
    for row in DEFORMERS:
        if (row.key, row.options) not in groups:
            groups.insert(2 if row.key else len(groups), (row.key, row.options))
    return tuple(groups)


def recipe_keys() -> tuple[str, ...]:
    """Keys that a recipe may have."""
    keys = [key for key, group in recipe_groups() for key in ([key] if key else options_of(group))]
    return ("version", "preset", "method", "rows_of", "handles", "pins", "remove", "grade", "place", "camera", *keys)


class RecipeError(ValueError):
    """A recipe that cannot be read; the message names the key and says what to put there."""


def read_recipe(path: str | os.PathLike[str], progress: Progress = no_progress) -> Edit:
    """Read a recipe.

    ``progress`` is told the share of bytes read, and now and then while they
    are parsed, which takes seconds for the largest; it may cancel.

    Raises
    ------
    RecipeError
        If the file cannot be read or is not a recipe; the message is one
        sentence with the file, the key and what to put there.
    """
    path = Path(path)

    def look() -> None:
        progress(0.5)

    try:
        data = regular_bytes(path, progress=part_of(progress, 0.0, 0.5))
    except OSError as error:
        raise RecipeError(f"{path} cannot be read: {error.strerror or error}. Check the path.") from error
    try:
        recipe = recipe_from_json(parsed_json(data, RecipeError, look), look)
    except RecipeError as error:
        raise RecipeError(f"{path.name}: {error}.") from None
    progress(1.0)
    return recipe


def write_recipe(path: str | os.PathLike[str], recipe: Edit) -> None:
    """Write a recipe, whole or not at all.

    Raises
    ------
    RecipeError
        If the file cannot be written, or could not be read again.
    """
    held = recipe_to_json(recipe)
    recipe_from_json(held)
    try:
        data = json_lines(held).encode()
    except UnicodeEncodeError:
        raise RecipeError("a handle or pin has a name that cannot be written: rename it") from None
    with whole_file(path, RecipeError) as file:
        file.write(data)


def recipe_from_json(value: Any, look: Look = no_look) -> Edit:
    """Make a recipe of what ``json`` parsed.

    A missing key takes its default, or what the preset says, which is not kept by its name; rotations are normalised.

    Raises
    ------
    RecipeError
        For anything else than a recipe of this version: unknown keys, wrong
        types, numbers out of range.
    """
    # The version comes first: a newer recipe may have keys that are no mistake.
    if isinstance(value, dict):
        version = value.get("version")
        if version is None:
            raise RecipeError(f'version is missing: put "version": {VERSION} into it')
        if isinstance(version, bool) or version != VERSION:
            raise RecipeError(f"version must be {VERSION}, got {shown(version)}: a newer one needs a newer editor")
    recipe = JsonObject(value, "", recipe_keys(), RecipeError, look)
    usual = OptionSet()
    if "preset" in recipe:
        usual = with_preset(usual, recipe.choice("preset", tuple(PRESETS), ""))
    groups: list[Any] = [
        (recipe.object(key, tuple(options_of(group))) if key else recipe).options(group, usual[group])
        for key, group in recipe_groups()
    ]
    return Edit(
        handles=tuple(_handle(h, i) for i, h in enumerate(recipe.objects("handles", HANDLE_KEYS))),
        pins=tuple(Pin(*_region(pin), pin.text("name", "")) for pin in recipe.objects("pins", PIN_KEYS)),
        method=recipe.choice("method", tuple(method_titles()), Edit.method),
        options=OptionSet(*groups),
        rows_of=recipe.text("rows_of", ""),
        remove=removal_from_json(recipe, "remove"),
        grade=grade_from_json(recipe, "grade"),
        place=place_from_json(recipe.object("place", PLACE_KEYS)),
        camera=camera_from_json(recipe, "camera"),
    )


def _region(region: JsonObject) -> tuple[Vector | None, float | None, tuple[int, ...] | None]:
    """Center, radius and rows of a handle or pin."""
    if "rows" not in region:
        return region.vector("center", 3, most=LARGEST_COORDINATE), region.number("radius", above=0), None
    if "radius" in region:
        raise region.refuse("radius", "left out where rows are given")
    center = region.vector("center", 3, most=LARGEST_COORDINATE) if "center" in region else None
    return center, None, region.rows("rows")


def _handle(handle: JsonObject, index: int) -> Handle:
    center, radius, rows = _region(handle)
    pose = pose_from_json(handle)
    return Handle(
        name=handle.text("name", f"handle {index + 1}"),
        center=center,
        radius=radius,
        rows=rows,
        translate=pose.translate,
        rotate=pose.rotate,
        scale=pose.scale,
        cage_radius=handle.options(CageOptions).cage_radius,
        frees=handle.flag("frees", Handle.frees),
    )


def pose_from_json(pose: JsonObject) -> Pose:
    """Pose of an object with the keys translate, rotate and scale, each at rest where it is missing."""
    translate = pose.vector("translate", 3, Handle.translate, most=LARGEST_COORDINATE)
    return Pose(translate, turn(pose, "rotate"), _scale(pose))


def pose_to_json(pose: Pose) -> dict[str, Any]:
    """Plain objects of a pose; what is at rest is left out."""
    return _without_defaults(pose, Pose())


def _scale(handle: JsonObject) -> float | Vector:
    """One factor, or one for each world axis."""
    scale: float | Vector
    try:
        scale = handle.number("scale", 1.0)
    except ValueError:
        try:
            scale = handle.vector("scale", 3)
        except ValueError:
            scale = 0.0
    least, largest = np.min(scale), np.max(scale)
    if not SCALES[0] <= least <= largest <= SCALES[1]:
        raise handle.refuse("scale", f"a number from {SCALES[0]:g} to {SCALES[1]:g}, or three of them")
    return scale


def recipe_to_json(recipe: Edit) -> dict[str, Any]:
    """Plain objects of a recipe for ``json``; what is left at its default is left out."""
    value: dict[str, Any] = {"version": VERSION, "method": recipe.method}
    if recipe.rows_of:
        value["rows_of"] = recipe.rows_of
    said = {(key, group): _said(recipe.options[group]) for key, group in recipe_groups()}
    # The keys of the first version stand where they stood.
    for key, group in (("graph", GraphOptions), ("", ReachOptions)):
        _put(value, key, said.pop((key, group)))
    # The region of a handle has no default, so it never goes missing.
    value["handles"] = [{"name": h.name, **_without_defaults(h, Handle(name=h.name))} for h in recipe.handles]
    value["pins"] = [_without_defaults(pin, Pin()) for pin in recipe.pins]
    for (key, _), options in said.items():
        _put(value, key, options)
    if recipe.remove:
        value["remove"] = removal_to_json(recipe.remove)
    if recipe.grade:
        value["grade"] = grade_to_json(recipe.grade)
    _put(value, "place", place_to_json(recipe.place))
    if recipe.camera:
        value["camera"] = camera_to_json(recipe.camera)
    return value


def _put(value: dict[str, Any], key: str, options: dict[str, Any]) -> None:
    """Put options under their key, if there are any, or among those of the recipe."""
    if not key:
        value.update(options)
    elif options:
        value[key] = options


def _said(group: Any) -> dict[str, Any]:
    """Options of a group that a recipe says."""
    held = {name: (known, getattr(group, name)) for name, known in options_of(group).items()}
    return {
        name: _plain(value)
        for name, (known, value) in held.items()
        if known.is_always_written or value != known.default
    }


def _without_defaults(spec: Any, default: Any) -> dict[str, Any]:
    """Fields that differ from their default, numpy numbers as Python's."""
    found = {}
    for key, value in vars(spec).items():
        usual = getattr(default, key)
        if value is usual or (value is not None and usual is not None and value == usual):
            continue
        found[key] = _plain(value)
    return found


def _plain(value: Any) -> Any:
    """Value with lists for tuples and Python's numbers for numpy's."""
    if isinstance(value, ShareOfSize):
        raise RecipeError(f"a length of {value.share:g} times the size cannot be written: give it in the file's units")
    if isinstance(value, Separation | Joint):
        return {"a": _plain(value.a), "b": _plain(value.b), **_said(value)}
    if isinstance(value, tuple | list | np.ndarray):
        return [_plain(item) for item in value]
    return value.item() if isinstance(value, np.generic) else value
