"""Formats beside PLY: what is written comes back within the format's steps, and others' files read as they do."""

import dataclasses
import gzip
import json
import struct
import zipfile
from pathlib import Path

import gaussforge
import gsply
import numpy as np
import pytest
from scipy.spatial import cKDTree

from splap_editor.core.splats.splats import Splats
from splap_editor.io.formats.bare_splats import THIN_LOG_SCALE, alphas_of, bare_splats
from splap_editor.io.formats.table import FORMATS, format_to_write, stem_of
from splap_editor.io.ply import read_ply, write_ply
from splap_editor.io.sample_maker import write_sample
from splap_editor.io.splat_files import are_splats, losses_by_format, losses_of_saving, read_splats, write_splats
from tests.reference.spherical_harmonics import real_basis

PARTS = ("means", "log_scales", "quats", "logit_opacities", "sh0", "shN")

STEPS = {
    # Half a step of each number, as the format's description has it.
    ".spz": {
        "means": 2**-17,
        "log_scales": 1 / 32,
        "turn": 0.005,
        "alphas": 1 / 510,
        "sh0": 1 / 76.5,
        "shN": 8.5 / 128,
    },
    ".usdc": {"means": 1e-6, "log_scales": 1e-5, "turn": 1e-3, "alphas": 1e-6, "sh0": 0, "shN": 1e-6},
    ".glb": {"means": 0, "log_scales": 1e-5, "turn": 1e-3, "alphas": 1e-6, "sh0": 0, "shN": 0},
    ".sog": {"means": 1e-4, "log_scales": 0.05, "turn": 0.02, "alphas": 1 / 510, "sh0": 0.05, "shN": 0.5},
    ".compressed.ply": {"means": 2e-3, "log_scales": 5e-3, "turn": 4e-3, "alphas": 1 / 510, "sh0": 0.02, "shN": 1 / 32},
}


def scene(n: int = 700, degree: int = 2, n_scales: int = 3) -> Splats:
    rng = np.random.default_rng(5)
    quats = rng.normal(size=(n, 4))
    return Splats(
        means=rng.uniform(-2, 2, (n, 3)).astype(np.float32),
        log_scales=rng.uniform(-7, -2, (n, n_scales)).astype(np.float32),
        quats=(quats / np.linalg.norm(quats, axis=1)[:, None]).astype(np.float32),
        logit_opacities=rng.uniform(-4, 4, n).astype(np.float32),
        sh0=rng.uniform(-1.5, 1.5, (n, 3)).astype(np.float32),
        shN=rng.uniform(-0.4, 0.4, (n, (degree + 1) ** 2 - 1, 3)).astype(np.float32),
    )


def as_file(folder: Path, splats: Splats, name: str = "scene.ply"):
    write_sample(folder / name, splats)
    return read_ply(folder / name)


def in_order_of(splats: Splats, other: Splats) -> Splats:
    """The rows of another file in the order of the nearest ones."""
    rows = cKDTree(other.means).query(splats.means)[1]
    assert len(set(rows.tolist())) == splats.n_splats
    return dataclasses.replace(other, **{part: getattr(other, part)[rows] for part in PARTS})


def largest_errors(a: Splats, b: Splats) -> dict[str, float]:
    unit = [s.quats / np.linalg.norm(s.quats, axis=1)[:, None] for s in (a, b)]
    cosines = np.abs(np.einsum("nc,nc->n", *[q.astype(np.float64) for q in unit]))
    found = {
        part: float(np.abs(getattr(a, part) - getattr(b, part)).max(initial=0)) for part in ("means", "log_scales")
    }
    found["turn"] = float(2 * np.arccos(np.minimum(cosines, 1)).max())
    found["alphas"] = float(np.abs(alphas_of(a.logit_opacities) - alphas_of(b.logit_opacities)).max())
    return found | {part: float(np.abs(getattr(a, part) - getattr(b, part)).max(initial=0)) for part in ("sh0", "shN")}


