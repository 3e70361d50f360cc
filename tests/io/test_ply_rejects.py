"""Files that are refused, each with a sentence that says what is wrong and what to do."""

import os
import re
from dataclasses import replace

import numpy as np
import pytest

from splap_editor.io import ply_reader
from splap_editor.io.ply import PlyError, read_ply, write_ply
from tests.reference.ply import compressed_bytes, ply_bytes, splat_columns

LETTERS = range(33, 123)
FORMATS = ["binary_little_endian", "binary_big_endian", "ascii"]


def columns(**changed):
    held = splat_columns(6, np.random.default_rng(0), n_rest=9)
    return {name: values for name, values in (held | changed).items() if values is not None}


def refused(tmp_path, data, message, **options):
    path = tmp_path / "scene.ply"
    path.write_bytes(data)
    with pytest.raises(PlyError, match=message) as caught:
        read_ply(path, **options)
    sentence = str(caught.value)
    assert "scene" in sentence or options
    assert sentence.endswith((".", "?"))
    return sentence


@pytest.mark.parametrize("data", [b"", b"plywood\n", b"\x89PNG\r\n", b"PLY\n", bytes(range(256)) * 10])
def test_what_is_no_ply_is_refused(data, tmp_path):
    refused(tmp_path, data, "not a PLY file")


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (b"format binary_middle_endian 1.0", "means nothing"),
        (b"element vertex -1", "means nothing"),
        (b"element vertex 1e9", "means nothing"),
        (b"element vertex 99999999999999999999", "means nothing"),
        (b"property quaternion rot", "unknown type"),
        (b"property list float", "unknown type"),
        (b"property float x", "two columns named 'x'"),
        (b"element vertex 2", "two elements named 'vertex'"),
        (b"\xff\xfe", "not plain ASCII"),
        (b"property float a\xc2\xa0b", "not plain ASCII"),
        (b"property\x0bfloat a", "not plain ASCII"),
        (b"property float \x00", "not plain ASCII"),
        (b"property list float int a", "unknown type"),
        (b"element empty 5", "5 rows of an element 'empty' without a column"),
        (b"element empty 4000000000", "4,000,000,000 rows of an element 'empty' without a column"),
        (
            b"\n".join(b"element a%d 0\n" % i + b"\n".join(b"property int %c" % c for c in LETTERS) for i in range(46)),
            "4,163 columns; 4,096 are the most",
        ),
        (b"\n".join(b"element a%d 0" % i for i in range(64)), "65 elements; 64 are the most"),
        (b"comment " + b"x" * 70000, "no 'end_header' line within 65,536 bytes"),
    ],
)
def test_a_broken_header_line_is_refused_with_the_line(line, message, tmp_path):
    header, body = ply_bytes(columns()).split(b"end_header\n", 1)
    refused(tmp_path, header + line + b"\nend_header\n" + body, message)


def test_a_header_without_format_is_refused(tmp_path):
    refused(
        tmp_path, ply_bytes(columns()).replace(b"format binary_little_endian 1.0\n", b""), "does not say its format"
    )


@pytest.mark.parametrize("format_", FORMATS)
def test_a_file_cut_anywhere_is_refused(format_, tmp_path):
    for after in (None, {"face": {"vertex_indices": [np.array([0, 1, 2], "i4")] * 3}}):
        data = ply_bytes(columns(), format_, after=after)
        # The last digits of a text file are not known to be missing.
        end = len(data) if format_ != "ascii" else data.rindex(b" ")
        for length in np.linspace(0, end - 1, 60, dtype=int):
            refused(tmp_path, data[:length], "not a PLY file|cut short|no 'end_header'")


def no_memory(monkeypatch, available):
    """Let the reader see so much memory and get none."""

    def nothing_left(*_):
        raise MemoryError

    monkeypatch.setattr(ply_reader, "available_memory", lambda: available)
    monkeypatch.setattr(ply_reader.np, "empty", nothing_left)


def test_a_lying_count_is_refused_before_memory_is_taken(tmp_path, monkeypatch):
    lies = [
        ply_bytes(columns(), format_).replace(b"element vertex 6\n", b"element vertex 987654321012345\n")
        for format_ in FORMATS
    ]
    no_memory(monkeypatch, available=None)
    for data in lies:
        refused(tmp_path, data, "cut short: its header promises at least")


def test_a_file_larger_than_the_memory_is_refused_before_memory_is_taken(tmp_path, monkeypatch):
    data = ply_bytes(columns())
    no_memory(monkeypatch, available=200)
    refused(tmp_path, data, "GiB of memory")


def test_memory_that_runs_out_is_said(tmp_path, monkeypatch):
    data = ply_bytes(columns())
    no_memory(monkeypatch, available=None)
    refused(tmp_path, data, "does not fit in memory")


def test_a_mesh_and_a_point_cloud_are_told_from_splats(tmp_path):
    points = {name: np.zeros(3, "f4") for name in "xyz"}
    faces = {"face": {"vertex_indices": [np.array([0, 1, 2], "i4")]}}
    refused(tmp_path, ply_bytes(points, after=faces), "is a mesh, not Gaussian splats")
    refused(tmp_path, ply_bytes(points), "is a plain point cloud, not Gaussian splats")
    refused(tmp_path, ply_bytes(points).replace(b"vertex", b"point"), "no 'vertex' element")


