"""Which columns hold which part of a splat, and the arrays they make."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.splats.splats import Splats
from splap_editor.io.layouts import Layout
from splap_editor.io.ply_header import PlyElement, PlyError
from splap_editor.io.ply_table import PlyTable

SH_C0 = 0.28209479177387814
_REST_COUNTS = (0, 9, 24, 45, 72)
_SPLAT_COLUMNS = frozenset({"opacity", "scale_0", "rot_0", "f_dc_0"})
_RGB = ("red", "green", "blue")
_BLOCK_ROWS = 1 << 12


@dataclass(frozen=True)
class SplatColumns:
    """Column names of each part of a splat, in the order of the arrays of `Splats`.

    ``sh_rest`` is channel-major, as files hold it: ``f_rest_[c K + k]``.
    """

    means: tuple[str, ...]
    log_scales: tuple[str, ...]
    quats: tuple[str, ...]
    opacity: str
    sh0: tuple[str, ...]
    sh_rest: tuple[str, ...]
    normals: tuple[str, ...]
    filter_radius: str | None


def require_splat_columns(element: PlyElement | None, elements: tuple[PlyElement, ...], name: str) -> None:
    """Refuse a vertex element that does not hold splats.

    Raises
    ------
    PlyError
        If it is a mesh or a bare point cloud, empty, or lacks columns.
    """
    if element is None:
        raise PlyError(f"{name} has no 'vertex' element, so no splats. Choose a .ply that a splat trainer wrote.")
    names = set(element.names)
    if "packed_position" in names:
        missing = [c for c in ("packed_rotation", "packed_scale", "packed_color") if c not in names]
    else:
        if not names & _SPLAT_COLUMNS:
            faces = any(e.name == "face" and e.count for e in elements)
            what = "a mesh" if faces else "a plain point cloud"
            raise PlyError(
                f"{name} is {what}, not Gaussian splats: it has no opacity, scale or rot columns. "
                "Choose the trainer's point_cloud.ply."
            )
        colours = [] if set(_RGB) <= names else ["f_dc_0", "f_dc_1", "f_dc_2"]
        needed = ["x", "y", "z", "opacity", "scale_0", "scale_1", "rot_0", "rot_1", "rot_2", "rot_3", *colours]
        missing = [c for c in needed if c not in names]
    scalars = {p.name for p in element.properties if p.length_type is None}
    missing += [c for c in sorted(names - scalars) if c in _SPLAT_COLUMNS or c in ("x", "y", "z")]
    if missing:
        raise PlyError(f"{name} lacks the columns {', '.join(missing)}. Export it again with all splat columns.")
    if element.count == 0:
        raise PlyError(f"{name} holds zero splats. Choose a file with splats in it.")
    _sh_rest_names(names, name)


def _sh_rest_names(names: set[str], name: str) -> tuple[str, ...]:
    """Names of the f_rest columns by number.

    Raises
    ------
    PlyError
        If they do not make up whole spherical-harmonic degrees.
    """
    n_rest = sum(column.startswith("f_rest_") for column in names)
    rest = tuple(f"f_rest_{i}" for i in range(n_rest))
    gaps = [column for column in rest if column not in names]
    if n_rest not in _REST_COUNTS or gaps:
        what = f"{gaps[0]} is missing" if gaps else "0, 9, 24, 45 or 72 make whole degrees"
        raise PlyError(
            f"{name} has inconsistent spherical-harmonic columns: {n_rest} f_rest columns, but {what}. "
            "Export it again, or without f_rest columns."
        )
    return rest


def splat_columns(table: PlyTable, layout: Layout) -> SplatColumns:
    """Find the columns of each part of a splat."""
    names = table.columns.keys()
    return SplatColumns(
        means=("x", "y", "z"),
        log_scales=("scale_0", "scale_1", "scale_2")[: layout.n_scales],
        quats=("rot_0", "rot_1", "rot_2", "rot_3"),
        opacity="opacity",
        sh0=("f_dc_0", "f_dc_1", "f_dc_2") if "f_dc_0" in names else _RGB,
        sh_rest=_sh_rest_names(set(names), table.name),
        normals=("nx", "ny", "nz") if {"nx", "ny", "nz"} <= names else (),
        filter_radius="filter_3D" if "filter_3D" in names else None,
    )


def splats_of(
    table: PlyTable,
    columns: SplatColumns,
    layout: Layout,
    *,
    thresholds: NDArray[np.floating] | None = None,
    opacity_floor: float = 0.0,
) -> Splats:
    """Make splats of a table; arrays are views into it wherever its bytes allow.

    Parameters
    ----------
    table : PlyTable
        The file.
    columns : SplatColumns
        Where each part is.
    layout : Layout
        What the columns mean.
    thresholds : (N,) float, optional
        SpikingGS thresholds.
    opacity_floor : float
        Opacities below it count as zero (SpikingGS ``Vth_opa``).
    """
    held = table.columns
    n_rest = len(columns.sh_rest)
    rest = column_group(held, columns.sh_rest) if n_rest else np.zeros((table.n_rows, 0), np.float32)
    sh0 = column_group(held, columns.sh0)
    if columns.sh0 == _RGB:
        sh0 = sh0_of_rgb(sh0, held["red"].dtype)
    opacities = column_group(held, (columns.opacity,))[:, 0]
    if layout.activated_opacity:
        opacities = logits(opacities, opacity_floor)
    filter_radii = None
    if columns.filter_radius is not None:
        filter_radii = column_group(held, (columns.filter_radius,))[:, 0]
    return Splats(
        means=column_group(held, columns.means),
        log_scales=column_group(held, columns.log_scales),
        quats=column_group(held, columns.quats),
        logit_opacities=opacities,
        sh0=sh0,
        shN=rest.reshape(table.n_rows, 3, n_rest // 3).transpose(0, 2, 1),
        thresholds=thresholds,
        filter_radii=filter_radii,
        normal_axis=layout.normal_axis,
    )


def column_group(columns: dict[str, NDArray], names: tuple[str, ...]) -> NDArray[np.floating]:
    """Put columns side by side as one array of native, aligned floats.

    Parameters
    ----------
    columns : dict of (N,) arrays
        Columns by name, of any numeric type and byte order.
    names : tuple of str
        The C columns wanted.

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
