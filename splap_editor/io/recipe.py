"""Recipes: an edit as JSON, for scripts and for the window alike."""

import math
import os
from pathlib import Path
from typing import Any

import numpy as np

from splap_editor.core.graph.options import GraphOptions
from splap_editor.core.options import options_of
from splap_editor.io.atomic_file import atomic_file
from splap_editor.io.json_object import JsonObject, json_lines, parsed_json, shown
from splap_editor.io.recipe_specs import (
    DEFAULT_RADIUS,
    LARGEST_COORDINATE,
    SCALES,
    HandleSpec,
    PinSpec,
    PoseSpec,
    Recipe,
    SolverSpec,
    Vector,
)
from splap_editor.io.regular_file import regular_bytes

__all__ = [
    "DEFAULT_RADIUS",
    "HandleSpec",
    "PinSpec",
    "PoseSpec",
    "Recipe",
    "RecipeError",
    "SolverSpec",
    "pose_from_json",
    "pose_to_json",
    "read_recipe",
    "recipe_from_json",
    "recipe_to_json",
    "write_recipe",
]

VERSION = 1

_RECIPE_KEYS = (
    "version",
    "method",
    "graph",
    "free_radius",
    "handles",
    "pins",
    "solver",
    "adaptation",
    "hops",
    "blending",
)
_REGION_KEYS = ("center", "radius", "rows")
_HANDLE_KEYS = ("name", *_REGION_KEYS, "translate", "rotate", "scale", "cage_radius")
_SOLVER_KEYS = ("kind", "tolerance", "iterations", "smoothness")


class RecipeError(ValueError):
    """A recipe that cannot be read; the message names the key and says what to put there."""


def read_recipe(path: str | os.PathLike[str]) -> Recipe:
    """Read a recipe.

    Raises
    ------
    RecipeError
        If the file cannot be read or is not a recipe; the message is one
        sentence with the file, the key and what to put there.
    """
    path = Path(path)
    try:
        data = regular_bytes(path)
    except OSError as error:
        raise RecipeError(f"{path} cannot be read: {error.strerror or error}. Check the path.") from error
    try:
        return recipe_from_json(parsed_json(data, RecipeError))
    except RecipeError as error:
        raise RecipeError(f"{path.name}: {error}.") from None


def write_recipe(path: str | os.PathLike[str], recipe: Recipe) -> None:
    """Write a recipe, whole or not at all.

    Raises
    ------
    RecipeError
        If the file cannot be written, or could not be read again.
    """
    held = recipe_to_json(recipe)
    recipe_from_json(held)
    try:
        with atomic_file(path) as file:
            file.write(json_lines(held).encode())
    except OSError as error:
        raise RecipeError(f"{path} cannot be written: {error.strerror or error}. Choose another place.") from error


