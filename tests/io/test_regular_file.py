"""What is opened: regular files of a sensible size, and everything else gets a sentence at once."""

import os
import socket

import pytest

from splap_editor.io.content_hash import content_hash
from splap_editor.io.ply import PlyError, read_ply
from splap_editor.io.recipe import RecipeError, read_recipe
from splap_editor.io.regular_file import MOST_TEXT_BYTES, open_regular, regular_bytes
from splap_editor.io.session_file import SessionFileError, read_session_file

READERS = [(read_recipe, RecipeError), (read_session_file, SessionFileError), (read_ply, PlyError)]


@pytest.fixture(params=["pipe", "socket", "device", "directory"])
def odd_path(request, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # the name of a socket is short
    path = tmp_path / "odd.ply"
    if request.param == "pipe":
        os.mkfifo(path)
        yield path
    elif request.param == "socket":
        with socket.socket(socket.AF_UNIX) as held:
            held.bind("odd.ply")
            yield path
    elif request.param == "device":
        path.symlink_to("/dev/zero")
        yield path
    else:
        path.mkdir()
        yield path


@pytest.mark.parametrize(("read", "error"), READERS)
def test_what_is_no_file_is_refused_by_its_kind(odd_path, read, error):
    with pytest.raises(error, match=r"odd\.ply.*(it is a|is a directory|not a regular file)"):
        read(odd_path)


def test_no_hash_is_made_of_what_is_no_file(odd_path):
    with pytest.raises(OSError, match="it is a"):
        content_hash(odd_path)


@pytest.mark.parametrize(("read", "error"), READERS[:2])
def test_a_recipe_or_session_has_a_largest_size(tmp_path, read, error):
    path = tmp_path / "huge"
    with open(path, "wb") as file:
        file.truncate(MOST_TEXT_BYTES + 1)
    with pytest.raises(error, match=r"huge.*67,108,865 bytes"):
        read(path)


@pytest.mark.parametrize(("read", "error"), READERS[:2])
def test_a_whole_number_of_thousands_of_digits_names_the_file(tmp_path, read, error):
    path = tmp_path / "odd"
    path.write_text('{"version": ' + "9" * 5000 + "}")
    with pytest.raises(error, match=r"odd: it has a whole number of 5,000 digits"):
        read(path)


@pytest.mark.parametrize("text", ["[" * 100_000, "[" + "[]," * 5_000_000 + "0]", "[" + '"",' * 5_000_000 + "0]"])
def test_nests_and_crowds_of_values_are_refused(tmp_path, text):
    path = tmp_path / "odd.json"
    path.write_text(text)
    with pytest.raises(RecipeError, match=r"odd\.json: it (is nested too deeply|holds more than)"):
        read_recipe(path)


@pytest.mark.parametrize(
    ("n_keys", "words"), [(4_000, "the key '7' stands twice"), (200_000, "it holds objects of more than 4,096 keys")]
)
def test_many_keys_one_of_them_twice_are_refused(tmp_path, n_keys, words):
    path = tmp_path / "odd.json"
    path.write_text("{" + ",".join(f'"{number}": 0' for number in range(n_keys)) + ',"7": 1}')
    with pytest.raises(RecipeError, match=rf"odd\.json: {words}"):
        read_recipe(path)


def test_a_link_to_a_file_is_followed(tmp_path):
    (tmp_path / "file").write_bytes(b"held")
    (tmp_path / "link").symlink_to("file")
    assert regular_bytes(tmp_path / "link") == b"held"
    with open_regular(tmp_path / "link", 4) as file:
        assert file.read() == b"held"
    with pytest.raises(OSError, match="at most 3"):
        open_regular(tmp_path / "link", 3)
