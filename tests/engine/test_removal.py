"""Laws of removing splats and of the place, from recipe to file."""

from dataclasses import replace

import numpy as np
import pytest

from splap_editor.core.graph.options import GraphOptions
from splap_editor.core.handle_nodes import Region
from splap_editor.core.options import OptionSet
from splap_editor.core.place import Place, placed_splats
from splap_editor.core.pose import Pose
from splap_editor.core.reach_options import ReachOptions
from splap_editor.core.removal import PickedBox, PickedRange, RemovalStep
from splap_editor.core.splats.occupancy import InertReason, occupancy_ellipses
from splap_editor.engine.bound_edit import bind, posed
from splap_editor.engine.edit import Edit, Handle, Pin, binds_like, writes_like
from splap_editor.engine.quantities import columns_of
from splap_editor.engine.recipe_edit import edit_of, recipe_of
from splap_editor.engine.removal import Removal, removal_of
from splap_editor.engine.scripting import deform
from splap_editor.engine.surface import surface_of
from splap_editor.io.ply import read_ply
from splap_editor.io.recipe import RecipeError, recipe_from_json, recipe_to_json
from splap_editor.resources import resource

TUBE = resource("samples", "tube.ply")
QUAT = tuple((np.array([0.8, 0.2, -0.4, 0.4]) / np.linalg.norm([0.8, 0.2, -0.4, 0.4])).tolist())


@pytest.fixture(scope="module")
def file():
    return read_ply(TUBE)


def some(splats, seed=0, n=200):
    mask = np.zeros(splats.n_splats, bool)
    mask[np.random.default_rng(seed).choice(splats.n_splats, n, replace=False)] = True
    return mask


def bent(splats, **changes):
    """One end lifted, the other held."""
    means = np.asarray(splats.means, np.float64)
    axis = int(np.argmax(np.ptp(means, axis=0)))
    reach = 0.1 * float(np.ptp(means[:, axis]))
    handle = Handle(1, "end", "#ffffff", Region(means[means[:, axis].argmax()], reach), Pose((reach, reach, 0.0)))
    pins = (Pin(1, "held", Region(means[means[:, axis].argmin()], reach)),)
    return replace(Edit((handle,), pins, options=OptionSet(ReachOptions(None))), **changes)


def test_removing_and_restoring_is_no_removal(file):
    mask = some(file.splats)
    removal = Removal().with_rows(mask)
    assert removal.n_removed == 200
    assert removal.with_rows(mask, restores=True).steps == ()
    assert removal.with_rows(mask) is removal
    half = mask & (np.cumsum(mask) > 100)
    np.testing.assert_array_equal(removal.with_rows(half, restores=True).mask, mask & ~half)


def test_rows_that_stay_keep_their_bytes_and_order_and_undo_the_file(file, tmp_path):
    removal = Removal().with_rows(some(file.splats))
    report = deform(TUBE, Edit(removal=removal), tmp_path / "less.ply")
    rows = read_ply(tmp_path / "less.ply").table.rows
    assert rows.tobytes() == file.table.rows[~removal.mask].tobytes()
    assert (report.n_splats, report.n_removed, report.n_changed) == (len(rows), 200, 0)
    deform(TUBE, Edit(removal=removal.with_rows(removal.mask, restores=True)), tmp_path / "all.ply")
    assert (tmp_path / "all.ply").read_bytes() == TUBE.read_bytes()


def test_removed_splats_leave_graph_size_and_quantities(file):
    far = Removal().with_rows(np.asarray(file.splats.means)[:, 0] > np.median(np.asarray(file.splats.means)[:, 0]))
    ellipses = occupancy_ellipses(file.splats, removed=far.mask)
    surface = surface_of(file.splats, GraphOptions(), ellipses=ellipses)
    assert not far.mask[ellipses.rows].any()
    assert (ellipses.inert[far.mask] == InertReason.REMOVED).all()
    snapshot = posed(file, Edit(removal=far), with_surface=True).snapshot
    for name, values in columns_of(["alpha", "flatness", "degree", "displacement"], snapshot).items():
        assert np.isnan(values[far.mask]).all(), name
    assert surface.key != surface_of(file.splats, GraphOptions()).key


def test_a_removed_scene_deforms_as_the_file_without_those_rows(file, tmp_path):
    removal = Removal().with_rows(some(file.splats))
    edit = bent(file.splats, removal=removal)
    deform(TUBE, edit, tmp_path / "bent.ply")
    deform(TUBE, Edit(removal=removal), tmp_path / "less.ply")
    deform(tmp_path / "less.ply", replace(edit, removal=Removal()), tmp_path / "twin.ply")
    assert read_ply(tmp_path / "bent.ply").table.rows.tobytes() == read_ply(tmp_path / "twin.ply").table.rows.tobytes()