@pytest.mark.parametrize("degree", [0, 1, 2, 3])
@pytest.mark.parametrize("ending", STEPS)
def test_what_is_written_comes_back_within_the_formats_steps(tmp_path, ending, degree):
    file = as_file(tmp_path, scene(degree=degree))
    path = tmp_path / f"out{ending}"
    write_splats(path, file, file.splats)
    back = read_splats(path).splats
    if format_to_write(path).reorders:
        back = in_order_of(file.splats, back)
    errors = largest_errors(file.splats, back)
    assert {part: error for part, error in errors.items() if error > STEPS[ending][part] * 1.001} == {}


@pytest.mark.parametrize("ending", STEPS)
def test_what_was_rounded_once_is_not_rounded_again(tmp_path, ending):
    file = as_file(tmp_path, scene())
    write_splats(tmp_path / f"one{ending}", file, file.splats)
    once = read_splats(tmp_path / f"one{ending}")
    # A compressed PLY of the compressed PLY itself would be a copy.
    again = as_file(tmp_path, once.splats, "again.ply")
    write_splats(tmp_path / f"two{ending}", again, again.splats)
    twice = in_order_of(once.splats, read_splats(tmp_path / f"two{ending}").splats)
    errors = largest_errors(once.splats, twice)
    assert errors["means"] < 1e-5
    assert errors["alphas"] < 1e-6
    # A palette of numbers may be cut anew.
    assert errors["log_scales"] < (1e-5 if ending != ".sog" else 0.05)


def test_rows_of_an_spz_keep_their_order(tmp_path):
    file = as_file(tmp_path, scene())
    write_splats(tmp_path / "out.spz", file, file.splats)
    np.testing.assert_allclose(read_splats(tmp_path / "out.spz").splats.means, file.splats.means, atol=1e-5)


def test_an_edited_compressed_ply_stays_compressed_and_keeps_its_rows(tmp_path):
    file = as_file(tmp_path, scene())
    write_splats(tmp_path / "packed.compressed.ply", file, file.splats)
    packed = read_splats(tmp_path / "packed.compressed.ply")
    moved = dataclasses.replace(packed.splats, means=packed.splats.means + np.float32(0.5))
    write_splats(tmp_path / "moved.compressed.ply", packed, moved)
    again = read_splats(tmp_path / "moved.compressed.ply")
    assert again.layout.name == "supersplat-compressed"
    np.testing.assert_allclose(again.splats.means, moved.means, atol=2e-3)
    # Splats that are equal are unedited, whoever made them.
    write_splats(tmp_path / "same.compressed.ply", packed, dataclasses.replace(packed.splats))
    assert (tmp_path / "same.compressed.ply").read_bytes() == (tmp_path / "packed.compressed.ply").read_bytes()


def test_an_edited_compressed_ply_says_that_it_is_rounded_again_and_a_copy_loses_nothing(tmp_path):
    file = as_file(tmp_path, scene())
    write_splats(tmp_path / "packed.compressed.ply", file, file.splats)
    packed, row = read_splats(tmp_path / "packed.compressed.ply"), FORMATS["compressed-ply"]
    assert losses_of_saving(packed, row) == []
    (told,) = losses_of_saving(packed, row, is_edited=True)
    assert told.startswith("Numbers are rounded once more")
    assert losses_of_saving(packed, FORMATS["ply"], is_edited=True) == []
    (by_info,) = losses_by_format(packed)[".compressed.ply"]
    assert by_info == f"Only if it is edited: {told}"
    # It is true of those that stay: one of 256 that goes far makes the steps of the others coarser.
    means = packed.splats.means.copy()
    means[0] += 1000
    write_splats(tmp_path / "far.compressed.ply", packed, dataclasses.replace(packed.splats, means=means))
    again = read_splats(tmp_path / "far.compressed.ply").splats
    assert np.abs(again.means[1:256] - means[1:256]).max() > 0.1
    np.testing.assert_allclose(again.means[256:], means[256:], atol=1e-5)


