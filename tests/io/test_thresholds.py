"""SpikingGS thresholds are found beside the file, joined by row, and never believed blindly."""

import pickle
import zipfile

import numpy as np
import pytest

from splap_editor.io.ply import read_ply, write_ply
from tests.reference.ply import ply_bytes, splat_columns

N = 12
CUTOFFS = np.linspace(-0.2, 0.2, N, dtype="f4")[:, None]


@pytest.fixture
def ply(tmp_path):
    columns = splat_columns(N, np.random.default_rng(0))
    columns["opacity"] = np.linspace(0, 0.99, N, dtype="f4")
    columns["scale_2"] = np.full(N, -1e10, "f4")
    path = tmp_path / "point_cloud.ply"
    path.write_bytes(ply_bytes(columns))
    return path


def test_thresholds_are_absolute_values_row_by_row(ply):
    np.savez(ply.with_suffix(".npz"), Vth_pdf=CUTOFFS, Vth_opa=np.array([0.001], "f4"))
    file = read_ply(ply)
    np.testing.assert_array_equal(file.splats.thresholds, np.abs(CUTOFFS[:, 0]))
    assert file.warnings == []


def test_opacities_below_the_common_threshold_are_zero(ply):
    np.savez(ply.with_suffix(".npz"), Vth_pdf=CUTOFFS, Vth_opa=np.array([0.1], "f4"))
    file = read_ply(ply)
    stored = file.table.columns["opacity"]
    np.testing.assert_array_equal(file.splats.opacities == 0, stored < 0.1)
    write_ply(ply.with_name("out.ply"), file, file.splats)
    assert ply.with_name("out.ply").read_bytes() == ply.read_bytes()


def test_the_archive_of_the_same_stem_goes_first(ply):
    other = ply.with_name("scene.ply")
    other.write_bytes(ply.read_bytes())
    np.savez(ply.with_name("point_cloud.npz"), Vth_pdf=CUTOFFS)
    np.testing.assert_array_equal(read_ply(other).splats.thresholds, np.abs(CUTOFFS[:, 0]))
    np.savez(other.with_suffix(".npz"), Vth_pdf=2 * CUTOFFS)
    np.testing.assert_array_equal(read_ply(other).splats.thresholds, 2 * np.abs(CUTOFFS[:, 0]))


def test_thresholds_tell_spikinggs_without_flat_scales(ply):
    columns = splat_columns(N, np.random.default_rng(0))
    columns["opacity"] = np.linspace(0, 1, N, dtype="f4")
    ply.write_bytes(ply_bytes(columns))
    assert read_ply(ply).layout.name != "spikinggs"
    np.savez(ply.with_suffix(".npz"), Vth_pdf=CUTOFFS)
    file = read_ply(ply)
    assert file.layout.name == "spikinggs"
    assert file.splats.thresholds is not None
    assert read_ply(ply, layout="3dgs").splats.thresholds is None


def test_a_missing_archive_is_said(ply):
    file = read_ply(ply)
    assert file.splats.thresholds is None
    assert "none lies beside this one" in file.warnings[0]


def test_an_archive_of_another_save_is_not_used(ply):
    np.savez(ply.with_suffix(".npz"), Vth_pdf=np.ones((N + 1, 1), "f4"))
    file = read_ply(ply)
    assert file.splats.thresholds is None
    assert "holds 13 thresholds for 12 splats" in file.warnings[0]


def damaged_archives():
    header = b"\x93NUMPY\x01\x00v\x00{'descr': '<f4', 'fortran_order': False, 'shape': (999999999999, 1), }"
    yield "empty", b""
    yield "text", b"not an archive"
    yield "zip", b"PK\x03\x04" + b"\0" * 50
    yield "pickle", pickle.dumps({"Vth_pdf": [1]})
    yield "lie", header.ljust(127) + b"\n" + b"\0" * 64


@pytest.mark.parametrize(("kind", "data"), list(damaged_archives()))
def test_a_damaged_archive_is_a_warning(kind, data, ply):
    if kind == "lie":
        with zipfile.ZipFile(ply.with_suffix(".npz"), "w") as archive:
            archive.writestr("Vth_pdf.npy", data)
    else:
        ply.with_suffix(".npz").write_bytes(data)
    file = read_ply(ply)
    assert file.splats.thresholds is None
    assert "point_cloud.npz" in file.warnings[0]


def test_a_cut_archive_is_a_warning(ply):
    np.savez_compressed(ply.with_suffix(".npz"), Vth_pdf=CUTOFFS)
    data = ply.with_suffix(".npz").read_bytes()
    for length in range(0, len(data), 7):
        ply.with_suffix(".npz").write_bytes(data[:length])
        assert read_ply(ply).splats.thresholds is None


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"xyz": np.zeros(3)}, "holds no Vth_pdf"),
        ({"Vth_pdf": np.full(N, np.nan)}, "12 thresholds that are not finite, first in row 0"),
        ({"Vth_pdf": np.array(["a"] * N)}, "no array of plain numbers"),
        ({"Vth_pdf": np.array([None] * N, object)}, "no array of plain numbers"),
    ],
)
def test_an_archive_of_something_else_is_a_warning(arrays, message, ply):
    np.savez(ply.with_suffix(".npz"), **arrays)
    file = read_ply(ply)
    assert file.splats.thresholds is None
    assert message in file.warnings[0]
