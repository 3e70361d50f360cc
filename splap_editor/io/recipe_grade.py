"""What a recipe says of colour grades."""

from typing import Any

from splap_editor.core.grade import GradeStep
from splap_editor.core.grade_options import GradeOptions
from splap_editor.core.options import options_of
from splap_editor.io.json_object import JsonObject
from splap_editor.io.recipe_removal import PICKED_KEYS, picked_from_json, picked_to_json

GRADE_KEYS = (*PICKED_KEYS, "outside", *options_of(GradeOptions))


def grade_from_json(recipe: JsonObject, key: str) -> tuple[GradeStep, ...]:
    """Grades: one object, or a list of them, each over those before; one that picks nothing is of all splats."""
    return tuple(_step(step) for step in recipe.one_or_more(key, GRADE_KEYS))


def _step(step: JsonObject) -> GradeStep:
    picked, outside = picked_from_json(step), step.flag("outside", False)
    if outside and picked is None:
        raise step.refuse("outside", f"left out where none of {', '.join(PICKED_KEYS)} says what is inside")
    return GradeStep(step.options(GradeOptions), picked, outside)


def grade_to_json(steps: tuple[GradeStep, ...]) -> Any:
    """Plain objects of grades; of a single one, the object itself."""
    said = [_said(step) for step in steps]
    return said[0] if len(said) == 1 else said


def _said(step: GradeStep) -> dict[str, Any]:
    held = {name: getattr(step.options, name) for name in options_of(GradeOptions)}
    said = {name: value for name, value in held.items() if value != options_of(GradeOptions)[name].default}
    outside = {"outside": True} if step.outside else {}
    return {**({} if step.picked is None else picked_to_json(step.picked)), **outside, **said}
