"""Which cells of a table differ after splats were deformed, and what to put there."""

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.splats.splats import Splats
from splap_editor.io.layout import Layout
from splap_editor.io.ply_header import ply_header
from splap_editor.io.ply_table import CellChanges, PlyTable, binary_table
from splap_editor.io.splat_columns import SplatColumns, column_group, rgb_of_sh0

_UNIT_TOLERANCE = 1e-2
_BLOCK_ROWS = 1 << 15


class SplatCells:
    """The difference between two states of a file's splats, as cells of its table.

    Parameters
    ----------
    columns : SplatColumns
        Where each part of a splat is.
    layout : Layout
        What the columns mean.
    rest, splats : Splats
        What the table holds, and what it shall hold.
    table : PlyTable
        The table, for its normals and the lengths of its quaternions.
    """

    def __init__(
        self,
        columns: SplatColumns,
        layout: Layout,
        rest: Splats,
        splats: Splats,
        table: PlyTable,
    ) -> None:
        self._columns = columns
        self._layout = layout
        self._rest = rest
        self._splats = splats
        self._table = table

    def changes(self, lo: int, hi: int) -> CellChanges:
        """Cells that differ in rows ``lo`` to ``hi - 1``; rows count from ``lo``."""
        found: CellChanges = {}
        if self._splats is self._rest:
            return found
        columns = self._columns
        self._plain(found, columns.means, *self._both("means", lo, hi))
        self._plain(found, columns.log_scales, *self._both("log_scales", lo, hi))
        self._opacities(found, lo, hi)
        self._colours(found, lo, hi)
        if columns.sh_rest:
            before, after = self._both("shN", lo, hi)
            flat = (len(before), len(columns.sh_rest))
            # The file is channel-major: transposed, a row's coefficients are in file order.
            self._plain(
                found, columns.sh_rest, before.transpose(0, 2, 1).reshape(flat), after.transpose(0, 2, 1).reshape(flat)
            )
        self._rotations(found, lo, hi)
        if columns.filter_radius is not None:
            before, after = self._both("filter_radii", lo, hi)
            self._plain(found, (columns.filter_radius,), before[:, None], after[:, None])
        return found

    def _both(self, part: str, lo: int, hi: int) -> tuple[NDArray, NDArray]:
        """Rows of a part before and after."""
        return _stored(self._rest, part, lo, hi), _stored(self._splats, part, lo, hi)

    @staticmethod
    def _plain(found: CellChanges, names: tuple[str, ...], before: NDArray, after: NDArray) -> None:
        """Add the cells of numbers stored as they are."""
        different = _differs(before, after)
        for c in np.flatnonzero(different.any(axis=0)):
            rows = np.flatnonzero(different[:, c])
            found[names[c]] = rows, after[rows, c]

    def _opacities(self, found: CellChanges, lo: int, hi: int) -> None:
        """Add changed opacities, activated if the file has them so."""
        before, after = self._both("logit_opacities", lo, hi)
        rows = np.flatnonzero(_differs(before, after))
        if len(rows):
            values = after[rows].astype(np.float64)
            if self._layout.activated_opacity:
                with np.errstate(over="ignore"):
                    values = 1 / (1 + np.exp(-values))
            found[self._columns.opacity] = rows, values

    def _colours(self, found: CellChanges, lo: int, hi: int) -> None:
        """Add changed degree-0 colours, as red, green, blue if the file has them so."""
        before, after = self._both("sh0", lo, hi)
        names = self._columns.sh0
        if not self._columns.is_rgb:
            self._plain(found, names, before, after)
            return
        different = _differs(before, after)
        for c in np.flatnonzero(different.any(axis=0)):
            rows = np.flatnonzero(different[:, c])
            found[names[c]] = rows, rgb_of_sh0(after[rows, c], self._table.columns[names[c]].dtype)

    def _rotations(self, found: CellChanges, lo: int, hi: int) -> None:
        """Add changed quaternions at the file's lengths, and the normals they turn."""
        before, after = self._both("quats", lo, hi)
        rows = np.flatnonzero(_differs(before, after).any(axis=1))
        if len(rows) == 0:
            return
        # A signalling NaN complains when it is made wider.
        with np.errstate(invalid="ignore"):
            old, new = before[rows].astype(np.float64), after[rows].astype(np.float64)
        with np.errstate(divide="ignore", invalid="ignore"):
            lengths = np.linalg.norm(old, axis=1) / np.linalg.norm(new, axis=1)
        # A row without a usable rotation has no length to keep.
        lengths[~np.isfinite(lengths) | (lengths == 0)] = 1.0
        scaled = new * lengths[:, None]
        for c, name in enumerate(self._columns.quats):
            found[name] = rows, scaled[:, c]
        if self._columns.normals:
            columns = {name: self._table.columns[name][lo:hi][rows] for name in self._columns.normals}
            normals = column_group(columns, self._columns.normals).astype(np.float64)
            unit = np.abs(np.linalg.norm(normals, axis=1) - 1) < _UNIT_TOLERANCE
            turned = _turned(normals[unit], old[unit], new[unit])
            finite = np.isfinite(turned).all(axis=1)
            for c, name in enumerate(self._columns.normals):
                found[name] = rows[unit][finite], turned[finite, c]


