"""An edge is found where it is drawn."""

import numpy as np
import pytest

from splap_editor.viewport.edge_picking import edge_under
from splap_editor.viewport.projection import Projection


@pytest.fixture
def projection() -> Projection:
    """Parallel, a world unit 100 pixels, the origin in the middle of 400 × 400."""
    view = np.eye(4)
    view[2, 3] = -10.0
    clip = np.diag([0.5, 0.5, -0.1, 1.0])
    return Projection(view, clip, 400, 400)


POINTS = np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, -1.0, -5.0], [0.0, 1.0, -5.0], [0.02, 0.0, 0.0]])


def test_the_nearest_edge_within_reach_is_found(projection):
    edges = np.array([[0, 1], [2, 3]])
    assert edge_under(projection, POINTS, edges, (150.0, 202.0), 4.0) == 0
    assert edge_under(projection, POINTS, edges, (203.0, 260.0), 4.0) == 1
    assert edge_under(projection, POINTS, edges, (150.0, 210.0), 4.0) is None


def test_at_an_end_the_splat_is_meant(projection):
    edges = np.array([[0, 1]])
    assert edge_under(projection, POINTS, edges, (102.0, 200.0), 4.0) is None
    assert edge_under(projection, POINTS, edges, (97.0, 200.0), 4.0) is None
    assert edge_under(projection, POINTS, np.array([[0, 4]]), (150.0, 200.0), 4.0) == 0


def test_what_lies_behind_the_surface_is_not_found(projection):
    edges = np.array([[2, 3]])
    assert edge_under(projection, POINTS, edges, (200.0, 240.0), 4.0, depth=10.0) is None
    assert edge_under(projection, POINTS, edges, (200.0, 240.0), 4.0, depth=15.0) == 0


def test_no_edges_no_find(projection):
    assert edge_under(projection, POINTS, np.empty((0, 2), int), (200.0, 200.0), 4.0) is None
