"""Presets: options that one name sets, in recipes and in memory alike."""

import pytest

from splap_editor.core.adaptation.options import AdaptationOptions
from splap_editor.core.arap.options import ArapOptions
from splap_editor.core.bbw.options import BbwOptions
from splap_editor.core.graph.options import GraphOptions
from splap_editor.core.options import OptionSet
from splap_editor.core.presets import with_preset
from splap_editor.io.recipe import RecipeError, recipe_from_json, recipe_to_json

PLACED = {"version": 1, "handles": [{"center": [0, 0, 0], "radius": 1}]}


def test_the_papers_method_is_all_of_its_choices():
    options = recipe_from_json({**PLACED, "preset": "paper"}).options
    assert options[GraphOptions] == GraphOptions(rule="paper", carriers="all", k=30, laplacian="robust")
    assert options[ArapOptions] == ArapOptions(kind="local-global", iterations=10)
    assert options[BbwOptions].blending == "linear"
    assert options[AdaptationOptions].adaptation == "paper"


def test_what_a_recipe_says_beside_the_preset_counts():
    said = {**PLACED, "preset": "paper", "graph": {"k": 12}, "adaptation": "affine"}
    options = recipe_from_json(said).options
    assert options[GraphOptions] == GraphOptions(rule="paper", carriers="all", k=12, laplacian="robust")
    assert options[AdaptationOptions].adaptation == "affine"
    assert options[ArapOptions].kind == "local-global"


def test_a_preset_is_written_as_what_it_means():
    recipe = recipe_from_json({**PLACED, "preset": "paper"})
    written = recipe_to_json(recipe)
    assert "preset" not in written
    assert recipe_from_json(written) == recipe


def test_mends_stay_when_a_preset_is_taken():
    options = with_preset(OptionSet(GraphOptions(cut=((1, 2),), k=9)), "paper")
    assert options[GraphOptions] == GraphOptions(rule="paper", carriers="all", k=30, laplacian="robust", cut=((1, 2),))


def test_an_unknown_preset_is_refused_with_those_known():
    with pytest.raises(RecipeError, match='preset must be "paper", got "papr"'):
        recipe_from_json({**PLACED, "preset": "papr"})
    with pytest.raises(ValueError, match="preset must be one of paper"):
        with_preset(OptionSet(), "papr")
