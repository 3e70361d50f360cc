import numpy as np
import pytest

from splap_editor.core.graph.ellipse_offset import normal_offsets, touch_scales
from splap_editor.core.graph.ellipse_tree import ellipse_tree, nearest_touches, offset_pairs
from splap_editor.core.splats.occupancy import Ellipses, occupancy_ellipses
from tests.core.splat_scenes import cloud, joined, splats_of
from tests.reference.graph import all_pairs

EPSILON = 0.02
N_PARTNERS = 5


def mixed_sizes() -> Ellipses:
    """A hundred ellipses, four of them a hundred times larger."""
    small, giants = cloud(96, size=0.2), cloud(4, size=20.0, seed=1)
    return occupancy_ellipses(joined(small, giants))


@pytest.fixture(scope="module", params=["alike", "mixed"])
def ellipses(request) -> Ellipses:
    return occupancy_ellipses(cloud(100, size=0.4)) if request.param == "alike" else mixed_sizes()


@pytest.mark.parametrize("ratio", [np.inf, 2.0])
def test_the_best_contacts_are_the_brute_force_ones(ellipses, ratio):
    n = ellipses.n_nodes
    pairs = all_pairs(n)
    touch = np.full((n, n), np.inf)
    touch[pairs[:, 0], pairs[:, 1]] = touch[pairs[:, 1], pairs[:, 0]] = touch_scales(ellipses, pairs, EPSILON)
    labels = np.random.default_rng(0).integers(0, 20, n)
    touch[labels[:, None] == labels] = np.inf
    touch[ellipses.reaches > ratio * ellipses.reaches[:, None]] = np.inf
    tree = ellipse_tree(ellipses)
    partners, scales = np.empty((n, N_PARTNERS), np.int32), np.empty((n, N_PARTNERS))
    nearest_touches(
        np.arange(n), *tree.arrays, labels[tree.nodes].astype(np.int32), tree.label_ranges(labels[tree.nodes]),
        EPSILON, 1.5, ratio, partners, scales,
    )  # fmt: skip
    for place, node in enumerate(tree.nodes):
        best = [j for j in np.argsort(touch[node], kind="stable")[:N_PARTNERS] if touch[node, j] <= 1.5]
        assert partners[place, : len(best)].tolist() == best
        assert (partners[place, len(best) :] == -1).all()
        # Which of the two is taken first differs, and with it the rounding.
        np.testing.assert_allclose(scales[place, : len(best)], touch[node, best], rtol=1e-13)


def test_pairs_within_the_tolerance_are_the_brute_force_ones(ellipses):
    tree = ellipse_tree(ellipses)
    everything = all_pairs(ellipses.n_nodes)
    within = everything[normal_offsets(ellipses, everything).min(axis=1) <= EPSILON]
    buffer = np.empty((len(within) + 1, 2), np.int32)
    end, count = offset_pairs(0, *tree.arrays, EPSILON, buffer)
    assert (end, count) == (ellipses.n_nodes, len(within))
    assert {frozenset(pair) for pair in buffer[:count].tolist()} == {frozenset(pair) for pair in within.tolist()}


def test_a_full_buffer_ends_at_a_whole_ellipse_and_loses_nothing(ellipses):
    tree = ellipse_tree(ellipses)
    everything = np.empty((10_000, 2), np.int32)
    _, total = offset_pairs(0, *tree.arrays, EPSILON, everything)
    buffer, start, collected = np.empty((total - 1, 2), np.int32), 0, []
    while start < len(tree.nodes):
        end, count = offset_pairs(start, *tree.arrays, EPSILON, buffer)
        assert end > start
        collected.append(buffer[:count].copy())
        start = end
    assert len(collected) > 1
    assert np.array_equal(np.concatenate(collected), everything[:total])


def test_size_classes_keep_a_giant_out_of_the_others_boxes():
    tree = ellipse_tree(mixed_sizes())
    assert len(tree.classes) > 3
    for first, end, slot, n_leaves in tree.classes:
        assert (tree.boxes[slot + 1, 6:] <= tree.reaches[first:end].max() * (1 + 1e-12)).all()
        assert tree.reaches[first:end].max() <= 3.0 * (1 + 1e-12) * tree.reaches[first:end].min()
        assert n_leaves * 8 >= end - first


def test_label_ranges_bound_the_labels_below_each_slot():
    tree = ellipse_tree(mixed_sizes())
    labels = np.random.default_rng(0).integers(0, 50, 100)
    ranges = tree.label_ranges(labels)
    for first, end, slot, _ in tree.classes:
        assert ranges[slot + 1].tolist() == [labels[first:end].min(), labels[first:end].max()]


def test_a_tree_of_nothing_has_no_classes():
    empty = occupancy_ellipses(splats_of(np.empty((0, 3)), np.empty((0, 2))))
    tree = ellipse_tree(empty)
    assert tree.classes.shape == (0, 4) and len(tree.boxes) == 0