def any_stored_difference(rest: Splats, splats: Splats) -> bool:
    """Whether any stored number of any splat differs."""
    parts = ("means", "log_scales", "quats", "logit_opacities", "sh0", "shN")
    blocks = [(lo, lo + _BLOCK_ROWS) for lo in range(0, rest.n_splats, _BLOCK_ROWS)]
    return any(
        _differs(_stored(rest, part, lo, hi), _stored(splats, part, lo, hi)).any()
        for part in parts
        for lo, hi in blocks
    )


def _stored(splats: Splats, part: str, lo: int, hi: int) -> NDArray:
    """Some rows of a part."""
    return np.asarray(getattr(splats, part))[lo:hi]


def _differs(before: NDArray, after: NDArray) -> NDArray[np.bool_]:
    """Where numbers differ; two NaNs do not."""
    different = before != after
    if different.any():
        different &= ~(np.isnan(before) & np.isnan(after))
    return different


def _turned(vectors: NDArray[np.float64], before: NDArray, after: NDArray) -> NDArray[np.float64]:
    """Vectors turned by the rotation that takes one quaternion (w, x, y, z, any length) to another."""
    with np.errstate(divide="ignore", invalid="ignore"):
        before = before / np.linalg.norm(before, axis=1, keepdims=True)
        after = after / np.linalg.norm(after, axis=1, keepdims=True)
        local = _rotated(before * [1, -1, -1, -1], vectors)
        return _rotated(after, local)


def _rotated(quats: NDArray[np.float64], vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Vectors rotated by unit quaternions."""
    w, axis = quats[:, :1], quats[:, 1:]
    twice = 2 * np.cross(axis, vectors)
    return vectors + w * twice + np.cross(axis, twice)


def plain_table(name: str, splats: Splats) -> PlyTable:
    """Lay splats out as a 3DGS file in memory: INRIA's columns, float32, normals zero."""
    table, sheet = blank_table(name, splats.n_splats, splats.shN.shape[1], splats.n_scales)
    for part in ("means", "log_scales", "quats", "logit_opacities", "sh0", "shN"):
        getattr(sheet, part)[...] = getattr(splats, part)
    return table


def blank_table(name: str, n_splats: int, n_coefficients: int, n_scales: int = 3) -> tuple[PlyTable, Splats]:
    """Make a 3DGS file in memory whose numbers are still to be filled in.

    Parameters
    ----------
    name : str
        File name, for messages.
    n_splats : int
        Rows N.
    n_coefficients : int
        Spherical-harmonic coefficients K of degrees 1 and up.
    n_scales : int
        2 or 3.

    Returns
    -------
    table : PlyTable
        INRIA's columns, float32, normals zero.
    splats : Splats
        Writable views into it, to fill.
    """
    groups = [
        ("x", "y", "z"),
        ("nx", "ny", "nz"),
        tuple(f"f_dc_{i}" for i in range(3)),
        tuple(f"f_rest_{i}" for i in range(3 * n_coefficients)),
        ("opacity",),
        tuple(f"scale_{i}" for i in range(n_scales)),
        tuple(f"rot_{i}" for i in range(4)),
    ]
    names = [column for columns in groups for column in columns]
    # The normals stay zero, and no page is touched before it is filled.
    rows = np.zeros((n_splats, len(names)), "<f4")
    ends = np.cumsum([len(columns) for columns in groups])
    means, _, sh0, rest, opacities, log_scales, quats = (
        rows[:, end - len(columns) : end] for columns, end in zip(groups, ends, strict=True)
    )
    sheet = Splats(
        means=means,
        log_scales=log_scales,
        quats=quats,
        logit_opacities=opacities[:, 0],
        sh0=sh0,
        shN=rest.reshape(n_splats, 3, n_coefficients).transpose(0, 2, 1),
    )
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {n_splats}"]
    lines += [f"property float {column}" for column in names] + ["end_header", ""]
    header = ply_header("\n".join(lines).encode(), name)
    return binary_table(name, header, rows.reshape(-1).view(np.uint8)), sheet
