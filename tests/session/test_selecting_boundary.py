"""Splats at open rims of a surface."""

import numpy as np

from splap_editor.core.graph.options import GraphOptions
from splap_editor.core.graph.splat_graph import splat_graph
from splap_editor.core.splats.occupancy import occupancy_ellipses
from splap_editor.core.surface.geodesics import geodesic_neighbors
from splap_editor.io.ply import read_ply
from splap_editor.resources import resource
from splap_editor.session.selection import boundary_selection


def test_the_ends_of_an_open_strip_are_its_boundary_and_its_middle_is_not():
    splats = read_ply(resource("samples", "tube.ply")).splats
    means = np.asarray(splats.means)
    long = int(np.argmax(np.ptp(means, axis=0)))
    along = means[:, long]
    kept = np.abs(along - np.median(along)) < 0.25 * np.ptp(along)
    ellipses = occupancy_ellipses(splats, removed=~kept)
    neighborhoods = geodesic_neighbors(splat_graph(ellipses, GraphOptions()), 30)
    found = boundary_selection(ellipses, neighborhoods)
    assert not found[~kept].any() and found.any()
    half = 0.25 * np.ptp(along)
    depth = 1.0 - np.abs(along - np.median(along)) / half
    assert found[kept & (depth < 0.02)].mean() > 0.9
    assert found[kept & (depth > 0.3)].mean() < 0.05
