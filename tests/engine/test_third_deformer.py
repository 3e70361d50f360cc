"""A deformer is one module and one row: this is the module, and a test registers the row."""

import json
from dataclasses import dataclass

import numpy as np
import pytest

from splap_editor.core import deformers
from splap_editor.core.deformer import Deformation
from splap_editor.core.deformers import DeformerRow
from splap_editor.core.options import Length, ShareOfSize, check_options, option, world_length
from splap_editor.core.progress import no_progress
from splap_editor.engine.bound_edit import posed
from splap_editor.engine.edit import binds_like
from splap_editor.engine.recipe_edit import edit_of, recipe_of
from splap_editor.engine.scripting import deform
from splap_editor.io.ply import read_ply
from splap_editor.io.recipe import RecipeError, recipe_from_json, recipe_to_json
from splap_editor.io.recipe_schema import recipe_schema
from splap_editor.resources import resource

TUBE = resource("samples", "tube.ply")


@dataclass(frozen=True)
class FadeOptions:
    """How a handle's motion fades."""

    power: float = option(2.0, "How fast the motion fades with distance.", label="Power", above=0.0, most=8.0)
    reach: Length = option(ShareOfSize(9.0), "What is farther stays.", label="Reach", above=0.0, unit="world")

    def __post_init__(self) -> None:
        check_options(self)


class FadeDeformer:
    """Every node takes part in the first handle's translation, the less the farther it is."""

    def __init__(self, surface, handles, options):
        self.rest = surface.rest
        apart = np.linalg.norm(self.rest - handles.centers[0], axis=1)
        reach = world_length(options.reach, surface.scene_scale)
        self.parts = 1.0 / (1.0 + apart / surface.scene_scale) ** options.power
        self.parts[apart > (np.inf if reach is None else reach)] = 0.0

    def drag(self, transforms):
        shift = transforms[0, :3, 3]
        turns = np.broadcast_to(np.eye(3), (len(self.rest), 3, 3)).copy()
        return Deformation(self.rest + self.parts[:, None] * shift, turns)

    def solve(self, transforms, *, progress=no_progress, shown=None):
        return self.drag(transforms)


def bind_fade(surface, handles, options, binding):
    return FadeDeformer(surface, handles, options)


@pytest.fixture
def fade(monkeypatch):
    row = DeformerRow("fade", "Fading translation", FadeOptions, f"{__name__}:bind_fade", key="fade")
    monkeypatch.setattr(deformers, "loaded", lambda named: bind_fade if named == row.bind else None)
    monkeypatch.setattr(deformers, "DEFORMERS", deformers.DEFORMERS)
    deformers.DEFORMERS.append(row)
    yield row
    deformers.DEFORMERS.remove(row)


RECIPE = {
    "version": 1,
    "method": "fade",
    "fade": {"power": 3.0},
    "handles": [{"center": [1.1, 0.0, 0.3], "radius": 0.1, "translate": [0.0, 0.0, 0.2]}],
}


def test_recipes_spell_it_both_ways(fade):
    recipe = recipe_from_json(RECIPE)
    assert recipe.options[FadeOptions].power == 3.0
    assert recipe_from_json(json.loads(json.dumps(recipe_to_json(recipe)))) == recipe
    with pytest.raises(RecipeError, match=r"fade\.power must be a finite number greater than 0 and at most 8, got 9"):
        recipe_from_json({**RECIPE, "fade": {"power": 9}})
    assert recipe_schema()["properties"]["fade"]["properties"]["power"]["maximum"] == 8.0
    assert recipe_from_json({**RECIPE, "fade": {"reach": None}}).options[FadeOptions].reach is None


def test_unknown_ones_are_refused_with_those_there_are(fade):
    with pytest.raises(RecipeError, match=r'method must be "arap" or "bbw".* or "fade", got "fado"'):
        recipe_from_json({**RECIPE, "method": "fado"})


def test_it_deforms_a_file(fade, tmp_path):
    file, recipe = read_ply(TUBE), recipe_from_json(RECIPE)
    made = posed(file, recipe)
    parts = made.bound.deformer.parts
    moved = made.deformation.positions - made.surface.rest
    np.testing.assert_allclose(moved[:, 2], 0.2 * parts, atol=1e-9)
    # Kernels follow their ellipse's corners, which bends a little where the motion fades.
    carried = made.kernels.means[made.surface.ellipses.rows] - made.surface.rest
    np.testing.assert_allclose(carried[:, 2], 0.2 * parts, atol=0.01)
    report = deform(TUBE, recipe, tmp_path / "faded.ply")
    assert report.n_changed > 0
    np.testing.assert_array_equal(read_ply(tmp_path / "faded.ply").splats.means, made.splats.means)


def test_it_is_bound_again_for_its_own_options_only(fade):
    edit = edit_of(recipe_from_json(RECIPE), read_ply(TUBE).splats)
    assert not binds_like(edit, edit.with_options(FadeOptions(1.0)))
    assert binds_like(edit, edit.with_options(deformers.ArapOptions(iterations=3)))
    assert recipe_of(edit).options == edit.options
