"""Mends do what they say to the graph, can be taken back, and travel in a recipe."""

import json
from dataclasses import replace

import numpy as np
import plyfile
import pytest
from scipy.spatial.transform import Rotation

from splap_editor.cli import main
from splap_editor.core.graph.ellipse_offset import touch_scales
from splap_editor.core.graph.splat_graph import GraphOptions, mended_graph, splat_graph
from splap_editor.core.options import OptionSet
from splap_editor.core.splats.occupancy import occupancy_ellipses
from splap_editor.engine.edit import Edit
from splap_editor.engine.recipe_edit import edit_of, recipe_of
from splap_editor.io.ply import read_ply
from splap_editor.io.recipe import read_recipe, write_recipe
from splap_editor.resources import resource
from splap_editor.session.cards import has_edge
from splap_editor.session.mends import best_links, edges_between, fragment_links, fragments, with_added, with_cut
from tests.core.splat_scenes import joined, moved, sheet

TUBE = resource("samples", "tube.ply")


@pytest.fixture(scope="module")
def tube():
    ellipses = occupancy_ellipses(read_ply(TUBE).splats)
    return ellipses, splat_graph(ellipses)


@pytest.fixture(scope="module")
def apart():
    """Two sheets side by side with a gap, and two specks beside the first."""
    left = sheet(400, seed=1)
    right = moved(sheet(400, seed=2), Rotation.identity(), 1.0, np.array([1.25, 0.0, 0.0]))
    specks = sheet(400, seed=3)
    rows = np.argsort(np.linalg.norm(specks.means - specks.means.mean(axis=0), axis=1))[:6]
    specks = replace(
        specks,
        **{
            name: np.asarray(getattr(specks, name))[rows]
            for name in ("means", "log_scales", "quats", "logit_opacities", "sh0", "shN")
        },
    )
    specks = moved(specks, Rotation.identity(), 1.0, np.array([0.0, 0.0, 0.12]))
    ellipses = occupancy_ellipses(joined(left, right, specks))
    return ellipses, splat_graph(ellipses)


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


def test_joining_two_selections_makes_one_component_by_the_best_contact(apart):
    ellipses, graph = apart
    first, second = masks(ellipses, np.arange(400), np.arange(400, 800))
    pairs = best_links(ellipses, 0.005, first, second)
    assert all(min(pair) < 400 <= max(pair) for pair in pairs)
    nodes = ellipses.node_of_row
    everyone = np.array([(nodes[a], nodes[b]) for a in range(400) for b in range(400, 800)])
    epsilon = 0.005 * ellipses.scene_scale
    chosen = touch_scales(ellipses, nodes[np.array(pairs)], epsilon)
    assert chosen.min() == touch_scales(ellipses, everyone, epsilon).min()
    joint = mended_graph(ellipses, graph, with_added(GraphOptions(), pairs))
    assert joint.components[nodes[0]] == joint.components[nodes[400]]
    assert len({row for pair in pairs for row in pair}) == 2 * len(pairs), "each splat is joined once"


def test_joining_needs_active_splats_on_both_sides(apart):
    ellipses, _ = apart
    first, none = masks(ellipses, [0, 1], [])
    assert best_links(ellipses, 0.005, first, none) == [] == best_links(ellipses, 0.005, first, first)


def test_fragments_are_tied_to_what_is_around_them_and_far_ones_left(apart):
    ellipses, graph = apart
    assert len(fragments(graph)) >= 1
    pairs, n_left = fragment_links(ellipses, graph, 0.005)
    mended = mended_graph(ellipses, graph, with_added(GraphOptions(), pairs))
    assert len(fragments(mended)) == n_left
    assert all(max(pair) >= 800 for pair in pairs)


def test_a_whole_graph_has_no_fragments(tube):
    ellipses, graph = tube
    assert fragment_links(ellipses, graph, 0.005) == ([], 0)


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
