"""What is odd about splats is counted, located and left alone."""

import dataclasses

import numpy as np
import pytest

from splap_editor.io import ply_reader
from splap_editor.io.lint import lint
from splap_editor.io.ply import PlyError, read_ply, write_ply
from tests.reference.ply import ply_bytes, splat_columns


def spoilt(tmp_path, format_="binary_little_endian", **cells):
    """File of 50 splats with some cells changed: column → {row: value}."""
    columns = splat_columns(50, np.random.default_rng(0), n_rest=9)
    for name, values in cells.items():
        for row, value in values.items():
            columns[name][row] = value
    (tmp_path / "a.ply").write_bytes(ply_bytes(columns, format_))
    return read_ply(tmp_path / "a.ply")


def test_good_splats_have_no_findings(tmp_path):
    file = spoilt(tmp_path)
    assert file.warnings == []
    assert lint(file.splats) == []


def test_infinite_opacity_and_no_extent_are_legal(tmp_path):
    file = spoilt(tmp_path, opacity={1: np.inf, 2: -np.inf}, scale_2={3: -np.inf, 4: -1e10})
    assert file.warnings == []
    assert lint(file.splats) == []


@pytest.mark.parametrize(
    ("kind", "cells", "rows", "words"),
    [
        ("scales", {"scale_1": {4: np.nan, 9: np.inf}}, [4, 9], "2 splats have a scale"),
        ("opacities", {"opacity": {7: np.nan}}, [7], "1 splat has an opacity"),
        ("rotations", {"rot_3": {5: np.nan}, "rot_0": {6: np.inf, 5: np.nan}}, [5, 6], "2 splats have a rotation"),
        ("zero_rotations", {f"rot_{c}": {8: 0.0} for c in range(4)}, [8], "1 splat has a zero rotation"),
        ("colours", {"f_rest_4": {3: np.nan}, "f_dc_0": {2: np.inf}}, [2, 3], "2 splats have a colour"),
    ],
)
@pytest.mark.parametrize("format_", ["binary_little_endian", "binary_big_endian", "ascii"])
def test_unusable_rows_are_warned_about_and_kept(kind, cells, rows, words, format_, tmp_path):
    file = spoilt(tmp_path, format_, **cells)
    assert len(file.warnings) == 1
    assert words in file.warnings[0]
    (finding,) = lint(file.splats)
    assert finding.kind == kind
    np.testing.assert_array_equal(finding.rows, rows)
    moved = dataclasses.replace(file.splats, means=file.splats.means + np.float32(1))
    write_ply(tmp_path / "out.ply", file, moved)
    out = read_ply(tmp_path / "out.ply")
    for name, before in file.table.columns.items():
        if name not in "xyz":
            np.testing.assert_array_equal(out.table.columns[name], before)


def test_a_rotation_that_begins_with_zero_is_no_zero_rotation(tmp_path):
    assert spoilt(tmp_path, rot_0={3: 0.0}).warnings == []


def test_duplicates_are_every_row_after_the_first(tmp_path):
    file = spoilt(tmp_path, **{axis: {3: 0.5, 20: 0.5, 41: 0.5} for axis in "xyz"})
    (finding,) = lint(file.splats)
    assert finding.kind == "duplicates"
    np.testing.assert_array_equal(finding.rows, [20, 41])
    assert finding.sentence == "2 splats have the position of an earlier splat"


def test_giants_are_measured_by_the_scene(tmp_path):
    file = spoilt(tmp_path, scale_1={12: 3.0})
    (finding,) = lint(file.splats)
    assert finding.kind == "giants"
    np.testing.assert_array_equal(finding.rows, [12])
    larger = dataclasses.replace(file.splats, means=file.splats.means * 100)
    assert lint(larger) == []


def test_blank_rows_and_useless_thresholds_are_found(tmp_path):
    zeros = {name: {row: 0.0 for row in (5, 6)} for name in ["x", "y", "z"]}
    zeros |= {f"{part}_{c}": {5: 0.0, 6: 0.0} for part in ("scale", "rot") for c in range(3)}
    zeros["rot_3"] = {5: 0.0, 6: 0.0}
    file = spoilt(tmp_path, **zeros)
    thresholds = np.zeros(50, "f4")
    thresholds[9] = 1
    found = {f.kind: f.rows.tolist() for f in lint(dataclasses.replace(file.splats, thresholds=thresholds))}
    assert found["all_zero"] == [5, 6]
    assert found["zero_rotations"] == [5, 6]
    assert found["thresholds"] == [9]


def test_activated_opacities_outside_0_to_1_are_found(tmp_path):
    columns = splat_columns(6, np.random.default_rng(0))
    columns["opacity"] = np.array([0, 0.5, 1, 1.5, -0.5, np.nan], "f4")
    (tmp_path / "a.ply").write_bytes(ply_bytes(columns))
    found = lint(read_ply(tmp_path / "a.ply", layout="spikinggs").splats)
    assert [f.rows.tolist() for f in found if f.kind == "opacities"] == [[3, 4, 5]]


@pytest.mark.parametrize("row", [0, 1, 24, 49])
@pytest.mark.parametrize("n_bytes", [1, 70, 92, 200, 10**6])
def test_no_row_escapes_the_look_at_blocks(row, n_bytes, tmp_path, monkeypatch):
    monkeypatch.setattr(ply_reader, "READ_BYTES", n_bytes)
    assert spoilt(tmp_path).warnings == []
    assert len(spoilt(tmp_path, opacity={row: np.nan}).warnings) == 1
    with pytest.raises(PlyError, match=f"1 splat whose position is not finite, the first in row {row}"):
        spoilt(tmp_path, z={row: np.nan})
