"""An animation handed over as a glTF skin plays, by glTF's own rules, as the deformer poses it."""

import dataclasses
import json
import struct
from pathlib import Path

import numpy as np
import pytest

from splap_editor.core.adaptation.options import AdaptationOptions
from splap_editor.core.bbw.options import BbwOptions
from splap_editor.core.camera_path import CameraPose
from splap_editor.core.options import OptionSet
from splap_editor.core.place import Place
from splap_editor.core.progress import Cancelled
from splap_editor.core.reach_options import ReachOptions
from splap_editor.core.splats.rotations import quats_to_matrices
from splap_editor.engine.edit import Edit, Handle, Pose
from splap_editor.engine.frames import frame_poser, write_frames
from splap_editor.engine.keyframes import edit_at_frame, keyed_edit
from splap_editor.engine.surface import surface_of
from splap_editor.io.ply import read_ply
from splap_editor.io.splat_files import FormatError, read_splats
from splap_editor.resources import resource
from splap_editor.session.placement import Region

TURN = (float(np.cos(0.3)), 0.0, float(np.sin(0.3)), 0.0)


class Player:
    """Just enough of a glTF player: the accessors, animation and skin of the specification."""

    def __init__(self, path: Path) -> None:
        data = path.read_bytes()
        (length,) = struct.unpack_from("<I", data, 12)
        self.held = json.loads(data[20 : 20 + length])
        self.buffer = data[28 + length :]

    def accessor(self, number: int) -> np.ndarray:
        item = self.held["accessors"][number]
        view = self.held["bufferViews"][item["bufferView"]]
        dtype = {5126: "<f4", 5123: "<u2", 5121: "u1"}[item["componentType"]]
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}[item["type"]]
        values = np.frombuffer(self.buffer, dtype, item["count"] * width, view["byteOffset"])
        return values.reshape(-1, width)

    def nodes(self, seconds: float) -> list[dict]:
        nodes = json.loads(json.dumps(self.held["nodes"]))
        animation = self.held["animations"][0]
        for channel in animation["channels"]:
            value, target = self.value(animation["samplers"][channel["sampler"]], seconds), channel["target"]
            if target["path"] == "pointer":
                continue
            if target["path"] == "rotation":
                value /= np.linalg.norm(value)
            nodes[target["node"]][target["path"]] = value.tolist()
        return nodes

    def value(self, sampler: dict, seconds: float) -> np.ndarray:
        times, values = self.accessor(sampler["input"])[:, 0], self.accessor(sampler["output"])
        return np.array([np.interp(seconds, times, values[:, c]) for c in range(values.shape[1])])

    def pointed(self, pointer: str, seconds: float) -> float:
        animation = self.held["animations"][0]
        for channel in animation["channels"]:
            extension = channel["target"].get("extensions", {}).get("KHR_animation_pointer")
            if extension == {"pointer": pointer}:
                return float(self.value(animation["samplers"][channel["sampler"]], seconds)[0])
        raise AssertionError(f"nothing moves {pointer}")

    def camera(self, seconds: float) -> np.ndarray:
        nodes = self.nodes(seconds)
        number = next(number for number, node in enumerate(nodes) if "camera" in node)
        return self._worlds(nodes)[number]

    def positions(self, seconds: float) -> np.ndarray:
        nodes = self.nodes(seconds)
        skin = self.held["skins"][0]
        inverse = self.accessor(skin["inverseBindMatrices"]).reshape(-1, 4, 4).transpose(0, 2, 1).astype(float)
        world = self._worlds(nodes)
        joints = np.array([world[joint] @ inverse[i] for i, joint in enumerate(skin["joints"])])
        attributes = self.held["meshes"][0]["primitives"][0]["attributes"]
        means = self.accessor(attributes["POSITION"]).astype(float)
        moved = np.zeros_like(means)
        for number in range(sum(name.startswith("JOINTS_") for name in attributes)):
            numbers, weights = (self.accessor(attributes[f"{part}_{number}"]) for part in ("JOINTS", "WEIGHTS"))
            for c in range(4):
                each = joints[numbers[:, c]]
                at = np.einsum("nij,nj->ni", each[:, :3, :3], means) + each[:, :3, 3]
                moved += weights[:, c, None] * at
        return moved

    def _worlds(self, nodes: list[dict]) -> dict[int, np.ndarray]:
        worlds: dict[int, np.ndarray] = {}
        todo = [(number, np.eye(4)) for number in self.held["scenes"][0]["nodes"]]
        while todo:
            number, parent = todo.pop()
            node = nodes[number]
            local = np.array(node["matrix"]).reshape(4, 4).T if "matrix" in node else np.eye(4)
            x, y, z, w = node.get("rotation", (0, 0, 0, 1))
            local[:3, :3] = (
                local[:3, :3] @ quats_to_matrices(np.array([[w, x, y, z]]))[0] * node.get("scale", (1, 1, 1))
            )
            local[:3, 3] += node.get("translation", (0, 0, 0))
            worlds[number] = parent @ local
            todo += [(child, worlds[number]) for child in node.get("children", ())]
        return worlds