def test_gsply_reads_our_spz_as_we_do(tmp_path):
    file = as_file(tmp_path, scene(degree=3))
    write_splats(tmp_path / "out.spz", file, file.splats)
    ours, theirs = read_splats(tmp_path / "out.spz").splats, gsply.read_spz(tmp_path / "out.spz")
    # It leaves the axes as the file has them.
    np.testing.assert_allclose(ours.means, theirs.means * [1, -1, -1], atol=1e-6)
    np.testing.assert_allclose(ours.log_scales, theirs.scales, atol=1e-6)
    np.testing.assert_allclose(ours.quats, theirs.quats * [1, 1, -1, -1], atol=1e-6)
    np.testing.assert_allclose(ours.sh0, theirs.sh0, atol=1e-6)
    direction = np.array([[0.3, 0.5, 0.8]]) / np.linalg.norm([0.3, 0.5, 0.8])
    flips = (real_basis(direction * [1, -1, -1], 3) / real_basis(direction, 3)).T
    np.testing.assert_allclose(np.abs(flips), 1.0, atol=1e-9)
    np.testing.assert_allclose(ours.shN, theirs.shN * flips, atol=1e-6)


@pytest.mark.parametrize("version", [3, 4])
def test_we_read_the_spz_of_gsply_as_it_does(tmp_path, version):
    file = as_file(tmp_path, scene(degree=1))

    data = gsply.plyread(tmp_path / "scene.ply")
    gsply.write_spz(tmp_path / "theirs.spz", data, version=version)
    theirs, ours = gsply.read_spz(tmp_path / "theirs.spz"), read_splats(tmp_path / "theirs.spz").splats
    assert ours.n_splats == file.splats.n_splats
    np.testing.assert_allclose(ours.means, theirs.means * [1, -1, -1], atol=1e-6)
    np.testing.assert_allclose(ours.quats, theirs.quats * [1, 1, -1, -1], atol=1e-6)


def test_versions_1_and_2_of_spz_are_read(tmp_path):
    n = 5
    means = np.arange(15, dtype=np.float32).reshape(n, 3) / 4
    half = np.sqrt(0.5)
    rest = np.full(n, 127, np.uint8).tobytes() + bytes(3 * n) + np.full(3 * n, 80, np.uint8).tobytes()
    # A quarter turn about z: x = y = 0 lies half-way between two bytes.
    turn = np.tile(np.array([127, 127, round((half + 1) * 127.5)], np.uint8), n).tobytes()
    positions = {
        1: means.astype("<f2").tobytes(),
        2: (means * 256).astype("<i4").view(np.uint8).reshape(-1, 4)[:, :3].tobytes(),
    }
    for version, held in positions.items():
        head = struct.pack("<4sIIBBBB", b"NGSP", version, n, 0, 8, 0, 0)
        path = tmp_path / f"{version}.spz"
        path.write_bytes(gzip.compress(head + held + rest + turn))
        splats = read_splats(path).splats
        np.testing.assert_array_equal(splats.means, means * [1, -1, -1])
        np.testing.assert_allclose(splats.quats[0], [half, 0, 0, -half], atol=0.01)
        np.testing.assert_allclose(splats.log_scales, -5.0)


@pytest.mark.parametrize(("ending", "steps"), [("splat", STEPS[".sog"]), ("ksplat", {"means": 0, "shN": 0})])
def test_what_gaussforge_writes_of_other_viewers_formats_is_read(tmp_path, ending, steps, capfd):
    file = as_file(tmp_path, scene(degree=1))
    forge = gaussforge.GaussForge()
    held = forge.read((tmp_path / "scene.ply").read_bytes(), "ply")["data"]
    (tmp_path / "theirs").write_bytes(forge.write(held, ending)["data"])
    back = read_splats(tmp_path / "theirs")
    assert back.format_name == ending
    errors = largest_errors(file.splats, in_order_of(file.splats, back.splats)) if ending == "ksplat" else None
    if errors is None:
        splats = in_order_of(file.splats, back.splats)
        np.testing.assert_array_equal(splats.means, file.splats.means)
        np.testing.assert_allclose(splats.log_scales, file.splats.log_scales, atol=1e-5)
        assert splats.shN.shape[1] == 0
    else:
        assert errors["means"] == errors["shN"] == 0
        assert errors["turn"] < 2e-3


