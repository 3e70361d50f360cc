"""OpenUSD: prims anywhere on a stage, animations in one file, and what is no good."""

import dataclasses
import os
import subprocess
import sys
import zipfile

import numpy as np
import pytest
from pxr import Usd, UsdGeom, Vt

from splap_editor.core.camera_path import CameraPose, camera_track
from splap_editor.core.place import Place
from splap_editor.core.progress import Cancelled
from splap_editor.io.formats import usd, usd_package
from splap_editor.io.formats.source import FormatError
from splap_editor.io.sample_maker import shape_sample, write_sample
from splap_editor.io.splat_files import read_splats, write_animation, write_splats

PRIM = "/World/Splats"


@pytest.fixture
def scene(tmp_path):
    write_sample(tmp_path / "scene.ply", shape_sample("coil", 100).splats)
    return read_splats(tmp_path / "scene.ply")


def moved(file, shift: float):
    return dataclasses.replace(file.splats, means=file.splats.means + np.float32(shift))


@pytest.mark.parametrize("ending", [".usdc", ".usdz"])
def test_an_animation_is_one_time_sampled_file(tmp_path, scene, ending):
    path = tmp_path / f"moving{ending}"
    frames = [(number, moved(scene, number / 10)) for number in (3, 4, 7)]
    write_animation(path, scene, frames, 30.0)
    stage = Usd.Stage.Open(str(path))
    assert stage.GetStartTimeCode() == 3 and stage.GetEndTimeCode() == 7 and stage.GetTimeCodesPerSecond() == 30
    positions = stage.GetPrimAtPath(PRIM).GetAttribute("positions")
    assert positions.GetTimeSamples() == [3, 4, 7]
    for number, splats in frames:
        np.testing.assert_array_equal(np.array(positions.Get(number)), splats.means)
    first = read_splats(path)
    np.testing.assert_allclose(first.splats.means, frames[0][1].means, atol=1e-6)
    assert any("first frame" in warning for warning in first.warnings)


