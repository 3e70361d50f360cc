"""Pictures in a row as one file: GIF and APNG at once, MP4 and WebM with the extra ``video``."""

import itertools
import shutil
import tempfile
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from splap_editor.io.atomic_file import whole_file

Pictures = Iterator[NDArray[np.uint8]]


class VideoError(ValueError):
    """A video that cannot be written; the message is one sentence that says what to do."""


def _pillow(kind: str, **more: Any) -> Callable[[Path, Pictures, float], None]:
    def write(path: Path, pictures: Pictures, rate: float) -> None:
        # Opened before the first picture is made: what cannot be written is said at once.
        with whole_file(path, VideoError) as file:
            first, *held = map(Image.fromarray, itertools.islice(pictures, None if kind == "PNG" else 1))
            # The writer of APNG goes through them twice, that of GIF takes them one at a time.
            rest: Iterable[Image.Image] = held if kind == "PNG" else map(Image.fromarray, pictures)
            first.save(file, kind, save_all=True, append_images=rest, duration=1000.0 / rate, loop=0, **more)

    return write


def _ffmpeg(codec: str, *options: str) -> Callable[[Path, Pictures, float], None]:
    def write(path: Path, pictures: Pictures, rate: float) -> None:
        try:
            import imageio_ffmpeg
        except ImportError:
            raise VideoError(
                f"{path.name} needs the package imageio-ffmpeg: install it with pip install 'splap-editor[video]', "
                "or choose .gif or .apng."
            ) from None
        evened = map(_even, pictures)
        first = next(evened)
        height, width, _ = first.shape
        with whole_file(path, VideoError) as file, tempfile.TemporaryDirectory() as folder:
            made = Path(folder) / f"video{path.suffix.lower()}"
            encoder = imageio_ffmpeg.write_frames(
                str(made),
                (width, height),
                fps=rate,
                codec=codec,
                pix_fmt_in="rgb24",
                macro_block_size=1,
                output_params=[*options],
            )
            try:
                encoder.send(None)
                for picture in itertools.chain([first], evened):
                    encoder.send(np.ascontiguousarray(picture))
            except OSError as error:
                raise VideoError(
                    f"{path.name} cannot be written: the encoder stopped. Choose another ending."
                ) from error
            finally:
                encoder.close()
            with made.open("rb") as source:
                shutil.copyfileobj(source, file, 1 << 20)

    return write


VIDEOS: dict[str, Callable[[Path, Pictures, float], None]] = {
    ".mp4": _ffmpeg("libx264", "-crf", "18", "-movflags", "+faststart"),
    ".webm": _ffmpeg("libvpx-vp9", "-crf", "24", "-b:v", "0", "-row-mt", "1"),
    ".gif": _pillow("GIF", disposal=2),
    ".apng": _pillow("PNG"),
}
"""What writes a video, by the ending of its name."""


def is_video(path: Path) -> bool:
    """Whether a name ends as a video's does."""
    return path.suffix.lower() in VIDEOS


def write_video(path: Path, pictures: Iterable[NDArray[np.uint8]], rate: float) -> None:
    """Write pictures as a video, whole or not at all.

    Parameters
    ----------
    path : Path
        Its ending is one of `VIDEOS`.
    pictures : iterable of (H, W, 3 or 4) uint8
        All of one size, top row first; made one at a time. MP4 and WebM leave opacity out, and repeat the last column
        or row where there is an odd number of them.
    rate : float
        Pictures per second.

    Raises
    ------
    VideoError
        If there is no picture, a package is missing, or the file cannot be written.
    """
    held = iter(pictures)
    first = next(held, None)
    if first is None:
        raise VideoError(f"{path.name} would hold no picture: name some frames")
    VIDEOS[path.suffix.lower()](path, itertools.chain([first], held), rate)


def _even(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    height, width, _ = picture.shape
    return np.pad(picture[:, :, :3], ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
