"""SuperSplat's compressed PLY: 16 bytes a splat in chunks of 256, plus a byte per SH coefficient."""

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.splats.splats import Splats
from splap_editor.io.layout import Layout, PlyEvidence
from splap_editor.io.ply_header import PlyError
from splap_editor.io.ply_table import PlyTable, field_types
from splap_editor.io.splat_columns import SH_C0

CHUNK = 256
"""Splats that share one chunk's bounds."""


def packed_splats(evidence: PlyEvidence, layout: Layout) -> tuple[Splats, list[str]]:
    """Decode a compressed table.

    Positions and log-scales are 11, 10 and 11 bits between their chunk's
    bounds, colours and opacity 8 bits each, rotations the three smallest
    components in 10 bits each with the number of the largest in the top two,
    spherical harmonics 8 bits over -4 to 4.

    Parameters
    ----------
    evidence : PlyEvidence
        A table with elements ``chunk``, ``vertex`` and perhaps ``sh``.
    layout : Layout
        Whose normal axis the splats get.

    Returns
    -------
    splats : Splats
        float32, in the file's order.
    warnings : list of str
        None of them.

    Raises
    ------
    PlyError
        If the elements do not belong together.
    """
    table = evidence.table
    n = table.n_rows
    if any(element.has_lists for element in table.header.elements):
        raise PlyError(f"{table.name} is damaged: compressed splats have no lists. Export it again.")
    if table.header.is_ascii:
        raise PlyError(f"{table.name} is damaged: compressed splats are never text. Export it again.")
    chunks = table.element("chunk")
    if chunks is None or len(chunks) * CHUNK < n:
        held = 0 if chunks is None else len(chunks)
        raise PlyError(
            f"{table.name} is damaged: {n:,} compressed splats need {-(-n // CHUNK):,} chunks, {held:,} are there. "
            "Export it again."
        )
    for column in layout.packed:
        if table.columns[column].dtype.kind not in "iu" or table.columns[column].dtype.itemsize != 4:
            raise PlyError(f"{table.name} is damaged: {column} is not of type uint. Export it again.")
    bounds = {column: chunks[column].astype(np.float32) for column in field_types(chunks.dtype)}
    packed = table.columns["packed_color"].astype(np.uint32)
    colour = np.stack([(packed >> shift & 255).astype(np.float32) / 255 for shift in (24, 16, 8, 0)], axis=1)
    rgb: NDArray[np.floating] = colour[:, :3]
    try:
        means = _lerped(_unit_11_10_11(table.columns["packed_position"]), bounds, "{}_x", "{}_y", "{}_z")
        scales = _lerped(
            _unit_11_10_11(table.columns["packed_scale"]), bounds, "{}_scale_x", "{}_scale_y", "{}_scale_z"
        )
        if "min_r" in bounds:
            rgb = _lerped(rgb, bounds, "{}_r", "{}_g", "{}_b")
    except KeyError as error:
        raise PlyError(f"{table.name} is damaged: its chunks lack {error}. Export it again.") from None
    with np.errstate(divide="ignore", over="ignore"):
        opacities = np.log(colour[:, 3]) - np.log1p(-colour[:, 3])
        sh0 = ((rgb - 0.5) / SH_C0).astype(np.float32)
    splats = Splats(
        means=means,
        log_scales=scales,
        quats=_smallest_three(table.columns["packed_rotation"].astype(np.uint32)),
        logit_opacities=opacities,
        sh0=sh0,
        shN=_harmonics(table),
        normal_axis=layout.normal_axis,
    )
    return splats, []


def _unit_11_10_11(packed: NDArray) -> NDArray[np.float32]:
    """Three numbers in [0, 1] from the bits of one."""
    packed = packed.astype(np.uint32)
    return np.stack(
        [
            (packed >> 21).astype(np.float32) / 2047,
            (packed >> 11 & 1023).astype(np.float32) / 1023,
            (packed & 2047).astype(np.float32) / 2047,
        ],
        axis=1,
    )


def _lerped(share: NDArray[np.floating], bounds: dict[str, NDArray], *names: str) -> NDArray[np.float32]:
    """Columns between the bounds of their chunks; either end is met exactly."""
    out = np.empty((len(share), len(names)), np.float32)
    for c, name in enumerate(names):
        low, high = (np.repeat(bounds[name.format(end)], CHUNK)[: len(share)] for end in ("min", "max"))
        # Bounds that are no numbers give positions that are none, which are refused by row.
        with np.errstate(invalid="ignore", over="ignore"):
            out[:, c] = low * (1 - share[:, c]) + high * share[:, c]
    return out


def _smallest_three(packed: NDArray[np.uint32]) -> NDArray[np.float32]:
    """Unit quaternions w, x, y, z; the component left out is the largest and positive."""
    three = np.stack([packed >> shift & 1023 for shift in (20, 10, 0)], axis=1).astype(np.float32)
    three = (three / 1023 - 0.5) * np.sqrt(np.float32(2))
    largest = (packed >> 30).astype(np.intp)
    quats = np.empty((len(packed), 4), np.float32)
    for which in range(4):
        rows = largest == which
        quats[rows, which] = np.sqrt(np.maximum(1 - (three[rows] ** 2).sum(axis=1), 0))
        quats[np.ix_(rows, [c for c in range(4) if c != which])] = three[rows]
    return quats


def _harmonics(table: PlyTable) -> NDArray[np.float32]:
    """(N, K, 3) coefficients of the ``sh`` element, K = 0 if there is none."""
    n = table.n_rows
    rows = table.element("sh")
    if rows is None:
        return np.zeros((n, 0, 3), np.float32)
    held = field_types(rows.dtype)
    names = tuple(f"f_rest_{i}" for i in range(len(held)))
    if len(rows) != n or len(names) not in (9, 24, 45, 72) or set(names) != held.keys():
        raise PlyError(f"{table.name} is damaged: its 'sh' element does not fit its splats. Export it again.")
    if any(dtype != np.uint8 for dtype in held.values()):
        raise PlyError(f"{table.name} is damaged: its 'sh' element is not of type uchar. Export it again.")
    share = (np.arange(256, dtype=np.float32) + 0.5) / 256
    share[[0, 255]] = 0, 1
    # A byte at a time through a table, which takes no more memory than the result.
    coefficients = np.empty((n, len(names)), np.float32)
    for c, name in enumerate(names):
        coefficients[:, c] = ((share - 0.5) * 8)[rows[name]]
    return coefficients.reshape(n, 3, -1).transpose(0, 2, 1)
