"""Session files: exact round trips, and every other file refused in a sentence."""

import json
import random

import numpy as np
import pytest

from splap_editor.core.adaptation.options import AdaptationOptions
from splap_editor.core.graph.options import GraphOptions
from splap_editor.core.options import OptionSet
from splap_editor.core.pose import Pose
from splap_editor.core.timeline import Key, Timeline
from splap_editor.io.recipe import Edit, Handle, Pin
from splap_editor.io.session_file import (
    SessionFileError,
    read_session_file,
    relative_path,
    session_from_json,
    session_to_json,
    write_session_file,
)
from splap_editor.io.session_specs import (
    HandleSettings,
    PinSettings,
    PlySpec,
    SessionFile,
    ViewSpec,
)

MASKS = ("selection", "hidden")


def full_session(n=1003) -> SessionFile:
    """A session with every field away from its default, and numbers that need all their digits."""
    rng = np.random.default_rng(2)
    turn = Pose((0.1, 1 / 3, -2e-17), (0.6, 0.0, 0.8, 0.0), (1.1, 0.7, 1 / 7))
    return SessionFile(
        PlySpec("../captures/bänk.ply", "blake2b:00ff", n, "pgsr"),
        Edit(
            method="bbw",
            options=OptionSet(GraphOptions(cut=((1, 2),), add=((7, 3),)), AdaptationOptions(hops=2)),
            handles=(
                Handle("arm", (0.1, 0.2, 0.3), 0.25, translate=(1e-300, 2.0, 3.0)),
                Handle("leg", (1.0, 2.0, 3.0), rows=(4, 9, 1002), rotate=(0.0, 1.0, 0.0, 0.0), scale=1.5),
            ),
            pins=(Pin(rows=(0, 1)), Pin((1.0, 0.0, 0.0), 0.5, name="foot")),
        ),
        (HandleSettings(7, "#ff0001"), HandleSettings(3, "#00ff02", False)),
        (PinSettings(4), PinSettings(2, 0.5)),
        (3,),
        (2, 4),
        Timeline((Key(1, {7: turn, 3: Pose()}), Key(30, {3: turn})), 12, 48, 29.97, False, False),
        ViewSpec((1.0, 2.0, 1 / 3), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 28.0, True, False, (0.0, -1.0, 0.0)),
        {"mode": "points", "size_factor": 0.3, "tints": False, "n": 3},
        rng.random(n) < 0.5,
        rng.random(n) < 0.1,
        {"left half": rng.random(n) < 0.5, "none": np.zeros(n, bool)},
        "",
    )


def assert_same(a: SessionFile, b: SessionFile) -> None:
    for name in vars(a):
        if name in MASKS:
            np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
        elif name == "selection_sets":
            assert list(a.selection_sets) == list(b.selection_sets)
            for key, mask in a.selection_sets.items():
                np.testing.assert_array_equal(mask, b.selection_sets[key])
        else:
            assert getattr(a, name) == getattr(b, name), name


@pytest.mark.parametrize("n", [1003, 1008])
def test_a_session_comes_back_exactly(tmp_path, n):
    session = full_session(n)
    write_session_file(tmp_path / "a.splap", session)
    again = read_session_file(tmp_path / "a.splap")
    assert_same(session, again)
    write_session_file(tmp_path / "b.splap", again)
    assert (tmp_path / "a.splap").read_bytes() == (tmp_path / "b.splap").read_bytes()


def test_a_session_from_before_pins_had_ids_opens():
    held = session_to_json(full_session())
    for key in ("pins", "active_pins"):
        del held[key]
    del held["recipe"]["pins"][1]["name"]
    session = session_from_json(held)
    assert session.pins == () and session.active_pins == () and len(session.recipe.pins) == 2


def test_an_empty_session_comes_back_exactly(tmp_path):
    session = SessionFile(PlySpec("a.ply", "", 0))
    write_session_file(tmp_path / "a.splap", session)
    assert_same(session, read_session_file(tmp_path / "a.splap"))


