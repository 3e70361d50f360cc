"""Copies of rows after a file's own: everything else stays, in every format."""

import numpy as np
import pytest

from splap_editor.io.grown_file import grown_file
from splap_editor.io.ply import read_ply, write_ply
from tests.reference.ply import compressed_bytes, ply_bytes, splat_columns

FACES = {"face": {"vertex_indices": [np.array([0, 1, 2], "i4"), np.array([2, 1, 0, 3], "i4")]}}
CAMERAS = {"camera": {"focal": np.array([1.5, 2.5], "f8"), "id": np.array([1, 2], "u1")}}


@pytest.mark.parametrize("after", [None, CAMERAS, FACES])
@pytest.mark.parametrize("format_", ["binary_little_endian", "binary_big_endian", "ascii"])
@pytest.mark.parametrize("newline", [b"\n", b"\r\n"])
def test_rows_are_copied_after_the_files_own_and_all_else_stays(format_, after, newline, tmp_path):
    columns = splat_columns(7, np.random.default_rng(0), n_rest=9)
    columns |= {"tag": np.arange(7, dtype="u1"), "index": -np.arange(7, dtype="i4")}
    (tmp_path / "in.ply").write_bytes(ply_bytes(columns, format_, comments=("kept",), newline=newline, after=after))
    file, rows = read_ply(tmp_path / "in.ply"), np.array([3, 6, 3])
    grown = grown_file(file, rows)
    write_ply(tmp_path / "out.ply", grown, grown.splats)
    written = read_ply(tmp_path / "out.ply")
    at = np.concatenate([np.arange(7), rows])
    assert written.splats.n_splats == grown.splats.n_splats == 10
    for name in columns:
        assert written.table.columns[name].tobytes() == file.table.columns[name][at].tobytes()
        assert grown.table.columns[name].tobytes() == file.table.columns[name][at].tobytes()
    assert written.table.header.raw == file.table.header.raw.replace(b"element vertex 7", b"element vertex 10")
    before, grew = ([bytes(block) for block in held.table.blocks(lambda lo, hi: {}, [])] for held in (file, written))
    assert (before[0], before[-1]) == (grew[0], grew[-1])


def test_lists_are_copied_with_their_rows(tmp_path):
    columns = splat_columns(4, np.random.default_rng(1))
    columns["seen_by"] = [np.arange(n, dtype="i4") for n in (3, 0, 2, 5)]
    for format_ in ("binary_little_endian", "ascii"):
        (tmp_path / "in.ply").write_bytes(ply_bytes(columns, format_))
        file = read_ply(tmp_path / "in.ply")
        grown = grown_file(file, np.array([3, 0]))
        write_ply(tmp_path / "out.ply", grown, grown.splats)
        at = [0, 1, 2, 3, 3, 0]
        wanted = {name: [held[i] for i in at] if isinstance(held, list) else held[at] for name, held in columns.items()}
        assert (tmp_path / "out.ply").read_bytes() == ply_bytes(wanted, format_)


def test_a_text_file_without_a_last_line_end_is_grown_by_whole_lines(tmp_path):
    columns = splat_columns(3, np.random.default_rng(2))
    (tmp_path / "in.ply").write_bytes(ply_bytes(columns, "ascii").rstrip(b"\n"))
    file = read_ply(tmp_path / "in.ply")
    grown = grown_file(file, np.array([2]))
    write_ply(tmp_path / "out.ply", grown, grown.splats)
    assert (tmp_path / "out.ply").read_bytes() == ply_bytes({n: v[[0, 1, 2, 2]] for n, v in columns.items()}, "ascii")


def test_a_compressed_file_is_grown_as_a_plain_one(tmp_path):
    (tmp_path / "in.ply").write_bytes(compressed_bytes(splat_columns(300, np.random.default_rng(3), n_scales=3)))
    file = read_ply(tmp_path / "in.ply")
    grown = grown_file(file, np.array([5]))
    assert grown.table.n_rows == grown.splats.n_splats == 301
    np.testing.assert_array_equal(grown.splats.means[300], file.splats.means[5])
