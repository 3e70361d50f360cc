"""Grades from recipe to file: the same by every way, and nothing but the colours of what they are of."""

import json
from dataclasses import replace

import numpy as np
import pytest

from splap_editor.cli import main
from splap_editor.core.grade import GradeStep
from splap_editor.core.grade_options import GradeOptions
from splap_editor.core.graph.options import GraphOptions
from splap_editor.core.handle_nodes import Region
from splap_editor.core.options import OptionSet
from splap_editor.core.place import Place
from splap_editor.core.pose import Pose
from splap_editor.core.progress import Cancelled
from splap_editor.core.reach_options import ReachOptions
from splap_editor.core.removal import PickedBall, PickedRange, PickedRows
from splap_editor.engine.bound_edit import posed, written_splats
from splap_editor.engine.edit import Edit, Handle, binds_like, poses_like, writes_like
from splap_editor.engine.grading import LARGEST_STACK, Grading, faded_share, grading_of
from splap_editor.engine.recipe_edit import edit_of, recipe_of
from splap_editor.engine.removal import Removal
from splap_editor.engine.scripting import deform
from splap_editor.engine.surface import surface_of
from splap_editor.io.ply import read_ply
from splap_editor.io.recipe import RecipeError, recipe_from_json, recipe_to_json
from splap_editor.resources import resource

TUBE = resource("samples", "tube.ply")
WARM = GradeOptions(exposure=0.5, temperature=0.4, opacity=0.8)
COLORS = ("f_dc_0", "f_dc_1", "f_dc_2", "opacity")


@pytest.fixture(scope="module")
def file():
    return read_ply(TUBE)


@pytest.fixture(scope="module")
def surface(file):
    return surface_of(file.splats, GraphOptions())


def ball(file, share=0.15):
    """A ball about the end of the tube, so large as a share of its length."""
    means = np.asarray(file.splats.means, np.float64)
    axis = int(np.argmax(np.ptp(means, axis=0)))
    return PickedBall(tuple(means[means[:, axis].argmax()].tolist()), share * float(np.ptp(means[:, axis])))


def test_a_grade_at_rest_exports_the_same_bytes(file, tmp_path):
    still = grading_of([GradeStep(), GradeStep(GradeOptions(falloff=0.5), ball(file))], file.splats)
    assert not still.needs_surface
    assert Edit(grading=still).is_identity
    deform(TUBE, Edit(grading=still), tmp_path / "same.ply")
    assert (tmp_path / "same.ply").read_bytes() == TUBE.read_bytes()


def test_only_colours_of_what_is_graded_are_written(file, tmp_path):
    grading = grading_of([GradeStep(WARM, ball(file))], file.splats)
    report = deform(TUBE, Edit(grading=grading), tmp_path / "warm.ply")
    written, (mask,) = read_ply(tmp_path / "warm.ply"), grading.masks
    assert 0 < mask.sum() < len(mask)
    for name, column in file.table.columns.items():
        same = written.table.columns[name] == column
        assert same[~mask].all(), name
        assert same[mask].any() == (name not in COLORS) or name in COLORS, name
        if name in COLORS:
            assert not same[mask].all(), name
    assert report.is_graded and report.n_changed == 0 and "colours graded" in str(report)


def test_a_falloff_runs_smoothly_along_the_surface_and_no_further(file, surface):
    picked = ball(file)
    (mask,) = grading_of([GradeStep(WARM, picked)], file.splats).masks
    length = 2.0 * picked.radius
    shares = faded_share(mask, length, surface)
    assert (shares[mask] == 1.0).all() and shares.min() == 0.0
    away = np.linalg.norm(np.asarray(file.splats.means, np.float64) - picked.center, axis=1) - picked.radius
    assert not shares[away > length].any(), "the way along the surface is no shorter than through the air"
    between = (shares > 0.0) & (shares < 1.0)
    assert between.sum() > 50
    assert np.corrcoef(shares[between], away[between])[0, 1] < -0.9
    assert faded_share(mask, length, surface) is shares, "a slider asks again and again"
    assert faded_share(mask, 0.0, surface) is mask


