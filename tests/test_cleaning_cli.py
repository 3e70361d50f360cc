"""Cleaning and placing from the command line."""

import json

import numpy as np
import pytest

from splap_editor.cli import main
from splap_editor.io.ply import read_ply
from splap_editor.resources import resource
from tests.reference.ply import ply_bytes, splat_columns

TUBE = resource("samples", "tube.ply")


def told(capsys, *arguments):
    """What a command says as JSON."""
    assert main([*arguments, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_a_crop_at_strength_0_leaves_the_bytes_of_what_lies_in_the_box(tmp_path, capsys):
    file = read_ply(TUBE)
    means = np.asarray(file.splats.means, np.float64)
    low, high = np.quantile(means, [0.2, 0.8], axis=0)
    box = [str(value) for value in (*low, *high)]
    out = tmp_path / "out.ply"
    facts = told(capsys, "clean", str(TUBE), "-o", str(out), "--strength", "0", "--crop", *box, "--report")
    inside = ((means >= low) & (means <= high)).all(axis=1)
    assert read_ply(out).table.rows.tobytes() == file.table.rows[inside].tobytes()
    assert facts["cropped"] == facts["n_removed"] == (~inside).sum()
    assert facts["floaters"] == 0
    assert facts["size_after"] < facts["size_before"]


def test_cleaning_a_clean_scene_takes_next_to_nothing(tmp_path, capsys):
    facts = told(capsys, "clean", str(TUBE), "-o", str(tmp_path / "out.ply"))
    assert facts["floaters"] <= 0.02 * read_ply(TUBE).splats.n_splats


def test_a_place_is_levelled_sized_and_recentred(tmp_path, capsys):
    file = read_ply(TUBE)
    means = np.asarray(file.splats.means, np.float64)
    a, b, c = 0, 500, 1200
    out = tmp_path / "out.ply"
    floor = ["--floor", str(a), str(b), str(c)]
    facts = told(capsys, "place", str(TUBE), "-o", str(out), *floor, "--length", str(a), str(b), "3", "--recentre")
    written = np.asarray(read_ply(out).splats.means, np.float64)
    assert np.ptp(written[[a, b, c], 2]) < 1e-5
    assert np.linalg.norm(written[a] - written[b]) == pytest.approx(3.0, rel=1e-5)
    M = np.array(facts["matrix"])
    np.testing.assert_allclose(written, means @ M[:3, :3].T + M[:3, 3], atol=1e-5)


def test_what_lies_off_the_floor_does_not_tilt_it(tmp_path, capsys):
    rng = np.random.default_rng(4)
    columns = splat_columns(90, rng)
    columns["x"], columns["y"] = rng.uniform(-1.0, 1.0, (2, 90)).astype(np.float32)
    columns["z"] = (0.3 * columns["x"] + np.where(np.arange(90) < 60, 0.0, 0.4 * (1.0 + columns["x"]))).astype(
        np.float32
    )
    source, out = tmp_path / "floor.ply", tmp_path / "out.ply"
    source.write_bytes(ply_bytes(columns))
    told(capsys, "place", str(source), "-o", str(out), "--floor", *map(str, range(90)))
    heights = np.asarray(read_ply(out).splats.means, np.float64)[:60, 2]
    assert np.ptp(heights) < 1e-4


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("clean", "--strength", "2"), "--strength must be from 0 to 0.99"),
        (("clean", "--crop", "0", "0", "0", "1", "-1", "1"), "--crop needs the least"),
        (("place", "--floor", "0", "1"), "three points"),
        (("place", "--floor", "0", "1", "99999"), "not 99999"),
        (("place", "--turn", "0", "0", "0", "90"), "an axis that is not zero"),
        (("place", "--scale", "0"), "--scale must be"),
        (("place", "--length", "3", "3", "1"), "two points apart"),
    ],
)
def test_what_means_nothing_is_refused(arguments, message, tmp_path, capsys):
    command, *rest = arguments
    assert main([command, str(TUBE), "-o", str(tmp_path / "out.ply"), *rest]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out.ply").exists()
