"""Which columns hold which part of a splat, and the arrays they make."""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.progress import Progress, no_progress, part_of
from splap_editor.core.splats.splats import Splats
from splap_editor.io.layout import ColumnNames, Layout, PlyEvidence
from splap_editor.io.ply_header import PlyError
from splap_editor.io.ply_table import PlyTable
from splap_editor.io.thresholds import Thresholds

SH_C0 = 0.28209479177387814
_REST_COUNTS = (0, 9, 24, 45, 72)
_BLOCK_ROWS = 1 << 12
_REPORT_ROWS = 1 << 15


@dataclass(frozen=True)
class SplatColumns:
    """Column names of each part of a splat that a table has, in the order of the arrays of `Splats`.

    ``sh_rest`` is channel-major, as files hold it: ``f_rest_[c K + k]``; ``sh0`` names colours if ``is_rgb``.
    """

    means: tuple[str, ...]
    log_scales: tuple[str, ...]
    quats: tuple[str, ...]
    opacity: str
    sh0: tuple[str, ...]
    is_rgb: bool
    sh_rest: tuple[str, ...]
    normals: tuple[str, ...]
    filter_radius: str | None


def require_whole_degrees(held: Collection[str], names: ColumnNames, name: str) -> tuple[str, ...]:
    """Names of the higher spherical-harmonic columns, by number.

    Raises
    ------
    PlyError
        If they do not make up whole degrees.
    """
    n_rest = sum(column.startswith(names.sh_rest) for column in held)
    rest = tuple(f"{names.sh_rest}{i}" for i in range(n_rest))
    gaps = [column for column in rest if column not in held]
    if n_rest not in _REST_COUNTS or gaps:
        what = f"{gaps[0]} is missing" if gaps else "0, 9, 24, 45 or 72 make whole degrees"
        columns = f"{names.sh_rest.rstrip('_')} columns"
        raise PlyError(
            f"{name} has inconsistent spherical-harmonic columns: {n_rest} {columns}, but {what}. "
            f"Export it again, or without {columns}."
        )
    return rest


def splat_columns(table: PlyTable, names: ColumnNames) -> SplatColumns:
    """Find the columns of each part of a splat."""
    held = table.columns.keys()
    is_rgb = not set(names.sh0) <= held
    return SplatColumns(
        means=names.means,
        log_scales=names.log_scales,
        quats=names.quats,
        opacity=names.opacity,
        sh0=names.rgb if is_rgb else names.sh0,
        is_rgb=is_rgb,
        sh_rest=require_whole_degrees(held, names, table.name),
        normals=names.normals if set(names.normals) <= held else (),
        filter_radius=names.filter_radius if names.filter_radius in held else None,
    )


