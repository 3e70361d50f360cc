"""Every format tells how far it is, and stops where it is told to, leaving nothing behind."""

import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from splap_editor.core.progress import Cancelled
from splap_editor.io.formats.table import FORMATS
from splap_editor.io.splat_files import read_splats, write_splats

from .test_round_trips import as_file, scene

WRITTEN = [row.suffixes[0] for row in FORMATS.values() if row.can_be_written]


class Stop:
    """Progress that cancels at its call of a number, and keeps the shares told."""

    def __init__(self, at: int = -1) -> None:
        self.at, self.shares = at, []

    def __call__(self, share: float) -> None:
        self.shares.append(share)
        if len(self.shares) == self.at:
            raise Cancelled


@pytest.mark.parametrize("suffix", WRITTEN)
def test_writing_stops_wherever_it_is_told_to_and_leaves_what_was_there(suffix, tmp_path):
    file = as_file(tmp_path, scene(40_000, degree=3))
    out = tmp_path / "out" / f"out{suffix}"
    out.parent.mkdir()
    told = Stop()
    # Every splat moved: a PLY that is unchanged would be copied.
    splats = replace(file.splats, means=file.splats.means + 1)
    write_splats(out, file, splats, progress=told)
    assert told.shares == sorted(told.shares) and told.shares[-1] == 1.0 and len(told.shares) >= 4
    before = out.read_bytes()
    for at in {1, 2, len(told.shares) // 2, len(told.shares) - 1}:
        with pytest.raises(Cancelled):
            write_splats(out, file, splats, progress=Stop(at))
        assert [path.name for path in out.parent.iterdir()] == [out.name] and out.read_bytes() == before
        shutil.rmtree(out.parent)
        out.parent.mkdir()
        with pytest.raises(Cancelled):
            write_splats(out, file, splats, progress=Stop(at))
        assert not list(out.parent.iterdir())
        out.write_bytes(before)


@pytest.mark.parametrize("suffix", WRITTEN)
def test_reading_stops_wherever_it_is_told_to(suffix, tmp_path):
    file = as_file(tmp_path, scene(40_000, degree=1))
    path = Path(tmp_path / f"held{suffix}")
    write_splats(path, file, file.splats)
    told = Stop()
    read_splats(path, progress=told)
    assert told.shares == sorted(told.shares) and told.shares[-1] == 1.0 and len(told.shares) >= 4
    for at in {1, 2, len(told.shares) // 2}:
        with pytest.raises(Cancelled):
            read_splats(path, progress=Stop(at))
