"""Videos hold the pictures they are made of."""

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image, ImageSequence

from splap_editor.io.video import VIDEOS, VideoError, is_video, write_video


def pictures(n: int = 6, channels: int = 3, size: tuple[int, int] = (49, 65)):
    for number in range(n):
        made = np.full((*size, channels), 255, np.uint8)
        made[:, :, :3] = (40 * number, 255 - 40 * number, 90)
        yield made


@pytest.mark.parametrize("ending", [".gif", ".apng"])
def test_pillow_reads_every_picture_back(tmp_path, ending):
    write_video(tmp_path / f"out{ending}", pictures(), 20.0)
    with Image.open(tmp_path / f"out{ending}") as image:
        frames = [np.asarray(frame.convert("RGB")).astype(int) for frame in ImageSequence.Iterator(image)]
        assert image.n_frames == 6 and (ending == ".apng" or image.info["duration"] == 50)
    assert len(frames) == 6
    for made, found in zip(pictures(), frames, strict=True):
        assert np.abs(found - made).max() <= (8 if ending == ".gif" else 0)


@pytest.mark.parametrize("ending", [".mp4", ".webm"])
def test_ffmpeg_reads_every_picture_back(tmp_path, ending):
    write_video(tmp_path / f"out{ending}", pictures(channels=4), 24.0)
    reader = imageio_ffmpeg.read_frames(str(tmp_path / f"out{ending}"))
    meta = next(reader)
    # An odd number of rows or columns gets one more.
    assert meta["size"] == (66, 50) and meta["fps"] == 24
    frames = [np.frombuffer(frame, np.uint8).reshape(50, 66, 3).astype(int) for frame in reader]
    assert len(frames) == 6
    for made, found in zip(pictures(), frames, strict=True):
        assert np.abs(found[:49, :65] - made).mean() < 8


@pytest.mark.parametrize("ending", VIDEOS)
def test_a_video_that_is_broken_off_leaves_nothing(tmp_path, ending):
    def broken():
        yield from pictures(2)
        raise KeyError("stop")

    with pytest.raises(KeyError):
        write_video(tmp_path / f"out{ending}", broken(), 24.0)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("ending", VIDEOS)
def test_what_cannot_be_written_is_said_before_a_picture_is_made(tmp_path, ending):
    drawn = []
    path = tmp_path / f"{'a' * 300}{ending}"
    with pytest.raises(VideoError, match=f"{ending} cannot be written: File name too long. Choose a shorter name"):
        write_video(path, map(lambda picture: drawn.append(1) or picture, pictures()), 24.0)
    assert len(drawn) <= 1
    with pytest.raises(VideoError, match=r"gone does not exist\. Create it"):
        write_video(tmp_path / "gone" / f"out{ending}", pictures(), 24.0)


def test_no_picture_and_no_encoder_are_said(tmp_path, monkeypatch):
    assert is_video(tmp_path / "a.MP4") and not is_video(tmp_path / "a.png")
    with pytest.raises(VideoError, match="no picture"):
        write_video(tmp_path / "out.gif", iter(()), 24.0)
    monkeypatch.setitem(__import__("sys").modules, "imageio_ffmpeg", None)
    with pytest.raises(VideoError, match=r"pip install 'splap-editor\[video\]', or choose \.gif"):
        write_video(tmp_path / "out.mp4", pictures(), 24.0)
