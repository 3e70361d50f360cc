"""What is read is what is written, bit for bit where nothing changed."""

import dataclasses
from io import BytesIO

import numpy as np
import plyfile
import pytest

from splap_editor.io.ply import read_ply, write_ply
from tests.reference.ply import compressed_bytes, ply_bytes, splat_columns

FORMATS = ["binary_little_endian", "binary_big_endian", "ascii"]
NEWLINES = [b"\n", b"\r\n"]
TRIANGLES = {"face": {"vertex_indices": [np.array([0, 1, 2], "i4"), np.array([2, 1, 0, 3], "i4")]}}
CAMERAS = {"camera": {"focal": np.array([1.5, 2.5], "f8"), "id": np.array([1, 2], "u1")}}


def random_file(seed, comments=("made for a test", "grüße: \x0c")):
    """A splat file that no trainer would write, but some program might."""
    rng = np.random.default_rng(seed)
    columns = splat_columns(
        int(rng.integers(1, 40)),
        rng,
        n_scales=int(rng.integers(2, 4)),
        n_rest=int(rng.choice([0, 9, 24, 45, 72])),
        normals=bool(rng.integers(2)),
        rgb=bool(rng.integers(2)),
    )
    n = len(columns["x"])
    columns |= {"tag": rng.integers(0, 255, n).astype("u1"), "index": rng.integers(-9, 9, n).astype("i4")}
    for name in rng.choice(list(columns), 5):
        if columns[name].dtype == "f4":
            columns[name] = columns[name].astype("f8")
    if rng.integers(2):
        names = rng.permutation(list(columns))
        columns = {name: columns[name] for name in names}
    format_ = FORMATS[rng.integers(3)]
    return columns, ply_bytes(
        columns,
        format_,
        comments=comments,
        newline=NEWLINES[rng.integers(2)],
        before=[None, CAMERAS][rng.integers(2)],
        after=[None, CAMERAS, TRIANGLES][rng.integers(3)],
    )


def moved(splats, rows):
    """Splats with some rows shifted, turned and grown."""
    means, quats, scales = (np.array(part, np.float64) for part in (splats.means, splats.quats, splats.log_scales))
    shN = np.array(splats.shN)
    means[rows] += [1.0, -2.0, 0.5]
    quats[rows] = quats[rows][:, [1, 0, 3, 2]] * [-1, 1, 1, -1]
    scales[rows] += 0.25
    shN[rows] *= -1
    return dataclasses.replace(splats, means=means, quats=quats, log_scales=scales, shN=shN)


@pytest.mark.parametrize("seed", range(24))
def test_unedited_splats_give_the_identical_file(seed, tmp_path):
    _, data = random_file(seed)
    (tmp_path / "in.ply").write_bytes(data)
    file = read_ply(tmp_path / "in.ply")
    for splats in (file.splats, dataclasses.replace(file.splats, means=np.array(file.splats.means, np.float64))):
        write_ply(tmp_path / "out.ply", file, splats)
        assert (tmp_path / "out.ply").read_bytes() == data


@pytest.mark.parametrize("seed", range(24))
def test_columns_mean_the_same_in_every_order_type_and_format(seed, tmp_path):
    columns, data = random_file(seed)
    (tmp_path / "in.ply").write_bytes(data)
    splats = read_ply(tmp_path / "in.ply").splats
    for c, name in enumerate("xyz"):
        np.testing.assert_array_equal(splats.means[:, c], columns[name])
    for c in range(4):
        np.testing.assert_array_equal(splats.quats[:, c], columns[f"rot_{c}"])
    for c in range(splats.n_scales):
        np.testing.assert_array_equal(splats.log_scales[:, c], columns[f"scale_{c}"])
    np.testing.assert_array_equal(splats.logit_opacities, columns["opacity"])
    n_coefficients = splats.shN.shape[1]
    for k in range(n_coefficients):
        for channel in range(3):
            np.testing.assert_array_equal(splats.shN[:, k, channel], columns[f"f_rest_{channel * n_coefficients + k}"])
    if "red" in columns and "f_dc_0" not in columns:
        colour = 0.5 + 0.28209479177387814 * splats.sh0[:, 1].astype(np.float64)
        # float32 coefficients.
        np.testing.assert_allclose(colour, columns["green"] / 255, atol=1e-6)


