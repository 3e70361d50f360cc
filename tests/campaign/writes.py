"""Writes that are cut off: by a kill, by a disk that fails, by the power."""

import errno
import json
import os
import random
import shutil
import signal
import tempfile
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from splap_editor.core.handle_nodes import Region
from splap_editor.core.pose import Pose
from splap_editor.engine.edit import Edit, Handle
from splap_editor.io import atomic_file as module
from splap_editor.io.atomic_file import atomic_file
from splap_editor.io.ply import read_ply, write_ply
from splap_editor.io.session_file import read_session_file, write_session_file
from splap_editor.session.autosave import Autosave
from splap_editor.session.documents import Documents
from splap_editor.session.recovery import left_behind
from splap_editor.session.session import Session
from tests.campaign.seeds import session as session_bytes
from tests.reference.ply import ply_bytes, splat_columns
from tests.session.main_thread import MainThread

WAYS = ("kill", "failed write", "power loss")


class Hook:
    """Stands between a writer and the system: the n-th call of write, fsync or replace is the last, or fails.

    Parameters
    ----------
    way : str
        ``"kill"`` ends the process, in the middle of a write; ``"failed write"`` raises; ``"power loss"`` ends the
        process too, and what was not synced is gone.
    at : int
        Which call.
    """

    def __init__(self, way: str, at: int) -> None:
        self.way, self.at, self.calls = way, at, 0
        self.n_synced: dict[int, int] = {}
        self.before_rename: tuple[Path, bytes | None] | None = None
        self._os = os

    def __getattr__(self, name: str) -> object:
        return getattr(self._os, name)

    def is_due(self) -> bool:
        """Whether this call is the one to fail; it is counted."""
        self.calls += 1
        return self.calls == self.at

    def strike(self) -> None:
        """Fail in the way that was asked for."""
        if self.way == "failed write":
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        if self.way == "power loss" and self.before_rename is not None:
            target, old = self.before_rename
            # The folder was not synced: the rename is gone with it. And where it is not, so is what was not synced.
            if random.random() < 0.5:
                target.unlink() if old is None else target.write_bytes(old)
            else:
                os.truncate(target, self.n_synced.get(os.stat(target).st_ino, 0))
        os.kill(os.getpid(), signal.SIGKILL)

    def fdopen(self, handle: int, mode: str) -> "HookedFile":
        """Open a file whose writes are counted."""
        return HookedFile(self, self._os.fdopen(handle, mode, buffering=0))

    def fsync(self, handle: int) -> None:
        """Remember what is safe."""
        if self.is_due():
            self.strike()
        held = self._os.fstat(handle)
        self.n_synced[held.st_ino] = held.st_size

    def replace(self, source: Path, target: Path) -> None:
        """Rename, and remember what was there."""
        if self.is_due():
            self.strike()
        target = Path(target)
        self.before_rename = target, target.read_bytes() if target.exists() else None
        self._os.replace(source, target)
        if self.is_due():
            self.strike()