@pytest.mark.parametrize("ending", [".usdc", ".usdz"])
def test_an_animation_tells_how_far_it_is_within_a_frame_and_stops_there(tmp_path, scene, ending):
    frames = [(number, moved(scene, number)) for number in (1, 2)]
    told: list[tuple[int, float]] = []

    def progress_of(place):
        return lambda share: told.append((place, share))

    write_animation(tmp_path / f"whole{ending}", scene, frames, 24.0, progress_of=progress_of)
    assert told == sorted(told) and all(0 <= share <= 1 for _, share in told)
    # Two frames, and what follows them.
    assert {place for place, _ in told} == {0, 1, 2}
    assert all(sum(place == which for place, _ in told) >= 3 for which in range(3))
    for stop in (told[1], told[len(told) // 2], told[-1]):

        def stopping_at(place, stop=stop):
            def cancel(share):
                if (place, share) >= stop:
                    raise Cancelled

            return cancel

        with pytest.raises(Cancelled):
            write_animation(tmp_path / f"part{ending}", scene, frames, 24.0, progress_of=stopping_at)
        assert not list(tmp_path.glob("*part*"))


def test_a_package_is_a_zip_of_one_layer_at_a_multiple_of_64_and_the_same_each_time(tmp_path, scene):
    write_splats(tmp_path / "one.usdz", scene, scene.splats)
    write_splats(tmp_path / "layer.usdc", scene, scene.splats)
    with zipfile.ZipFile(tmp_path / "one.usdz") as package:
        (member,) = package.infolist()
        assert package.testzip() is None and member.compress_type == zipfile.ZIP_STORED
        data = package.read(member)
    assert data == (tmp_path / "layer.usdc").read_bytes()
    whole = (tmp_path / "one.usdz").read_bytes()
    assert whole.index(data) % 64 == 0
    stage = Usd.Stage.Open(str(tmp_path / "one.usdz"))
    np.testing.assert_array_equal(stage.GetPrimAtPath(PRIM).GetAttribute("positions").Get(), scene.splats.means)


def test_a_package_too_large_for_zip_is_refused_in_a_sentence(tmp_path, scene, monkeypatch):
    monkeypatch.setattr(usd_package, "LARGEST_LAYER", 100)
    with pytest.raises(FormatError, match=r"at most 4 GiB.*save fewer frames or a \.usdc"):
        write_splats(tmp_path / "out.usdz", scene, scene.splats)
    assert not (tmp_path / "out.usdz").exists()


@pytest.mark.parametrize("is_parallel", [False, True])
@pytest.mark.parametrize("numbers", [(3, 4, 7), (5,)])
def test_the_camera_of_a_stage_films_what_it_films_here(tmp_path, scene, is_parallel, numbers):
    poses = [
        CameraPose((3.0, 0.5, number), (0.1, 0.0, 0.3), (0.0, 0.1, 1.0), 20.0 + number, is_parallel)
        for number in numbers
    ]
    place = Place(translate=(1.0, 2.0, 3.0), rotate=(0.8, 0.0, 0.6, 0.0), scale=2.0)
    frames = [(number, scene.splats) for number in numbers]
    write_animation(tmp_path / "film.usdc", scene, frames, 24.0, camera=camera_track(poses, place))
    stage = Usd.Stage.Open(str(tmp_path / "film.usdc"))
    camera = UsdGeom.Camera(stage.GetPrimAtPath("/World/Camera"))
    for number, pose in zip(numbers, poses, strict=True):
        frustum = camera.GetCamera(number).frustum
        to_picture = np.array(frustum.ComputeViewMatrix()) @ np.array(frustum.ComputeProjectionMatrix())
        half = pose.distance * np.tan(np.radians(pose.angle) / 2)
        seen = np.array([pose.target, np.array(pose.target) + half * pose.matrix[:3, 1]])
        seen = (seen @ place.matrix[:3, :3].T + place.matrix[:3, 3]) * [-1, -1, 1]
        pixels = np.column_stack([seen, [1, 1]]) @ to_picture
        np.testing.assert_allclose(pixels[:, :2] / pixels[:, 3:], [[0, 0], [0, 1]], atol=1e-5)
        assert (np.abs(pixels[:, 2] / pixels[:, 3]) < 1).all()
    assert read_splats(tmp_path / "film.usdc").splats.n_splats == scene.splats.n_splats


def test_a_still_file_has_no_time_samples(tmp_path, scene):
    write_splats(tmp_path / "still.usdc", scene, scene.splats)
    stage = Usd.Stage.Open(str(tmp_path / "still.usdc"))
    prim = stage.GetPrimAtPath(PRIM)
    assert all(not attribute.GetTimeSamples() for attribute in prim.GetAttributes())
    assert read_splats(tmp_path / "still.usdc").warnings == []


def changed(tmp_path, scene, change):
    write_splats(tmp_path / "made.usdc", scene, scene.splats)
    stage = Usd.Stage.Open(str(tmp_path / "made.usdc"))
    change(stage, stage.GetPrimAtPath(PRIM))
    stage.GetRootLayer().Export(str(tmp_path / "changed.usda"))
    return tmp_path / "changed.usda"


def test_a_stage_whose_z_points_up_is_turned(tmp_path, scene):
    path = changed(tmp_path, scene, lambda stage, prim: UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z))
    x, y, z = scene.splats.means.T
    # Half a turn about z puts it on the stage; z up becomes y up, and that half a turn is taken back.
    np.testing.assert_allclose(read_splats(path).splats.means, np.column_stack([x, -z, y]), atol=1e-5)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda stage, prim: stage.RemovePrim(PRIM), "no Gaussian splats"),
        (lambda stage, prim: prim.GetAttribute("positions").Set(Vt.Vec3fArray(0)), "zero splats"),
        (lambda stage, prim: UsdGeom.Xformable(prim).AddScaleOp().Set((1, 2, 1)), "stretches"),
        (lambda stage, prim: prim.GetAttribute("radiance:sphericalHarmonicsDegree").Set(9), "degree 9"),
    ],
)
def test_a_stage_of_no_use_is_refused(tmp_path, scene, change, words):
    with pytest.raises(FormatError, match=words):
        read_splats(changed(tmp_path, scene, change))


