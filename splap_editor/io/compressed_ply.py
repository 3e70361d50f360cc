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

_BLOCK_ROWS = CHUNK << 7
"""Splats that are decoded at a time."""


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
    harmonics, n_coefficients = _harmonic_rows(table)
    splats = Splats(
        means=np.empty((n, 3), np.float32),
        log_scales=np.empty((n, 3), np.float32),
        quats=np.empty((n, 4), np.float32),
        logit_opacities=np.empty(n, np.float32),
        sh0=np.empty((n, 3), np.float32),
        shN=np.empty((n, 3, n_coefficients), np.float32).transpose(0, 2, 1),
        normal_axis=layout.normal_axis,
    )
    for lo in range(0, n, _BLOCK_ROWS):
        hi = min(lo + _BLOCK_ROWS, n)
        block, within = slice(lo, hi), slice(lo // CHUNK, -(-hi // CHUNK))
        packed = {column: table.columns[column][block].astype(np.uint32) for column in layout.packed}
        bounds = {column: chunks[column][within].astype(np.float32) for column in field_types(chunks.dtype)}
        try:
            _fill(splats, block, packed, bounds)
        except KeyError as error:
            raise PlyError(f"{table.name} is damaged: its chunks lack {error}. Export it again.") from None
        # A byte at a time through a table, which takes no more memory than the result.
        for c in range(3 * n_coefficients):
            splats.shN[block, c % n_coefficients, c // n_coefficients] = _COEFFICIENTS[harmonics[f"f_rest_{c}"][block]]
        evidence.making(hi / n)
    return splats, []


def _fill(splats: Splats, rows: slice, packed: dict[str, NDArray], bounds: dict[str, NDArray]) -> None:
    """Write what the bits of some rows stand for, but for their harmonics; KeyError names bounds that are missing."""
    colour = np.stack([(packed["packed_color"] >> shift & 255).astype(np.float32) / 255 for shift in (24, 16, 8, 0)], 1)
    rgb: NDArray[np.floating] = colour[:, :3]
    splats.means[rows] = _lerped(_unit_11_10_11(packed["packed_position"]), bounds, "{}_x", "{}_y", "{}_z")
    shares = _unit_11_10_11(packed["packed_scale"])
    splats.log_scales[rows] = _lerped(shares, bounds, "{}_scale_x", "{}_scale_y", "{}_scale_z")
    if "min_r" in bounds:
        rgb = _lerped(rgb, bounds, "{}_r", "{}_g", "{}_b")
    splats.quats[rows] = _smallest_three(packed["packed_rotation"])
    with np.errstate(divide="ignore", over="ignore"):
        splats.logit_opacities[rows] = np.log(colour[:, 3]) - np.log1p(-colour[:, 3])
        splats.sh0[rows] = (rgb - 0.5) / SH_C0


def _unit_11_10_11(packed: NDArray) -> NDArray[np.float32]:
    """Three numbers in [0, 1] from the bits of one."""
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


_COEFFICIENTS = ((np.concatenate([[0.0], (np.arange(1, 255) + 0.5) / 256, [1.0]]) - 0.5) * 8).astype(np.float32)
"""What a byte of the harmonics stands for; the ends are met."""


def _harmonic_rows(table: PlyTable) -> tuple[NDArray, int]:
    """Rows of the ``sh`` element and the number K of their coefficients a channel, 0 if there is none."""
    n = table.n_rows
    rows = table.element("sh")
    if rows is None:
        return np.zeros(n, np.uint8), 0
    held = field_types(rows.dtype)
    names = tuple(f"f_rest_{i}" for i in range(len(held)))
    if len(rows) != n or len(names) not in (9, 24, 45, 72) or set(names) != held.keys():
        raise PlyError(f"{table.name} is damaged: its 'sh' element does not fit its splats. Export it again.")
    if any(dtype != np.uint8 for dtype in held.values()):
        raise PlyError(f"{table.name} is damaged: its 'sh' element is not of type uchar. Export it again.")
    return rows, len(names) // 3