def changed(path, value):
    """The full session as JSON with one place replaced."""
    held = json.loads(json.dumps(session_to_json(full_session())))
    place = held
    for part in path[:-1]:
        place = place[part]
    place[path[-1]] = value
    return held


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        (["format"], "other", "not a SpLap session"),
        (["version"], 2, "newer SpLap Editor"),
        (["version"], "1", "version must be 1"),
        (["version"], True, "version must be 1"),
        (["ply", "path"], "", r"ply\.path must be"),
        (["ply", "n_splats"], -4, r"ply\.n_splats must be"),
        (["ply", "n_splats"], 1001, "selection"),
        (["recipe", "handles", 0, "radius"], -1, r"recipe: handles\[0\]\.radius"),
        (["recipe", "version"], 9, "recipe: version"),
        (["handles"], [], "handles must name each of the 2"),
        (["handles", 0, "id"], 3, "handles must name each"),
        (["pins"], [{"id": 1}], "pins must name each of the 2"),
        (["pins", 0, "id"], 2, "pins must name each"),
        (["pins", 1, "reach"], 0, "reach"),
        (["handles", 0, "color"], "red", "a colour"),
        (["handles", 0, "enabled"], 1, "true or false"),
        (["timeline", "frame"], 0, r"timeline\.frame"),
        (["timeline", "fps"], 1e9, "at most 1000"),
        (["timeline", "keys", 1, "frame"], 1, "after that of the key before"),
        (["timeline", "keys", 0, "poses", 0, "rotate"], [0, 0, 0, 0], "quaternion"),
        (["timeline", "keys", 0, "poses", 0, "scale"], -1, "scale"),
        (["timeline", "keys", 0, "poses", 1, "id"], 7, "no other pose"),
        (["view", "angle"], 180, "below 180"),
        (["view", "focal_point"], [1.0, 2.0, 1 / 3], "away from the position"),
        (["view", "view_up"], [1.0, 2.0, 1 / 3], "across the line of sight"),
        (["view", "view_up"], [0, 0, 0], "not zero"),
        (["view", "world_up"], [0, 0, 0], "not zero"),
        (["display"], [], "display must be"),
        (["display", "mode"], None, r"display\.mode"),
        (["selection"], "§§§", "base64"),
        (["selection"], "AAAA", "base64 of a bit for each of 1003"),
        (["hidden"], "/" * 168, "base64"),
        (["selection_sets", 1, "name"], "left half", "no other selection set"),
        (["unknown"], 1, "not known"),
    ],
)
def test_what_is_no_session_is_refused_in_a_sentence(path, value, message):
    with pytest.raises(SessionFileError, match=message):
        session_from_json(changed(path, value))


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"ply\n",
        b"\xff\xfe",
        b"[]",
        b"null",
        b"{",
        b'{"version": 1}',
        b'{"format": 1, "format": 2}',
        b"[" * 100_000,
    ],
)
def test_foreign_files_are_refused_in_a_sentence(tmp_path, data):
    path = tmp_path / "a.splap"
    path.write_bytes(data)
    with pytest.raises(SessionFileError, match=r"^a\.splap: .*\.$"):
        read_session_file(path)


def test_a_file_that_is_not_there_is_said(tmp_path):
    with pytest.raises(SessionFileError, match="cannot be read"):
        read_session_file(tmp_path / "gone.splap")


def test_a_damaged_session_is_refused_or_still_one(tmp_path):
    """Bytes flipped, dropped and doubled anywhere: never another error than the one with the sentence."""
    path, draw = tmp_path / "a.splap", random.Random(5)
    write_session_file(path, full_session())
    whole = path.read_bytes()
    n_refused = 0
    for _ in range(400):
        data = bytearray(whole)
        for _ in range(draw.randint(1, 3)):
            at = draw.randrange(len(data))
            kind = draw.randrange(4)
            if kind == 0:
                data[at] = draw.randrange(256)
            elif kind == 1:
                del data[at : at + draw.randint(1, 50)]
            elif kind == 2:
                data[at:at] = data[at : at + draw.randint(1, 50)]
            else:
                data[at : at + 1] = draw.choice([b"-", b"9", b"e9", b"null", b"[]", b"{}", b'"', b"NaN", b"1e999"])
        path.write_bytes(data)
        try:
            read_session_file(path)
        except SessionFileError as error:
            assert "\n" not in str(error)
            n_refused += 1
    assert n_refused > 200


def test_a_session_that_could_not_be_read_again_is_not_written(tmp_path):
    with pytest.raises(SessionFileError, match="n_splats"):
        write_session_file(tmp_path / "a.splap", SessionFile(PlySpec("a.ply", "", -1)))
    with pytest.raises(SessionFileError, match="rename"):
        write_session_file(tmp_path / "a.splap", SessionFile(PlySpec("a\udcff.ply", "", 1)))
    assert not (tmp_path / "a.splap").exists()


def test_a_folder_that_is_not_there_is_said(tmp_path):
    with pytest.raises(SessionFileError, match="cannot be written"):
        write_session_file(tmp_path / "no" / "a.splap", SessionFile(PlySpec("a.ply", "", 1)))


def test_the_way_to_a_neighbour_is_its_name(tmp_path):
    assert relative_path(tmp_path / "a.ply", tmp_path) == "a.ply"
    assert relative_path(tmp_path / "x" / "a.ply", tmp_path / "y") == "../x/a.ply"
