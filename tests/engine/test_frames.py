"""Frames of an edit, one by one."""

from pathlib import Path

import numpy as np
import pytest

from splap_editor.core.options import OptionSet
from splap_editor.core.progress import Cancelled
from splap_editor.core.reach_options import ReachOptions
from splap_editor.engine.edit import Edit, Handle, Pose
from splap_editor.engine.frames import FramePoser, frame_path, frame_poser, frame_range, write_frames
from splap_editor.engine.keyframes import edit_at_frame, keyed_edit
from splap_editor.engine.surface import surface_of
from splap_editor.io.ply import read_ply
from splap_editor.resources import resource
from splap_editor.session.placement import Region

TUBE = resource("samples", "tube.ply")


@pytest.fixture(scope="module")
def file():
    return read_ply(TUBE)


@pytest.fixture(scope="module")
def poser(file) -> FramePoser:
    """The tube's end, at rest in frame 1 and lifted in frame 9."""
    surface = surface_of(file.splats, Edit().graph)
    center = surface.ellipses.centers[np.argmax(surface.ellipses.centers[:, 2])]
    edit = Edit(handles=(Handle(1, "end", "#ffffff", Region(center, 0.15)),), options=OptionSet(ReachOptions(None)))
    edit = keyed_edit(edit, 1)
    edit = keyed_edit(edit_at_frame(edit, 9).with_poses({1: Pose((0.2, 0.0, 0.1))}))
    return frame_poser(surface, edit)


def test_frames_pass_through_the_keys_and_do_not_depend_on_their_order(poser):
    last = poser.kernels(9).means.copy()
    middle = poser.kernels(5).means.copy()
    assert not poser.kernels(1).changed.any()
    np.testing.assert_array_equal(poser.kernels(5).means, middle)
    np.testing.assert_array_equal(poser.kernels(9).means, last)
    np.testing.assert_array_equal(poser.kernels(40).means, last)
    moved = [np.abs(means - poser.kernels(1).means).max() for means in (middle, last)]
    assert 0.0 < moved[0] < moved[1]


def test_each_frame_is_a_file_with_what_it_shows(poser, file, tmp_path):
    shares = []
    written = write_frames(poser, file, range(8, 10), tmp_path / "out.ply", progress=shares.append)
    assert [path.name for path in written] == ["out_0008.ply", "out_0009.ply"]
    np.testing.assert_array_equal(read_ply(written[1]).splats.means, poser.kernels(9).means.astype(np.float32))
    assert shares == sorted(shares) and shares[-1] == 1.0


def test_within_a_frame_it_is_told_how_far_its_file_is(poser, file, tmp_path):
    for name in ("out.ply", "out.spz", "out.usdc"):
        shares = []
        write_frames(poser, file, range(8, 10), tmp_path / name, progress=shares.append)
        assert shares == sorted(shares) and shares[-1] == 1.0
        assert len({share for share in shares if 0.3 < share < 0.5}) >= 3, name


def test_cancelling_keeps_the_frames_that_are_whole(poser, file, tmp_path):
    def cancel(share):
        if share > 0.5:
            raise Cancelled

    with pytest.raises(Cancelled):
        write_frames(poser, file, range(1, 4), tmp_path / "out.ply", progress=cancel)
    left = sorted(tmp_path.iterdir())
    assert [path.name for path in left] in (["out_0001.ply"], ["out_0001.ply", "out_0002.ply"])
    assert all(read_ply(path).splats.n_splats == file.splats.n_splats for path in left)


def test_an_edit_without_handles_gives_the_file_in_every_frame(file, tmp_path):
    (path,) = write_frames(frame_poser(None, Edit()), file, range(3, 4), tmp_path / "out.ply")
    assert path.read_bytes() == TUBE.read_bytes()


@pytest.mark.parametrize(
    ("text", "first", "last"),
    [("", 1, 72), ("7", 7, 7), ("3-40", 3, 40), ("3-", 3, 72), ("-5", 1, 5), ("99-99", 99, 99)],
)
def test_ranges_are_read(text, first, last):
    assert frame_range(text, 72) == range(first, last + 1)


@pytest.mark.parametrize("text", ["0", "x", "5-3", "1-2-3", "-0", "1.5", "9999999"])
def test_what_is_no_range_is_refused(text):
    with pytest.raises(ValueError, match="frames must be given as"):
        frame_range(text, 72)


def test_names_sort_as_their_frames(tmp_path):
    assert frame_path(tmp_path / "a.b.png", 7, 12).name == "a.b_0007.png"
    assert frame_path(tmp_path / "a.png", 7, 12345).name == "a_00007.png"


def test_an_ending_of_two_parts_stays_whole_in_the_names_of_frames():
    assert frame_path(Path("a/out.compressed.ply"), 7, 30) == Path("a/out_0007.compressed.ply")
    assert frame_path(Path("out.png"), 7, 30) == Path("out_0007.png")
    assert frame_path(Path("out"), 7, 30) == Path("out_0007")
