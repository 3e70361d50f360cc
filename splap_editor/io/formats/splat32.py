"""``.splat`` files: 32 bytes a splat, without a header and without view-dependent colour."""

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.progress import Progress
from splap_editor.io.formats.bare_splats import logits_of_bytes
from splap_editor.io.formats.source import Source
from splap_editor.io.ply_table import PlyTable
from splap_editor.io.splat_cells import blank_table
from splap_editor.io.splat_columns import SH_C0

RECORD = np.dtype([("mean", "<f4", 3), ("scale", "<f4", 3), ("rgba", "u1", 4), ("quat", "u1", 4)])
_BLOCK_ROWS = 1 << 15
_SMALLEST_SCALE = np.float32(1e-6)


def are_splats(start: bytes) -> bool:
    """Whether the first records can be splats: nothing else says what a ``.splat`` is."""
    records = np.frombuffer(start, RECORD, len(start) // RECORD.itemsize)
    if not len(records):
        return False
    with np.errstate(invalid="ignore"):
        numbers = np.isfinite(records["mean"]).all() and np.isfinite(records["scale"]).all()
        lengths = np.linalg.norm(records["quat"] / 127.5 - 1, axis=1)
    return bool(numbers and (records["scale"] >= 0).all() and (np.abs(lengths - 1) < 0.1).all())


def read(source: Source, progress: Progress) -> tuple[PlyTable, list[str]]:
    """Decode a ``.splat``.

    Raises
    ------
    FormatError
        If it is cut short.
    """
    data = source.data
    if len(data) % RECORD.itemsize or not data:
        raise source.refused(
            f"is no whole number of splats: it has {len(data):,} bytes and a splat has {RECORD.itemsize}",
            "Copy or export it again.",
        )
    records = np.frombuffer(data, RECORD)
    source.require_room(4 * 17 * len(records))
    table, sheet = blank_table(source.name, len(records), 0)
    logits = logits_of_bytes()
    for lo in range(0, len(records), _BLOCK_ROWS):
        rows = slice(lo, lo + _BLOCK_ROWS)
        block = records[rows]
        sheet.means[rows] = block["mean"]
        sheet.log_scales[rows] = log_scales_of(block["scale"])
        sheet.logit_opacities[rows] = logits[block["rgba"][:, 3]]
        sheet.sh0[rows] = (block["rgba"][:, :3].astype(np.float32) / 255 - 0.5) / np.float32(SH_C0)
        sheet.quats[rows] = _unit(block["quat"].astype(np.float32) / 127.5 - 1)
        progress(min((lo + _BLOCK_ROWS) / len(records), 1.0))
    return table, []


def log_scales_of(scales: NDArray[np.floating]) -> NDArray[np.floating]:
    """Logarithms of scales; those of zero or less become a millionth."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.log(np.where(scales > 0, scales, _SMALLEST_SCALE))


def _unit(quats: NDArray[np.float32]) -> NDArray[np.float32]:
    lengths = np.linalg.norm(quats, axis=1, keepdims=True)
    return np.asarray(quats / np.where(lengths > 0, lengths, 1), np.float32)