def test_a_grade_by_recipe_is_that_by_command_and_by_script(file, tmp_path):
    picked = ball(file)
    held = {"sphere": {"center": list(picked.center), "radius": picked.radius}, "exposure": 0.5, "temperature": 0.4}
    held |= {"opacity": 0.8, "falloff": picked.radius}
    recipe = tmp_path / "grade.json"
    recipe.write_text(json.dumps({"version": 1, "grade": held}))
    outputs = [tmp_path / f"{name}.ply" for name in ("recipe", "command", "script")]
    assert main(["deform", str(TUBE), "--recipe", str(recipe), "-o", str(outputs[0]), "--quiet"]) == 0
    sphere = [f"{number!r}" for number in (*picked.center, picked.radius)]
    flags = ["--exposure", "0.5", "--temperature", "0.4", "--opacity", "0.8", "--falloff", f"{picked.radius!r}"]
    assert main(["grade", str(TUBE), "-o", str(outputs[1]), "--quiet", *flags, "--sphere", *sphere]) == 0
    options = replace(WARM, falloff=picked.radius)
    deform(TUBE, Edit(grading=grading_of([GradeStep(options, picked)], file.splats)), outputs[2])
    assert len({path.read_bytes() for path in outputs}) == 1
    assert outputs[0].read_bytes() != TUBE.read_bytes()


def test_posing_removing_and_placing_do_not_change_what_a_grade_does(file):
    means = np.asarray(file.splats.means, np.float64)
    axis = int(np.argmax(np.ptp(means, axis=0)))
    reach = 0.1 * float(np.ptp(means[:, axis]))
    handle = Handle(1, "end", "#ffffff", Region(means[means[:, axis].argmax()], reach), Pose((reach, reach, 0.0)))
    bent = Edit((handle,), options=OptionSet(ReachOptions(None)), place=Place(rotate=(0.6, 0.8, 0.0, 0.0), scale=2.0))
    grading = grading_of([GradeStep(WARM, ball(file))], file.splats)
    plain, graded = posed(file, bent).splats, posed(file, replace(bent, grading=grading)).splats
    still = grading.graded(file.splats)
    np.testing.assert_array_equal(graded.means, plain.means)
    np.testing.assert_array_equal(graded.quats, plain.quats)
    np.testing.assert_array_equal(graded.sh0, still.sh0)
    np.testing.assert_array_equal(graded.logit_opacities, still.logit_opacities)


def test_grades_replay_from_a_recipe_and_edits_tell_them_apart(file):
    steps = (
        GradeStep(GradeOptions(hue=30.0)),
        GradeStep(WARM, PickedRows(np.array([3, 5], np.int32)), outside=True),
        GradeStep(replace(WARM, falloff=0.2), PickedRange("size", least=0.02)),
    )
    edit = Edit(grading=grading_of(steps, file.splats))
    read = edit_of(recipe_from_json(recipe_to_json(recipe_of(edit))), file.splats)
    assert read.grading.steps == steps
    for mask, again in zip(edit.grading.masks, read.grading.masks, strict=True):
        assert mask is again is None or np.array_equal(mask, again)
    assert (~edit.grading.masks[1]).sum() == 2
    assert writes_like(read, edit) and binds_like(read, Edit()) and poses_like(read, Edit())
    assert not writes_like(read, Edit())
    assert edit.has_work and not edit.is_identity


def test_what_is_removed_is_not_graded_by_a_quantity(file):
    gone = np.zeros(file.splats.n_splats, bool)
    gone[::3] = True
    recipe = {"version": 1, "remove": {"rows": np.flatnonzero(gone).tolist()}, "grade": {"quantity": {"name": "alpha"}}}
    edit = edit_of(recipe_from_json(recipe), file.splats)
    np.testing.assert_array_equal(edit.grading.masks[0], ~gone)
    assert edit.removal.like(Removal().with_rows(gone))


