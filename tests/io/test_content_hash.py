"""What a file is named by covers all of its bytes, those that it keeps beside itself too."""

import hashlib
import json
import struct
import zipfile

import pytest

from splap_editor.engine.recipe_edit import require_rows_fit, rows_of
from splap_editor.io.content_hash import content_hash, has_content
from splap_editor.io.plain_edit import Edit, Handle
from splap_editor.io.recipe import RecipeError
from splap_editor.io.sample_maker import shape_sample, write_sample
from splap_editor.io.splat_files import read_splats, write_splats


@pytest.fixture
def scene(tmp_path):
    write_sample(tmp_path / "scene.ply", shape_sample("coil", 60).splats)
    return read_splats(tmp_path / "scene.ply")


@pytest.fixture
def meta(tmp_path, scene):
    """The ``meta.json`` of a SOG in a folder."""
    write_splats(tmp_path / "scene.sog", scene, scene.splats)
    with zipfile.ZipFile(tmp_path / "scene.sog") as held:
        held.extractall(tmp_path / "folder")
    return tmp_path / "folder" / "meta.json"


def test_the_hash_is_that_of_the_bytes(tmp_path):
    for name, data in (("a", b"1" * (1 << 20) + b"2"), ("b", b"1" * (1 << 20) + b"2"), ("c", b"1" * (1 << 20) + b"3")):
        (tmp_path / name).write_bytes(data)
    assert content_hash(tmp_path / "a") == content_hash(tmp_path / "b") != content_hash(tmp_path / "c")


def test_each_picture_of_a_sog_in_a_folder_counts(meta):
    known, shares = content_hash(meta), []
    assert known == content_hash(meta, shares.append) and shares == sorted(shares) and shares[-1] == 1.0
    pictures = sorted(meta.parent.glob("*.webp"))
    assert pictures
    for picture in pictures:
        data = picture.read_bytes()
        picture.write_bytes(data[:-1] + bytes([data[-1] ^ 1]))
        assert content_hash(meta) != known and not has_content(meta, known), picture.name
        picture.write_bytes(data)
    assert has_content(meta, known)
    pictures[0].unlink()
    assert not has_content(meta, known)
    with pytest.raises(OSError, match=pictures[0].name):
        content_hash(meta)


def test_the_buffer_of_a_gltf_counts_and_that_of_a_glb_is_its_own(tmp_path, scene):
    write_splats(tmp_path / "scene.glb", scene, scene.splats)
    data = (tmp_path / "scene.glb").read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    document = json.loads(data[20 : 20 + length])
    document["buffers"][0]["uri"] = "some%20numbers.bin"
    (tmp_path / "scene.gltf").write_text(json.dumps(document))
    buffer = tmp_path / "some numbers.bin"
    buffer.write_bytes(data[28 + length :])
    known = content_hash(tmp_path / "scene.gltf")
    buffer.write_bytes(buffer.read_bytes()[:-1] + b"\1")
    assert not has_content(tmp_path / "scene.gltf", known)
    assert content_hash(tmp_path / "scene.glb").startswith("blake2b:")


def test_a_recipe_by_rows_is_refused_once_a_picture_beside_has_changed_and_an_old_one_keeps_opening(meta):
    file = read_splats(meta)
    by_rows = Edit(handles=(Handle(rows=(1, 2)),), rows_of=rows_of(file))
    # As long as a hash was that of the one file alone.
    alone = hashlib.blake2b(meta.read_bytes(), digest_size=16).hexdigest()
    old = Edit(handles=(Handle(rows=(1, 2)),), rows_of=f"blake2b:{alone}")
    for recipe in (by_rows, old):
        require_rows_fit(recipe, file)
    picture = meta.parent / "quats.webp"
    picture.write_bytes(picture.read_bytes() + b" ")
    with pytest.raises(RecipeError, match="another order"):
        require_rows_fit(by_rows, file)
    require_rows_fit(old, file)


def test_a_file_that_only_looks_as_if_it_named_others_is_hashed_alone(tmp_path):
    (tmp_path / "odd.json").write_text('{"asset": 1, "means": 2, "codebook": "x.webp"}')
    assert content_hash(tmp_path / "odd.json").startswith("blake2b:")
