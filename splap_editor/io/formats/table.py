"""The formats of splat files: a row for each, with what gives it away, what reads and writes it, and what it loses."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import BinaryIO

import numpy as np

from splap_editor.core.camera_path import CameraTrack
from splap_editor.core.progress import FrameProgress, Progress
from splap_editor.core.splats.splats import Splats
from splap_editor.io.formats.bare_splats import THIN_LOG_SCALE
from splap_editor.io.formats.source import FormatError, Source
from splap_editor.io.ply_table import PlyTable

GLANCE = 4096
"""First bytes that a format is recognised by."""


@dataclass(frozen=True)
class SplatFormat:
    """One format.

    Parameters
    ----------
    name : str
        Key of `FORMATS`.
    title : str
        What people call it.
    suffixes : tuple of str
        Endings of its files' names, the usual one first.
    also_read : tuple of str
        Endings of files that are read as well, and not written.
    is_begun_by : callable (bytes) → bool
        Whether a file's first `GLANCE` bytes give it away.
    reads, writes : str
        ``"module:function"`` in `splap_editor.io.formats`, imported when it is needed; empty where there is none.
    writes_frames : str
        The same for frames of an animation; empty where one file holds one frame.
    names_others : str
        The same for the names of the files beside it that hold its numbers; empty where it holds them itself.
    rounds : str
        What writing does to the numbers, as a clause; empty where nothing.
    reorders : bool
        Whether its files' rows stand in an order of their own.
    largest_degree : int
        Spherical-harmonic degree that it holds.
    log_scales : tuple of 2 float
        Smallest and largest log-scale that it holds.
    colors : tuple of 2 float
        Smallest and largest degree-0 coefficient that it holds.
    readers : str
        Programs that open its files.
    """

    name: str
    title: str
    suffixes: tuple[str, ...]
    is_begun_by: Callable[[bytes], bool]
    reads: str = ""
    writes: str = ""
    writes_frames: str = ""
    names_others: str = ""
    rounds: str = ""
    reorders: bool = False
    largest_degree: int = 3
    log_scales: tuple[float, float] = (THIN_LOG_SCALE, float("inf"))
    colors: tuple[float, float] = (-float("inf"), float("inf"))
    readers: str = ""
    also_read: tuple[str, ...] = ()

    @property
    def opened_suffixes(self) -> tuple[str, ...]:
        """Endings of all its files that are opened."""
        return self.suffixes + self.also_read

    @property
    def is_ply(self) -> bool:
        """Whether `splap_editor.io.ply` reads it."""
        return self.suffixes[0].endswith(".ply")

    @property
    def is_lossless(self) -> bool:
        """Whether it is the format whose files come back byte for byte."""
        return self.name == "ply"

    @property
    def can_be_written(self) -> bool:
        """Whether splats can be saved in it."""
        return self.is_lossless or bool(self.writes)

    def read(self, source: Source, progress: Progress) -> tuple[PlyTable, list[str]]:
        """Decode a file into a table of plain columns; the second value are warnings.

        Raises
        ------
        FormatError
            If it is damaged, of an unknown version, or a package for it is missing.
        """
        read: Callable[[Source, Progress], tuple[PlyTable, list[str]]] = _function(self.reads)
        # What stands in a file may be no number, signalling too, or overflow: that is refused by row, once it is read.
        with np.errstate(all="ignore"):
            return read(source, progress)

    def others(self, source: Source) -> list[str]:
        """Names of the files beside it that hold its numbers.

        Raises
        ------
        FormatError
            If it does not say.
        """
        names: Callable[[Source], list[str]] = _function(self.names_others)
        return names(source)

    def write(self, out: BinaryIO, splats: Splats, progress: Progress) -> None:
        """Encode bare splats.

        Raises
        ------
        FormatError
            If the format cannot hold them, or a package for it is missing.
        """
        write: Callable[[BinaryIO, Splats, Progress], None] = _function(self.writes)
        write(out, splats, progress)

    def write_frames(
        self,
        out: BinaryIO,
        frames: Iterable[tuple[int, Splats]],
        rate: float,
        camera: CameraTrack | None,
        progress_of: FrameProgress,
    ) -> None:
        """Encode bare splats at each frame of an animation, ``rate`` frames a second, and a camera that films them.

        Raises
        ------
        FormatError
            As of `write`.
        """
        write: Callable[[BinaryIO, Iterable[tuple[int, Splats]], float, CameraTrack | None, FrameProgress], None]
        write = _function(self.writes_frames)
        write(out, frames, rate, camera, progress_of)


def _function(path: str) -> Callable:
    module, _, name = path.partition(":")
    return getattr(import_module(f"splap_editor.io.formats.{module}"), name)


def _is_sog(start: bytes) -> bool:
    return start[:4] == b"PK\x03\x04"


def _is_sog_meta(start: bytes) -> bool:
    from splap_editor.io.formats.sog import is_meta

    return is_meta(start)


def _is_usd(start: bytes) -> bool:
    return start.startswith((b"PXR-USDC", b"#usda "))


def _is_usdz(start: bytes) -> bool:
    """Whether the first member of a zip is a USD layer."""
    length = int.from_bytes(start[26:28], "little")
    return _is_sog(start) and start[30 : 30 + length].lower().endswith((b".usdc", b".usda", b".usd"))


def _is_gltf(start: bytes) -> bool:
    from splap_editor.io.formats.gltf import MAGIC, is_text

    return start[:4] == MAGIC or is_text(start)


def _is_ksplat(start: bytes) -> bool:
    from splap_editor.io.formats.ksplat import is_header

    return is_header(start)


def _is_splat(start: bytes) -> bool:
    from splap_editor.io.formats.splat32 import are_splats

    return are_splats(start)


FORMATS: dict[str, SplatFormat] = {
    row.name: row
    for row in (
        SplatFormat(
            "ply",
            "splat PLY",
            (".ply",),
            lambda start: start[:3] == b"ply",
            largest_degree=4,
            readers="every program that opens splats, if its layout is theirs",
        ),
        SplatFormat(
            "compressed-ply",
            "SuperSplat's compressed PLY",
            (".compressed.ply",),
            lambda start: False,
            writes="compressed:write",
            rounds="positions and scales keep 10 or 11 bits between the bounds of 256 neighbours, rotations 10 bits, "
            "colours 8",
            reorders=True,
            log_scales=(THIN_LOG_SCALE, 20.0),
            readers="SuperSplat, PlayCanvas, splat-transform, Spark",
        ),
        SplatFormat(
            "spz",
            "Niantic's SPZ",
            (".spz",),
            lambda start: start[:2] == b"\x1f\x8b" or start[:4] == b"NGSP",
            reads="spz:read",
            writes="spz:write",
            rounds="positions keep up to 16 bits after the point, scales steps of 6 %, rotations 9 bits a part, "
            "colours 8 bits, view-dependent colours 4 or 5",
            largest_degree=3,
            log_scales=(-10.0, 255 / 16 - 10),
            colors=(-0.5 / 0.15, 0.5 / 0.15),
            readers="Scaniverse, SuperSplat, splat-transform, Spark, Blender add-ons",
        ),
        SplatFormat(
            "usd",
            "OpenUSD",
            (".usdc",),
            _is_usd,
            reads="usd:read",
            writes="usd:write_usdc",
            writes_frames="usd:write_usdc_frames",
            readers="programs on OpenUSD 26.03 and later",
            also_read=(".usda", ".usd"),
        ),
        SplatFormat(
            "usdz",
            "OpenUSD package",
            (".usdz",),
            _is_usdz,
            reads="usd:read",
            writes="usd:write_usdz",
            writes_frames="usd:write_usdz_frames",
            readers="programs on OpenUSD 26.03 and later",
        ),
        SplatFormat(
            "sog",
            "PlayCanvas' SOG",
            (".sog",),
            _is_sog,
            reads="sog:read",
            writes="sog:write",
            rounds="positions keep 16 bits between the scene's bounds, rotations 8 bits a part, scales and colours one "
            "of 256 values, view-dependent colours one of up to 65,536 sets",
            reorders=True,
            readers="SuperSplat, PlayCanvas, splat-transform, Spark",
        ),
        # Before glTF: both are JSON that names an asset.
        SplatFormat(
            "sog-folder",
            "PlayCanvas' SOG in a folder",
            ("meta.json",),
            _is_sog_meta,
            reads="sog:read_folder",
            names_others="sog:pictures_beside",
            reorders=True,
        ),
        SplatFormat(
            "gltf",
            "glTF with KHR_gaussian_splatting",
            (".glb",),
            _is_gltf,
            reads="gltf:read",
            writes="gltf:write",
            names_others="gltf:buffers_beside",
            readers="PlayCanvas, Babylon.js, Cesium",
            also_read=(".gltf",),
        ),
        SplatFormat("ksplat", "KSPLAT", (".ksplat",), _is_ksplat, reads="ksplat:read", reorders=True),
        # Last: without a header, it is whatever could be one.
        SplatFormat("splat", "the .splat of antimatter15's viewer", (".splat",), _is_splat, reads="splat32:read"),
    )
}
"""Every format by name; of several that a file's bytes could be the first is meant."""


