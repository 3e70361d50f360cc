"""The benchmark of adaptations: what it measures, on one bent object."""

import numpy as np
import pytest

from splap_editor.io.sample_shapes import box_union
from tests.benchmark import paper_adaptation, paper_methods, paper_pictures, paper_scenes
from tests.benchmark.ground_truth import GroundTruth
from tests.benchmark.paper_objects import CATEGORIES, MadeObject
from tests.benchmark.paper_scenes import Case

CASE = Case("comb", 0, "thin", 1.4)


@pytest.fixture(autouse=True)
def comb(monkeypatch):
    """An object of four teeth, small enough for a test."""

    def made(rng):
        teeth = [(x, x + 0.3, -0.1, 0.1, -0.9, 0.5) for x in -0.7 + 0.37 * np.arange(4)]
        return MadeObject("comb", box_union([(-0.7, 0.71, -0.1, 0.1, 0.45, 0.8), *teeth], 0.08), 0.07)

    monkeypatch.setitem(CATEGORIES, "comb", made)
    paper_scenes.made_subject.cache_clear()
    yield
    paper_scenes.made_subject.cache_clear()


def test_ellipses_that_follow_the_surface_stand_off_it_less_than_those_that_only_move(monkeypatch):
    monkeypatch.setattr(paper_adaptation, "SIZE", (96, 72))
    rows = {row["adaptation"]: row for row in paper_adaptation.compared(CASE, 1)}
    assert set(rows) == {"at rest", paper_adaptation.BY_TRUTH, *paper_adaptation.ADAPTATIONS}
    distances = {name: row["distance"] for name, row in rows.items()}
    assert distances["at rest"] < min(distances["ours"], distances[paper_adaptation.BY_TRUTH])
    assert max(distances["ours"], distances[paper_adaptation.BY_TRUTH]) < distances["none"]
    # What moves the centres alone makes no ellipse larger, so that fewer of its rims reach over a crease.
    assert all(0.0 <= row["spikes"] < 0.05 for row in rows.values())
    drawn = {name: row["psnr"] for name, row in rows.items() if "psnr" in row}
    assert set(rows) - set(drawn) == {paper_adaptation.BY_TRUTH}
    assert drawn["at rest"] > 15.0 and min(drawn.values()) > 5.0
    text = paper_adaptation.table(list(rows.values()))
    assert "1 pulls" in text and "| affine, 3 hops |" in text


def test_a_mesh_that_turns_takes_points_off_it_along_as_one_body():
    surface = box_union([(-0.5, 0.5, -0.1, 0.1, -0.4, 0.4)], 0.1)
    turn, truth = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), GroundTruth(surface)
    carried = paper_adaptation.Carried(
        truth, surface.vertices @ turn.T + 0.3, np.broadcast_to(turn, (len(surface.vertices), 3, 3))
    )
    points = np.random.default_rng(2).uniform(-0.6, 0.6, (40, 3))
    deformation = carried.carry(points)
    np.testing.assert_allclose(deformation.positions, points @ turn.T + 0.3, atol=1e-9)
    on_it = surface.vertices[:9]
    np.testing.assert_allclose(carried.origins(on_it @ turn.T + 0.3), on_it, atol=1e-9)


def test_rims_stand_off_a_plane_by_how_high_they_are():
    surface = box_union([(-1.0, 1.0, -1.0, 1.0, -0.2, 0.2)], 0.2)
    rng = np.random.default_rng(4)
    centers = np.column_stack([rng.uniform(-0.5, 0.5, (30, 2)), rng.uniform(0.15, 0.3, 30)])
    axes = rng.uniform(-0.1, 0.1, (30, 2, 3))
    distances = paper_adaptation.rim_distances(centers, axes, surface)
    turns = np.arange(12) * np.pi / 6
    heights = centers[:, 2:] + np.outer(axes[:, 0, 2], np.cos(turns)) + np.outer(axes[:, 1, 2], np.sin(turns))
    np.testing.assert_allclose(distances, abs(heights - 0.2), atol=1e-9)


def test_the_ellipse_around_the_corners_of_an_affine_image_is_the_image_of_the_ellipse():
    rng = np.random.default_rng(5)
    centers, axes, matrix = rng.normal(size=(9, 3)), rng.normal(size=(9, 2, 3)), rng.normal(size=(3, 3))
    corners = paper_adaptation.corners_of(centers, axes) @ matrix + 0.3
    middles, halves = paper_adaptation.steiner(corners)
    np.testing.assert_allclose(middles, centers @ matrix + 0.3, atol=1e-12)
    np.testing.assert_allclose(halves, axes @ matrix, atol=1e-12)


def test_the_same_pull_is_drawn_by_each_method_beside_the_rest_pose(monkeypatch):
    monkeypatch.setattr(paper_pictures, "SIZE", (64, 48))
    monkeypatch.setattr(paper_methods, "CAGE_CELLS", 12)
    sheet = np.asarray(paper_pictures.strip(CASE, 0, "arap", 1, ("ours", "cage")))
    assert sheet.shape == (48 + paper_pictures.CAPTION_PX, 3 * 64, 3)
    panels = sheet[paper_pictures.CAPTION_PX :].reshape(48, 3, 64, 3).astype(int)
    for place in (1, 2):
        assert (panels[:, place] != 255).any() and abs(panels[:, place] - panels[:, 0]).max() > 40
