"""Laws of the floater finder, and what it finds in a scene whose floaters are known."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from splap_editor.core.place import Place, placed_splats
from splap_editor.core.progress import in_turn
from splap_editor.core.splats import surroundings
from splap_editor.core.splats.floater_evidence import EVIDENCE, REASONS
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
    made = floaters(splats, ellipses)
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
    around = surroundings.surroundings(ellipses)
    neighbors, distances = around.neighbors, around.distances
    ways = np.linalg.norm(ellipses.centers[:, None] - ellipses.centers, axis=2)
    np.testing.assert_allclose(distances, np.sort(ways, axis=1)[:, 1 : 1 + surroundings.N_NEAREST])
    assert not (neighbors == np.arange(ellipses.n_nodes)[:, None]).any()
    logits, strays = surroundings.bounded_logits(ellipses), surroundings.STRAY
    slow, slow_ties = local_evidence(neighbors, distances, ellipses, logits, surroundings.THICKNESS, strays)
    np.testing.assert_allclose(around.local, slow, atol=1e-9)
    for found, ties in zip((around.narrow, around.wide), slow_ties, strict=True):
        np.testing.assert_array_equal(found.tied, ties)
        assert ties.any() and not ties.all()


def test_pieces_are_the_connected_components_of_the_ties_between_some_nodes(scene):
    ellipses = occupancy_ellipses(scene[0])
    ties = surroundings.surroundings(ellipses).narrow
    n = len(ties.neighbors)
    nodes = np.random.default_rng(3).random(n) < 0.7
    goes = ties.tied & nodes[:, None] & nodes[ties.neighbors]
    pairs = sparse.coo_array((np.ones(goes.sum()), (np.nonzero(goes)[0], ties.neighbors[goes])), (n, n))
    found, known = ties.pieces(nodes), connected_components(pairs, directed=False)[1]
    both = np.unique(np.stack([found, known]), axis=1)
    assert both.shape[1] == found.max() + 1 == known.max() + 1
    first = np.unique(found, return_index=True)[1]
    assert (np.diff(first) > 0).all()


def test_what_is_found_does_not_depend_on_how_parts_are_run(scene):
    splats, _ = scene
    ellipses = occupancy_ellipses(splats)

    def backwards(parts, told):
        return in_turn(parts[::-1], told)[::-1]

    np.testing.assert_array_equal(
        floaters(splats, ellipses).likelihoods, floaters(splats, ellipses, run=backwards).likelihoods
    )


def test_every_evidence_says_one_reason():
    assert sorted(name for names in REASONS.values() for name in names) == sorted(EVIDENCE)


def test_far_specks_are_given_away_by_their_place(scene):
    splats, is_floater = scene
    _, made, ellipses = likelihoods(splats)
    words = np.array(list(REASONS))[made.reasons]
    floats = is_floater[ellipses.rows] & made.at(0.5)
    beyond = ~ellipses.subject.holds(ellipses.centers, room=0.2 * ellipses.scene_scale)
    assert np.isin(words[floats & beyond], ("apart from the rest", "few splats about it", "a small piece")).mean() > 0.8


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
    assert len(floaters(splats, one).at(0.5)) == 1
