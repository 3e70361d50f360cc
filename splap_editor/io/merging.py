"""Several splat files as one: the rows of the first, then those of the second, in one layout."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from splap_editor.core.progress import Progress, no_progress, part_of
from splap_editor.core.splats.splats import Splats
from splap_editor.io.formats.bare_splats import THIN_LOG_SCALE, bare_splats, row_blocks
from splap_editor.io.formats.losses import losses
from splap_editor.io.formats.table import FORMATS
from splap_editor.io.layout import ColumnNames, PlyEvidence
from splap_editor.io.layouts import LAYOUTS
from splap_editor.io.ply import SplatFile, splat_file
from splap_editor.io.ply_header import PlyError, ply_header
from splap_editor.io.ply_table import PlyTable, binary_table, cast_values, field_types
from splap_editor.io.splat_cells import blank_table
from splap_editor.io.splat_columns import plain_splats

MOST_ROWS = 2**31 - 1
_LARGEST_DEGREE = 4
_TYPE_NAMES = {
    **{f"i{n}": f"int{8 * n}" for n in (1, 2, 4)},
    **{f"u{n}": f"uint{8 * n}" for n in (1, 2, 4)},
    **{"f4": "float", "f8": "double"},
}


@dataclass(frozen=True, eq=False)
class Merged:
    """Several files in one table.

    Parameters
    ----------
    file : SplatFile
        As it would be read from the file that becomes of it.
    counts : tuple of int
        Rows of each, in their order: cut there, the table is the files again.
    notes : list of str
        What differs between them, and what became of it, each as a sentence.
    """

    file: SplatFile
    counts: tuple[int, ...]
    notes: list[str]


def merged_files(files: Sequence[SplatFile], *, layout: str | None = None, progress: Progress = no_progress) -> Merged:
    """Put the rows of several files one after the other.

    Files of one layout keep it, and their cells: columns that only some have are 0 in the others' rows, and harmonics
    are filled up with zeros to the highest degree. Where layouts differ all become plain 3DGS, or plain 2DGS if all are
    flat: numbers that mean the same there stay as they are.

    Parameters
    ----------
    files : sequence of SplatFile
        Two at least.
    layout : str, optional
        ``"3dgs"`` to make that of them in any case, or one that all of them have.
    progress : Progress
        Told the share of rows put together; may cancel.

    Raises
    ------
    PlyError
        There is only one file, they cannot become what is asked for, or are too many rows for one file.
    """
    if len(files) < 2:
        raise PlyError("a merge needs two files or more: name another one.")
    counts = tuple(file.splats.n_splats for file in files)
    if sum(counts) > MOST_ROWS:
        raise PlyError(f"together they have {sum(counts):,} splats, and a file holds {MOST_ROWS:,}: merge fewer.")
    common = files[0].layout.name if _are_alike(files) else None
    plain = "2dgs" if all(file.splats.n_scales == 2 for file in files) else "3dgs"
    target = layout or common or plain
    if target not in {common, plain, "3dgs"} - {None}:
        held = ", ".join(f"{file.path.name} is {file.layout.name}" for file in files)
        raise PlyError(f"they cannot become {target}, as {held}: choose 3dgs, which any splats can be.")
    notes = _degrees_told(files)
    names = dict.fromkeys(file.layout.name for file in files)
    if len(names) > 1:
        held = ", ".join(f"{file.path.name} is {file.layout.name}" for file in files)
        notes.append(f"Layouts differ ({held}): all become {target}.")
    if target == common:
        table, told = _united_table(files, part_of(progress, 0.0, 0.6))
        found = files[0].layout
    else:
        table, told = _plain_table(files, 2 if target == "2dgs" else 3, part_of(progress, 0.0, 0.6))
        found = replace(LAYOUTS[target], reason="merged")
    # Nothing lies beside a file that is not there yet, so its path is that of the first.
    file = splat_file(PlyEvidence(table, files[0].path, part_of(progress, 0.6, 1.0)), found)
    progress(1.0)
    return Merged(file, counts, notes + told)


def _are_alike(files: Sequence[SplatFile]) -> bool:
    """Whether one table of one layout holds the cells of all."""
    first = files[0]
    return all(
        file.layout.choice == first.layout.choice
        and file.layout.columns is not None
        and file.layout.splats is plain_splats
        and _color_types(file) == _color_types(first)
        for file in files
    )


def _color_types(file: SplatFile) -> list[str]:
    """Types of red, green and blue, over which they range; empty where colours are coefficients."""
    columns, held = file.layout.columns, file.table.columns
    if columns is None or set(columns.sh0) <= held.keys():
        return []
    return [held[name].dtype.str[1:] for name in columns.rgb]


def _degrees_told(files: Sequence[SplatFile]) -> list[str]:
    most = max(file.splats.sh_degree for file in files)
    lower = [file for file in files if file.splats.sh_degree < most]
    return [
        f"{file.path.name} has harmonics of degree {file.splats.sh_degree}: zeros up to degree {most}."
        for file in lower
    ]


def _united_table(files: Sequence[SplatFile], progress: Progress) -> tuple[PlyTable, list[str]]:
    """All cells of files of one layout, in the columns that any of them has."""
    columns = files[0].layout.columns
    assert columns is not None
    n_rest = 3 * max(file.splats.shN.shape[1] for file in files)
    types = _united_types(files, columns, n_rest)
    record = np.dtype([(name, f"<{code}") for name, code in types.items()])
    rows = np.zeros(sum(file.splats.n_splats for file in files), record)
    first, notes = 0, []
    for file in files:
        held, n = file.table.columns, file.splats.n_splats
        target, told = rows[first : first + n], part_of(progress, first / len(rows), (first + n) / len(rows))
        if _stands_so(file.table, record):
            for block in row_blocks(n, told):
                target[block] = file.table.rows[block]
        else:
            for done, (name, values) in enumerate(held.items()):
                united = _united_name(name, columns, 3 * file.splats.shN.shape[1], n_rest)
                target[united] = cast_values(values, record[united])
                told((done + 1) / len(held))
        missing = [name for name in types if name not in held and not name.startswith(columns.sh_rest)]
        if missing:
            notes.append(f"{file.path.name} has no {_listed(missing)}: 0 in its rows.")
        others = [element.name for element in file.table.header.elements if element.name != "vertex"]
        if others:
            notes.append(f"Elements of {file.path.name} beside its splats are not kept: {_listed(others)}.")
        first += n
    comments = dict.fromkeys(comment for file in files for comment in file.table.header.comments)
    return _table(files[0].table.name, types, rows, list(comments)), notes


def _stands_so(table: PlyTable, record: np.dtype) -> bool:
    """Whether a table's rows lie in memory as just these records, not as text or in rows of different sizes."""
    return type(table) is PlyTable and field_types(table.rows.dtype) == field_types(record)


