"""Laws of the stage cache: what goes in comes out, and nothing broken ever does."""

import os
import subprocess
import sys

import numpy as np
import pytest

from splap_editor.engine.cache import StageCache, content_key


@pytest.fixture
def cache(tmp_path):
    return StageCache(tmp_path / "scenes", max_bytes=1 << 20)


def as_kept(arrays):
    return arrays


def test_what_goes_in_comes_out(cache):
    arrays = {"a": np.arange(5, dtype=np.int32), "b": np.array(0.5), "c": np.asfortranarray(np.eye(3)[:, :2])}
    assert cache.store("key", arrays)
    kept = cache.load("key", as_kept)
    assert kept.keys() == arrays.keys()
    for name, array in arrays.items():
        np.testing.assert_array_equal(kept[name], array)
        assert kept[name].dtype == array.dtype


def test_an_unknown_key_is_missing(cache):
    assert cache.load("nothing", as_kept) is None


def test_whichever_byte_is_damaged_the_entry_is_dropped_and_said_once(tmp_path):
    said = []
    cache = StageCache(tmp_path, say=said.append)
    cache.store("key", {"a": np.arange(20.0), "b": np.arange(3)})
    path = tmp_path / "key.npz"
    data = path.read_bytes()
    for at in range(len(data)):
        path.write_bytes(data[:at] + bytes([data[at] ^ 0x10]) + data[at + 1 :])
        assert cache.load("key", as_kept) is None
        assert not path.exists()
    for wrong in (b"", b"not a cache entry", data[: len(data) // 2], data[:-1], data + b"x"):
        path.write_bytes(wrong)
        assert cache.load("key", as_kept) is None
        assert not path.exists()
    path.mkdir()
    assert cache.load("key", as_kept) is None
    assert said == [f"A prepared scene in {tmp_path} was damaged: it is made again."]


def test_an_entry_that_its_maker_refuses_is_dropped(cache):
    cache.store("key", {"a": np.arange(3)})
    assert cache.load("key", lambda arrays: arrays["b"]) is None
    assert cache.load("key", as_kept) is None


def test_an_entry_of_an_earlier_version_goes_without_a_word(tmp_path):
    said = []
    np.savez(tmp_path / "key.npz", a=np.arange(3))
    assert StageCache(tmp_path, say=said.append).load("key", as_kept) is None
    assert not said and not list(tmp_path.iterdir())


def test_the_folder_stays_under_its_bound_and_the_newest_entry_stays(tmp_path):
    cache = StageCache(tmp_path, max_bytes=100_000)
    for number in range(10):
        cache.store(f"key{number}", {"a": np.zeros(4000)})
        os.utime(tmp_path / f"key{number}.npz", (number, number))
    assert sum(path.stat().st_size for path in tmp_path.iterdir()) <= 100_000
    assert cache.load("key9", as_kept) is not None and cache.load("key0", as_kept) is None


def test_a_folder_that_cannot_be_made_keeps_nothing(tmp_path):
    (tmp_path / "file").write_text("in the way")
    cache = StageCache(tmp_path / "file" / "scenes")
    assert not cache.store("key", {"a": np.zeros(1)})
    assert cache.load("key", as_kept) is None


def test_two_processes_may_store_the_same_key(cache):
    script = (
        "import sys, numpy as np; from pathlib import Path; from splap_editor.engine.cache import StageCache\n"
        "cache = StageCache(Path(sys.argv[1]))\n"
        "for turn in range(30):\n"
        "    cache.store('key', {'a': np.full(20000, 7.0)}); kept = cache.load('key', dict)\n"
        "    assert kept is None or (kept['a'] == 7.0).all()\n"
    )
    both = [subprocess.Popen([sys.executable, "-c", script, str(cache.folder)]) for _ in range(2)]
    assert [process.wait(60) for process in both] == [0, 0]
    assert (cache.load("key", as_kept)["a"] == 7.0).all()
    assert [path.name for path in cache.folder.iterdir()] == ["key.npz"]


def test_keys_tell_values_dtypes_shapes_and_order_apart():
    a = np.arange(4.0)
    parts = [[a], [a.astype(np.float32)], [a.reshape(2, 2)], [a, 1], [1, a], [a + 1], ["1", a]]
    assert len({content_key(part) for part in parts}) == len(parts)
    assert content_key([a, 1]) == content_key([a.copy(), 1])


def test_a_tighter_bound_counts_at_once(tmp_path):
    cache = StageCache(tmp_path)
    for k in range(3):
        cache.store(f"entry{k}", {"a": np.zeros(1000)})
    one = cache.nbytes // 3
    cache.set_max_bytes(2 * one + 10)
    assert cache.nbytes == 2 * one
    cache.clear()
    assert cache.nbytes == 0