def test_a_sog_of_version_1_reads_between_its_bounds(tmp_path):
    import io
    import json
    import zipfile

    from PIL import Image

    rng = np.random.default_rng(2)
    pixels = {name: rng.integers(0, 256, (4, 4, 4), np.uint8) for name in ("l", "u", "s", "c", "q")}
    pixels["q"][:, :, 3] = 252
    meta = {
        "means": {"shape": [16, 3], "mins": [-1.0] * 3, "maxs": [1.0] * 3, "files": ["l", "u"]},
        "scales": {"mins": [-9.0] * 3, "maxs": [-1.0] * 3, "files": ["s"]},
        "sh0": {"mins": [-2.0] * 4, "maxs": [2.0] * 4, "files": ["c"]},
        "quats": {"files": ["q"]},
    }
    with zipfile.ZipFile(tmp_path / "old.sog", "w") as archive:
        archive.writestr("meta.json", json.dumps(meta))
        for name, held in pixels.items():
            out = io.BytesIO()
            Image.fromarray(held).save(out, "WEBP", lossless=True, exact=True)
            archive.writestr(name, out.getvalue())
    splats = read_splats(tmp_path / "old.sog").splats
    np.testing.assert_allclose(splats.log_scales, -9 + pixels["s"].reshape(-1, 4)[:, :3] * (8 / 255), atol=1e-5)
    np.testing.assert_allclose(splats.logit_opacities, -2 + pixels["c"].reshape(-1, 4)[:, 3] * (4 / 255), atol=1e-5)


@pytest.mark.parametrize("ending", [".spz", ".sog", ".compressed.ply"])
def test_a_file_is_opened_by_what_it_holds(tmp_path, ending):
    file = as_file(tmp_path, scene(60))
    write_splats(tmp_path / f"out{ending}", file, file.splats)
    renamed = (tmp_path / f"out{ending}").rename(tmp_path / "photo.jpeg")
    assert read_splats(renamed).splats.n_splats == 60


def test_what_was_decoded_is_saved_as_a_ply_of_inrias_columns(tmp_path):
    file = as_file(tmp_path, scene(40, degree=1))
    write_splats(tmp_path / "a.spz", file, file.splats)
    decoded = read_splats(tmp_path / "a.spz")
    write_splats(tmp_path / "b.ply", decoded, decoded.splats)
    written = read_ply(tmp_path / "b.ply")
    assert list(written.table.columns) == [
        *("x", "y", "z", "nx", "ny", "nz"),
        *(f"f_dc_{i}" for i in range(3)),
        *(f"f_rest_{i}" for i in range(9)),
        *("opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"),
    ]
    for part in PARTS:
        np.testing.assert_array_equal(getattr(written.splats, part), getattr(decoded.splats, part))


def test_through_the_table_an_unedited_ply_is_byte_for_byte_what_it_was(tmp_path):
    file = as_file(tmp_path, scene(50))
    again = read_splats(tmp_path / "scene.ply")
    write_splats(tmp_path / "same.ply", again, again.splats)
    assert (tmp_path / "same.ply").read_bytes() == (tmp_path / "scene.ply").read_bytes()
    assert losses_of_saving(file, FORMATS["ply"]) == []


def test_flat_splats_get_a_thin_third_scale_and_it_is_said(tmp_path):
    file = as_file(tmp_path, scene(50, n_scales=2))
    write_splats(tmp_path / "out.compressed.ply", file, file.splats)
    back = read_splats(tmp_path / "out.compressed.ply").splats
    np.testing.assert_allclose(back.log_scales[:, 2], THIN_LOG_SCALE, atol=1e-4)
    assert all(any("2DGS" in loss for loss in told) for told in losses_by_format(file).values())


