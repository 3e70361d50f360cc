"""What is no splat file, or a damaged one, is refused in a sentence."""

import dataclasses
import gzip
import json
import os
import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest

from splap_editor.engine.recipe_edit import edit_of, require_rows_fit, rows_of
from splap_editor.io.content_hash import content_hash
from splap_editor.io.formats import sog
from splap_editor.io.formats.source import FormatError
from splap_editor.io.plain_edit import Edit, Handle, Pin
from splap_editor.io.ply import PlyError
from splap_editor.io.recipe import RecipeError, recipe_from_json, recipe_to_json
from splap_editor.io.sample_maker import shape_sample, write_sample
from splap_editor.io.splat_files import read_splats, write_splats


@pytest.fixture
def scene(tmp_path):
    write_sample(tmp_path / "scene.ply", shape_sample("coil", 300).splats)
    return read_splats(tmp_path / "scene.ply")


def spz(n: int, *, version: int = 3, degree: int = 0, bits: int = 12, body: bytes = b"") -> bytes:
    return gzip.compress(struct.pack("<4sIIBBBB", b"NGSP", version, n, degree, bits, 0, 0) + body)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (spz(10), "cut short"),
        (spz(0), "zero splats"),
        (spz(4_000_000_000), "memory|cannot hold"),
        (spz(1_000_000), "cannot hold 1,000,000 splats"),
        (spz(1, version=9), "version 9"),
        (spz(1, degree=7), "degree 7"),
        (spz(1, bits=40), "40 of them"),
        (gzip.compress(b"something else, long enough"), "does not begin as an SPZ"),
        (spz(10)[:-12], "does not unpack|cut short"),
        (struct.pack("<4sIIBBBBI", b"NGSP", 4, 10, 0, 12, 0, 5, 32), "cut short"),
        (struct.pack("<4sIIBBBBI12x", b"NGSP", 4, 10, 0, 12, 0, 2, 32), "2 streams"),
        (struct.pack("<4sIIBBBBI12x", b"NGSP", 4, 10, 0, 12, 0, 5, 32) + struct.pack("<QQ", 9, 7) * 5, "7 bytes"),
    ],
)
def test_a_damaged_spz_is_refused(tmp_path, data, words):
    (tmp_path / "bad.spz").write_bytes(data)
    with pytest.raises(FormatError, match=words):
        read_splats(tmp_path / "bad.spz")


@pytest.mark.parametrize("is_bundled", [True, False])
@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda meta: meta.update(version=3), "version 3"),
        (lambda meta: meta.update(count="many"), "how many splats"),
        (lambda meta: meta.update(count=10**7), "pixels for 10,000,000 splats"),
        (lambda meta: meta["means"].update(files=["means_l.webp"]), "where its means are"),
        (lambda meta: meta["means"].update(mins=[0, None, 0]), "3 numbers as mins"),
        (lambda meta: meta["scales"].update(codebook=[]), "table of up to 256 values"),
        (lambda meta: meta["scales"].update(codebook=[float("nan")] * 256), "256 numbers"),
        (lambda meta: meta["quats"].update(files=["nothing.webp"]), "'nothing.webp'"),
        (lambda meta: meta["quats"].update(files=["meta.json"]), "no lossless WebP"),
    ],
)
def test_a_sog_whose_words_do_not_fit_its_pictures_is_refused(tmp_path, scene, change, words, is_bundled):
    folder = unbundled(tmp_path, scene)
    change_meta(folder, change)
    path = bundled(folder, tmp_path / "bad.sog") if is_bundled else folder
    with pytest.raises(FormatError, match=words):
        read_splats(path)


def unbundled(tmp_path: Path, scene) -> Path:
    """A folder of a SOG's files."""
    write_splats(tmp_path / "good.sog", scene, scene.splats)
    with zipfile.ZipFile(tmp_path / "good.sog") as held:
        held.extractall(tmp_path / "folder")
    return tmp_path / "folder"


def bundled(folder: Path, path: Path) -> Path:
    """A zip of a folder's files."""
    with zipfile.ZipFile(path, "w") as archive:
        for file in folder.iterdir():
            archive.write(file, file.name)
    return path


def change_meta(folder: Path, change) -> None:
    meta = json.loads((folder / "meta.json").read_text())
    change(meta)
    (folder / "meta.json").write_text(json.dumps(meta))


@pytest.mark.parametrize(
    "name", ["../means_l.webp", "/etc/passwd", "a/../../x", "..", "", "c:x.webp", "a\\b", "a\0b", "a\ud800"]
)
def test_a_sog_in_a_folder_reads_nothing_elsewhere(tmp_path, scene, name):
    folder = unbundled(tmp_path, scene)
    (tmp_path / "means_l.webp").write_bytes((folder / "means_l.webp").read_bytes())
    change_meta(folder, lambda meta: meta["means"].update(files=[name, "means_u.webp"]))
    with pytest.raises(FormatError, match="not beside it"):
        read_splats(folder)


