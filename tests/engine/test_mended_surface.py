"""A mended surface is the one made from scratch, whichever way it came about."""

from dataclasses import replace

import numpy as np
import pytest

from splap_editor.core.graph.splat_graph import GraphOptions
from splap_editor.engine.cache import StageCache
from splap_editor.engine.surface import Surface, surface_of
from splap_editor.io.ply import read_ply
from splap_editor.resources import resource


@pytest.fixture(scope="module")
def splats():
    return read_ply(resource("samples", "tube.ply")).splats


@pytest.fixture(scope="module")
def plain(splats) -> Surface:
    return surface_of(splats, GraphOptions())


@pytest.fixture(scope="module")
def options(plain) -> GraphOptions:
    rows = plain.ellipses.rows
    cut = [tuple(rows[pair].tolist()) for pair in plain.graph.edges[100:2000:400]]
    return GraphOptions(cut=tuple(cut), add=((int(rows[3]), int(rows[1500])),))


@pytest.fixture(scope="module")
def mended(splats, options) -> Surface:
    return surface_of(splats, options)


def assert_same(found: Surface, expected: Surface) -> None:
    for name in ("indptr", "indices", "lengths", "touch"):
        np.testing.assert_array_equal(getattr(found.graph, name), getattr(expected.graph, name))
    for name in ("indptr", "indices", "distances"):
        np.testing.assert_array_equal(getattr(found.neighborhoods, name), getattr(expected.neighborhoods, name))
    np.testing.assert_array_equal(found.triangles, expected.triangles)
    for name in ("indptr", "indices", "data"):
        np.testing.assert_array_equal(getattr(found.L, name), getattr(expected.L, name))
    np.testing.assert_array_equal(found.M, expected.M)
    for name in ("carriers", "weights", "stencils", "inverse_moments", "dampings", "inert_carriers", "inert_weights"):
        np.testing.assert_array_equal(getattr(found.binding, name), getattr(expected.binding, name), err_msg=name)
    for made, wanted in zip(found.binding.published_carriers, expected.binding.published_carriers, strict=True):
        np.testing.assert_array_equal(made, wanted)
    assert found.key == expected.key and found.options == expected.options


def test_going_on_from_a_surface_searches_no_graph_and_gives_the_same(splats, plain, options, mended):
    found = surface_of(splats, options, ellipses=plain.ellipses, near=plain)
    assert "graph" not in found.timings_s and "geodesics" not in found.timings_s
    assert_same(found, mended)


def test_taking_mends_back_gives_the_unmended_surface(splats, plain, options):
    there = surface_of(splats, options, ellipses=plain.ellipses, near=plain)
    back = surface_of(splats, GraphOptions(), ellipses=plain.ellipses, near=there)
    assert back.graph is plain.graph
    assert_same(back, plain)


def test_one_mend_after_another_is_both(splats, plain, options, mended):
    first = replace(options, cut=options.cut[:2], add=())
    step = surface_of(splats, first, ellipses=plain.ellipses, near=plain)
    assert_same(surface_of(splats, options, ellipses=plain.ellipses, near=step), mended)


def test_a_cached_scene_is_mended_from_what_is_kept(splats, options, mended, tmp_path):
    cache = StageCache(tmp_path)
    surface_of(splats, GraphOptions(), cache=cache)
    found = surface_of(splats, options, cache=cache)
    assert "graph" not in found.timings_s
    assert_same(found, mended)
    assert len(list(tmp_path.iterdir())) == 1, "mended stages are quick to make again and not kept"


def test_other_options_start_over(splats, plain, options):
    other = surface_of(splats, replace(options, k=12), ellipses=plain.ellipses, near=plain)
    assert "graph" in other.timings_s and other.options.k == 12


def test_mends_of_another_file_are_refused_before_any_work(splats, plain):
    stages = []
    with pytest.raises(ValueError, match="cut: rows 999999 are not in the file"):
        surface_of(splats, GraphOptions(cut=((0, 999_999),)), stages=lambda name: stages.append(name))
    assert stages == []


def test_another_laplacian_of_the_same_graph_is_kept_by_itself(tmp_path):
    splats = read_ply(resource("samples", "tube.ply")).splats
    cache = StageCache(tmp_path)
    stars, robust = (surface_of(splats, GraphOptions(laplacian=name), cache=cache) for name in ("stars", "robust"))
    assert stars.key != robust.key and "laplacian" in robust.timings_s
    np.testing.assert_array_equal(stars.graph.indices, robust.graph.indices)
    assert abs(stars.L - robust.L).max() > 1e-3
