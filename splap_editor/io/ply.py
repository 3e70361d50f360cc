"""Splat files: any trainer's PLY to splats and, with only what changed changed, back."""

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from splap_editor.core.index_spaces import FileMask
from splap_editor.core.progress import Progress, no_progress, part_of
from splap_editor.core.splats.splats import LARGEST_COORDINATE, Splats
from splap_editor.io.atomic_file import whole_file
from splap_editor.io.formats.bare_splats import THIN_LOG_SCALE, bare_splats
from splap_editor.io.layout import COMMON_NAMES, SPLATS_SHARE, Layout, PlyEvidence
from splap_editor.io.layouts import LAYOUTS, layout_of, require_splats
from splap_editor.io.lint import unusable_rows
from splap_editor.io.ply_header import PlyError
from splap_editor.io.ply_reader import read_table
from splap_editor.io.ply_table import NewColumn, PlyTable, field_types
from splap_editor.io.splat_cells import SplatCells, any_stored_difference, plain_table
from splap_editor.io.splat_columns import SplatColumns, splat_columns

__all__ = ["PlyError", "SplatFile", "read_ply", "splat_file", "write_ply"]


@dataclass(frozen=True, eq=False)
class SplatFile:
    """A splat file in memory.

    Parameters
    ----------
    path : Path
        Where it was read from.
    splats : Splats
        Its splats in file order; arrays may be views into ``table``.
    table : PlyTable
        Its bytes and columns; of another format than PLY, those of the PLY that its splats make.
    layout : Layout
        Which trainer wrote it, how that was recognised, what its columns mean.
    warnings : list of str
        Sentences about what is odd; such rows are kept as they are.
    format_name : str
        Key of `splap_editor.io.formats.table.FORMATS`.
    """

    path: Path
    splats: Splats
    table: PlyTable
    layout: Layout
    warnings: list[str]
    format_name: str = "ply"

    @property
    def is_misread(self) -> bool:
        """Whether a program that only knows INRIA's 3DGS refuses its layout or takes its numbers for others."""
        is_filtered = self.splats.filter_radii is not None
        return self.splats.n_scales == 2 or self.layout.activated_opacity or is_filtered


def read_ply(path: str | os.PathLike[str], *, layout: str | None = None, progress: Progress = no_progress) -> SplatFile:
    """Read a splat PLY of any trainer.

    The rows are read once and left as they are: unless the file has odd types,
    byte order or column order, the arrays of the splats are views.

    Parameters
    ----------
    path : path
        A PLY file: binary of either byte order, ascii, or SuperSplat's compressed.
    layout : str, optional
        Name in `splap_editor.io.layouts.LAYOUTS` to use instead of the one recognised.
    progress : Progress
        Told the share done; may cancel.

    Raises
    ------
    PlyError
        If the file cannot be read or holds no usable splats; the message is
        one sentence for the user and what to do.
    """
    path = Path(path)
    glance = _Glance()
    table = read_table(path, accepts=require_splats, glance=glance.look, progress=part_of(progress, 0.0, 0.9))
    evidence = PlyEvidence(table, path, part_of(progress, 0.9, 1.0))
    found = layout_of(evidence, chosen=layout)
    file = splat_file(evidence, found, is_usable=glance.shows_only_usable_rows(table.n_rows))
    progress(1.0)
    return file


def splat_file(
    evidence: PlyEvidence, layout: Layout, *, format_name: str = "ply", is_usable: bool = False
) -> SplatFile:
    """Make splats of a table, and look for what is odd about them.

    Parameters
    ----------
    evidence : PlyEvidence
    layout : Layout
        What its columns mean.
    format_name : str
        As of `SplatFile`.
    is_usable : bool
        All its numbers are known to be finite, and its rotations none of zeros.

    Raises
    ------
    PlyError
        If its columns make no splats, or a position is no place.
    """
    splats, warnings = layout.splats(evidence, layout)
    if layout.bound:
        warnings.append(_BOUND.format(layout.name))
    if layout.activated_opacity or not is_usable:
        told = part_of(evidence.progress, SPLATS_SHARE, 1.0)
        _require_usable_positions(splats.means, evidence.path.name)
        warnings += [f"{finding.sentence}; left as they are." for finding in unusable_rows(splats, told)]
    return SplatFile(evidence.path, splats, evidence.table, layout, warnings, format_name)


