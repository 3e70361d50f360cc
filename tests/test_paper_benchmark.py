"""A small run of the paper's comparison: what it scores, and that its figures have not become worse."""

import numpy as np

from tests.benchmark.paper import main
from tests.benchmark.paper_objects import CATEGORIES, made_object
from tests.benchmark.paper_tables import markdown

SMALL = ["--categories", "bench", "--seeds", "1", "--spacings", "2", "--regime", "thin", "--pulls", "1"]


def test_slats_come_apart_as_on_the_true_surface(capsys):
    results = main([*SMALL, "--method", "arap", "--candidates", "ours", "paper", "oracle"])
    scores = {result["candidate"]: result["pck"] for result in results}
    assert scores["oracle"] == [1.0, 1.0, 1.0]
    assert min(scores["ours"]) >= 0.9
    assert scores["ours"][1] > scores["paper"][1] + 0.1
    assert all(np.isfinite(result["mean_distance"]) for result in results)
    capsys.readouterr()


def test_an_object_is_one_watertight_part_and_its_density_is_told_by_its_gap():
    assert len(CATEGORIES) == 10
    for category in ("bench", "bed", "fence"):
        made = made_object(category, 1)
        faces = made.surface.faces
        edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
        _, counts = np.unique(edges, axis=0, return_counts=True)
        assert (counts == 2).all()
        assert made.surface.volume > 0.0
        spacing = np.sqrt(made.surface.areas.sum() / made.n_splats(2.0))
        np.testing.assert_allclose(made.gap / spacing, 2.0, rtol=1e-3)


def test_the_same_seed_makes_the_same_object_and_another_another():
    first, again, other = made_object("fence", 0), made_object("fence", 0), made_object("fence", 1)
    np.testing.assert_array_equal(first.surface.vertices, again.surface.vertices)
    assert first.gap != other.gap


def test_the_table_has_a_row_a_method_and_the_papers_figures_in_italics():
    results = [
        {"category": "bench", "candidate": name, "solver": "arap", "pck": pck}
        for name, pck in (("ours", [0.8, 0.9, 1.0]), ("paper", [0.5, 0.45, 0.7]), ("oracle", [0.9, 0.9, 1.0]))
    ]
    table = markdown(results).splitlines()
    assert table[4] == "| SpLap Editor | .900 | .800 | .900 | 1.000 | 1.000 | – |"
    assert table[5] == "| Paper's rule, geodesic k = 30 | .450 | .500 | .450 | .700 | .500 | *.985* |"
