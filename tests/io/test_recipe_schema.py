"""The published schema of recipes says what their reader does."""

import json
import math

import jsonschema
import pytest

from splap_editor.io.recipe import RecipeError, recipe_from_json, recipe_to_json
from splap_editor.io.recipe_schema import recipe_schema, schema_text
from splap_editor.resources import resource
from tests.io.test_recipe import BALL, random_recipe

REFUSED = [
    {"version": 2},
    {"metod": "arap"},
    {"method": "arapp"},
    {"free_radius": 0},
    {"free_radius": "1"},
    {"graph": None},
    {"graph": {"epsilon": -1}},
    {"graph": {"k": 2}},
    {"graph": {"k": 1001}},
    {"graph": {"cut": [[1, 1]]}},
    {"graph": {"add": [[1, 2], [1]]}},
    {"graph": {"laplacian": "mesh"}},
    {"handles": {}},
    {"handles": [BALL, {}]},
    {"handles": [{"center": [0, 0, 0]}]},
    {"handles": [{**BALL, "center": [0, 0]}]},
    {"handles": [{**BALL, "rows": [1]}]},
    {"handles": [{"rows": []}]},
    {"handles": [{"rows": [-1]}]},
    {"handles": [{**BALL, "rotate": [0, 0, 0, 0]}]},
    {"handles": [{**BALL, "scale": 0}]},
    {"handles": [{**BALL, "scale": 1e7}]},
    {"handles": [{**BALL, "translate": [0, 0, 1e31]}]},
    {"handles": [{**BALL, "scale": [1, 1, -1]}]},
    {"handles": [{**BALL, "cage_radius": -1}]},
    {"pins": [{**BALL, "translate": [0, 0, 1]}]},
    {"solver": {"kind": "fast"}},
    {"solver": {"tolerance": 0}},
    {"solver": {"iterations": 0}},
    {"solver": {"smoothness": -1}},
    {"adaptation": "smooth"},
    {"hops": 4},
    {"blending": "log"},
]


@pytest.fixture(scope="module")
def validator():
    schema = recipe_schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


def test_the_published_schema_is_the_one_that_the_tables_make():
    made = "python -m splap_editor.io.recipe_schema > resources/schemas/recipe.schema.json"
    assert resource("schemas", "recipe.schema.json").read_text(encoding="utf-8") == schema_text(), made


@pytest.mark.parametrize("seed", range(20))
def test_what_is_written_is_accepted(validator, seed):
    assert validator.is_valid(json.loads(json.dumps(recipe_to_json(random_recipe(seed)))))


@pytest.mark.parametrize("changed", [{}, {"free_radius": None}, {"handles": [{"rows": [3], "cage_radius": None}]}])
def test_what_the_reader_reads_is_accepted(validator, changed):
    recipe_from_json({"version": 1, **changed})
    assert validator.is_valid({"version": 1, **changed})


@pytest.mark.parametrize("changed", REFUSED)
def test_what_the_reader_refuses_is_refused(validator, changed):
    with pytest.raises(RecipeError):
        recipe_from_json({"version": 1, **changed})
    assert not validator.is_valid({"version": 1, **changed})


def test_defaults_of_the_schema_are_those_of_the_reader(validator):
    def filled(schema):
        return {
            name: filled(held) if "properties" in held else held["default"]
            for name, held in schema["properties"].items()
            if "default" in held or "properties" in held
        }

    said = {"version": 1, **filled(recipe_schema())}
    assert recipe_from_json(said) == recipe_from_json({"version": 1})
    assert math.isclose(said["graph"]["epsilon"], 0.005)