@pytest.fixture(scope="module")
def file():
    return read_ply(resource("samples", "tube.ply"))


@pytest.fixture(scope="module")
def surface(file):
    return surface_of(file.splats, Edit().graph)


def edit_of(surface, *, method: str = "bbw", blending: str = "linear", adaptation: str = "none") -> Edit:
    """Both ends of the tube, one moved and turned until frame 9, the other scaled."""
    heights = surface.ellipses.centers[:, 2]
    ends = [surface.ellipses.centers[chosen(heights)] for chosen in (np.argmin, np.argmax)]
    handles = [Handle(i, f"end {i}", "#ffffff", Region(at, 0.15), cage_radius=None) for i, at in enumerate(ends, 1)]
    options = (ReachOptions(None), BbwOptions(blending=blending), AdaptationOptions(adaptation=adaptation))
    edit = keyed_edit(Edit(handles=tuple(handles), method=method, options=OptionSet(*options)), 1)
    posed = {1: Pose((0.2, 0.0, 0.1), TURN), 2: Pose(scale=(1.2, 0.9, 1.0))}
    return keyed_edit(edit_at_frame(edit, 9).with_poses(posed))


@pytest.mark.parametrize("place", [Place(), Place(translate=(1.0, 2.0, 3.0), rotate=TURN, scale=2.0)])
def test_a_player_puts_every_splat_where_the_deformer_does(tmp_path, file, surface, place):
    edit = dataclasses.replace(edit_of(surface), place=place)
    poser, said = frame_poser(surface, edit), []
    assert write_frames(poser, file, range(1, 10), tmp_path / "out.glb", say=said.append) == [tmp_path / "out.glb"]
    player = Player(tmp_path / "out.glb")
    for frame in (1, 4, 9):
        means = poser.kernels(frame).means
        expected = means @ place.matrix[:3, :3].T + place.matrix[:3, 3]
        # glTF's y points up: half a turn about z.
        played = player.positions((frame - 1) / edit.timeline.fps) * [-1, -1, 1]
        assert np.abs(played - expected).max() < 1e-4 * surface.scene_scale, frame
    assert len(said) == 1 and "linear blending" in said[0]


def test_a_skin_tells_how_far_it_is_within_a_frame_and_stops_anywhere(tmp_path, file, surface):
    poser, shares = frame_poser(surface, edit_of(surface)), []
    write_frames(poser, file, range(1, 3), tmp_path / "out.glb", progress=shares.append)
    assert shares == sorted(shares) and shares[-1] == 1.0
    # Two frames, and then the file.
    assert all(any(third / 3 < share < (third + 1) / 3 for share in shares) for third in range(3))
    (tmp_path / "out.glb").unlink()
    for stop in (shares[1], 0.9, shares[-2]):

        def cancel(share, stop=stop):
            if share >= stop:
                raise Cancelled

        with pytest.raises(Cancelled):
            write_frames(poser, file, range(1, 3), tmp_path / "out.glb", progress=cancel)
        assert not list(tmp_path.glob("*out*"))


