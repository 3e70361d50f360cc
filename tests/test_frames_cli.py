"""Frames and pictures from the command line."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from splap_editor.cli import main
from splap_editor.core.options import OptionSet
from splap_editor.core.pose import Pose
from splap_editor.core.reach_options import ReachOptions
from splap_editor.core.timeline import Key, Timeline
from splap_editor.io.ply import read_ply
from splap_editor.io.recipe import Edit, Handle, write_recipe
from splap_editor.io.session_file import write_session_file
from splap_editor.io.session_specs import (
    HandleSettings,
    PlySpec,
    SessionFile,
    ViewSpec,
)
from splap_editor.resources import resource

TUBE = resource("samples", "tube.ply")
SIZE = ["--size", "96x64"]


@pytest.fixture
def ply(tmp_path):
    return shutil.copy(TUBE, tmp_path / "tube.ply")


@pytest.fixture
def session(tmp_path, ply):
    """The end of the tube at rest in frame 1 and lifted in frame 3."""
    splats = read_ply(ply).splats
    means = np.asarray(splats.means, np.float64)
    end = tuple(means[np.argmax(means[:, 2])].tolist())
    lifted = Pose((0.3, 0.0, 0.0))
    held = SessionFile(
        PlySpec("tube.ply", "", splats.n_splats),
        Edit(options=OptionSet(ReachOptions(None)), handles=(Handle("end", end, 0.15, translate=(0.3, 0.0, 0.0)),)),
        (HandleSettings(4, "#ffffff"),),
        timeline=Timeline((Key(1, {4: Pose()}), Key(3, {4: lifted})), 3, 3),
        view=ViewSpec((0.0, -6.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
        display={"mode": "ellipses", "background": "black"},
    )
    write_session_file(tmp_path / "work.splap", held)
    return held, tmp_path / "work.splap"


def picture(path):
    """(H, W, 4) pixels of a PNG."""
    with Image.open(path) as image:
        return np.array(image.convert("RGBA"))


def test_frames_of_a_session_become_files(tmp_path, ply, session, capsys):
    _, path = session
    arguments = ["deform", str(ply), "--session", str(path), "-o", str(tmp_path / "out.ply")]
    assert main([*arguments, "--frames", "--json"]) == 0
    names = [f"out_000{n}.ply" for n in (1, 2, 3)]
    assert [p.rsplit("/", 1)[-1] for p in json.loads(capsys.readouterr().out)["outputs"]] == names
    assert (tmp_path / names[0]).read_bytes() == ply.read_bytes()
    assert main([*arguments, "--quiet"]) == 0, "without --frames, the poses as they were saved"
    assert (tmp_path / "out.ply").read_bytes() == (tmp_path / names[2]).read_bytes()


def test_frames_in_a_format_that_loses_something_say_so_first(tmp_path, ply, session, capsys):
    _, path = session
    arguments = ["deform", str(ply), "--session", str(path), "-o", str(tmp_path / "out.spz"), "--frames", "1-2"]
    assert main(arguments) == 0
    said = capsys.readouterr().err
    assert said.index("lost in out.spz: ") < said.index("wrote 2 files")
    assert (tmp_path / "out_0002.spz").exists()


def test_a_session_deforms_as_its_recipe_does(tmp_path, ply, session):
    held, path = session
    write_recipe(tmp_path / "edit.json", held.recipe)
    for option, source in (("--session", path), ("--recipe", tmp_path / "edit.json")):
        assert main(["deform", str(ply), option, str(source), "-o", str(tmp_path / f"{option}.ply"), "--quiet"]) == 0
    assert (tmp_path / "--session.ply").read_bytes() == (tmp_path / "--recipe.ply").read_bytes()


def test_a_picture_is_drawn_from_the_view_of_the_session(tmp_path, ply, session):
    _, path = session
    out = tmp_path / "a.png"
    assert main(["render", str(ply), "--session", str(path), "-o", str(out), *SIZE, "--quiet"]) == 0
    pixels = picture(out)
    assert pixels.shape == (64, 96, 4) and (pixels[..., 3] == 255).all()
    assert (pixels[0, 0, :3] == 0).all(), "the background of the session"
    assert pixels[..., :3].any()


def test_frames_are_drawn_into_a_folder_and_differ_where_it_moves(tmp_path, ply, session):
    _, path = session
    out = tmp_path / "film"
    arguments = ["render", str(ply), "--session", str(path), "-o", str(out), *SIZE, "--transparent", "--quiet"]
    assert main([*arguments, "--frames", "1-3"]) == 0
    names = sorted(p.name for p in out.iterdir())
    assert names == ["tube_0001.png", "tube_0002.png", "tube_0003.png"]
    frames = [picture(out / name).astype(int) for name in names]
    assert (frames[0][0, 0] == 0).all(), "nothing is behind the scene"
    assert np.abs(frames[0] - frames[1]).max() > 30 and np.abs(frames[1] - frames[2]).max() > 30


def test_a_turntable_starts_at_the_view_and_goes_round(tmp_path, ply):
    arguments = ["render", str(ply), *SIZE, "--mode", "points", "--quiet"]
    assert main([*arguments, "-o", str(tmp_path / "one.png")]) == 0
    assert main([*arguments, "-o", str(tmp_path / "round.png"), "--turntable", "3"]) == 0
    turns = [picture(tmp_path / f"round_000{n}.png").astype(int) for n in (1, 2, 3)]
    np.testing.assert_array_equal(turns[0], picture(tmp_path / "one.png"))
    assert np.abs(turns[0] - turns[1]).max() > 30


def test_the_whole_object_is_in_the_picture(tmp_path, ply):
    out = tmp_path / "a.png"
    assert main(["render", str(ply), "-o", str(out), *SIZE, "--transparent", "--quiet", "--mode", "ellipses"]) == 0
    alpha = picture(out)[..., 3] > 0
    rows, columns = np.flatnonzero(alpha.any(axis=1)), np.flatnonzero(alpha.any(axis=0))
    assert rows[0] > 0 and rows[-1] < 63 and columns[0] > 0 and columns[-1] < 95
    assert len(rows) > 40 or len(columns) > 60, "and fills it"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["render", "--frames"], "--frames needs keyframes"),
        (["render", "--frames", "--turntable", "3"], "give one of them"),
        (["render", "--turntable", "0"], "--turntable must be"),
        (["render", "--size", "20000x10"], "16384"),
        (["render", "-o", "LONG"], ".png cannot be written: File name too long. Choose a shorter name"),
        (["deform", "--frames", "--recipe", "EDIT"], "--frames needs keyframes"),
        (["deform", "--frames", "--columns", "stretch", "--session", "WORK"], "--columns goes with one PLY"),
        (["deform", "--frames", "--report", "--session", "WORK"], "--report looks at one pose"),
        (["deform", "--frames", "9-3", "--session", "WORK"], "frames must be given as"),
        (["deform", "--session", "PLY"], "it is not text in UTF-8"),
    ],
)
def test_what_cannot_be_is_said_in_a_sentence(tmp_path, ply, session, capsys, arguments, message):
    held, path = session
    write_recipe(tmp_path / "edit.json", held.recipe)
    names = {"EDIT": tmp_path / "edit.json", "WORK": path, "PLY": ply, "LONG": tmp_path / f"{'a' * 300}.png"}
    command, *rest = (str(names.get(word, word)) for word in arguments)
    assert main([command, str(ply), "-o", str(tmp_path / "out.png"), *rest]) == 2
    assert message in capsys.readouterr().err


def test_a_session_of_another_file_is_noted(tmp_path, ply, session, capsys):
    held, path = session
    write_session_file(path, replace(held, ply=PlySpec("tube.ply", "blake2b:00", held.ply.n_splats)))
    assert main(["deform", str(ply), "--session", str(path), "-o", str(tmp_path / "out.ply")]) == 0
    assert "not the file that the session was saved with" in capsys.readouterr().err


@pytest.mark.parametrize("ending", [".gif", ".mp4"])
def test_a_turntable_is_one_video(ending, tmp_path, capsys):
    out = tmp_path / f"out{ending}"
    arguments = ["--turntable", "4", "--size", "64x48", "--fps", "12", "--json"]
    assert main(["render", str(TUBE), "-o", str(out), *arguments]) == 0
    assert json.loads(capsys.readouterr().out)["outputs"] == [str(out)]
    assert out.stat().st_size > 500 and list(tmp_path.iterdir()) == [out]


def test_a_video_of_one_picture_is_refused(tmp_path, capsys):
    assert main(["render", str(TUBE), "-o", str(tmp_path / "out.mp4")]) == 2
    assert "needs --frames or --turntable" in capsys.readouterr().err
