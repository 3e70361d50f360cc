"""A repair from recipe to file: the same by every way, and nothing changed but what is split."""

import json

import numpy as np
import pytest

from splap_editor.cli import main
from splap_editor.core.adaptation.options import USUAL_REPAIR, RepairOptions
from splap_editor.core.options import OptionSet
from splap_editor.engine.edit import writes_like
from splap_editor.engine.recipe_edit import edit_of
from splap_editor.engine.scripting import deform
from splap_editor.io.ply import read_ply
from splap_editor.io.recipe import RecipeError, read_recipe, recipe_from_json, recipe_to_json
from splap_editor.io.splat_files import read_splats
from splap_editor.resources import resource

TUBE = resource("samples", "tube.ply")
PULL = {
    "version": 1,
    "method": "arap",
    "free_radius": None,
    "handles": [{"name": "end", "center": [1.16, 0, 0.38], "radius": 0.2, "translate": [2, 0, 1]}],
    "pins": [{"center": [-1.16, 0, -0.28], "radius": 0.3}],
    "remove": {"rows": [0, 5]},
    "place": {"translate": [0, 1, 0], "scale": 2},
}


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """The tube pulled out, without a repair and with one, by the terminal and by a script."""
    folder = tmp_path_factory.mktemp("pulled")
    recipe, repairing = folder / "pull.json", folder / "repair.json"
    recipe.write_text(json.dumps(PULL))
    repairing.write_text(json.dumps({**PULL, "repair": USUAL_REPAIR}))
    names = ("plain", "flag", "recipe", "script")
    outputs = {name: folder / f"{name}.ply" for name in names}
    for name, held, flags in (("plain", recipe, []), ("flag", recipe, ["--repair"]), ("recipe", repairing, [])):
        told = ["--columns", "stretch", "--quiet"]
        assert main(["deform", str(TUBE), "--recipe", str(held), "-o", str(outputs[name]), *told, *flags]) == 0
    report = deform(TUBE, read_recipe(repairing), outputs["script"], columns=("stretch",))
    return outputs, report


def test_terminal_recipe_and_script_write_the_same_file(written):
    outputs, report = written
    assert len({outputs[name].read_bytes() for name in ("flag", "recipe", "script")}) == 1
    n = read_ply(TUBE).splats.n_splats - 2
    assert report.n_split > 20 and report.n_new > report.n_split and report.n_splats == n + report.n_new
    assert f"{report.n_split:,} splats split into {report.n_new:,} new rows" in str(report)


def test_rows_that_are_not_split_keep_their_bytes_and_new_ones_are_copies_but_for_shape_and_place(written):
    outputs, report = written
    plain, repaired = (read_ply(outputs[name]).table for name in ("plain", "flag"))
    n = plain.n_rows
    differs = repaired.rows[:n] != plain.rows
    assert 0 < np.count_nonzero(differs) <= report.n_split
    new, old = repaired.rows[n:], plain.rows
    for name in ("stretch", "f_dc_0", "f_dc_1", "f_dc_2"):
        assert np.isin(new[name], old[name][differs]).all()
    assert len(new) == report.n_new
    # No splat that is left is drawn out beyond the limit, and what was written lies where it was written before.
    ratios = np.exp(np.abs(new["scale_0"] - new["scale_1"]))
    assert ratios.max() < np.exp(np.abs(old["scale_0"] - old["scale_1"])).max()
    for axis in "xyz":
        low, high = old[axis].min(), old[axis].max()
        assert new[axis].min() > low - 0.1 * (high - low) and new[axis].max() < high + 0.1 * (high - low)


def test_a_repair_goes_into_other_formats(tmp_path, written):
    outputs, report = written
    recipe = outputs["plain"].with_name("repair.json")
    assert deform(TUBE, read_recipe(recipe), tmp_path / "out.spz").n_splats == report.n_splats
    assert read_splats(tmp_path / "out.spz").splats.n_splats == report.n_splats


def test_a_limit_that_nothing_exceeds_writes_the_same_bytes(tmp_path, written):
    recipe = recipe_from_json({**PULL, "repair": 100})
    report = deform(TUBE, recipe, tmp_path / "out.ply", columns=("stretch",))
    assert report.n_split == report.n_new == 0 and "split" not in str(report)
    assert (tmp_path / "out.ply").read_bytes() == written[0]["plain"].read_bytes()


def test_recipes_hold_a_repair_and_edits_tell_it_apart():
    plain, repairing = recipe_from_json(PULL), recipe_from_json({**PULL, "repair": 3})
    assert "repair" not in recipe_to_json(plain) and recipe_to_json(repairing)["repair"] == 3.0
    splats = read_ply(TUBE).splats
    edit = edit_of(plain, splats)
    assert not writes_like(edit, edit.with_options(RepairOptions(3.0))) and edit.repair == 0.0
    assert repairing.options == OptionSet(*plain.options, RepairOptions(3.0))
    for limit in (-1, 0.5, 1):
        with pytest.raises(RecipeError, match="repair must be"):
            recipe_from_json({**PULL, "repair": limit})