def test_arrays_too_short_count_as_missing(tmp_path, scene):
    path = changed(tmp_path, scene, lambda stage, prim: prim.GetAttribute("scales").Set(Vt.Vec3fArray(1, (1, 1, 1))))
    np.testing.assert_allclose(read_splats(path).splats.log_scales, 0, atol=1e-6)


def test_damaged_bytes_end_in_a_sentence(tmp_path, scene):
    write_splats(tmp_path / "good.usdc", scene, scene.splats)
    data = (tmp_path / "good.usdc").read_bytes()
    for bad in (data[:200], data[: len(data) // 2], data[:100] + bytes(200) + data[300:]):
        (tmp_path / "bad.usdc").write_bytes(bad)
        with pytest.raises(FormatError, match=r"bad\.usdc is damaged|holds no"):
            read_splats(tmp_path / "bad.usdc")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="the system has no pipes with names")
@pytest.mark.parametrize("arc", ["(subLayers = [@./{}@])", "def Xform {}a{} (references = @./{}@) {{}}"])
def test_a_stage_that_names_a_pipe_does_not_wait_for_it(tmp_path, arc):
    os.mkfifo(tmp_path / "pipe.usda")
    (tmp_path / "between.usda").write_text("#usda 1.0\n(subLayers = [@./pipe.usda@])\n")
    quote = ('"', '"') if "Xform" in arc else ()
    for named in ("pipe.usda", "between.usda"):
        path = tmp_path / "stage.usda"
        path.write_text("#usda 1.0\n" + arc.format(*quote, named) + "\n")
        with pytest.raises(FormatError, match="names a layer that is no regular file"):
            read_splats(path)


def test_layers_beside_a_stage_are_composed(tmp_path, scene):
    write_splats(tmp_path / "held.usdc", scene, scene.splats)
    (tmp_path / "stage.usda").write_text("#usda 1.0\n(subLayers = [@./gone.usda@, @./held.usdc@])\n")
    np.testing.assert_array_equal(read_splats(tmp_path / "stage.usda").splats.means, scene.splats.means)


@pytest.mark.skipif(sys.platform != "linux", reason="other systems do not keep to the limit")
def test_the_process_that_opens_a_stage_gets_no_more_memory_than_a_stage_of_that_size_needs():
    program = """
import numpy as np
from splap_editor.io.formats import usd_arrays
usd_arrays.limit({n_bytes})
np.empty({fits} << 20, np.uint8)
try:
    np.empty({more} << 20, np.uint8)
except MemoryError:
    print("no more")
"""
    # 1.5 GiB, and 32 times the file.
    for n_bytes, fits, more in ((1 << 10, 1400, 1600), (8 << 20, 1600, 1900)):
        done = subprocess.run(
            [sys.executable, "-c", program.format(n_bytes=n_bytes, fits=fits, more=more)],
            capture_output=True,
            text=True,
            check=False,
        )
        assert (done.stdout, done.stderr) == ("no more\n", "")


def test_reading_can_be_cancelled(tmp_path, scene):
    write_splats(tmp_path / "good.usdc", scene, scene.splats)

    def cancel(share: float) -> None:
        raise Cancelled

    with pytest.raises(Cancelled):
        read_splats(tmp_path / "good.usdc", progress=cancel)


def test_without_the_library_the_line_that_installs_it_is_said(tmp_path, scene, monkeypatch):
    write_splats(tmp_path / "good.usdc", scene, scene.splats)
    monkeypatch.setitem(__import__("sys").modules, "pxr.UsdVol", None)
    with pytest.raises(FormatError, match=r"pip install 'splap-editor\[usd\]'"):
        read_splats(tmp_path / "good.usdc")
    with pytest.raises(FormatError, match="usd-core"):
        write_splats(tmp_path / "out.usdc", scene, scene.splats)
    assert not (tmp_path / "out.usdc").exists() and usd.__doc__