def test_a_sog_in_a_folder_follows_no_link_out_of_it(tmp_path, scene):
    folder = unbundled(tmp_path, scene)
    outside = (folder / "quats.webp").rename(tmp_path / "quats.webp")
    (folder / "quats.webp").symlink_to(outside)
    with pytest.raises(FormatError, match=r"'quats\.webp', a link that leads out of its folder"):
        read_splats(folder)
    (folder / "quats.webp").unlink()
    (folder / "quats.webp").symlink_to("quats.webp")
    with pytest.raises(FormatError, match=r"'quats\.webp', which cannot be read"):
        read_splats(folder)
    (folder / "quats.webp").unlink()
    outside.rename(folder / "elsewhere.webp")
    (folder / "quats.webp").symlink_to("elsewhere.webp")
    assert read_splats(folder).splats.n_splats == scene.splats.n_splats


def test_a_sog_in_a_folder_that_is_too_large_or_no_file_is_not_read(tmp_path, scene, monkeypatch):
    folder = unbundled(tmp_path, scene)
    with monkeypatch.context() as limits:
        limits.setattr(sog, "LARGEST_PICTURE", 100)
        with pytest.raises(FormatError, match="at most 100 are read"):
            read_splats(folder)
    with (folder / "scales.webp").open("r+b") as file:
        file.truncate(1 << 40)
    with pytest.raises(FormatError, match="GiB of memory"):
        read_splats(folder)
    (folder / "scales.webp").unlink()
    os.mkfifo(folder / "scales.webp")
    with pytest.raises(FormatError, match="a pipe"):
        read_splats(folder)
    (folder / "meta.json").write_text((folder / "meta.json").read_text() + " " * (1 << 23))
    with pytest.raises(FormatError, match="at most 4,194,304 are read"):
        read_splats(folder)


def towers(node: dict) -> list[dict]:
    """Nodes within nodes, the last of them the one given, each as large as one may be."""
    huge = [{"scale": [9e14] * 3, "children": [k + 1]} for k in range(40)]
    return [*huge, node]


def test_a_gltf_follows_no_link_out_of_its_folder(tmp_path, scene):
    write_splats(tmp_path / "out.glb", scene, scene.splats)
    packed = (tmp_path / "out.glb").read_bytes()
    length = int.from_bytes(packed[12:16], "little")
    held = json.loads(packed[20 : 20 + length])
    held["buffers"][0]["uri"] = "numbers.bin"
    folder = tmp_path / "folder"
    folder.mkdir()
    (folder / "scene.gltf").write_text(json.dumps(held))
    (tmp_path / "numbers.bin").write_bytes(packed[28 + length :])
    (folder / "numbers.bin").symlink_to(tmp_path / "numbers.bin")
    with pytest.raises(FormatError, match="leads out of its folder"):
        read_splats(folder / "scene.gltf")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda held: held["accessors"][0].update(componentType=[5126]), "componentType is"),
        (lambda held: held["accessors"][0].update(componentType=5124), "wrong type"),
        (lambda held: held.update(scenes=None, nodes=5), "holds no Gaussian splats"),
        (lambda held: held["nodes"].__setitem__(slice(None), towers(held["nodes"][0])), "farther away than anything"),
        (lambda held: held["nodes"][0].update(scale=[1, 1, 2]), "mirrors or stretches"),
    ],
)
def test_a_gltf_whose_json_is_of_other_types_is_refused(tmp_path, scene, change, words):
    write_splats(tmp_path / "out.glb", scene, scene.splats)
    packed = (tmp_path / "out.glb").read_bytes()
    length = int.from_bytes(packed[12:16], "little")
    held = json.loads(packed[20 : 20 + length])
    change(held)
    (tmp_path / "bad.gltf").write_text(json.dumps(held))
    with pytest.raises(FormatError, match=words):
        read_splats(tmp_path / "bad.gltf")


def test_a_splat_file_cut_short_is_refused(tmp_path):
    (tmp_path / "bad.splat").write_bytes(bytes(33))
    with pytest.raises(FormatError, match="33 bytes and a splat has 32"):
        read_splats(tmp_path / "bad.splat")


def test_a_ksplat_cut_short_or_of_foreign_counts_is_refused(tmp_path):
    head = bytearray(4096 + 1024)
    head[1] = 1
    struct.pack_into("<IIIIH", head, 4, 1, 1, 9, 9, 0)
    struct.pack_into("<II", head, 4096, 9, 9)
    for change, words in (((4096, 9, 9), "cut short"), ((4096, 10, 9), "counts of a section")):
        struct.pack_into("<II", head, *change)
        (tmp_path / "bad.ksplat").write_bytes(head)
        with pytest.raises(FormatError, match=words):
            read_splats(tmp_path / "bad.ksplat")


