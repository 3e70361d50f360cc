"""Laws of the floater finder, and what it finds in a scene whose floaters are known."""

from dataclasses import replace

import numpy as np
import pytest

from splap_editor.core.place import Place, placed_splats
from splap_editor.core.splats import floater_evidence
from splap_editor.core.splats.contributions import contributions
from splap_editor.core.splats.floaters import floaters
from splap_editor.core.splats.occupancy import occupancy_ellipses
from splap_editor.core.splats.splats import Splats
from splap_editor.io.ply import read_ply
from splap_editor.resources import resource
from tests.benchmark.floater_scenes import KINDS
from tests.benchmark.floaters import with_floaters
from tests.reference.floater_evidence import local_evidence

PLACE = Place(rotate=(0.8, 0.0, 0.6, 0.0), translate=(1.0, 2.0, 3.0), scale=2.0)


def likelihoods(splats):
    """(N,) of every file row, 0 for inert ones."""
    ellipses = occupancy_ellipses(splats)
    made = floaters(ellipses, contributions(splats, ellipses))
    held = np.zeros(splats.n_splats)
    held[ellipses.rows] = made.likelihoods
    return held, made, ellipses


@pytest.fixture(scope="module")
def scene():
    return with_floaters(read_ply(resource("samples", "tube.ply")).splats, seed=7)


def test_known_floaters_are_found_and_little_else(scene):
    splats, is_floater = scene
    held, _, ellipses = likelihoods(splats)
    # Some are too faint to be seen at all: nobody looks for those.
    is_floater = is_floater & (ellipses.node_of_row >= 0)
    found = held > 0.5
    hits = (found & is_floater).sum()
    assert hits >= 0.95 * is_floater.sum()
    assert hits >= 0.95 * found.sum()


def test_what_is_known_of_a_splat_among_its_nearest_is_as_the_slow_twin_says(scene):
    splats, _ = scene
    removed = np.ones(splats.n_splats, bool)
    removed[:: splats.n_splats // 150] = False
    ellipses = occupancy_ellipses(splats, removed=removed)
    neighbors, distances = floater_evidence.nearest(ellipses.centers)
    ways = np.linalg.norm(ellipses.centers[:, None] - ellipses.centers, axis=2)
    np.testing.assert_allclose(distances, np.sort(ways, axis=1)[:, 1 : 1 + floater_evidence.N_NEAREST])
    assert not (neighbors == np.arange(ellipses.n_nodes)[:, None]).any()
    logits, strays = np.log(ellipses.opacities / (1.0001 - ellipses.opacities)), floater_evidence._STRAY
    found, ties = np.empty((len(neighbors), 9)), np.zeros((2, *neighbors.shape), bool)
    shapes = ellipses.centers, ellipses.semi_axes, ellipses.normals, ellipses.reaches
    floater_evidence._local(neighbors, distances, *shapes, logits, np.array(strays), found, ties)
    slow, slow_ties = local_evidence(neighbors, distances, ellipses, logits, floater_evidence._THICKNESS, strays)
    np.testing.assert_allclose(found, slow, atol=1e-9)
    np.testing.assert_array_equal(ties, slow_ties)
    assert ties.any() and not ties.all()


@pytest.mark.parametrize("kind", ["half 9 times sparser", "half transparent", "two objects", "thin bars"])
def test_no_part_of_an_object_is_taken_for_floaters(kind):
    clean = read_ply(resource("samples", "tube.ply")).splats
    splats, is_floater = with_floaters(KINDS[kind](clean, np.random.default_rng(5)), seed=5)
    held, _, ellipses = likelihoods(splats)
    is_floater = is_floater & (ellipses.node_of_row >= 0)
    found = held > 0.5
    assert (found & ~is_floater).sum() <= 0.02 * (~is_floater).sum()
    assert (found & is_floater).sum() >= 0.95 * is_floater.sum()


def test_a_higher_strength_takes_what_a_lower_one_takes(scene):
    made = likelihoods(scene[0])[1]
    assert not made.at(0.0).any()
    for low, high in ((0.2, 0.5), (0.5, 0.9)):
        assert not (made.at(low) & ~made.at(high)).any()


def test_order_and_place_do_not_matter(scene):
    splats, _ = scene
    found = likelihoods(splats)[0] > 0.5
    order = np.random.default_rng(0).permutation(splats.n_splats)
    shuffled = replace(splats, **{name: np.asarray(getattr(splats, name))[order] for name in _parts(splats)})
    # Pixels at the rims of splats move with the frame, which a few doubtful ones feel.
    assert (found[order] != (likelihoods(shuffled)[0] > 0.5)).mean() < 0.005
    placed = placed_splats(replace(splats, means=np.asarray(splats.means, np.float64)), PLACE)
    assert (found != (likelihoods(placed)[0] > 0.5)).mean() < 0.005


def _parts(splats):
    """Names of its arrays."""
    held = vars(splats)
    return [name for name in Splats.__dataclass_fields__ if isinstance(held[name], np.ndarray)]


def test_a_scene_of_one_splat_has_no_floater():
    splats = read_ply(resource("samples", "tube.ply")).splats
    ellipses = occupancy_ellipses(splats)
    removed = np.ones(splats.n_splats, bool)
    removed[ellipses.rows[0]] = False
    one = occupancy_ellipses(splats, removed=removed)
    assert len(floaters(one, contributions(splats, one)).at(0.5)) == 1
