"""A file is replaced whole or not at all, and nothing is left beside it."""

import errno
import os
import resource
import signal
import stat
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import splap_editor
from splap_editor.core.progress import Cancelled
from splap_editor.io import atomic_file as module
from splap_editor.io.atomic_file import atomic_file
from splap_editor.io.ply import PlyError, read_ply, write_ply
from tests.reference.ply import ply_bytes, splat_columns


def test_the_file_appears_when_the_block_ends(tmp_path):
    target = tmp_path / "a"
    with atomic_file(target) as file:
        file.write(b"new")
        assert not target.exists()
    assert target.read_bytes() == b"new"
    assert os.listdir(tmp_path) == ["a"]


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt, Cancelled])
def test_an_exception_leaves_the_old_file_alone(error, tmp_path):
    target = tmp_path / "a"
    target.write_bytes(b"old")
    with pytest.raises(error), atomic_file(target) as file:
        file.write(b"new")
        raise error
    assert target.read_bytes() == b"old"
    assert os.listdir(tmp_path) == ["a"]


def test_a_failure_names_the_file_that_was_to_be_written(tmp_path):
    with pytest.raises(OSError, match="No space left") as full, atomic_file(tmp_path / "a") as file:
        file.write(b"x")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    (tmp_path / "link").symlink_to(tmp_path / "gone" / "a")
    with pytest.raises(FileNotFoundError) as dangling, atomic_file(tmp_path / "link"):
        pass
    assert full.value.filename == str(tmp_path / "a")
    assert dangling.value.filename == str(tmp_path / "gone" / "a")


@pytest.mark.parametrize("call", ["fsync", "replace"])
def test_a_failing_disk_leaves_the_old_file_alone(call, tmp_path, monkeypatch):
    target = tmp_path / "a"
    target.write_bytes(b"old")

    def fails(*_):
        raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr(module.os, call, fails)
    with pytest.raises(OSError, match="Input/output"), atomic_file(target) as file:
        file.write(b"new")
    assert target.read_bytes() == b"old"
    assert os.listdir(tmp_path) == ["a"]


def test_permission_bits_are_kept_and_new_files_get_the_usual_ones(tmp_path):
    old = tmp_path / "old"
    old.write_bytes(b"")
    old.chmod(0o640)
    (tmp_path / "usual").write_bytes(b"")
    for name in ("old", "new"):
        with atomic_file(tmp_path / name) as file:
            file.write(b"x")
    assert stat.S_IMODE(old.stat().st_mode) == 0o640
    assert (tmp_path / "new").stat().st_mode == (tmp_path / "usual").stat().st_mode


def test_a_link_stays_a_link(tmp_path):
    (tmp_path / "real").write_bytes(b"old")
    (tmp_path / "link").symlink_to("real")
    with atomic_file(tmp_path / "link") as file:
        file.write(b"new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real").read_bytes() == b"new"


def test_what_is_no_plain_file_is_not_replaced(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "folder").mkdir()
    for name in ("pipe", "folder"):
        with pytest.raises(OSError, match=r"regular|directory"), atomic_file(tmp_path / name):
            pass
    assert sorted(os.listdir(tmp_path)) == ["folder", "pipe"]


def test_a_write_protected_file_is_not_replaced(tmp_path, monkeypatch):
    target = tmp_path / "a"
    target.write_bytes(b"old")
    monkeypatch.setattr(module.os, "access", lambda path, mode: False)
    with pytest.raises(PermissionError), atomic_file(target):
        pass
    assert os.listdir(tmp_path) == ["a"]


ABANDONED = """
import os, signal, sys
from splap_editor.io.atomic_file import atomic_file
with atomic_file(sys.argv[1]) as file:
    file.write(b"half")
    file.flush()
    if sys.argv[2] == "live":
        print("writing", flush=True)
        sys.stdin.read()
    os.kill(os.getpid(), signal.SIGKILL)
"""