class _Glance:
    """A look at rows as they are read that spares clean files a second pass."""

    def __init__(self) -> None:
        self._n_clean = 0

    def look(self, rows: NDArray) -> None:
        """Count the rows of a block if all their numbers are finite and no rotation begins with zero."""
        types = field_types(rows.dtype)
        if set(types.values()) == {np.dtype(np.float32)} and "rot_0" in types:
            numbers = rows.view(np.float32)
            # A NaN or an infinity stays in the sum of squares, and that is the fastest pass there is. A sum that
            # overflows costs a second pass, no more.
            with np.errstate(over="ignore", invalid="ignore"):
                clean = np.isfinite(np.dot(numbers, numbers)) and (rows["rot_0"] != 0).all()
            self._n_clean += len(rows) if clean else 0

    def shows_only_usable_rows(self, n_rows: int) -> bool:
        """Whether all rows were seen and clean."""
        return self._n_clean == n_rows


_BOUND = (
    "This file is of {0}, whose splats are bound to a mesh that it does not hold: what you see may not be the object."
)


def _require_usable_positions(means: NDArray[np.floating], name: str) -> None:
    """Refuse positions that are infinite, no numbers, or so far away that arithmetic would make them so."""
    usable = np.abs(means) <= LARGEST_COORDINATE
    if usable.all():
        return
    bad = np.flatnonzero(~usable.all(axis=1))
    splats = f"{len(bad):,} splats" if len(bad) > 1 else "1 splat"
    what = "is not finite"
    if np.isfinite(means[bad]).all():
        what = f"is farther than {LARGEST_COORDINATE:g} from the origin"
    raise PlyError(
        f"{name} has {splats} whose position {what}, the first in row {bad[0]:,}. "
        "Remove them in a splat viewer or export the file again."
    )


def write_ply(
    path: str | os.PathLike[str],
    file: SplatFile,
    splats: Splats,
    *,
    removed: FileMask | None = None,
    as_3dgs: bool = False,
    extra: Mapping[str, ArrayLike] | None = None,
    progress: Progress = no_progress,
) -> None:
    """Write splats as the file they came from, with only what changed changed.

    Rows, columns, types, their order, comments and extra elements stay; a cell
    is written only where ``splats`` differs from ``file.splats``, so unedited
    splats give the identical bytes, less those of rows that are removed. A changed rotation is written with the
    length the file's quaternion had, and turns the row's normal if that is a
    unit vector. SuperSplat's compressed form is kept for unedited splats only:
    where some are deformed or removed, all are written as a plain 3DGS file. The target appears whole or
    not at all, and may be the file that was read.

    Parameters
    ----------
    path : path
        File to create or replace.
    file : SplatFile
        What `read_ply` returned.
    splats : Splats
        Its splats, deformed: same number, scales and degree.
    removed : (N,) bool, optional
        Rows that are left out of the file; those that stay keep their bytes and their order.
    as_3dgs : bool
        Write what programs that know only 3DGS read rightly. 2DGS splats get a third scale of 1e-6 and keep all else;
        of SpikingGS and of files with a 3-D filter a plain 3DGS file is made, of what all programs hold.
    extra : dict of (N,) float, optional
        Columns to add at the end, by name.
    progress : Progress
        Told the share of rows written; cancelling leaves the old file.

    Raises
    ------
    PlyError
        If the file cannot be written, or no row would be left.
    ValueError
        If ``splats``, ``removed`` or ``extra`` do not match the file.
    """
    _require_same_shape(splats, file.splats)
    kept = kept_rows(removed, file)
    table, rest = file.table, file.splats
    names = file.layout.columns
    layout = file.layout
    if as_3dgs and file.is_misread and rest.n_scales == 3:
        _require_no_overflow(splats, rest, table.name)
        rest = splats = bare_splats(splats)[0]
        table, names, layout = plain_table(table.name, splats), COMMON_NAMES, LAYOUTS["3dgs"]
    elif names is None and (as_3dgs or extra or kept is not None or any_stored_difference(rest, splats)):
        _require_no_overflow(splats, rest, table.name)
        table, names, rest = plain_table(table.name, splats), COMMON_NAMES, splats
    added: list[NewColumn] = []
    if names is None:
        blocks = table.blocks(lambda lo, hi: {}, added)
    else:
        columns = splat_columns(table, names)
        added = _added_columns(table, columns if as_3dgs else None, extra or {})
        blocks = table.blocks(SplatCells(columns, layout, rest, splats, table).changes, added, kept)
    n_rows = table.n_rows if kept is None else int(np.count_nonzero(kept))
    header = table.header.with_columns([(column.after, column.name) for column in added], n_rows)
    _write_blocks(Path(path), header, blocks, table.body.nbytes, progress)