def test_a_file_that_is_graded_tells_how_far_it_is_and_hears_cancel_between_grades(file, surface):
    steps = [GradeStep(replace(WARM, falloff=reach), ball(file)) for reach in (0.3, 0.4)]
    edit = Edit(grading=grading_of(steps, file.splats))
    told = []
    written_splats(file.splats, None, edit, surface, told.append)
    assert told == sorted(told) and len(set(told)) >= 4

    def stop(share):
        raise Cancelled

    with pytest.raises(Cancelled):
        written_splats(file.splats, None, edit, surface, stop)


def test_steps_are_put_over_each_other_changed_and_taken_away(file):
    mask = np.arange(file.splats.n_splats) < 7
    grading = Grading().with_grade().with_grade(mask)
    assert grading.is_identity
    changed = grading.with_options(1, WARM)
    assert not changed.is_identity and changed.masks[1] is mask
    assert changed.without(0).steps == changed.steps[1:]
    assert changed.without(1).like(Grading())
    assert changed.nbytes >= mask.nbytes
    full = Grading((GradeStep(),) * LARGEST_STACK, (None,) * LARGEST_STACK)
    with pytest.raises(ValueError, match="delete one first"):
        full.with_grade()


def test_a_falloff_needs_a_surface(file, surface):
    grading = grading_of([GradeStep(replace(WARM, falloff=0.3), ball(file))], file.splats)
    with pytest.raises(ValueError, match="needs the surface"):
        written_splats(file.splats, None, Edit(grading=grading))
    bare = grading.graded_so_far(file.splats, None)
    full = grading.graded(file.splats, surface)
    changed = (bare.sh0 != file.splats.sh0).any(axis=1)
    np.testing.assert_array_equal(bare.sh0[grading.masks[0]], full.sh0[grading.masks[0]])
    assert changed.sum() == grading.masks[0].sum() < (full.sh0 != file.splats.sh0).any(axis=1).sum()


@pytest.mark.parametrize(
    ("said", "message"),
    [
        ({"exposure": 9}, "grade.exposure must be a finite number"),
        ([{"hue": 1}, {"warmth": 1}], r"grade\[1\]"),
        ({"outside": True}, "grade.outside must be left out where none of"),
        ({"rows": [1], "sphere": {"center": [0, 0, 0], "radius": 1}}, "grade must have one of the keys"),
    ],
)
def test_a_grade_that_means_nothing_is_refused(said, message):
    with pytest.raises(RecipeError, match=message):
        recipe_from_json({"version": 1, "grade": said})


@pytest.mark.parametrize(
    ("said", "message"),
    [
        ({"rows": [10**6]}, "the recipe was made for another file"),
        ({"quantity": {"name": "stretch"}}, "'stretch'"),
        ([{"hue": 1}] * (LARGEST_STACK + 1), "64 grades, not 65"),
    ],
)
def test_a_grade_that_does_not_fit_the_file_is_refused(file, said, message):
    recipe = recipe_from_json({"version": 1, "grade": said})
    with pytest.raises(RecipeError, match=message):
        edit_of(recipe, file.splats)


@pytest.mark.parametrize(
    ("flags", "message"),
    [
        (["--exposure", "9"], "--exposure must be a finite number"),
        (["--falloff", "1"], "need --box, --sphere or --rows"),
        (["--box", "1", "0", "0", "0", "1", "1"], "--box needs the least"),
        (["--sphere", "0", "0", "0", "0"], "--sphere needs"),
        (["--rows", "-1"], "--rows needs"),
    ],
)
def test_a_grade_from_the_terminal_says_what_is_wrong(flags, message, tmp_path, capsys):
    assert main(["grade", str(TUBE), "-o", str(tmp_path / "out.ply"), *flags]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out.ply").exists()
