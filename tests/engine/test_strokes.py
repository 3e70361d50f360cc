"""Strokes become edges: laws on two leaves that touch, and what replays them."""

from dataclasses import replace

import numpy as np
import pytest

from splap_editor.core.graph.options import GraphOptions, Joint, Separation
from splap_editor.core.graph.splat_graph import mended_graph
from splap_editor.core.splats.occupancy import occupancy_ellipses
from splap_editor.core.splats.splats import Splats
from splap_editor.core.surface.separation import seam_between
from splap_editor.engine.strokes import nodes_at, stroke_mends, stroke_seam
from splap_editor.engine.surface import surface_of
from splap_editor.io.recipe import Edit, RecipeError, read_recipe, recipe_from_json, recipe_to_json, write_recipe


def leaves(gap: float) -> Splats:
    """Two leaves of flat splats, so far apart, that face each other with a third of their sides."""
    x, y = np.meshgrid(np.arange(12) * 0.1, np.arange(9) * 0.1, indexing="ij")
    left = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    means = np.concatenate([left, left + np.array([1.1 + gap, 0.6, 0.0])])
    n = len(means)
    return Splats(
        means=means,
        log_scales=np.log(np.tile([0.035, 0.035, 0.0005], (n, 1))),
        quats=np.tile([1.0, 0.0, 0.0, 0.0], (n, 1)),
        logit_opacities=np.full(n, 3.0),
        sh0=np.zeros((n, 3)),
        shN=np.zeros((n, 0, 3)),
    )


A, B = ((0.4, 0.4, 0.0),), ((1.9, 1.0, 0.0),)


def pieces(surface) -> int:
    return int(surface.graph.components.max()) + 1


def test_one_point_a_side_separates_two_leaves_and_a_joint_ties_them_again() -> None:
    splats = leaves(0.1)
    plain = surface_of(splats, GraphOptions())
    assert pieces(plain) == 1
    apart = GraphOptions(separate=(Separation(A, B),))
    parted = surface_of(splats, apart, near=plain)
    assert pieces(parted) == 2
    rims = Joint(((1.1, 0.7, 0.0),), ((1.2, 0.7, 0.0),), 0.15)
    joined = surface_of(splats, replace(apart, join=(rims,)), near=parted)
    assert pieces(joined) == 1


@pytest.mark.parametrize("way", ["from nothing", "from the stroke before", "from another stroke"])
def test_the_surface_is_the_same_to_the_bit_whichever_way_it_came_about(way: str) -> None:
    splats = leaves(0.1)
    ellipses = occupancy_ellipses(splats)
    wanted = GraphOptions(separate=(Separation(A, B), Separation(((0.0, 0.0, 0.0),), ((0.0, 0.8, 0.0),))))
    before = {
        "from nothing": None,
        "from the stroke before": GraphOptions(separate=wanted.separate[:1]),
        "from another stroke": GraphOptions(separate=(Separation(((2.0, 0.6, 0.0),), ((2.0, 1.4, 0.0),)),)),
    }[way]
    near = None if before is None else surface_of(splats, before, ellipses=ellipses)
    made = surface_of(splats, wanted, ellipses=ellipses, near=near)
    fresh = surface_of(splats, wanted)
    assert (made.L != fresh.L).nnz == 0
    assert made.stages.mends == fresh.stages.mends
    explicit = mended_graph(ellipses, fresh.stages.unmended, fresh.stages.mends)
    np.testing.assert_array_equal(explicit.indices, made.graph.indices)


def test_a_seam_is_looked_for_once_and_each_stroke_has_its_own() -> None:
    surface = surface_of(leaves(0.1), GraphOptions())
    ellipses, graph = surface.ellipses, surface.graph
    strokes = [Separation(A, B), Separation(A, ((0.4, 0.7, 0.0),)), Separation(A, B, wider=1)]
    for stroke in (*strokes, *strokes):
        found = stroke_seam(ellipses, graph, stroke)
        first, second = nodes_at(ellipses, stroke.a), nodes_at(ellipses, stroke.b)
        np.testing.assert_array_equal(found.edges, seam_between(graph, first, second, wider=stroke.wider).edges)
        assert stroke_seam(ellipses, graph, stroke) is found


def test_no_stroke_changes_nothing() -> None:
    splats = leaves(0.1)
    surface = surface_of(splats, GraphOptions())
    assert stroke_mends(surface.ellipses, surface.graph, surface.options) == surface.options


def test_parts_at_the_same_splat_are_refused() -> None:
    with pytest.raises(ValueError, match="farther apart"):
        surface_of(leaves(0.1), GraphOptions(separate=(Separation(A, A),)))


def test_a_recipe_keeps_strokes(tmp_path) -> None:
    options = GraphOptions(separate=(Separation(A, B), Separation(B, A, -1)), join=(Joint(A, B, 0.25),))
    write_recipe(tmp_path / "edit.json", Edit(options=(options,)))
    assert read_recipe(tmp_path / "edit.json").options[GraphOptions] == options
    assert "graph" not in recipe_to_json(Edit())
    said = recipe_to_json(Edit(options=(options,)))["graph"]
    assert said["separate"][0] == {"a": [[0.4, 0.4, 0.0]], "b": [[1.9, 1.0, 0.0]]}
    assert said["join"] == [{"a": [[0.4, 0.4, 0.0]], "b": [[1.9, 1.0, 0.0]], "reach": 0.25}]


@pytest.mark.parametrize(
    ("graph", "message"),
    [
        ({"separate": 3}, "graph.separate must be a list of objects"),
        ({"separate": [{"a": [[0, 0, 0]]}]}, r"separate\[0\].b must be a list of \[x, y, z\] points"),
        ({"separate": [{"a": [], "b": [[0, 0, 0]]}]}, r"separate\[0\].a must be a list"),
        ({"separate": [{"a": [[0, 0]], "b": [[0, 0, 0]]}]}, r"a\[0\] must be a point of 3 finite numbers"),
        ({"separate": [{"a": [[0, 0, 0]], "b": [[1, 0, 0]], "wider": 2.5}]}, "wider must be a whole number"),
        ({"join": [{"a": [[0, 0, 0]], "b": [[1, 0, 0]]}]}, r"join\[0\].reach must be a finite number greater than 0"),
        ({"join": [{"a": [[0, 0, 0]], "b": [[1, 0, 0]], "reach": 0}]}, "reach must be a finite number"),
    ],
)
def test_a_recipe_with_a_wrong_stroke_is_refused(graph: dict, message: str) -> None:
    with pytest.raises(RecipeError, match=message):
        recipe_from_json({"version": 1, "graph": graph})