def test_zero_splats_are_refused(tmp_path):
    for format_ in FORMATS:
        header = ply_bytes(columns(), format_).split(b"end_header\n")[0] + b"end_header\n"
        refused(tmp_path, header.replace(b"vertex 6", b"vertex 0"), "zero splats")


@pytest.mark.parametrize("format_", FORMATS)
def test_positions_that_are_not_finite_are_counted(format_, tmp_path):
    x, z = np.zeros(6, "f4"), np.zeros(6, "f4")
    x[4], z[2], z[4] = np.nan, -np.inf, np.nan
    refused(
        tmp_path, ply_bytes(columns(x=x, z=z), format_), "2 splats whose position is not finite, the first in row 2"
    )


def test_missing_columns_are_named(tmp_path):
    sentence = refused(tmp_path, ply_bytes(columns(rot_2=None, opacity=None)), "lacks the columns")
    assert re.search("opacity, rot_2", sentence)
    refused(tmp_path, ply_bytes(columns(f_dc_1=None)), "lacks the columns f_dc_1")
    refused(tmp_path, ply_bytes(columns(scale_1=None)), "lacks the columns scale_1")
    opacity = [np.zeros(1, "f4")] * 6
    refused(tmp_path, ply_bytes(columns(opacity=opacity)), "has lists in the columns opacity")


@pytest.mark.parametrize("name", ["x", "f_dc_0", "f_rest_3", "opacity", "scale_1", "rot_0", "rot_3", "nx", "filter_3D"])
@pytest.mark.parametrize("format_", FORMATS)
def test_a_list_where_a_number_belongs_is_named(name, format_, tmp_path):
    held = columns(**{name: [np.zeros(1, "f4")] * 6})
    refused(tmp_path, ply_bytes(held, format_), f"has lists in the columns {name}, where one number")


@pytest.mark.parametrize("name", ["packed_position", "packed_color"])
def test_packed_columns_of_another_type_are_named(name, tmp_path):
    data = compressed_bytes(splat_columns(300, np.random.default_rng(0), n_rest=9))
    refused(tmp_path, data.replace(b"uint " + name.encode(), b"float " + name.encode()), f"{name} is not of type uint")
    refused(tmp_path, data.replace(b"uchar f_rest_", b"char f_rest_"), "'sh' element is not of type uchar")


@pytest.mark.parametrize("format_", FORMATS)
@pytest.mark.parametrize("value", [2e30, -1e38])
def test_positions_beyond_the_limit_are_counted(format_, value, tmp_path):
    x = np.zeros(6, "f4")
    x[3] = value
    message = r"1 splat whose position is farther than 1e\+30 from the origin, the first in row 3"
    refused(tmp_path, ply_bytes(columns(x=x), format_), message)
    refused(tmp_path, ply_bytes(columns(x=x.astype("f8") * 1e200), format_), message)


def test_a_list_of_negative_length_is_said(tmp_path):
    faces = {"face": {"vertex_indices": [np.arange(3, dtype="i4")] * 4}}
    data = ply_bytes(columns(), after=faces).replace(b"list uchar", b"list char")
    at = len(data) - 2 * 13
    refused(tmp_path, data[:at] + b"\xff" + data[at + 1 :], "row 2 of its element 'face' has a list of negative length")
    text = ply_bytes(columns(), "ascii", after=faces)
    refused(tmp_path, text[: text.rindex(b"3 0 1 2")] + b"-1 0 1 2\n", "the line of row 3 is not whole")


def test_rows_that_end_otherwise_than_the_header_are_said(tmp_path):
    header, body = ply_bytes(columns(), "ascii").split(b"end_header\n", 1)
    data = header + b"end_header\n" + body.replace(b"\n", b"\r")
    refused(tmp_path, data, "ends its rows with CR alone and its header otherwise")


def test_a_line_without_end_is_not_parsed(tmp_path):
    lines = ply_bytes(columns(), "ascii").split(b"\n")
    first = lines.index(b"end_header") + 1
    for row in (0, 5):
        long = [*lines[: first + row], lines[first + row] + b" " * (1 << 21), *lines[first + row + 1 :]]
        refused(tmp_path, b"\n".join(long), f"the line of row {row} is not within 1,048,576 bytes")


@pytest.mark.parametrize("value", [1e39, -1e300])
@pytest.mark.parametrize("format_", FORMATS)
@pytest.mark.parametrize("where", ["alone", "beside lists"])
def test_a_result_that_a_column_cannot_hold_is_refused_and_nothing_is_written(value, format_, where, tmp_path):
    bones = {"bones": [np.arange(i, dtype="i2") for i in range(6)]} if where == "beside lists" else {}
    path = tmp_path / "scene.ply"
    path.write_bytes(ply_bytes(columns(**bones), format_))
    file = read_ply(path)
    means = np.array(file.splats.means, np.float64)
    means[4, 1] = value
    with pytest.raises(PlyError, match=r"scene.ply cannot hold the result: y of row 4 would be"):
        write_ply(path, file, replace(file.splats, means=means))
    assert path.read_bytes() == ply_bytes(columns(**bones), format_) and os.listdir(tmp_path) == ["scene.ply"]