def test_a_ksplat_of_splats_without_buckets_is_refused(tmp_path):
    data = bytearray(4096 + 1024 + 64)
    data[1] = 1
    struct.pack_into("<IIIIH", data, 4, 1, 1, 1, 1, 1)
    struct.pack_into("<IIIIfH", data, 4096, 1, 1, 1, 0, 5.0, 12)
    (tmp_path / "bad.ksplat").write_bytes(data)
    with pytest.raises(FormatError, match="splats outside its buckets"):
        read_splats(tmp_path / "bad.ksplat")


@pytest.mark.parametrize("name", ["nothing.ply", "photo.jpeg", "text"])
def test_what_is_no_splat_file_is_refused_as_a_ply(tmp_path, name):
    (tmp_path / name).write_bytes(b"some text that is no splat at all, and long enough to be one")
    with pytest.raises(PlyError, match="not a PLY file"):
        read_splats(tmp_path / name)


def test_what_cannot_be_opened_is_said(tmp_path):
    with pytest.raises(PlyError, match="does not exist"):
        read_splats(tmp_path / "nowhere.spz")
    with pytest.raises(PlyError, match="directory"):
        read_splats(tmp_path)


def test_formats_that_are_only_read_are_not_written(tmp_path, scene):
    with pytest.raises(FormatError, match=r"only read. Choose a name with one of \.ply"):
        write_splats(tmp_path / "out.splat", scene, scene.splats)


def test_only_a_ply_takes_columns(tmp_path, scene):
    with pytest.raises(FormatError, match="cannot hold the columns stretch"):
        write_splats(tmp_path / "out.spz", scene, scene.splats, extra={"stretch": np.ones(scene.splats.n_splats)})


def test_a_position_too_far_for_an_spz_leaves_no_file(tmp_path, scene):
    far = dataclasses.replace(scene.splats, means=scene.splats.means + np.float32(1e8))
    with pytest.raises(FormatError, match="positions up to"):
        write_splats(tmp_path / "out.spz", scene, far)
    assert not (tmp_path / "out.spz").exists()


def test_an_edit_by_rows_fits_a_reordered_file_only_if_it_was_made_for_it(tmp_path, scene):
    write_splats(tmp_path / "out.sog", scene, scene.splats)
    write_splats(tmp_path / "out.spz", scene, scene.splats)
    sog, spz_ = read_splats(tmp_path / "out.sog"), read_splats(tmp_path / "out.spz")
    by_rows = Edit(handles=(Handle(rows=(1, 2)),))
    by_place = Edit(handles=(Handle(center=(0, 0, 0), radius=1.0),), pins=(Pin((0, 0, 1), 0.1),))
    for recipe, file in ((by_place, sog), (by_rows, scene), (by_rows, spz_)):
        require_rows_fit(recipe, file)
    with pytest.raises(RecipeError, match=r"rows, and those of out\.sog stand in another order"):
        require_rows_fit(by_rows, sog)
    own = dataclasses.replace(by_rows, rows_of=rows_of(sog))
    assert recipe_from_json(recipe_to_json(own)).rows_of == content_hash(sog.path)
    require_rows_fit(own, sog)
    assert edit_of(own, sog.splats).handles[0].region.rows.tolist() == [1, 2]
    with pytest.raises(RecipeError, match="another order"):
        require_rows_fit(own, scene)
    assert rows_of(scene) == ""


@pytest.mark.parametrize("ending", [".glb", ".usdc", ".spz", ".sog", ".compressed.ply"])
def test_a_splat_too_large_for_any_format_becomes_invisible(tmp_path, scene, ending):
    log_scales = scene.splats.log_scales.copy()
    log_scales[3] = 100.0
    file = dataclasses.replace(scene, splats=dataclasses.replace(scene.splats, log_scales=log_scales))
    write_splats(tmp_path / f"out{ending}", file, file.splats)
    again = read_splats(tmp_path / f"out{ending}").splats
    assert np.isfinite(again.log_scales).all() and again.logit_opacities.min() < -5


def test_half_floats_that_are_no_numbers_are_refused_by_row(tmp_path):
    # The second is a signalling one.
    body = struct.pack("<6H", 0, 0x3C00, 0, 0x7D01, 0, 0) + bytes(2 * (1 + 3 + 3 + 3))
    (tmp_path / "bad.spz").write_bytes(spz(2, version=1, body=body))
    with pytest.raises(PlyError, match="row 1"):
        read_splats(tmp_path / "bad.spz")