@pytest.mark.parametrize("seed", range(24))
def test_only_changed_cells_change(seed, tmp_path):
    columns, data = random_file(seed)
    (tmp_path / "in.ply").write_bytes(data)
    file = read_ply(tmp_path / "in.ply")
    n = file.splats.n_splats
    rows = np.arange(0, n, 3)
    splats = moved(file.splats, rows)
    write_ply(tmp_path / "out.ply", file, splats)
    out = read_ply(tmp_path / "out.ply")
    assert out.table.header.raw == file.table.header.raw
    spared = np.setdiff1d(np.arange(n), rows)
    touched = {"x", "y", "z"} | {name for name in columns if name.startswith(("rot_", "scale_", "f_rest_", "n"))}
    for name, before in file.table.columns.items():
        after = out.table.columns[name]
        assert after.dtype == before.dtype
        np.testing.assert_array_equal(after[spared], before[spared])
        if name not in touched:
            np.testing.assert_array_equal(after, before)
    # Columns are float32.
    np.testing.assert_allclose(out.splats.means, splats.means, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(out.splats.quats, splats.quats, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(out.splats.log_scales, splats.log_scales, rtol=1e-6, atol=1e-6)
    np.testing.assert_array_equal(out.splats.shN, splats.shN)
    write_ply(tmp_path / "back.ply", out, dataclasses.replace(file.splats, quats=out.splats.quats))
    back = read_ply(tmp_path / "back.ply")
    np.testing.assert_array_equal(back.splats.means, file.splats.means)


@pytest.mark.parametrize("seed", range(24))
def test_plyfile_reads_what_is_written(seed, tmp_path):
    columns, data = random_file(seed, comments=["plyfile takes ASCII only"])
    (tmp_path / "in.ply").write_bytes(data)
    file = read_ply(tmp_path / "in.ply")
    n = file.splats.n_splats
    value = np.linspace(0, 1, n)
    write_ply(tmp_path / "out.ply", file, moved(file.splats, [0]), as_3dgs=True, extra={"stretch": value})
    ply = plyfile.PlyData.read(tmp_path / "out.ply")
    before = plyfile.PlyData.read(BytesIO(data))
    vertex = ply["vertex"].data
    assert "scale_2" in vertex.dtype.names
    if "scale_2" not in columns:
        names = list(vertex.dtype.names)
        assert names[names.index("scale_1") + 1] == "scale_2"
        np.testing.assert_allclose(vertex["scale_2"], np.log(1e-6), rtol=1e-7)  # float32
    np.testing.assert_array_equal(vertex["stretch"], value.astype("f4"))
    for name in before["vertex"].data.dtype.names:
        np.testing.assert_array_equal(vertex[name][1:], before["vertex"][name][1:])
    for element in before.elements:
        if element.name != "vertex":
            for name in element.data.dtype.names:
                for a, b in zip(element.data[name], ply[element.name].data[name], strict=True):
                    np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("format_", FORMATS)
@pytest.mark.parametrize("where", ["before", "after", "within"])
def test_lists_anywhere_are_kept(where, format_, tmp_path):
    columns = splat_columns(5, np.random.default_rng(1))
    lists = [np.arange(i, dtype="i2") for i in range(1, 6)]
    if where == "within":
        columns = {"x": columns.pop("x"), "bones": lists, **columns}
    faces = {"face": {"vertex_indices": lists, "area": np.arange(5, dtype="f4")}}
    data = ply_bytes(columns, format_, **({where: faces} if where != "within" else {}))
    (tmp_path / "in.ply").write_bytes(data)
    file = read_ply(tmp_path / "in.ply")
    write_ply(tmp_path / "out.ply", file, file.splats)
    assert (tmp_path / "out.ply").read_bytes() == data
    write_ply(tmp_path / "out.ply", file, moved(file.splats, [2]), extra={"weight": np.arange(5)})
    before, after = plyfile.PlyData.read(tmp_path / "in.ply"), plyfile.PlyData.read(tmp_path / "out.ply")
    np.testing.assert_array_equal(after["vertex"]["weight"], np.arange(5))
    np.testing.assert_array_equal(np.flatnonzero(after["vertex"]["x"] != before["vertex"]["x"]), [2])
    element, name = ("vertex", "bones") if where == "within" else ("face", "vertex_indices")
    for a, b in zip(before[element][name], after[element][name], strict=True):
        np.testing.assert_array_equal(a, b)
    if where != "within":
        np.testing.assert_array_equal(after["face"]["area"], np.arange(5))


def test_bytes_after_the_last_element_are_kept(tmp_path):
    for after in (None, TRIANGLES):
        data = ply_bytes(splat_columns(4, np.random.default_rng(0)), after=after) + b"tail\n\x00"
        (tmp_path / "in.ply").write_bytes(data)
        file = read_ply(tmp_path / "in.ply")
        write_ply(tmp_path / "out.ply", file, moved(file.splats, [1]))
        out = (tmp_path / "out.ply").read_bytes()
        assert out.endswith(b"tail\n\x00")
        assert len(out) == len(data)


def test_text_numbers_nobody_touched_keep_their_digits(tmp_path):
    columns = splat_columns(4, np.random.default_rng(0))
    lines = ply_bytes(columns, "ascii").split(b"\n")
    lines[-3] = b"\t" + lines[-3].replace(b" ", b"   ") + b"  "
    lines[-2] = b"+1.50000e0" + lines[-2][lines[-2].index(b" ") :]
    (tmp_path / "in.ply").write_bytes(b"\n".join(lines[:-1]))
    file = read_ply(tmp_path / "in.ply")
    means = file.splats.means.copy()
    means[2, 1] = 7.25
    write_ply(tmp_path / "out.ply", file, dataclasses.replace(file.splats, means=means))
    out = (tmp_path / "out.ply").read_bytes().split(b"\n")
    assert out[-2].split()[1] == b"7.25"
    assert out[-2].replace(b"7.25", lines[-3].split()[1]) == lines[-3]
    assert out[-1] == lines[-2]


def test_integer_positions_are_rounded_and_integer_colours_clipped(tmp_path):
    columns = splat_columns(3, np.random.default_rng(0), rgb=True)
    columns["x"] = np.array([10, 20, 30], "u1")
    (tmp_path / "in.ply").write_bytes(ply_bytes(columns))
    file = read_ply(tmp_path / "in.ply")
    means, sh0 = np.array(file.splats.means), np.array(file.splats.sh0)
    means[:, 0] = [9.6, 255.4, -0.4]
    sh0[0] = [0.0, 100.0, -100.0]
    write_ply(tmp_path / "out.ply", file, dataclasses.replace(file.splats, means=means, sh0=sh0))
    out = read_ply(tmp_path / "out.ply").table.columns
    np.testing.assert_array_equal(out["x"], [10, 255, 0])
    assert [out[name][0] for name in ("red", "green", "blue")] == [128, 255, 0]
    np.testing.assert_array_equal(out["red"][1:], columns["red"][1:])


def test_rotations_keep_the_lengths_of_the_file_and_turn_unit_normals(tmp_path):
    columns = splat_columns(3, np.random.default_rng(0), normals=True)
    quats = np.array([[2.0, 0, 0, 0], [0.5, 0, 0, 0], [0, 0, 0, 0]], "f4")
    normals = np.array([[0, 0, 1], [0, 0, 3], [1, 0, 0]], "f4")
    columns |= {f"rot_{c}": quats[:, c] for c in range(4)}
    columns |= {name: normals[:, c] for c, name in enumerate(("nx", "ny", "nz"))}
    (tmp_path / "in.ply").write_bytes(ply_bytes(columns))
    file = read_ply(tmp_path / "in.ply")
    quarter = np.array([np.sqrt(0.5), np.sqrt(0.5), 0, 0])  # about x: z goes to -y
    new = np.array(file.splats.quats)
    new[:2] = quarter
    write_ply(tmp_path / "out.ply", file, dataclasses.replace(file.splats, quats=new))
    out = read_ply(tmp_path / "out.ply")
    np.testing.assert_allclose(out.splats.quats, [2 * quarter, 0.5 * quarter, np.zeros(4)], rtol=1e-7)  # float32
    got = np.stack([out.table.columns[name] for name in ("nx", "ny", "nz")], axis=1)
    np.testing.assert_allclose(got, [[0, -1, 0], [0, 0, 3], [1, 0, 0]], atol=1e-7)  # float32


@pytest.mark.parametrize("n_rest", [0, 9, 24, 45])
def test_compressed_files_are_kept_unless_deformed(n_rest, tmp_path):
    columns = splat_columns(300, np.random.default_rng(0), n_rest=n_rest)
    data = compressed_bytes(columns)
    (tmp_path / "in.ply").write_bytes(data)
    file = read_ply(tmp_path / "in.ply")
    write_ply(tmp_path / "out.ply", file, file.splats)
    assert (tmp_path / "out.ply").read_bytes() == data
    splats = moved(file.splats, [7])
    write_ply(tmp_path / "out.ply", file, splats, extra={"weight": np.arange(300)})
    out = read_ply(tmp_path / "out.ply")
    assert out.layout.name == "3dgs"
    assert list(out.table.columns)[:6] == ["x", "y", "z", "nx", "ny", "nz"]
    for part in ("means", "log_scales", "quats", "logit_opacities", "sh0", "shN"):
        np.testing.assert_array_equal(getattr(out.splats, part), np.asarray(getattr(splats, part), "f4"))


def test_arrays_of_a_plain_file_are_views(tmp_path):
    (tmp_path / "in.ply").write_bytes(ply_bytes(splat_columns(9, np.random.default_rng(0), n_rest=45, normals=True)))
    file = read_ply(tmp_path / "in.ply")
    for part in ("means", "log_scales", "quats", "logit_opacities", "sh0", "shN"):
        array = getattr(file.splats, part)
        assert np.shares_memory(array, file.table.body), part
        assert not array.flags.writeable


def test_a_file_may_be_written_onto_itself(tmp_path):
    data = ply_bytes(splat_columns(9, np.random.default_rng(0)))
    (tmp_path / "in.ply").write_bytes(data)
    file = read_ply(tmp_path / "in.ply")
    splats = moved(file.splats, [3])
    write_ply(tmp_path / "in.ply", file, splats)
    np.testing.assert_allclose(read_ply(tmp_path / "in.ply").splats.means, splats.means, rtol=1e-6)  # float32
    write_ply(tmp_path / "in.ply", file, file.splats)
    assert (tmp_path / "in.ply").read_bytes() == data


@pytest.mark.parametrize("seed", range(24))
def test_removed_rows_are_left_out_and_all_other_bytes_stay(seed, tmp_path):
    """Of each column, of other elements and of the header, in every format."""
    columns, data = random_file(seed)
    (tmp_path / "in.ply").write_bytes(data)
    file = read_ply(tmp_path / "in.ply")
    n = file.splats.n_splats
    removed = np.random.default_rng(seed).random(n) < 0.5
    removed[0] = False
    write_ply(tmp_path / "out.ply", file, file.splats, removed=removed)
    written = read_ply(tmp_path / "out.ply")
    for name in columns:
        assert written.table.columns[name].tobytes() == file.table.columns[name][~removed].tobytes()
    count = f"element vertex {n}".encode(), f"element vertex {(~removed).sum()}".encode()
    assert written.table.header.raw == file.table.header.raw.replace(*count)
    whole, less = ([bytes(block) for block in held.table.blocks(lambda lo, hi: {}, [])] for held in (file, written))
    # What stands before and after the rows of the vertices: other elements.
    assert (whole[0], whole[-1]) == (less[0], less[-1])


def test_compressed_splats_of_which_some_are_removed_become_plain_ones(tmp_path):
    (tmp_path / "in.ply").write_bytes(compressed_bytes(splat_columns(600, np.random.default_rng(0), n_scales=3)))
    file = read_ply(tmp_path / "in.ply")
    removed = np.arange(file.splats.n_splats) % 3 == 1
    write_ply(tmp_path / "out.ply", file, file.splats, removed=removed)
    written = read_ply(tmp_path / "out.ply").splats
    for part in ("means", "log_scales", "quats", "logit_opacities", "sh0", "shN"):
        np.testing.assert_array_equal(getattr(written, part), getattr(file.splats, part)[~removed])