def test_what_a_skin_cannot_play_is_measured(tmp_path, file, surface):
    said = []
    poser = frame_poser(surface, edit_of(surface, blending="dual-quaternion", adaptation="surface"))
    write_frames(poser, file, range(1, 10), tmp_path / "out.glb", say=said.append)
    played = Player(tmp_path / "out.glb").positions(8 / 24) * [-1, -1, 1]
    off = np.linalg.norm(played - poser.kernels(9).means, axis=1).max()
    assert float(said[0].split("up to ")[1].split()[0]) == pytest.approx(off, rel=0.06)


def test_a_skin_is_a_few_megabytes_and_opens_at_rest(tmp_path, file, surface):
    poser = frame_poser(surface, edit_of(surface))
    write_frames(poser, file, range(1, 61), tmp_path / "out.glb")
    still = tmp_path / "out.glb"
    assert still.stat().st_size < 3 * file.path.stat().st_size
    opened = read_splats(still)
    np.testing.assert_allclose(opened.splats.means, file.splats.means, atol=1e-5)
    assert any("animation" in warning for warning in opened.warnings)


def test_a_method_without_weights_makes_no_skin(tmp_path, file, surface):
    poser = frame_poser(surface, edit_of(surface, method="arap"))
    with pytest.raises(FormatError, match="bounded biharmonic weights"):
        write_frames(poser, file, range(1, 3), tmp_path / "out.glb")
    assert not (tmp_path / "out.glb").exists()


@pytest.mark.parametrize("is_parallel", [False, True])
def test_the_camera_films_in_another_program_what_it_films_here(tmp_path, surface, file, is_parallel):
    place = Place(translate=(1.0, 2.0, 3.0), rotate=TURN, scale=2.0)
    near = CameraPose((3.0, 0.5, 0.2), (0.1, 0.0, 0.3), angle=30.0, is_parallel=is_parallel)
    far = CameraPose((-1.0, 4.0, 2.0), (0.0, 0.1, 0.0), (0.0, 0.2, 1.0), 50.0, is_parallel)
    edit = edit_of(surface)
    timeline = edit.timeline.with_camera_key(1, near).with_camera_key(9, far)
    edit = dataclasses.replace(edit, timeline=timeline, place=place)
    write_frames(frame_poser(surface, edit), file, range(1, 10), tmp_path / "out.glb")
    player = Player(tmp_path / "out.glb")
    kind = "orthographic" if is_parallel else "perspective"
    assert player.held["cameras"][0]["type"] == kind
    assert "KHR_animation_pointer" in player.held["extensionsUsed"]
    for frame in (1, 5, 9):
        pose, seconds = timeline.camera_at(frame), (frame - 1) / timeline.fps
        # What stands in the middle of the picture, and at the middle of its upper edge, in the file's coordinates.
        half = pose.distance * np.tan(np.radians(pose.angle) / 2)
        seen = np.array([pose.target, np.array(pose.target) + half * pose.matrix[:3, 1]])
        seen = (seen @ place.matrix[:3, :3].T + place.matrix[:3, 3]) * [-1, -1, 1]
        x, y, z = np.linalg.inv(player.camera(seconds))[:3] @ np.column_stack([seen, [1, 1]]).T
        if is_parallel:
            y = y / player.pointed("/cameras/0/orthographic/ymag", seconds)
        else:
            y = y / -z / np.tan(player.pointed("/cameras/0/perspective/yfov", seconds) / 2)
        np.testing.assert_allclose([x, y], [[0, 0], [0, 1]], atol=1e-4)
        assert (z < 0).all()


def test_without_camera_keys_there_is_no_camera(tmp_path, file, surface):
    write_frames(frame_poser(surface, edit_of(surface)), file, range(1, 3), tmp_path / "out.glb")
    held = Player(tmp_path / "out.glb").held
    assert "cameras" not in held and held["extensionsUsed"] == ["KHR_gaussian_splatting"]
