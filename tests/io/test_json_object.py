"""Long JSON documents: read in steps, between which the reader may be stopped, and bounded before they are parsed."""

import json

import pytest

from splap_editor.core.progress import Cancelled
from splap_editor.io import json_object
from splap_editor.io.json_object import JsonObject, parsed_json
from splap_editor.io.recipe import read_recipe
from splap_editor.io.session_file import SessionFileError, read_session_file

N = 20_000
BALL = {"center": [0, 0, 0], "radius": 1}


def poses(n):
    return [{"frame": k + 1, "poses": [{"id": 1, "translate": [0.5, 0, k]}]} for k in range(n)]


def session(**more):
    ply = {"path": "a.ply", "hash": "", "n_splats": 9}
    settings = [{"id": 1, "color": "#f2a93b", "enabled": True}]
    recipe = {"version": 1, "handles": [BALL]}
    return {"format": "splap-session", "version": 1, "ply": ply, "recipe": recipe, "handles": settings, **more}


LONG = {
    "rows.json": {"version": 1, "handles": [{"rows": list(range(N))}]},
    "pairs.json": {"version": 1, "graph": {"cut": [[k, k + 1] for k in range(N)]}},
    "points.json": {"version": 1, "graph": {"separate": [{"a": [[0.5, 0, 1]] * N, "b": [[0, 0, 0]]}]}},
    "handles.json": {"version": 1, "handles": [BALL] * 200},
    "keys.splap": session(timeline={"n_frames": 999, "keys": poses(999)}),
}


@pytest.mark.parametrize("name", LONG)
def test_a_long_document_can_be_stopped_while_it_is_parsed_and_while_it_is_understood(name, tmp_path, monkeypatch):
    monkeypatch.setattr(json_object, "ITEMS", 64)
    path = tmp_path / name
    path.write_text(json.dumps(LONG[name]))
    read = read_session_file if path.suffix == ".splap" else read_recipe
    shares = []
    read(path, shares.append)
    # A look for each few numbers, each object, and each few items of what they make.
    assert shares == sorted(shares) and shares[-1] == 1.0 and len(shares) > 200
    for at in (2, len(shares) // 2, len(shares) - 2):
        told = iter(range(at))

        def stop(share, told=told):
            if next(told, None) is None:
                raise Cancelled

        with pytest.raises(Cancelled):
            read(path, stop)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[" + ",".join(["null"] * 40) + "]", "flags and nulls"),
        ("{" + ",".join(f'"{k}":0' for k in range(40)) + "}", "more than 16 keys"),
        ("[" * 40 + "]" * 40, "more than 20 lists"),
    ],
)
def test_what_is_parsed_in_one_go_is_bounded_before_it_is(text, message, monkeypatch):
    monkeypatch.setattr(json_object, "MOST_VALUES", 20)
    monkeypatch.setattr(json_object, "MOST_KEYS", 16)
    with pytest.raises(ValueError, match=message):
        parsed_json(text.encode(), ValueError)


def test_ids_chosen_in_a_session_are_each_taken_once_where_there_is_such_a_handle(tmp_path):
    path = tmp_path / "chosen.splap"
    path.write_text(json.dumps(session(active_handles=[1, 7, 1, *range(2, N)])))
    assert read_session_file(path).active_handles == (1,)


def test_an_object_looks_before_it_is_read():
    def stop():
        raise Cancelled

    with pytest.raises(Cancelled):
        JsonObject({}, "", (), SessionFileError, stop)