def writer(path, how):
    env = {**os.environ, "PYTHONPATH": str(Path(splap_editor.__file__).parents[1])}
    streams = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    return subprocess.Popen([sys.executable, "-c", ABANDONED, str(path), how], env=env, **streams)


def test_the_next_write_clears_what_dead_processes_left_and_nothing_of_living_ones(tmp_path):
    with writer(tmp_path / "live", "live") as live:
        assert live.stdout.readline() == b"writing\n"
        with writer(tmp_path / "dead", "dead") as dead:
            dead.wait(60)
        (tmp_path / ".not.ours.part").write_bytes(b"kept")
        assert {name[:6] for name in os.listdir(tmp_path)} == {".dead.", ".live.", ".not.o"}
        with atomic_file(tmp_path / "a") as file:
            file.write(b"x")
        assert {name[:6] for name in os.listdir(tmp_path)} == {"a", ".live.", ".not.o"}
        live.stdin.close()
        live.wait(60)


def splat_file(tmp_path):
    (tmp_path / "in.ply").write_bytes(ply_bytes(splat_columns(500, np.random.default_rng(0), n_rest=45)))
    return read_ply(tmp_path / "in.ply")


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EACCES, errno.EROFS, errno.EDQUOT])
def test_a_failing_write_becomes_a_sentence(number, tmp_path, monkeypatch):
    file = splat_file(tmp_path)

    def fails(*_):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(module.os, "fsync", fails)
    with pytest.raises(PlyError, match=f"cannot be written: {os.strerror(number)}"):
        write_ply(tmp_path / "out.ply", file, file.splats)
    assert os.listdir(tmp_path) == ["in.ply"]


def test_a_missing_folder_becomes_a_sentence(tmp_path):
    file = splat_file(tmp_path)
    with pytest.raises(PlyError, match=r"does not exist\. Create it"):
        write_ply(tmp_path / "no" / "out.ply", file, file.splats)
    with pytest.raises(PlyError, match=r"cannot be written: .*directory"):
        write_ply(tmp_path, file, file.splats)


def test_cancelling_an_export_leaves_the_old_file(tmp_path):
    file = splat_file(tmp_path)

    def cancel(share):
        raise Cancelled

    with pytest.raises(Cancelled):
        write_ply(tmp_path / "in.ply", file, file.splats, progress=cancel)
    assert os.listdir(tmp_path) == ["in.ply"]
    assert (tmp_path / "in.ply").read_bytes() == file.table.header.raw + file.table.body.tobytes()


FULL_DISK = """
import sys
from splap_editor.io.ply import PlyError, read_ply, write_ply
file = read_ply(sys.argv[1])
try:
    write_ply(sys.argv[2], file, file.splats)
except PlyError as error:
    sys.exit(str(error))
"""


def test_a_disk_that_fills_up_leaves_the_old_file(tmp_path):
    splat_file(tmp_path)
    (tmp_path / "out.ply").write_bytes(b"old")

    def small_files_only():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))

    done = subprocess.run(
        [sys.executable, "-c", FULL_DISK, tmp_path / "in.ply", tmp_path / "out.ply"],
        preexec_fn=small_files_only,
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": str(Path(splap_editor.__file__).parents[1])},
    )
    assert done.returncode == 1
    assert "out.ply cannot be written: File too large. Free some space" in done.stderr
    assert "Traceback" not in done.stderr
    assert (tmp_path / "out.ply").read_bytes() == b"old"
    assert sorted(os.listdir(tmp_path)) == ["in.ply", "out.ply"]


LOADED = """
import sys
import splap_editor.io.ply, splap_editor.io.recipe
loaded = {name.partition(".")[0] for name in sys.modules}
print(*sorted(loaded & {"scipy", "numba", "plyfile", "zipfile", "vtkmodules"}))
"""


def test_importing_the_readers_loads_nothing_heavy():
    env = {**os.environ, "PYTHONPATH": str(Path(splap_editor.__file__).parents[1])}
    done = subprocess.run([sys.executable, "-c", LOADED], capture_output=True, text=True, env=env, check=True)
    assert done.stdout.strip() == ""