def plain_splats(
    evidence: PlyEvidence, layout: Layout, thresholds: Thresholds | None = None
) -> tuple[Splats, list[str]]:
    """Make splats of a table whose columns are numbers; arrays are views into it wherever its bytes allow.

    Parameters
    ----------
    evidence : PlyEvidence
        The file.
    layout : Layout
        Where its columns are and what they mean.
    thresholds : Thresholds, optional
        Where SpikingGS's kernels end; opacities below its floor count as zero.

    Returns
    -------
    splats : Splats
    warnings : list of str
        None of them.
    """
    assert layout.columns is not None, "a packed layout is read otherwise"
    table = evidence.table
    columns, held = splat_columns(table, layout.columns), table.columns
    n_rest = len(columns.sh_rest)
    groups = (columns.sh_rest, columns.sh0, (columns.opacity,), columns.means, columns.log_scales, columns.quats)
    n_columns, n_done = sum(map(len, groups)) + 1, 0

    def group(names: tuple[str, ...]) -> NDArray[np.floating]:
        nonlocal n_done
        start, n_done = n_done, n_done + len(names)
        return column_group(held, names, part_of(evidence.making, start / n_columns, n_done / n_columns))

    rest = group(columns.sh_rest) if n_rest else np.zeros((table.n_rows, 0), np.float32)
    sh0 = group(columns.sh0)
    if columns.is_rgb:
        sh0 = sh0_of_rgb(sh0, held[columns.sh0[0]].dtype)
    opacities = group((columns.opacity,))[:, 0]
    if layout.activated_opacity:
        opacities = logits(opacities, thresholds.opacity_floor if thresholds is not None else 0.0)
    means, log_scales, quats = group(columns.means), group(columns.log_scales), group(columns.quats)
    filter_radii = None
    if columns.filter_radius is not None:
        filter_radii = group((columns.filter_radius,))[:, 0]
    splats = Splats(
        means=means,
        log_scales=log_scales,
        quats=quats,
        logit_opacities=opacities,
        sh0=sh0,
        shN=rest.reshape(table.n_rows, 3, n_rest // 3).transpose(0, 2, 1),
        thresholds=None if thresholds is None else thresholds.cutoffs,
        filter_radii=filter_radii,
        normal_axis=layout.normal_axis,
    )
    return splats, []


def thresholded_splats(evidence: PlyEvidence, layout: Layout) -> tuple[Splats, list[str]]:
    """Make splats of a table with the thresholds that SpikingGS leaves beside it; a warning if there are none."""
    thresholds = evidence.thresholds
    if isinstance(thresholds, Thresholds):
        return plain_splats(evidence, layout, thresholds)
    splats, _ = plain_splats(evidence, layout)
    return splats, [_NO_THRESHOLDS.format(evidence.path.stem) if thresholds is None else thresholds]


_NO_THRESHOLDS = (
    "SpikingGS keeps its thresholds in an .npz file and none lies beside this one: splats are taken to reach as far as "
    "without. Put {0}.npz or point_cloud.npz of the same iteration beside it."
)


def column_group(
    columns: dict[str, NDArray], names: tuple[str, ...], progress: Progress = no_progress
) -> NDArray[np.floating]:
    """Put columns side by side as one array of native, aligned floats.

    Parameters
    ----------
    columns : dict of (N,) arrays
        Columns by name, of any numeric type and byte order.
    names : tuple of str
        The C columns wanted.
    progress : Progress
        Told the share of rows copied; may cancel.

    Returns
    -------
    (N, C) float32 or float64
        A view if the columns are evenly spaced native floats in one buffer,
        a copy if not. float64 if a column needs it to be exact.
    """
    parts = [columns[name] for name in names]
    view = _strided_view(parts)
    if view is not None:
        return view
    dtype = np.result_type(np.float32, *(part.dtype.newbyteorder("=") for part in parts))
    group = np.empty((len(parts[0]), len(parts)), dtype)
    # Row blocks keep each record in the cache while its columns are picked out. A NaN stays one, of either kind.
    with np.errstate(invalid="ignore"):
        for lo in range(0, len(group), _BLOCK_ROWS):
            for c, part in enumerate(parts):
                group[lo : lo + _BLOCK_ROWS, c] = part[lo : lo + _BLOCK_ROWS]
            if lo % _REPORT_ROWS == 0:
                progress(lo / len(group))
    return group


def _strided_view(parts: list[NDArray]) -> NDArray | None:
    """One view over evenly spaced columns, None if there is none."""
    first = parts[0]
    if first.dtype.kind != "f" or any(
        p.dtype != first.dtype or not p.dtype.isnative or not p.flags.aligned or p.strides != first.strides
        for p in parts
    ):
        return None
    addresses = [part.__array_interface__["data"][0] for part in parts]
    steps = set(np.diff(addresses).tolist())
    record = first.strides[0]
    if len(steps) > 1 or not all(0 < step < record for step in steps):
        return None
    owner = _owner(first)
    if any(_owner(part) is not owner for part in parts):
        return None
    step = steps.pop() if steps else first.dtype.itemsize
    return np.lib.stride_tricks.as_strided(first, (len(first), len(parts)), (record, step), writeable=False)


def _owner(array: NDArray) -> object:
    """The array that owns the memory of a view."""
    while isinstance(array.base, np.ndarray):
        array = array.base
    return array


def sh0_of_rgb(rgb: NDArray[np.floating], dtype: np.dtype) -> NDArray[np.floating]:
    """Degree-0 coefficients of colours; integers fill their type's range, floats 0 to 1."""
    full = np.iinfo(dtype).max if dtype.kind in "iu" else 1
    return ((rgb / full - 0.5) / SH_C0).astype(rgb.dtype)


def rgb_of_sh0(sh0: NDArray[np.floating], dtype: np.dtype) -> NDArray[np.float64]:
    """Inverse of `sh0_of_rgb`, not rounded."""
    full = np.iinfo(dtype).max if dtype.kind in "iu" else 1
    return np.clip(0.5 + SH_C0 * np.asarray(sh0, np.float64), 0, 1) * full


def logits(opacities: NDArray[np.floating], floor: float = 0.0) -> NDArray[np.floating]:
    """``log(α / (1 - α))``; -inf where α is below the floor, NaN where α is not in [0, 1]."""
    alpha = np.asarray(opacities, np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        values = np.where((alpha >= 0) & (alpha < floor), -np.inf, np.log(alpha / (1 - alpha)))
    return values.astype(opacities.dtype)