def test_a_packed_result_beyond_single_precision_is_refused(tmp_path):
    path = tmp_path / "scene.ply"
    path.write_bytes(compressed_bytes(splat_columns(300, np.random.default_rng(0))))
    file = read_ply(path)
    means = np.array(file.splats.means, np.float64)
    means[7, 0] = 1e39
    with pytest.raises(PlyError, match=r"cannot hold the result: means of row 7 would not be finite"):
        write_ply(tmp_path / "out.ply", file, replace(file.splats, means=means))
    assert os.listdir(tmp_path) == ["scene.ply"]


def test_spherical_harmonics_must_make_whole_degrees(tmp_path):
    refused(tmp_path, ply_bytes(columns(f_rest_8=None)), "8 f_rest columns, but 0, 9, 24, 45 or 72")
    nine = np.zeros(6, "f4")
    refused(tmp_path, ply_bytes(columns(f_rest_3=None, f_rest_9=nine)), "9 f_rest columns, but f_rest_3 is missing")


@pytest.mark.parametrize("word", [b"spam", b"1,5", b"1 2", b"", b"1\xa02", b"1_0"])
def test_a_damaged_number_in_a_text_file_is_located(word, tmp_path):
    lines = ply_bytes(columns(), "ascii").split(b"\n")
    first = lines.index(b"end_header") + 1
    lines[first + 4] = word + lines[first + 4][lines[first + 4].index(b" ") :]
    refused(tmp_path, b"\n".join(lines), "the line of row 4 is not")


def test_paths_that_are_no_files_are_refused(tmp_path):
    with pytest.raises(PlyError, match="is a directory"):
        read_ply(tmp_path)
    with pytest.raises(PlyError, match="does not exist"):
        read_ply(tmp_path / "missing.ply")
    os.mkfifo(tmp_path / "pipe.ply")
    with pytest.raises(PlyError, match="not a regular file"):
        read_ply(tmp_path / "pipe.ply")


def test_a_file_one_may_not_read_is_refused(tmp_path, monkeypatch):
    (tmp_path / "scene.ply").write_bytes(ply_bytes(columns()))

    def forbidden(*_, **__):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("os.open", forbidden)
    with pytest.raises(PlyError, match="may not be read"):
        read_ply(tmp_path / "scene.ply")


def test_a_layout_the_columns_cannot_have_is_refused(tmp_path):
    sentence = refused(tmp_path, ply_bytes(columns()), "'3dg' is no layout", layout="3dg")
    assert "did you mean '3dgs'" in sentence
    assert "gaussian-surfels" in sentence
    refused(tmp_path, ply_bytes(columns()), "lacks the columns packed_position", layout="supersplat-compressed")
    refused(tmp_path, ply_bytes(columns(scale_2=None)), "lacks the columns scale_2. Choose one of 2dgs", layout="3dgs")
    refused(tmp_path, compressed_bytes(columns()), "Choose one of supersplat-compressed", layout="3dgs")


def test_compressed_files_whose_elements_do_not_fit_are_refused(tmp_path):
    data = compressed_bytes(splat_columns(300, np.random.default_rng(0), n_rest=9))
    two_chunks = data.index(b"end_header\n") + len(b"end_header\n")
    one_chunk = data[:two_chunks] + data[two_chunks + 18 * 4 :]
    refused(tmp_path, one_chunk.replace(b"element chunk 2", b"element chunk 1"), "need 2 chunks, 1 are there")
    refused(tmp_path, data.replace(b"property float max_z", b"property float max_w"), "chunks lack 'max_z'")
    refused(tmp_path, data.replace(b"packed_scale", b"packed_cells"), "lacks the columns packed_scale")
    refused(tmp_path, data.replace(b"property uchar f_rest_8", b"property uchar f_rest_9"), "'sh' element does not fit")


def test_splats_and_columns_that_do_not_match_the_file_are_refused(tmp_path):
    (tmp_path / "scene.ply").write_bytes(ply_bytes(columns()))
    file = read_ply(tmp_path / "scene.ply")
    (tmp_path / "other.ply").write_bytes(ply_bytes(splat_columns(5, np.random.default_rng(0))))
    other = read_ply(tmp_path / "other.ply")
    out = tmp_path / "out.ply"
    with pytest.raises(ValueError, match=re.escape("splats.means must have the file's shape (6, 3), got (5, 3)")):
        write_ply(out, file, other.splats)
    for extra, message in (
        ({"a": np.zeros(5)}, re.escape("must have shape (6,), got (5,)")),
        ({"x": np.zeros(6)}, "has a column 'x' already"),
        ({"a b": np.zeros(6)}, "cannot be a column name"),
        ({"": np.zeros(6)}, "cannot be a column name"),
        ({"é": np.zeros(6)}, "cannot be a column name"),
    ):
        with pytest.raises(ValueError, match=message):
            write_ply(out, file, file.splats, extra=extra)
    assert not out.exists()
