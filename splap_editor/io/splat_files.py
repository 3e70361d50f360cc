"""Splat files of every format: opened by what they hold, saved by what their name ends in."""

import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from splap_editor.core.camera_path import CameraTrack
from splap_editor.core.index_spaces import FileMask
from splap_editor.core.progress import FrameProgress, Progress, no_frame_progress, no_progress, part_of
from splap_editor.core.splats.splats import Splats
from splap_editor.io.atomic_file import whole_file
from splap_editor.io.formats.bare_splats import bare_splats
from splap_editor.io.formats.losses import losses
from splap_editor.io.formats.source import FormatError, Source
from splap_editor.io.formats.table import FORMATS, GLANCE, SplatFormat, format_of, format_to_write
from splap_editor.io.layout import PlyEvidence
from splap_editor.io.layouts import LAYOUTS, layout_of
from splap_editor.io.ply import SplatFile, kept_rows, read_ply, splat_file, write_ply
from splap_editor.io.splat_cells import any_stored_difference

if TYPE_CHECKING:
    from splap_editor.io.formats.gltf_skin import Skin

__all__ = [
    "FormatError",
    "SplatFile",
    "are_splats",
    "file_meant",
    "losses_by_format",
    "losses_of_saving",
    "read_splats",
    "write_animation",
    "write_skinned",
    "write_splats",
]


def read_splats(
    path: str | os.PathLike[str], *, layout: str | None = None, progress: Progress = no_progress
) -> SplatFile:
    """Read a splat file of any format in `FORMATS`.

    What it is, its bytes say; the name counts for nothing. A folder is read by its ``meta.json``. A PLY is read as
    `read_ply` does. Of another format the splats are decoded into a table with
    INRIA's columns, in the file's own order, and saved as a PLY that is the
    file that comes out.

    Parameters
    ----------
    path : path
    layout : str, optional
        Name in `splap_editor.io.layouts.LAYOUTS` to use instead of the one recognised.
    progress : Progress
        Told the share done; may cancel.

    Raises
    ------
    ValueError
        If the file cannot be read or holds no usable splats (`PlyError`, `FormatError`); the message is one sentence
        for the user and what to do.
    """
    path = file_meant(Path(path))
    source = Source(path, part_of(progress, 0.0, 0.2))
    try:
        row = format_of(path, source.head(GLANCE))
    except OSError:
        # Whatever keeps it from being opened, the PLY reader says best.
        row = FORMATS["ply"]
    if row.is_ply:
        return read_ply(path, layout=layout, progress=progress)
    try:
        table, warnings = row.read(source, part_of(progress, 0.2, 0.9))
    except MemoryError:
        raise FormatError(
            f"{path.name} does not fit in memory. Close other programs or crop the scene first."
        ) from None
    evidence = PlyEvidence(table, path, part_of(progress, 0.9, 1.0))
    found = (
        layout_of(evidence, chosen=layout) if layout else replace(LAYOUTS["3dgs"], reason=f"decoded from {row.title}")
    )
    file = splat_file(evidence, found, format_name=row.name)
    progress(1.0)
    return replace(file, warnings=warnings + file.warnings)


def file_meant(path: Path) -> Path:
    """The file to read of a path: of a folder the one that names its others, if it holds one."""
    held = path / "meta.json"
    try:
        return held if held.is_file() else path
    except OSError:
        # A name too long for any file; whoever opens it says so.
        return path


def are_splats(path: Path) -> bool:
    """Whether the first bytes of a file are those of splats, whatever its name."""
    path = file_meant(path)
    try:
        start = Source(path).head(GLANCE)
    except OSError:
        return False
    return any(row.is_begun_by(start) for row in FORMATS.values())


def losses_of_saving(
    file: SplatFile,
    row: SplatFormat,
    splats: Splats | None = None,
    *,
    as_3dgs: bool = False,
    is_edited: bool = False,
    progress: Progress = no_progress,
) -> list[str]:
    """Say what saving a file's splats in a format loses, each as a sentence.

    Parameters
    ----------
    file : SplatFile
    row : SplatFormat
    splats : Splats, optional
        The file's splats, deformed.
    as_3dgs : bool
        As of `write_splats`.
    is_edited : bool
        Some splats are to be moved or left out. A compressed PLY that is saved as one is copied otherwise.
    progress : Progress
        May cancel.
    """
    if row.is_lossless and as_3dgs and file.is_misread and file.splats.n_scales == 3:
        row = replace(row, name="3dgs", largest_degree=3)
    is_kept = _is_kept(file, row)
    if row.is_lossless or (is_kept and not is_edited):
        return []
    splats = file.splats if splats is None else splats
    bare, n_unusable = bare_splats(splats, row.largest_degree, progress)
    return losses(file, splats, bare, n_unusable, row, is_kept=is_kept)


def losses_by_format(file: SplatFile) -> dict[str, list[str]]:
    """What saving a file's splats would lose in each format but PLY, by the format's usual ending."""
    rows = [row for row in FORMATS.values() if row.can_be_written and not row.is_lossless]
    found = {row.suffixes[0]: losses_of_saving(file, row, is_edited=_is_kept(file, row)) for row in rows}
    for row in rows:
        if _is_kept(file, row):
            found[row.suffixes[0]] = [f"Only if it is edited: {loss}" for loss in found[row.suffixes[0]]]
    return found