def kept_rows(removed: FileMask | None, file: SplatFile) -> FileMask | None:
    """(N,) rows that are written; None where all are."""
    if removed is None or not removed.any():
        return None
    if removed.shape != (file.table.n_rows,):
        raise ValueError(f"removed must have shape ({file.table.n_rows},), got {removed.shape}")
    if removed.all():
        raise PlyError(f"every splat of {file.path.name} is removed, so there is nothing to write: restore some.")
    return ~removed


def _write_blocks(
    path: Path, header: bytes, blocks: Iterator[NDArray[np.uint8] | bytes], n_bytes: int, progress: Progress
) -> None:
    """Write header and blocks to a file, whole or not at all."""
    written, next_report = 0, 0.0
    with whole_file(path, PlyError) as out:
        out.write(header)
        for block in blocks:
            data = block if isinstance(block, bytes) else np.ascontiguousarray(block).data.cast("B")
            out.write(data)
            written += len(data)
            if written >= next_report * n_bytes:
                progress(min(written / max(n_bytes, 1), 1.0))
                next_report += 0.05


def _require_no_overflow(splats: Splats, rest: Splats, name: str) -> None:
    """Refuse splats with a number that single precision does not hold where the file's own is finite."""
    for part in ("means", "log_scales", "quats"):
        with np.errstate(over="ignore"):
            cells = np.asarray(getattr(splats, part)).astype(np.float32)
        lost = ~np.isfinite(cells) & np.isfinite(getattr(rest, part))
        if lost.any():
            row = int(np.argmax(lost.any(axis=1)))
            raise PlyError(
                f"{name} cannot hold the result: {part} of row {row:,} would not be finite. Move the handles less far; "
                "nothing was written."
            )


def _require_same_shape(splats: Splats, rest: Splats) -> None:
    """Refuse splats that are not those of the file."""
    for part in ("means", "log_scales", "quats", "logit_opacities", "sh0", "shN"):
        got, wanted = np.shape(getattr(splats, part)), np.shape(getattr(rest, part))
        if got != wanted:
            raise ValueError(f"splats.{part} must have the file's shape {wanted}, got {got}")


def _added_columns(table: PlyTable, thickened: SplatColumns | None, extra: Mapping[str, ArrayLike]) -> list[NewColumn]:
    """Columns to add to the file: a third scale to flat splats that shall be thickened, and extra ones."""
    added = []
    third = COMMON_NAMES.log_scales[2]
    if thickened is not None and third not in table.columns:
        second = thickened.log_scales[1]
        added.append(NewColumn(second, third, np.full(table.n_rows, THIN_LOG_SCALE, np.float32)))
    last = table.header.vertex.names[-1]
    for name, values in extra.items():
        values = np.asarray(values, np.float32)
        if values.shape != (table.n_rows,):
            raise ValueError(f"extra[{name!r}] must have shape ({table.n_rows},), got {values.shape}")
        if not name.isascii() or not name.isprintable() or name.split() != [name]:
            raise ValueError(f"{name!r} cannot be a column name: use letters, digits and underscores")
        if name in table.columns or any(column.name == name for column in added):
            raise ValueError(f"the file has a column {name!r} already: choose another name")
        added.append(NewColumn(last, name, values))
    return added
