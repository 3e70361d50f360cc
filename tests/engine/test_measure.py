"""Distances between splats."""

import numpy as np
import pytest

from splap_editor.core.graph.options import GraphOptions
from splap_editor.core.graph.splat_graph import splat_graph
from splap_editor.core.place import Place
from splap_editor.core.splats.occupancy import occupancy_ellipses
from splap_editor.engine.measure import measured
from splap_editor.io.ply import read_ply
from splap_editor.resources import resource


def test_the_way_along_the_surface_is_no_shorter_and_grows_with_the_place():
    splats = read_ply(resource("samples", "tube.ply")).splats
    removed = np.zeros(splats.n_splats, bool)
    removed[5] = True
    ellipses = occupancy_ellipses(splats, removed=removed)
    graph = splat_graph(ellipses, GraphOptions())
    a, b = (int(row) for row in ellipses.rows[[0, -1]])
    found = measured(ellipses, graph, a, b)
    means = np.asarray(splats.means, np.float64)
    assert found.straight == pytest.approx(np.linalg.norm(means[a] - means[b]))
    assert found.straight <= found.along < np.inf
    assert measured(ellipses, graph, b, a, Place(scale=2.0)).along == pytest.approx(2.0 * found.along)
    with pytest.raises(ValueError, match="row 5 takes no part"):
        measured(ellipses, graph, a, 5)
