"""A small run of the paper's comparison: what it scores, that its figures have not become worse, and how it is kept."""

import argparse
import json
from pathlib import Path

import numpy as np
import pytest

from splap_editor.core.splats.occupancy import occupancy_ellipses
from splap_editor.engine.surface import surface_of
from splap_editor.io.sample_maker import surface_splats
from splap_editor.io.sample_shapes import box_union, level_set
from tests.benchmark.fidelity import Scene
from tests.benchmark.ground_truth import GroundTruth
from tests.benchmark.paper import arguments, main
from tests.benchmark.paper_methods import METHODS, PAPER, on_shared_graph
from tests.benchmark.paper_objects import CATEGORIES, MadeObject, made_object
from tests.benchmark.paper_published import PUBLISHED, PUBLISHED_CATEGORIES
from tests.benchmark.paper_rows import RowFile
from tests.benchmark.paper_scenes import made_subject
from tests.benchmark.paper_tables import END, START, below, figures, main_rows, markdown, summary, with_readme_table

SHIFT = np.array([0.1, -0.2, 0.3])


def comb(rng):
    """Four teeth on a spine: small, and each tooth far from the next along the surface."""
    teeth = [(x, x + 0.25, -0.1, 0.1, -0.6, 0.5) for x in -0.6 + 0.31 * np.arange(4)]
    return MadeObject("comb", box_union([(-0.6, 0.58, -0.1, 0.1, 0.45, 0.7), *teeth], 0.07), 0.06)