def name_filter(*, to_write: bool = False) -> str:
    """Endings of all formats for a file dialog: ``"*.ply *.spz …"``."""
    rows = FORMATS.values()
    suffixes = (
        [row.suffixes if row.can_be_written else () for row in rows]
        if to_write
        else [row.opened_suffixes for row in rows]
    )
    return " ".join(f"*{suffix}" for held in suffixes for suffix in held)


def write_splats(
    path: str | os.PathLike[str],
    file: SplatFile,
    splats: Splats,
    *,
    removed: FileMask | None = None,
    as_3dgs: bool = False,
    extra: Mapping[str, ArrayLike] | None = None,
    progress: Progress = no_progress,
) -> str:
    """Write splats in the format that the path's name ends in; a PLY where it ends in none.

    A PLY is written as `write_ply` does. A file of another format is made anew
    of the splats; `losses_of_saving` tells before what it cannot hold. The
    target appears whole or not at all, and may be the file that was read.

    Parameters
    ----------
    path, file, splats, removed, as_3dgs, extra, progress
        As of `write_ply`.

    Returns
    -------
    str
        What all splats were brought to, those too that are as in the file: "as .spz holds them"; empty where these
        stand as they were.

    Raises
    ------
    ValueError
        If the file cannot be written, or cannot hold ``extra``.
    """
    path = Path(path)
    row = format_to_write(path)
    kept = kept_rows(removed, file)
    is_copy = _is_kept(file, row) and kept is None and not any_stored_difference(file.splats, splats)
    if row.is_lossless or (is_copy and not extra):
        write_ply(path, file, splats, removed=removed, as_3dgs=as_3dgs, extra=extra, progress=progress)
        return "in the layout of 3DGS" if as_3dgs else ""
    if extra:
        raise FormatError(f"{path.name} cannot hold the columns {', '.join(extra)}. Save them in a PLY.")
    kept_splats = splats if kept is None else splats.at(kept)
    bare, _ = bare_splats(kept_splats, row.largest_degree, part_of(progress, 0.0, 0.1))
    encoding = part_of(progress, 0.1, 1.0)

    with whole_file(path, FormatError) as out:
        if _is_kept(file, row):
            from splap_editor.io.formats.compressed import write_in_order

            write_in_order(out, bare, encoding)
        else:
            row.write(out, bare, encoding)
    progress(1.0)
    return f"as {row.suffixes[0]} holds them"


def write_animation(
    path: str | os.PathLike[str],
    file: SplatFile,
    frames: Iterable[tuple[int, Splats]],
    rate: float,
    *,
    removed: FileMask | None = None,
    camera: CameraTrack | None = None,
    progress_of: FrameProgress = no_frame_progress,
) -> None:
    """Write the frames of an animation to one file, whole or not at all.

    Parameters
    ----------
    path : path
        Its ending must be of a format that holds frames (`SplatFormat.writes_frames`).
    file : SplatFile
        What they were read as.
    frames : iterable of (int, Splats)
        Numbers and splats, the file's own rows each time.
    rate : float
        Frames per second.
    removed : FileMask, optional
        As of `write_splats`.
    camera : CameraTrack, optional
        At each frame.
    progress_of : FrameProgress
        May cancel.

    Raises
    ------
    FormatError
        If the file cannot be written.
    """
    row = format_to_write(Path(path))
    kept = kept_rows(removed, file)

    def bared() -> Iterator[tuple[int, Splats]]:
        for place, (number, splats) in enumerate(frames):
            told = part_of(progress_of(place), 0.0, 0.2)
            yield number, bare_splats(splats if kept is None else splats.at(kept), row.largest_degree, told)[0]

    def encoding(place: int) -> Progress:
        return part_of(progress_of(place), 0.2, 1.0)

    with whole_file(path, FormatError) as out:
        row.write_frames(out, bared(), rate, camera, encoding)


def write_skinned(
    path: str | os.PathLike[str],
    file: SplatFile,
    skin: "Skin",
    *,
    splats: Splats | None = None,
    removed: FileMask | None = None,
    progress: Progress = no_progress,
) -> None:
    """Write a file's splats at rest with an animation's skin as a ``.glb``, whole or not at all.

    ``splats`` are written in the place of the file's own, as where they are graded; ``progress`` may cancel.

    Raises
    ------
    FormatError
        If the file cannot be written.
    """
    from splap_editor.io.formats.gltf_skin import write

    kept = kept_rows(removed, file)
    splats = file.splats if splats is None else splats
    if kept is not None:
        splats, skin = splats.at(kept), replace(skin, weights=skin.weights[kept])
    bare, _ = bare_splats(splats, FORMATS["gltf"].largest_degree, part_of(progress, 0.0, 0.1))
    with whole_file(path, FormatError) as out:
        write(out, bare, skin, part_of(progress, 0.1, 1.0))


def _is_kept(file: SplatFile, row: SplatFormat) -> bool:
    """Whether a compressed PLY is to be written as the one that it was: its rows keep their order."""
    return row.is_ply and not row.is_lossless and file.layout.columns is None
