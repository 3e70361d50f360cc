"""Mends do what they say to the graph, can be taken back, and travel in a recipe."""

import json

import numpy as np
import plyfile
import pytest
from scipy.spatial.transform import Rotation

from splap_editor.cli import main
from splap_editor.core.graph.splat_graph import GraphOptions, mended_graph, splat_graph
from splap_editor.core.options import OptionSet
from splap_editor.core.splats.occupancy import occupancy_ellipses
from splap_editor.core.surface.fragments import fragment_contacts, fragments
from splap_editor.engine.edit import Edit
from splap_editor.engine.recipe_edit import edit_of, recipe_of
from splap_editor.io.ply import read_ply
from splap_editor.io.recipe import read_recipe, write_recipe
from splap_editor.resources import resource
from splap_editor.session.cards import has_edge
from splap_editor.session.mends import edges_between, fragment_links, with_added, with_cut
from tests.core.splat_scenes import joined, moved, row_edges, sheet

TUBE = resource("samples", "tube.ply")


@pytest.fixture(scope="module")
def tube():
    ellipses = occupancy_ellipses(read_ply(TUBE).splats)
    return ellipses, splat_graph(ellipses)


@pytest.fixture(scope="module")
def apart():
    """A sheet, and a small one beside it with a gap."""
    splats = joined(
        sheet(400, seed=1), moved(sheet(9, size=0.15, seed=2), Rotation.identity(), 1.0, np.array([1.22, 0.4, 0.0]))
    )
    ellipses = occupancy_ellipses(splats)
    return splats, ellipses, splat_graph(ellipses)


def masks(ellipses, *groups):
    found = []
    for rows in groups:
        mask = np.zeros(ellipses.n_splats, bool)
        mask[rows] = True
        found.append(mask)
    return found


def test_cutting_and_adding_are_each_others_undoing():
    options = GraphOptions()
    cut = with_cut(options, [(5, 2), (2, 5), (7, 9)])
    assert cut.cut == ((2, 5), (7, 9)) and cut.add == ()
    assert with_added(cut, [(5, 2), (9, 7)]) == options
    added = with_added(options, [(3, 1)])
    assert added.add == ((1, 3),) and with_cut(added, [(1, 3)]) == options


def test_all_edges_between_two_selections_are_cut(tube):
    ellipses, graph = tube
    middle = np.median(ellipses.centers, axis=0)
    axis = int(np.argmax(np.ptp(ellipses.centers, axis=0)))
    low = ellipses.centers[:, axis] < middle[axis]
    first, second = masks(ellipses, ellipses.rows[low], ellipses.rows[~low])
    pairs = edges_between(ellipses, graph, first, second)
    assert pairs and all(has_edge(ellipses, graph, pair) for pair in pairs)
    parted = mended_graph(ellipses, graph, with_cut(GraphOptions(), pairs))
    assert edges_between(ellipses, parted, first, second) == []
    assert parted.n_edges == graph.n_edges - len(pairs)
    assert parted.components.max() > graph.components.max()


def test_fragments_are_tied_as_file_rows(apart):
    splats, ellipses, graph = apart
    links = fragment_links(splats, ellipses, graph)
    contacts = fragment_contacts(ellipses, graph, np.full((ellipses.n_nodes, 3), 0.5))
    assert links[1:4] == contacts[1:] and links.n_far + links.n_tied + links.n_unlike == len(fragments(graph)) > 0
    assert {frozenset(pair) for pair in links.pairs} == row_edges(ellipses.rows, contacts.pairs)
    tied = mended_graph(ellipses, graph, with_added(GraphOptions(), links.pairs))
    assert links.n_pieces == tied.components.max() + 1 < graph.components.max() + 1


def test_mends_come_back_from_a_recipe_and_the_command_line_honours_them(tube, tmp_path):
    ellipses, graph = tube
    pairs = [tuple(ellipses.rows[pair].tolist()) for pair in graph.edges[::500]]
    options = with_added(with_cut(GraphOptions(), pairs), [(int(ellipses.rows[0]), int(ellipses.rows[900]))])
    recipe, out = tmp_path / "edit.json", tmp_path / "out.ply"
    write_recipe(recipe, recipe_of(Edit(options=OptionSet(options))))
    assert json.loads(recipe.read_text())["graph"].keys() == {"cut", "add"}
    assert edit_of(read_recipe(recipe), read_ply(TUBE).splats).graph == options
    command = ["deform", str(TUBE), "--recipe", str(recipe), "-o", str(out), "--quiet", "--columns", "degree"]
    assert main(command) == 0
    degrees = plyfile.PlyData.read(out)["vertex"].data["degree"]
    np.testing.assert_array_equal(degrees[ellipses.rows], mended_graph(ellipses, graph, options).degrees)