def test_teeth_come_apart_as_on_the_true_surface_and_a_run_goes_on_where_it_ended(tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(CATEGORIES, "comb", comb)
    made_subject.cache_clear()
    few = ["--categories", "comb", "--seeds", "1", "--spacings", "1.6", "--regime", "thin", "--pulls", "1"]
    few += ["--method", "arap", "--out", str(tmp_path), "--candidates", "ours", "oracle"]
    main(few)
    kept = (tmp_path / "rows.jsonl").read_text()
    # What an interrupted write leaves is no row.
    (tmp_path / "rows.jsonl").write_text(kept + kept[: len(kept) // 4] + "\n")
    rows = main([*few, "knn30"])
    assert [row["candidate"] for row in rows] == ["ours", "oracle", "knn30"]
    scores = {name: figures(rows, name) for name in ("ours", "oracle", "knn30")}
    assert min(scores["oracle"][:3]) >= 0.97 and min(scores["ours"][:3]) >= 0.9
    assert scores["ours"][1] > scores["knn30"][1] + 0.05
    assert all(np.isfinite(row["pulls"]).all() and row["gap"] == 1.6 for row in rows)
    table = (tmp_path / "paper.md").read_text()
    assert "| SpLap Editor | " in table and "NeLO (not run: no licence" in table
    told = json.loads((tmp_path / "paper.json").read_text())
    assert told["arap"]["n_scenes"] == 1 and told["commits"] == [rows[0]["commit"]]
    made_subject.cache_clear()
    capsys.readouterr()


def test_an_object_is_one_watertight_part_and_its_density_is_told_by_its_gap():
    assert len(CATEGORIES) == 10
    for category in ("fence", "coil"):
        made = made_object(category, 1)
        faces = made.surface.faces
        edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
        _, counts = np.unique(edges, axis=0, return_counts=True)
        assert (counts == 2).all()
        assert made.surface.volume > 0.0
        np.testing.assert_allclose(made.spacings(made.n_splats(2.0)), 2.0, rtol=1e-3)


def test_the_same_seed_makes_the_same_object_and_another_another():
    first, again, other = made_object("fence", 0), made_object("fence", 0), made_object("fence", 1)
    np.testing.assert_array_equal(first.surface.vertices, again.surface.vertices)
    assert first.gap != other.gap


def test_a_level_set_asked_near_its_surface_alone_is_the_same():
    def distance(points):
        ball = np.linalg.norm(points - [0.3, 0.0, 0.1], axis=1) - 0.7
        return np.minimum(ball, np.hypot(np.linalg.norm(points[:, :2], axis=1) - 0.9, points[:, 2]) - 0.15)

    whole, near = (level_set(distance, spacing=0.11, is_distance=is_distance) for is_distance in (False, True))
    np.testing.assert_array_equal(whole.vertices, near.vertices)
    np.testing.assert_array_equal(whole.faces, near.faces)


@pytest.mark.parametrize("name", ["paper", "raw graph"])
def test_a_graph_that_methods_share_gives_what_the_editors_own_stages_give(name):
    surface = level_set(lambda p: np.linalg.norm(p, axis=1) - 0.8, spacing=0.2)
    splats = surface_splats(surface, 250).splats
    scene = Scene("ball", "thin", splats, GroundTruth(surface), occupancy_ellipses(splats), [])
    options = PAPER if name == "paper" else PAPER.__class__(**vars(PAPER) | {"neighborhood": "edges"})
    own, shared = surface_of(splats, options), on_shared_graph(options)(scene)
    assert METHODS[name].bind.__qualname__ == on_shared_graph(options).__qualname__
    assert abs(own.L - shared.L).max() == 0.0
    np.testing.assert_array_equal(own.M, shared.M)


def test_a_cage_carries_a_move_of_the_whole_by_just_that():
    surface = level_set(lambda p: np.linalg.norm(p, axis=1) - 0.8, spacing=0.2)
    splats = surface_splats(surface, 60).splats
    bound = METHODS["cage"].bind(Scene("ball", "thin", splats, GroundTruth(surface), occupancy_ellipses(splats), []))
    moved = argparse.Namespace(positions=bound.rest + SHIFT)
    rows = np.arange(splats.n_splats)
    np.testing.assert_allclose(bound.carried(moved, rows), splats.means + SHIFT, atol=1e-6)


def test_what_is_done_first_is_of_all_regimes_and_densities_alike():
    cases = arguments(["--cells", "9"]).cases
    assert len(cases) == len(set(cases)) == 10 * 3 * 3 * 3
    assert arguments([]).cases == cases[: 10 * 3 * 4]
    pairs = [(case.regime, case.spacings) for case in cases[:30]]
    assert {pairs.count(pair) for pair in set(pairs)} <= {3, 4} and len(set(pairs)) == 9
    assert len(arguments(["--quick"]).cases) == 10
    assert len({(case.regime, case.spacings) for case in arguments(["--quick"]).cases}) == 3 * 2


def _row(category, candidate, pck, **others):
    row = {"category": category, "seed": 0, "regime": "thin", "spacings": 2.0, "handles": "near", "n_pulls": 1}
    row |= {"candidate": candidate, "solver": "arap", "pulls": [[*pck, 0.01]], "commit": "c", "cpu_s": 1.0}
    return row | others


def test_only_scenes_on_which_every_method_was_run_are_compared():
    rows = [_row("bench", "ours", [0.8, 0.9, 1.0]), _row("bench", "paper", [0.5, 0.95, 0.7])]
    rows.append(_row("bed", "ours", [0.0, 0.0, 0.0]))
    kept = main_rows(rows, "arap")
    assert len(kept) == 2 and below(kept) == [("bench", "paper", 0.05)]
    text = markdown(rows)
    assert "| SpLap Editor | .900 | .800 | .900 | 1.000 | – |" in text
    assert "| Paper's rule, geodesic k = 30 | .950 *.997* | .500 *.968* | .950 *.985* | .700 *.988* | – |" in text
    assert "Below a rival at τ = .075: bench: Paper's rule, geodesic k = 30 by .050." in text


def test_several_writers_add_to_one_file_and_the_last_row_of_a_name_counts(tmp_path):
    one, other = RowFile(tmp_path / "rows.jsonl"), RowFile(tmp_path / "rows.jsonl")
    one.add(_row("bench", "ours", [0.1, 0.1, 0.1]))
    other.add(_row("bed", "ours", [0.2, 0.2, 0.2]))
    one.add(_row("bench", "ours", [0.3, 0.3, 0.3]))
    assert [row["pulls"][0][0] for row in other.rows()] == [0.3, 0.2]
    assert len(one.known()) == 2


def test_the_tables_that_are_kept_and_that_of_the_readme_say_what_the_kept_rows_say():
    root = Path(__file__).parents[1]
    folder = root / "resources" / "evidence"
    rows = RowFile(folder / "rows.jsonl").rows()
    assert rows and not any(str(row["commit"]).endswith("+") for row in rows)
    assert (folder / "paper.md").read_text(encoding="utf-8") == markdown(rows), (
        "run python -m tests.benchmark.paper_tables"
    )
    assert json.loads((folder / "paper.json").read_text(encoding="utf-8")) == summary(rows)
    text = (root / "README.md").read_text(encoding="utf-8")
    assert text.count(START) == text.count(END) == 1
    assert text == with_readme_table(text, rows), "run python -m tests.benchmark.paper_tables resources/evidence"


def test_published_averages_are_those_of_the_published_categories():
    for (name, solver), told in PUBLISHED.items():
        assert len(told.categories) == len(PUBLISHED_CATEGORIES), name
        np.testing.assert_allclose(np.mean(told.categories), told.averages[1], atol=0.0015, err_msg=f"{name} {solver}")