def recipe_from_json(value: Any) -> Recipe:
    """Make a recipe of what ``json`` parsed.

    A missing key takes its default; rotations are normalised.

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
    recipe = JsonObject(value, "", _RECIPE_KEYS, RecipeError)
    free_radius = None
    if not recipe.is_null("free_radius"):
        free_radius = recipe.number("free_radius", above=0) if "free_radius" in recipe else DEFAULT_RADIUS
    return Recipe(
        method=recipe.choice("method", ("arap", "bbw"), Recipe.method),
        graph=recipe.object("graph", tuple(options_of(GraphOptions))).options(GraphOptions),
        free_radius=free_radius,
        handles=tuple(_handle(h, i) for i, h in enumerate(recipe.objects("handles", _HANDLE_KEYS))),
        pins=tuple(PinSpec(*_region(pin)) for pin in recipe.objects("pins", _REGION_KEYS)),
        solver=_solver(recipe.object("solver", _SOLVER_KEYS)),
        adaptation=recipe.choice("adaptation", ("surface", "affine", "none"), Recipe.adaptation),
        hops=recipe.integer("hops", Recipe.hops, low=1, high=3),
        blending=recipe.choice("blending", ("dual-quaternion", "linear"), Recipe.blending),
    )


def _solver(solver: JsonObject) -> SolverSpec:
    return SolverSpec(
        kind=solver.choice("kind", ("converged", "local-global", "libigl"), SolverSpec.kind),
        tolerance=solver.number("tolerance", SolverSpec.tolerance, above=0),
        iterations=solver.integer("iterations", SolverSpec.iterations, low=1),
        smoothness=solver.number("smoothness", SolverSpec.smoothness, above=0, least=True),
    )


def _region(region: JsonObject) -> tuple[Vector | None, float | None, tuple[int, ...] | None]:
    """Center, radius and rows of a handle or pin."""
    if "rows" not in region:
        return region.vector("center", 3, most=LARGEST_COORDINATE), region.number("radius", above=0), None
    if "radius" in region:
        raise region.refuse("radius", "left out where rows are given")
    center = region.vector("center", 3, most=LARGEST_COORDINATE) if "center" in region else None
    return center, None, region.rows("rows")


def _handle(handle: JsonObject, index: int) -> HandleSpec:
    center, radius, rows = _region(handle)
    pose = pose_from_json(handle)
    cage_radius = None
    if not handle.is_null("cage_radius"):
        cage_radius = handle.number("cage_radius", above=0) if "cage_radius" in handle else DEFAULT_RADIUS
    return HandleSpec(
        name=handle.text("name", f"handle {index + 1}"),
        center=center,
        radius=radius,
        rows=rows,
        translate=pose.translate,
        rotate=pose.rotate,
        scale=pose.scale,
        cage_radius=cage_radius,
    )


def pose_from_json(pose: JsonObject) -> PoseSpec:
    """Pose of an object with the keys translate, rotate and scale, each at rest where it is missing."""
    rotate = pose.vector("rotate", 4, HandleSpec.rotate)
    length = math.hypot(*rotate)
    if not 0 < length < math.inf:
        raise pose.refuse("rotate", "a quaternion w, x, y, z that is not zero")
    if abs(length - 1) > 1e-12:
        # Twice, since the length of very short ones is imprecise.
        rotate = tuple(part / length for part in rotate)
        rotate = tuple(part / math.hypot(*rotate) for part in rotate)
    return PoseSpec(pose.vector("translate", 3, HandleSpec.translate, most=LARGEST_COORDINATE), rotate, _scale(pose))


def pose_to_json(pose: PoseSpec) -> dict[str, Any]:
    """Plain objects of a pose; what is at rest is left out."""
    return _without_defaults(pose, PoseSpec())


def _scale(handle: JsonObject) -> float | Vector:
    """One factor, or one for each world axis."""
    try:
        scale = handle.number("scale", HandleSpec.scale)
    except ValueError:
        try:
            scale = handle.vector("scale", 3)
        except ValueError:
            scale = (0.0,)
    least, largest = np.min(scale), np.max(scale)
    if not SCALES[0] <= least <= largest <= SCALES[1]:
        raise handle.refuse("scale", f"a number from {SCALES[0]:g} to {SCALES[1]:g}, or three of them")
    return scale


def recipe_to_json(recipe: Recipe) -> dict[str, Any]:
    """Plain objects of a recipe for ``json``; what is left at its default is left out."""
    value: dict[str, Any] = {"version": VERSION, "method": recipe.method}
    graph = _without_defaults(recipe.graph, GraphOptions())
    if graph:
        value["graph"] = graph
    if not _is_default(recipe.free_radius):
        value["free_radius"] = recipe.free_radius
    # The region of a handle has no default, so it never goes missing.
    value["handles"] = [{"name": h.name, **_without_defaults(h, HandleSpec(name=h.name))} for h in recipe.handles]
    value["pins"] = [_without_defaults(pin, PinSpec()) for pin in recipe.pins]
    value["solver"] = {"kind": recipe.solver.kind, **_without_defaults(recipe.solver, SolverSpec())}
    value["adaptation"] = recipe.adaptation
    for key in ("hops", "blending"):
        if getattr(recipe, key) != getattr(Recipe, key):
            value[key] = getattr(recipe, key)
    return value


def _is_default(radius: float | None) -> bool:
    """Whether a radius is left to the program."""
    return radius is not None and math.isnan(radius)


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
    if isinstance(value, tuple | list | np.ndarray):
        return [_plain(item) for item in value]
    return value.item() if isinstance(value, np.generic) else value
