"""glTF: splats in any node, buffers of every kind, and what is no good."""

import base64
import io
import json
import struct
import warnings

import numpy as np
import pytest

from splap_editor.core.progress import no_progress
from splap_editor.core.splats.rotations import quats_to_matrices
from splap_editor.core.splats.spherical_harmonics import rotated_sh
from splap_editor.core.splats.splats import Splats
from splap_editor.io.formats.gltf import write
from splap_editor.io.formats.source import FormatError
from splap_editor.io.splat_files import read_splats


def scene(n: int = 20) -> Splats:
    rng = np.random.default_rng(3)
    quats = rng.normal(size=(n, 4))
    return Splats(
        means=rng.normal(size=(n, 3)).astype("f4"),
        log_scales=rng.uniform(-5, -1, (n, 3)).astype("f4"),
        quats=(quats / np.linalg.norm(quats, axis=1)[:, None]).astype("f4"),
        logit_opacities=rng.normal(size=n).astype("f4"),
        sh0=rng.normal(size=(n, 3)).astype("f4"),
        shN=rng.normal(size=(n, 8, 3)).astype("f4"),
    )


def parts(splats: Splats) -> tuple[dict, bytes]:
    """The JSON and the buffer of a .glb."""
    out = io.BytesIO()
    write(out, splats, no_progress)
    data = out.getvalue()
    (length,) = struct.unpack_from("<I", data, 12)
    return json.loads(data[20 : 20 + length]), data[28 + length :]


def glb(document: dict, buffer: bytes) -> bytes:
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(buffer))
    return head + struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(buffer), b"BIN\0") + buffer


def test_a_text_gltf_has_its_buffer_inside_or_beside_it(tmp_path):
    splats = scene()
    document, buffer = parts(splats)
    for uri in ("data:application/octet-stream;base64," + base64.b64encode(buffer).decode(), "my%20numbers.bin"):
        document["buffers"][0]["uri"] = uri
        (tmp_path / "my numbers.bin").write_bytes(buffer)
        (tmp_path / "scene.gltf").write_text(json.dumps(document))
        file = read_splats(tmp_path / "scene.gltf")
        assert file.format_name == "gltf"
        np.testing.assert_array_equal(file.splats.means, splats.means)


def test_nodes_move_turn_and_scale_their_splats(tmp_path):
    splats = scene()
    document, buffer = parts(splats)
    half = float(np.sqrt(0.5))
    document["nodes"][0]["translation"] = [1.0, 2.0, 3.0]
    document["nodes"].append({"children": [0], "rotation": [0.0, half, 0.0, half], "scale": [2.0, 2.0, 2.0]})
    document["scenes"][0]["nodes"] = [1]
    (tmp_path / "scene.glb").write_bytes(glb(document, buffer))
    found = read_splats(tmp_path / "scene.glb").splats
    back, turn = np.diag([-1.0, -1.0, 1.0]), quats_to_matrices(np.array([[half, 0, half, 0]]))[0]
    whole = back @ turn @ back
    np.testing.assert_allclose(found.means, 2 * (splats.means @ whole.T + [1, 2, 3] @ (back @ turn).T), atol=1e-5)
    np.testing.assert_allclose(found.log_scales, splats.log_scales + np.log(2), atol=1e-5)
    np.testing.assert_allclose(
        quats_to_matrices(found.quats), whole @ quats_to_matrices(splats.quats), atol=1e-5
    )  # a quaternion's sign says nothing
    np.testing.assert_allclose(found.shN, rotated_sh(splats.shN, np.broadcast_to(whole, (20, 3, 3))), atol=1e-5)


def test_small_integers_are_shares(tmp_path):
    splats = scene()
    document, buffer = parts(splats)
    at = document["meshes"][0]["primitives"][0]["attributes"]["KHR_gaussian_splatting:OPACITY"]
    view = document["bufferViews"][document["accessors"][at]["bufferView"]]
    held = bytearray(buffer)
    held[view["byteOffset"] : view["byteOffset"] + 20] = np.full(20, 51, np.uint8).tobytes()
    document["accessors"][at] |= {"componentType": 5121, "normalized": True}
    (tmp_path / "scene.glb").write_bytes(glb(document, bytes(held)))
    np.testing.assert_allclose(read_splats(tmp_path / "scene.glb").splats.opacities, 0.2, atol=1e-6)


def _replaced(key: str, value: object):
    def change(document: dict) -> None:
        for step in key.split(".")[:-1]:
            document = document[int(step) if step.isdecimal() else step]
        last = key.split(".")[-1]
        document[int(last) if last.isdecimal() else last] = value

    return change


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (_replaced("meshes.0.primitives.0.extensions", {}), "holds no Gaussian splats"),
        (_replaced("nodes.0.children", [0]), "nodes within themselves"),
        (_replaced("nodes.0.children", [0] * 70_000), "nodes within themselves"),
        (lambda document: document["scenes"][0].update(nodes=[0] * 5000), "more than 4,096 clouds"),
        (_replaced("nodes.0.scale", [1, 2, 1]), "stretches its splats"),
        (_replaced("nodes.0.scale", [-1, -1, -1]), "mirrors"),
        (_replaced("nodes.0.rotation", "up"), "a node has rotation"),
        (_replaced("nodes.0.mesh", 7), "no meshes 7"),
        (_replaced("accessors.0.count", 10**9), "reaches beyond|memory"),
        (_replaced("accessors.2.count", 3), "3 rows for 20 splats"),
        (_replaced("accessors.0.type", "VEC4"), "POSITION is of the wrong type"),
        (_replaced("accessors.0.sparse", {}), "sparse"),
        (_replaced("bufferViews.0.byteOffset", 10**9), "reaches beyond"),
        (_replaced("buffers.0.uri", "../secret.bin"), "not beside it"),
        (_replaced("buffers.0.uri", "/etc/passwd"), "not beside it"),
        (_replaced("buffers.0.uri", "\ud800"), "not beside it"),
        (_replaced("buffers.0.uri", "nowhere.bin"), "cannot be read"),
        (_replaced("buffers.0.uri", "data:;base64,???"), "not base64"),
        (
            _replaced(
                "meshes.0.primitives.0.extensions.KHR_gaussian_splatting.extensions",
                {"KHR_gaussian_splatting_compression_spz_2": {"bufferView": 0}},
            ),
            "packed as SPZ",
        ),
    ],
)
def test_what_makes_no_sense_is_refused(tmp_path, change, words):
    document, buffer = parts(scene())
    change(document)
    (tmp_path / "bad.glb").write_bytes(glb(document, buffer))
    with pytest.raises(FormatError, match=words):
        read_splats(tmp_path / "bad.glb")


def test_signalling_nans_are_refused_by_row_or_held_without_a_warning(tmp_path):
    splats = scene()
    document, buffer = parts(splats)
    attributes = document["meshes"][0]["primitives"][0]["attributes"]
    for name, number in attributes.items():
        view = document["bufferViews"][document["accessors"][number]["bufferView"]]
        start, end = view["byteOffset"], view["byteOffset"] + view["byteLength"]
        bad = buffer[:start] + struct.pack("<I", 0x7FA00000) * ((end - start) // 4) + buffer[end:]
        (tmp_path / "bad.glb").write_bytes(glb(document, bad))
        with warnings.catch_warnings(record=True, action="always") as told:
            if name == "POSITION":
                with pytest.raises(ValueError, match="row"):
                    read_splats(tmp_path / "bad.glb")
            else:
                np.testing.assert_array_equal(read_splats(tmp_path / "bad.glb").splats.means, splats.means)
        assert told == [], name
