"""Fragments: a piece of the surface is tied by a seam of contacts, other things are left, and each is counted."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from splap_editor.core.graph.splat_graph import GraphOptions, mended_graph, splat_graph
from splap_editor.core.splats.occupancy import occupancy_ellipses
from splap_editor.core.surface.fragments import N_LINKS, fragment_contacts, fragments
from tests.core.splat_scenes import joined, moved, sheet

WHOLE = sheet(900, seed=1)
LEVEL = Rotation.identity()


def piece(shift, *, turn=LEVEL, n: int = 16, seed: int = 2):
    """A small sheet with the splats of the whole: turned about its corner, then shifted."""
    return moved(sheet(n, size=0.13, seed=seed), turn, 1.0, np.array(shift))


def found(*pieces, colors=None):
    splats = joined(WHOLE, *pieces)
    ellipses = occupancy_ellipses(splats)
    graph = splat_graph(ellipses)
    colors = np.full((len(splats.means), 3), 0.5) if colors is None else colors
    return ellipses, graph, fragment_contacts(ellipses, graph, colors[ellipses.rows])


def tied(ellipses, graph, contacts):
    rows = tuple(tuple(pair) for pair in ellipses.rows[contacts.pairs].tolist())
    return mended_graph(ellipses, graph, GraphOptions(add=rows))


def test_a_piece_beside_the_surface_is_tied_along_its_rim():
    ellipses, graph, contacts = found(piece((1.16, 0.4, 0.0)))
    assert len(fragments(graph)) == 1 and contacts[1:] == (1, 0, 0)
    assert len(contacts.pairs) >= N_LINKS
    assert len(np.unique(contacts.pairs[:, 0])) > 1 and len(np.unique(contacts.pairs[:, 1])) > 1
    assert len(fragments(tied(ellipses, graph, contacts))) == 0


def test_a_longer_rim_gets_more_contacts():
    short, long = (found(moved(sheet(n, size=size, seed=2), LEVEL, 1.0, np.array([1.16, 0.3, 0.0]))) for n, size in
                   ((9, 0.1), (36, 0.2)))  # fmt: skip
    assert len(long[2].pairs) > len(short[2].pairs)


def test_what_is_far_is_left_and_counted():
    _, graph, contacts = found(piece((0.4, 0.4, 2.0)))
    assert len(fragments(graph)) == 1 and contacts[1:] == (0, 1, 0) and len(contacts.pairs) == 0


@pytest.mark.parametrize("why", ["above", "steep", "coloured"])
def test_what_does_not_go_on_is_left_and_counted(why):
    part = {
        "above": piece((0.4, 0.4, 0.12)),
        "steep": piece((1.16, 0.4, 0.0), turn=Rotation.from_euler("y", -80, degrees=True)),
        "coloured": piece((1.16, 0.4, 0.0)),
    }[why]
    colors = np.full((len(WHOLE.means) + len(part.means), 3), 0.5)
    if why == "coloured":
        colors[len(WHOLE.means) :] = 0.9, 0.1, 0.1
    _, graph, contacts = found(part, colors=colors)
    assert len(fragments(graph)) == 1 and contacts[1:] == (0, 0, 1) and len(contacts.pairs) == 0


def test_a_piece_beyond_a_piece_is_tied_to_it():
    near, beyond = piece((1.16, 0.4, 0.0)), piece((1.46, 0.4, 0.0), seed=4)
    ellipses, graph, contacts = found(near, beyond)
    assert len(fragments(graph)) == 2 and contacts[1:] == (2, 0, 0)
    assert len(fragments(tied(ellipses, graph, contacts))) == 0


def test_file_order_and_a_rigid_motion_change_nothing():
    parts = piece((1.16, 0.4, 0.0)), piece((0.4, 0.4, 0.12), seed=4)
    splats = joined(WHOLE, *parts)
    turned = moved(splats, Rotation.from_euler("xyz", [30, 50, -70], degrees=True), 1.0, np.array([1.0, 2.0, 3.0]))
    pairs = []
    for each in (splats, turned):
        ellipses = occupancy_ellipses(each)
        contacts = fragment_contacts(ellipses, splat_graph(ellipses), np.full((ellipses.n_nodes, 3), 0.5))
        assert contacts[1:] == (1, 0, 1)
        pairs.append({frozenset(pair) for pair in ellipses.rows[contacts.pairs].tolist()})
    assert pairs[0] == pairs[1]


def test_a_whole_graph_has_no_fragments():
    _, graph, contacts = found()
    assert len(fragments(graph)) == 0 and contacts[1:] == (0, 0, 0)