def stem_of(path: Path) -> str:
    """A file's name without the ending of its format; of one that is nothing but the ending, its folder's."""
    named = format_named(path)
    suffix = next((s for s in named.suffixes if path.name.lower().endswith(s)), "") if named else path.suffix
    return path.name[: len(path.name) - len(suffix)] or path.absolute().parent.name


def format_of(path: Path, start: bytes) -> SplatFormat:
    """Recognise a file by its first bytes; where they tell nothing, its name says which format shall complain."""
    for row in FORMATS.values():
        if row.is_begun_by(start):
            return row
    named = format_named(path)
    return named if named is not None and named.reads else FORMATS["ply"]


def format_named(path: Path) -> SplatFormat | None:
    """The format that a file's name ends in, None if it ends in none; the longest ending counts."""
    name = path.name.lower()
    held = [(suffix, row) for row in FORMATS.values() for suffix in row.suffixes if name.endswith(suffix)]
    return max(held, key=lambda pair: len(pair[0]))[1] if held else None


def format_to_write(path: Path) -> SplatFormat:
    """The format to save a file in; names that end in none make a PLY.

    Raises
    ------
    FormatError
        If files of that format can only be read.
    """
    row = format_named(path) or _only_opened(path)
    if row is None:
        return FORMATS["ply"]
    if path.name.lower().endswith(row.also_read):
        raise FormatError(
            f"{path.name} cannot be written: {row.title} is saved as {row.suffixes[0]}. Choose a name that ends so."
        )
    if not row.can_be_written:
        raise FormatError(
            f"{path.name} cannot be written: {row.title} is only read. Choose a name with one of {endings_to_write()}."
        )
    return row


def _only_opened(path: Path) -> SplatFormat | None:
    return next((row for row in FORMATS.values() if path.name.lower().endswith(row.also_read)), None)


def can_be_opened(path: Path) -> bool:
    """Whether a file's name ends in a format that is read."""
    return any(path.name.lower().endswith(row.opened_suffixes) for row in FORMATS.values())


def endings_to_write() -> str:
    """Endings of the formats that splats can be saved in, for a sentence."""
    return ", ".join(suffix for row in FORMATS.values() if row.can_be_written for suffix in row.suffixes)
