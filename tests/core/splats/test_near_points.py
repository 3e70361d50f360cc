"""The nearest points found without scipy are those that its tree finds."""

import subprocess
import sys

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from splap_editor.core.progress import Cancelled
from splap_editor.core.splats.near_points import (
    are_near,
    are_near_in_boxes,
    connected_labels,
    nearest_in_boxes,
    nearest_points,
)
from splap_editor.core.splats.smallest_box import rotations_about

SETS = ["even", "uneven", "line", "one place"]


def points(kind: str, n: int = 700) -> np.ndarray:
    rng = np.random.default_rng(11)
    spread = {"even": rng.uniform(-1, 1, (n, 3)), "uneven": rng.normal(size=(n, 3)) ** 3}
    spread["line"] = np.column_stack([np.sort(rng.uniform(size=n)), np.zeros((n, 2))])
    spread["one place"] = np.repeat([[1.0, 2.0, 3.0]], n, axis=0)
    return spread[kind]


@pytest.mark.parametrize("kind", SETS)
@pytest.mark.parametrize("n", [9, 200, 700])
def test_the_nearest_are_those_of_the_tree(kind, n):
    held = points(kind, n)
    distances, indices = nearest_in_boxes(held, 9)
    wanted, _ = cKDTree(held).query(held, 9)
    np.testing.assert_allclose(distances, wanted, atol=1e-12)
    assert all(len(set(row)) == 9 for row in indices.tolist()), "each once"
    of_indices = np.linalg.norm(held[indices] - held[:, None], axis=2)
    np.testing.assert_allclose(of_indices, distances, atol=1e-12)
    np.testing.assert_allclose(nearest_points(held, 9)[0], wanted, atol=1e-12)


@pytest.mark.parametrize("kind", SETS)
@pytest.mark.parametrize("reach", [0.0, 0.05, 0.4, 50.0])
def test_who_is_near_is_whom_the_tree_finds_near(kind, reach):
    held = points(kind)
    others = held[::7] + np.array([0.03, 0.0, 0.1])
    wanted = np.isfinite(cKDTree(others).query(held, distance_upper_bound=reach)[0])
    for found in (are_near_in_boxes(held, others, reach), are_near(held, others, reach)):
        np.testing.assert_array_equal(found, wanted)


def test_nobody_is_near_to_nobody():
    assert not are_near_in_boxes(np.zeros((3, 3)), np.zeros((0, 3)), 1.0).any()
    assert are_near_in_boxes(np.zeros((0, 3)), np.zeros((3, 3)), 1.0).shape == (0,)


@pytest.mark.parametrize("n_edges", [0, 40, 200, 2000])
def test_parts_of_a_graph_are_numbered_as_scipy_does(n_edges):
    n = 200
    edges = np.random.default_rng(n_edges).integers(0, n, (n_edges, 2))
    graph = sparse.coo_array((np.ones(n_edges), edges.T), shape=(n, n)).tocsr()
    np.testing.assert_array_equal(connected_labels(n, *edges.T), connected_components(graph, directed=False)[1])


def test_a_long_chain_in_any_order_is_one_part():
    order = np.random.default_rng(5).permutation(3000)
    assert not connected_labels(3000, order[1:], order[:-1]).any()
    assert len(connected_labels(0, np.zeros(0, int), np.zeros(0, int))) == 0


def test_the_search_may_be_cancelled():
    def cancel(share):
        raise Cancelled

    for search in (
        lambda: nearest_in_boxes(points("even"), 9, cancel),
        lambda: nearest_points(points("even"), 9, cancel),
    ):
        with pytest.raises(Cancelled):
            search()


def test_rotations_about_vectors_are_those_of_scipy():
    vectors = np.random.default_rng(3).normal(size=(50, 3)) * np.logspace(-9, 0.5, 50)[:, None]
    vectors[0] = 0.0
    np.testing.assert_allclose(rotations_about(vectors), Rotation.from_rotvec(vectors).as_matrix(), atol=1e-15)


def test_the_main_subject_needs_no_scipy_and_is_the_same_with_it():
    program = """
import sys
import numpy as np
if "with" in sys.argv:
    import scipy.spatial
from splap_editor.core.splats.main_subject import main_subject
rng = np.random.default_rng(1)
ball = rng.normal(size=(1500, 3))
ball /= np.linalg.norm(ball, axis=1)[:, None]
part = rng.uniform(0, 0.3, (300, 3)) + [1.05, 0, 0]
points = np.concatenate([ball, part, rng.uniform(-9, 9, (400, 3))])
found = main_subject(points, rng.uniform(0.5, 1, len(points)))
print(found.size.hex(), found.center.tolist(), "scipy" in sys.modules)
"""
    said = [
        subprocess.run([sys.executable, "-c", program, *more], capture_output=True, text=True, check=True).stdout
        for more in ((), ("with",))
    ]
    without, with_it = (line.split() for line in said)
    assert without[-1] == "False" and with_it[-1] == "True"
    assert without[:-1] == with_it[:-1]