def _united_types(files: Sequence[SplatFile], columns: ColumnNames, n_rest: int) -> dict[str, str]:
    """Type codes of all columns, in the order of the first file, those of the others after them."""
    types: dict[str, str] = {}
    for file in files:
        for name, values in file.table.columns.items():
            united = _united_name(name, columns, 3 * file.splats.shN.shape[1], n_rest)
            code = values.dtype.str[1:]
            known = types.get(united, code)
            # A wider type holds the numbers of both.
            types[united] = code if known == code else np.result_type(known, code, np.float32).str[1:]
    rest = [f"{columns.sh_rest}{i}" for i in range(n_rest)]
    if not rest:
        return types
    # By their number, where the first of them stands.
    names, others = list(types), [name for name in types if name not in set(rest)]
    first = min(names.index(name) for name in rest)
    return {name: types[name] for name in (*others[:first], *rest, *others[first:])}


def _united_name(name: str, columns: ColumnNames, n_own: int, n_rest: int) -> str:
    """Name of a file's column among those of all: ``f_rest_[c K + k]`` depends on how many there are."""
    number = name.removeprefix(columns.sh_rest)
    if n_own in (0, n_rest) or number == name or not number.isdecimal():
        return name
    channel, k = divmod(int(number), n_own // 3)
    return f"{columns.sh_rest}{channel * (n_rest // 3) + k}"


def _table(name: str, types: dict[str, str], records: np.ndarray, comments: list[str]) -> PlyTable:
    lines = ["ply", "format binary_little_endian 1.0", *(f"comment {comment}" for comment in comments)]
    lines.append(f"element vertex {len(records)}")
    lines += [f"property {_TYPE_NAMES[code]} {column}" for column, code in types.items()]
    header = ply_header("\n".join([*lines, "end_header", ""]).encode("latin-1", "replace"), name)
    return binary_table(name, header, records.view(np.uint8))


def _plain_table(files: Sequence[SplatFile], n_scales: int, progress: Progress) -> tuple[PlyTable, list[str]]:
    """Splats of any layouts in the columns that every program reads."""
    n = sum(file.splats.n_splats for file in files)
    n_coefficients = max(file.splats.shN.shape[1] for file in files)
    table, sheet = blank_table(files[0].table.name, n, n_coefficients, n_scales)
    first, notes = 0, []
    for file in files:
        count = file.splats.n_splats
        told = part_of(progress, first / n, (first + count) / n)
        splats, lost = _plain(file, n_scales, told)
        notes += [f"Of {file.path.name}: {loss}" for loss in lost]
        rows = slice(first, first + count)
        for part in ("means", "log_scales", "quats", "logit_opacities", "sh0"):
            getattr(sheet, part)[rows] = getattr(splats, part)
        sheet.shN[rows, : splats.shN.shape[1]] = splats.shN
        first += count
        told(1.0)
    return table, notes


def _plain(file: SplatFile, n_scales: int, progress: Progress) -> tuple[Splats, list[str]]:
    """A file's splats as plain ones, and what is lost on the way."""
    splats = file.splats
    row = replace(FORMATS["ply"], name="3dgs", largest_degree=_LARGEST_DEGREE, log_scales=(THIN_LOG_SCALE, np.inf))
    bare, n_unusable = bare_splats(splats, _LARGEST_DEGREE, progress)
    if splats.filter_radii is not None or splats.thresholds is not None or file.layout.activated_opacity:
        told = losses(file, splats, bare, n_unusable, row)
        # Flat splats have no third scale to tell of where all stay flat.
        return replace(bare, log_scales=bare.log_scales[:, :n_scales]), told
    if splats.n_scales == n_scales:
        # Shapes stay as they are, however thin.
        return splats, losses(file, bare, bare, 0, row)
    thin = np.full(splats.n_splats, THIN_LOG_SCALE, np.float32)
    return replace(splats, log_scales=np.column_stack([splats.log_scales, thin])), losses(file, splats, bare, 0, row)


def _listed(names: list[str], most: int = 6) -> str:
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more
