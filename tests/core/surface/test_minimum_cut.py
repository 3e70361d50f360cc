"""Minimum cuts: the twin that scipy's maximum flow gives, and what happens at the edges of the question."""

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.csgraph import breadth_first_order, maximum_flow
from scipy.spatial import cKDTree

from splap_editor.core.surface.minimum_cut import first_side


def reference_side(edges, strength, first, second, n):
    """(n,) what the first part still reaches once a maximum flow has filled the edges."""
    source, sink = n, n + 1
    tails = np.concatenate([edges[:, 0], edges[:, 1], np.full(len(first), source), second])
    heads = np.concatenate([edges[:, 1], edges[:, 0], first, np.full(len(second), sink)])
    plenty = np.full(len(first) + len(second), strength.sum() + 1)
    held = np.concatenate([strength, strength, plenty]).astype(np.int32)
    capacity = sp.csr_array((held, (tails, heads)), shape=(n + 2, n + 2))
    residual = capacity - maximum_flow(capacity, source, sink).flow
    residual.eliminate_zeros()
    side = np.zeros(n + 2, bool)
    side[breadth_first_order(residual, source, return_predecessors=False)] = True
    return side[:n]


def network(n, n_neighbors, most, seed):
    """Edges of the nearest of points in a slab, their strengths, and two parts of a few points each."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(0.0, [3.0, 1.0, 0.2], (n, 3))
    near = cKDTree(points).query(points, n_neighbors + 1)[1]
    pairs = np.stack([np.repeat(np.arange(n), n_neighbors), near[:, 1:].ravel()], axis=1)
    edges = np.unique(np.sort(pairs, axis=1), axis=0)
    order = np.argsort(points[:, 0])
    n_first, n_second = rng.integers(1, 5, 2)
    return edges, rng.integers(0, most, len(edges)), order[:n_first], order[n - n_second :]


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize(("n", "n_neighbors", "most"), [(8, 2, 3), (60, 3, 2), (200, 5, 1000)])
def test_the_side_is_the_one_a_maximum_flow_leaves(n, n_neighbors, most, seed):
    edges, strength, first, second = network(n, n_neighbors, most, seed)
    side = first_side(edges, strength, first, second, n)
    np.testing.assert_array_equal(side, reference_side(edges, strength, first, second, n))
    assert side[first].all() and not side[second].any()


def test_the_side_does_not_depend_on_the_order_of_the_edges_nor_on_their_sense():
    edges, strength, first, second = network(200, 5, 1000, seed=1)
    side = first_side(edges, strength, first, second, 200)
    order = np.random.default_rng(0).permutation(len(edges))
    np.testing.assert_array_equal(first_side(edges[order][:, ::-1], strength[order], first[::-1], second, 200), side)


def test_without_a_second_part_all_that_hangs_together_stays_with_the_first():
    edges, none = np.array([[0, 1], [1, 2], [3, 4]]), np.zeros(0, np.int64)
    side = first_side(edges, np.array([1, 0, 1]), np.array([0]), none, 5)
    np.testing.assert_array_equal(side, [True, True, False, False, False])
    assert not first_side(edges, np.ones(3, np.int64), none, np.array([4]), 5).any()
    assert first_side(np.zeros((0, 2), np.int64), none, np.array([1]), np.array([0]), 2).tolist() == [False, True]