class HookedFile:
    """A file whose n-th write is cut in two."""

    def __init__(self, hook: Hook, file: object) -> None:
        self._hook, self._file = hook, file

    def __enter__(self) -> "HookedFile":
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def __getattr__(self, name: str) -> object:
        return getattr(self._file, name)

    def write(self, data: object) -> int:
        """Write, in pieces so that there are moments in between."""
        view = memoryview(data).cast("B") if len(data) else memoryview(b"")
        piece = max(len(view) // 8, 1)
        for lo in range(0, len(view), piece):
            part = view[lo : lo + piece]
            if self._hook.is_due():
                self._file.write(part[: len(part) // 2])
                self._hook.strike()
            self._file.write(part)
        return len(view)


def _export(target: Path, number: int) -> None:
    file = read_ply(target.with_name("source.ply"))
    means = np.asarray(file.splats.means, np.float64) + number
    write_ply(target, file, replace(file.splats, means=means))


def _save(target: Path, number: int) -> None:
    held = read_session_file(target.with_name("source.splap"))
    write_session_file(target, replace(held, document=f"state {number} " + "x" * 20_000))


WRITERS: dict[str, tuple[Callable[[Path, int], None], Callable[[Path], object]]] = {
    "out.ply": (_export, read_ply),
    "out.splap": (_save, read_session_file),
}
"""Export and save: what writes, and what reads it back."""


def try_writes(seed: int, count: int, counts: Counter, failures: list[str]) -> None:
    """Cut ``count`` writes off, each way and each writer in turn, and look at what is there after."""
    draw = random.Random(seed)
    folder = Path(tempfile.mkdtemp())
    try:
        (folder / "source.ply").write_bytes(ply_bytes(splat_columns(300, np.random.default_rng(seed), n_rest=9)))
        (folder / "source.splap").write_bytes(session_bytes(seed))
        for trial in range(count):
            way, name, at = WAYS[trial % 3], (*WRITERS, "autosave")[trial // 3 % 3], draw.randrange(1, 30)
            if name == "autosave":
                _cut_autosave_off(folder / f"recovery {trial}", way, at, trial, counts, failures)
            else:
                _cut_off(folder / name, way, at, trial, counts, failures)
        with atomic_file(folder / "last") as file:
            file.write(b"x")
        left = sorted(path.name for path in folder.glob(".*.part"))
        if left:
            failures.append(f"left behind by dead processes: {left}")
    finally:
        shutil.rmtree(folder)


def _cut_off(target: Path, way: str, at: int, trial: int, counts: Counter, failures: list[str]) -> None:
    write, read = WRITERS[target.name]
    write(target, 0)
    old = target.read_bytes()
    write(target, trial + 1)
    new = target.read_bytes()
    target.write_bytes(old)
    _die(lambda: write(target, trial + 1), way, at, trial, target.name, counts, failures)
    if target.read_bytes() not in (old, new):
        counts["files broken"] += 1
        failures.append(f"{way} at call {at} of {target.name}: neither the old nor the new file is there")
    read(target)


def _cut_autosave_off(folder: Path, way: str, at: int, trial: int, counts: Counter, failures: list[str]) -> None:
    """What the next start finds is one edit that was made, and the last one that was told to be on disk or a later."""
    reader, writer = os.pipe()

    def tell(number: int) -> None:
        os.write(writer, bytes([number]))

    _die(lambda: _edit(folder, tell), way, at, trial, folder.name, counts, failures)
    os.close(writer)
    with os.fdopen(reader, "rb") as told:
        kept = max(told.read(), default=0)
    found = left_behind(folder)
    numbers = [round(orphan.session.recipe.handles[0].translate[0]) for orphan in found.orphans]
    # Without a sync of the folder, the power takes the last rename with it.
    least = kept - 1 if way == "power loss" else kept
    if found.set_aside or max(numbers, default=0) < least or len(numbers) > 1:
        counts["files broken"] += 1
        failures.append(f"{way} at call {at} of autosave: edit {kept} was on disk, found {numbers}")
    for orphan in found.orphans:
        orphan.slot.remove()


def _edit(folder: Path, tell: Callable[[int], None]) -> None:
    """Move a handle by 1, 2, 3, each once the one before is on disk; raises what autosave tells of."""
    main = MainThread()
    session = Session(main.post)
    documents = Documents(session, main.post)
    autosave = Autosave(documents, main.post, folder=folder, delay_s=0.0)
    wrong: list[Exception] = []
    written: list[object] = []
    autosave.failed.connect(wrong.append)
    autosave.written.connect(lambda state: written.append(state and state.edit))
    session.scene_changed.connect(session.halt)
    session.open(folder.with_name("source.ply"))
    main.run_until(lambda: session.scene is not None)
    for number in (1, 2, 3, 4):
        pose = Pose((float(number), 0.0, 0.0))
        edit = Edit(handles=(Handle(1, "one", "#ffffff", Region(np.zeros(3), 0.1), pose),))
        session.steps.change_edit(edit, "Move handle")
        main.run_until(lambda edit=edit: wrong or edit in written)
        if wrong:
            raise wrong[0]
        tell(number)


def _die(
    act: Callable[[], None], way: str, at: int, trial: int, name: str, counts: Counter, failures: list[str]
) -> None:
    """Write in a process of its own, whose n-th call is its last, or fails with a sentence that names the file."""
    child = os.fork()
    if child == 0:
        module.os = Hook(way, at)
        random.seed(trial)
        try:
            act()
        except ValueError as error:
            os._exit(7 if name in str(error) else 8)
        except BaseException:
            os._exit(9)
        os._exit(0)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    counts[
        {-9: "kills" if way == "kill" else "power losses", 7: "failed writes", 0: "whole writes"}.get(code, "odd")
    ] += 1
    if code not in (-9, 7, 0):
        failures.append(f"{way} at call {at} of {name}: ended with {code}")


if __name__ == "__main__":
    found: Counter = Counter()
    wrong: list[str] = []
    try_writes(0, 60, found, wrong)
    print(json.dumps(found), *wrong, sep="\n")