def test_every_loss_is_said(tmp_path):
    splats = scene(50, degree=3)
    splats.log_scales[3] = -20
    splats.log_scales[4] = np.nan
    splats.sh0[5] = 9
    plain = as_file(tmp_path, splats, "plain.ply")
    write_ply(tmp_path / "more.ply", plain, plain.splats, extra={"curvature": np.ones(50)})
    told = losses_of_saving(read_splats(tmp_path / "more.ply"), FORMATS["spz"])
    for word in ("curvature", "thinner", "bright", "without a usable", "rounded"):
        assert any(word in loss for loss in told), (word, told)
    assert not any("order" in loss for loss in told)
    assert any("order" in loss for loss in losses_of_saving(plain, FORMATS["sog"]))


def test_splats_made_bare_are_finite_and_look_as_they_did():
    splats = scene(30)
    splats.quats[3] = 0
    splats.log_scales[4] = -np.inf
    splats.logit_opacities[5] = np.inf
    splats.shN[6] = np.nan
    bare, n_unusable = bare_splats(dataclasses.replace(splats, filter_radii=np.full(30, 0.01, np.float32)))
    assert n_unusable == 1
    assert all(np.isfinite(getattr(bare, part)).all() for part in PARTS)
    filtered = dataclasses.replace(splats, filter_radii=np.full(30, 0.01, np.float32))
    np.testing.assert_allclose(np.exp(bare.log_scales[7:]), filtered.scales[7:], rtol=1e-5)
    np.testing.assert_allclose(alphas_of(bare.logit_opacities[7:]), filtered.opacities[7:], rtol=1e-4, atol=1e-6)


def test_a_sog_in_a_folder_is_the_same_as_in_one_file(tmp_path):
    file = as_file(tmp_path, scene())
    write_splats(tmp_path / "scene.sog", file, file.splats)
    with zipfile.ZipFile(tmp_path / "scene.sog") as held:
        held.extractall(tmp_path / "folder")
    whole = read_splats(tmp_path / "scene.sog").splats
    # By content, so that the name is its own.
    renamed = (tmp_path / "folder" / "meta.json").rename(tmp_path / "folder" / "scene.words")
    shares: list[float] = []
    named = read_splats(renamed, progress=shares.append)
    assert shares == sorted(shares) and shares[-1] == 1.0
    renamed.rename(tmp_path / "folder" / "meta.json")
    for found in (named, read_splats(tmp_path / "folder"), read_splats(tmp_path / "folder" / "meta.json")):
        assert found.format_name == "sog-folder"
        for part in PARTS:
            np.testing.assert_array_equal(getattr(found.splats, part), getattr(whole, part))


def test_edits_and_sessions_are_not_taken_for_splats(tmp_path):
    file = as_file(tmp_path, scene())
    write_splats(tmp_path / "scene.sog", file, file.splats)
    with zipfile.ZipFile(tmp_path / "scene.sog") as held:
        held.extractall(tmp_path / "folder")
    words = {"version": 1, "handles": [{"name": "means", "center": [0, 0, 0], "radius": 0.1}]}
    (tmp_path / "edit.json").write_text(json.dumps(words))
    (tmp_path / "long.json").write_text(json.dumps({**words, "pins": [{"rows": list(range(9000))}]}))
    assert not are_splats(tmp_path / "edit.json") and not are_splats(tmp_path / "long.json")
    assert not are_splats(tmp_path / "nowhere.json") and not are_splats(tmp_path)
    assert are_splats(tmp_path / "folder") and are_splats(tmp_path / "folder" / "meta.json")


@pytest.mark.parametrize(
    ("name", "stem"),
    [
        ("a.ply", "a"),
        ("a.b.ply", "a.b"),
        ("a.COMPRESSED.ply", "a"),
        ("a.spz", "a"),
        ("a.png", "a"),
        ("a", "a"),
        ("meta.json", "garden"),
    ],
)
def test_a_files_own_name_is_what_stands_before_the_ending_of_its_format(name, stem):
    assert stem_of(Path("/captures/garden") / name) == stem