def test_edges_that_end_at_removed_splats_are_passed_over(file):
    ellipses = occupancy_ellipses(file.splats)
    a, b = (int(row) for row in ellipses.rows[:2])
    mask = np.zeros(file.splats.n_splats, bool)
    mask[a] = True
    options = GraphOptions(add=((a, b),))
    surface = surface_of(file.splats, options, removed=mask)
    assert surface.options == options
    plain = surface_of(file.splats, GraphOptions(), removed=mask)
    np.testing.assert_array_equal(surface.graph.indices, plain.graph.indices)


def test_a_surface_of_other_splats_is_refused(file):
    surface = surface_of(file.splats, GraphOptions())
    with pytest.raises(ValueError, match="other splats than the edit leaves"):
        bind(surface, bent(file.splats, removal=Removal().with_rows(some(file.splats))))


def test_nothing_left_says_what_to_do(file, tmp_path):
    everything = Edit(removal=Removal().with_rows(np.ones(file.splats.n_splats, bool)))
    with pytest.raises(ValueError, match="restore some"):
        deform(TUBE, everything, tmp_path / "none.ply")
    with pytest.raises(ValueError, match="restore some"):
        posed(file, everything, with_surface=True)


def test_steps_by_place_and_quantity_replay_from_a_recipe(file):
    center = tuple(np.asarray(file.splats.means, np.float64).mean(axis=0).tolist())
    steps = (
        RemovalStep(PickedBox(center, (0.5, 0.5, 0.5), QUAT), outside=True),
        RemovalStep(PickedRange("size", least=0.02)),
    )
    edit = Edit(removal=removal_of(steps, file.splats), place=Place((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), QUAT, 2.0))
    read = edit_of(recipe_from_json(recipe_to_json(recipe_of(edit))), file.splats)
    assert read.removal.steps == steps
    assert 0 < read.removal.n_removed < file.splats.n_splats
    assert writes_like(read, edit)
    assert not binds_like(read, Edit())


@pytest.mark.parametrize(
    ("remove", "message"),
    [
        ({"rows": [10**6]}, "the recipe was made for another file"),
        ({"quantity": {"name": "displacement", "most": 1}}, "cannot be removed by 'displacement'"),
    ],
)
def test_a_removal_that_does_not_fit_is_refused(file, remove, message):
    recipe = recipe_from_json({"version": 1, "remove": remove})
    with pytest.raises(RecipeError, match=message):
        edit_of(recipe, file.splats)


@pytest.mark.parametrize(
    ("said", "message"),
    [
        ({"remove": {}}, "remove must have one of the keys rows, box"),
        ({"remove": [{"rows": [1], "sphere": {"center": [0, 0, 0], "radius": 1}}]}, r"remove\[0\] must have one"),
        ({"remove": {"box": {"center": [0, 0, 0], "size": [1, 0, 1]}}}, "remove.box.size must be three numbers"),
        ({"remove": {"plane": {"point": [0, 0, 0], "normal": [0, 0, 0]}}}, "remove.plane.normal must be a vector"),
        ({"remove": {"quantity": {"name": "alpha", "least": 2, "most": 1}}}, "remove.quantity.most must be at least 2"),
        ({"remove": {"floaters": {"strength": 2}}}, "remove.floaters.strength must be"),
        ({"place": {"scale": 0}}, "place.scale must be"),
        ({"place": {"rotate": [0, 0, 0, 0]}}, "place.rotate must be a quaternion"),
    ],
)
def test_a_step_that_means_nothing_is_refused(said, message):
    with pytest.raises(RecipeError, match=message):
        recipe_from_json({"version": 1, **said})


def test_a_turned_scene_deforms_as_the_unturned_one(file, tmp_path):
    place = Place((0.1, 0.0, 0.2), (1.0, -2.0, 0.5), QUAT, 3.0)
    straight = posed(file, bent(file.splats))
    turned = posed(file, bent(file.splats, place=place))
    s = turned.surface.scene_scale
    wanted = placed_splats(straight.splats, place)
    np.testing.assert_allclose(turned.splats.means, wanted.means, atol=3.0 * 1e-6 * s)
    deform(TUBE, bent(file.splats, place=place), tmp_path / "placed.ply")
    written = read_ply(tmp_path / "placed.ply")
    np.testing.assert_allclose(written.splats.means, wanted.means, atol=3.0 * 1e-6 * s)
    assert list(written.table.columns) == list(file.table.columns)
