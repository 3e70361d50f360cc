"""``.ksplat`` files: sections of splats, their positions relative to buckets, in three degrees of compression."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.progress import Progress
from splap_editor.core.splats.splats import Splats
from splap_editor.io.formats.bare_splats import logits_of_bytes
from splap_editor.io.formats.source import Source
from splap_editor.io.formats.splat32 import log_scales_of
from splap_editor.io.ply_table import PlyTable
from splap_editor.io.splat_cells import blank_table
from splap_editor.io.splat_columns import SH_C0

_HEAD_BYTES, _SECTION_BYTES = 4096, 1024
_N_HARMONICS = (0, 9, 24, 45)
_BLOCK_ROWS = 1 << 15


@dataclass(frozen=True)
class _Level:
    """Types of a splat's numbers at one level of compression, and the range of its positions."""

    position: str
    number: str
    harmonic: str
    position_range: int

    def record(self, n_harmonics: int) -> np.dtype:
        return np.dtype(
            [
                ("mean", self.position, 3),
                ("scale", self.number, 3),
                ("quat", self.number, 4),
                ("rgba", "u1", 4),
                ("sh", self.harmonic, (n_harmonics,)),
            ]
        )


_LEVELS = (_Level("<f4", "<f4", "<f4", 1), _Level("<u2", "<f2", "<f2", 32767), _Level("<u2", "<f2", "u1", 32767))


def is_header(start: bytes) -> bool:
    """Whether these bytes can be the head of a ``.ksplat``: version 0.1 or later, a known level, some splats."""
    if len(start) < _HEAD_BYTES or start[0] != 0 or start[1] == 0 or start[2:4] != bytes(2):
        return False
    # Some writers leave the number of sections in use, and the most splats, at zero.
    n_sections, _, _, n_splats = np.frombuffer(start, "<u4", 4, 4).tolist()
    level = int.from_bytes(start[20:22], "little")
    return level < len(_LEVELS) and 0 < n_sections < 1 << 16 and n_splats > 0


@dataclass(frozen=True)
class _Section:
    """Where a section's splats are, and what their positions are relative to.

    Full buckets come first, of ``capacity`` rows each, then partial ones, up to the row where each ends.
    """

    records: NDArray
    degree: int
    centers: NDArray[np.float32]
    capacity: int
    n_full: int
    ends: NDArray[np.int64]
    step: float
    position_range: int

    def buckets(self, lo: int, hi: int) -> NDArray[np.int64]:
        """Bucket of each row from one to another."""
        rows = np.arange(lo, hi)
        beyond = self.n_full + np.searchsorted(self.ends, rows, side="right")
        # Where all buckets are full the count of rows in them may be beyond any integer of numpy's.
        n_in_full = min(self.n_full * self.capacity, len(self.records))
        return np.where(rows < n_in_full, rows // max(self.capacity, 1), beyond)


def read(source: Source, progress: Progress) -> tuple[PlyTable, list[str]]:
    """Decode a ``.ksplat``.

    Raises
    ------
    FormatError
        If it is damaged.
    """
    if len(source.data) < _HEAD_BYTES:
        raise source.cut_short()
    if not is_header(source.data[:_HEAD_BYTES]):
        raise source.damaged("it does not begin as a .ksplat does")
    (most_sections,) = source.unpack("<I", 4)
    (level_number,) = source.unpack("<H", 20)
    level = _LEVELS[level_number]
    sections, at = [], _HEAD_BYTES + most_sections * _SECTION_BYTES
    for number in range(most_sections):
        section, at = _section(source, level, _HEAD_BYTES + number * _SECTION_BYTES, at)
        if len(section.records):
            sections.append(section)
    n_splats = sum(len(section.records) for section in sections)
    if n_splats == 0:
        raise source.refused("holds zero splats", "Choose a file with splats in it.")
    degree = max(section.degree for section in sections)
    n_coefficients = (degree + 1) ** 2 - 1
    source.require_room(4 * n_splats * (17 + 3 * n_coefficients))
    table, sheet = blank_table(source.name, n_splats, n_coefficients)
    low, high = source.unpack("<ff", 36)
    low, high = low or -1.5, high or 1.5
    done = 0
    for section in sections:
        for lo in range(0, len(section.records), _BLOCK_ROWS):
            hi = min(lo + _BLOCK_ROWS, len(section.records))
            _fill(sheet, slice(done, done + hi - lo), section, slice(lo, hi), level_number, (low, high))
            done += hi - lo
            progress(done / n_splats)
    return table, []


def _section(source: Source, level: _Level, head: int, at: int) -> tuple[_Section, int]:
    """A section, and where the next one's data starts."""
    n, most, capacity, n_buckets = source.unpack("<IIII", head)
    (block,) = source.unpack("<f", head + 16)
    (bucket_bytes,) = source.unpack("<H", head + 20)
    (position_range,) = source.unpack("<I", head + 24)
    n_full, n_partial = source.unpack("<II", head + 32)
    (degree,) = source.unpack("<H", head + 40)
    if degree >= len(_N_HARMONICS):
        raise source.damaged(f"no .ksplat has harmonics of degree {degree}")
    if n > most or (n and level.position_range > 1 and (bucket_bytes != 12 or n_full + n_partial > n_buckets)):
        raise source.damaged("the counts of a section do not fit together")
    record = level.record(_N_HARMONICS[degree])
    partial = np.frombuffer(source.piece(at, 4 * n_partial), "<u4").astype(np.int64)
    start = at + 4 * n_partial + bucket_bytes * n_buckets
    centers = np.zeros((0, 3), np.float32)
    records = np.frombuffer(source.piece(start, record.itemsize * most), record)[:n]
    if n and level.position_range > 1:
        centers = np.frombuffer(source.piece(at + 4 * n_partial, 12 * n_buckets), "<f4").reshape(-1, 3)
    reach = position_range or level.position_range
    ends = min(n_full * capacity, n) + np.cumsum(partial)
    found = _Section(records, degree, centers, capacity, n_full, ends, block / 2 / reach, reach)
    # Buckets follow one another: the last row has the last of them.
    if n and level.position_range > 1 and found.buckets(n - 1, n)[0] >= len(centers):
        raise source.damaged("a section has splats outside its buckets")
    return found, start + record.itemsize * most


def _fill(
    sheet: Splats, rows: slice, section: _Section, held: slice, level: int, harmonic_range: tuple[float, float]
) -> None:
    """Write some splats of a section to some rows."""
    block = section.records[held]
    if level == 0:
        sheet.means[rows] = block["mean"]
    else:
        offsets = (block["mean"].astype(np.float64) - section.position_range) * section.step
        sheet.means[rows] = offsets + section.centers[section.buckets(held.start, held.stop)]
    sheet.log_scales[rows] = log_scales_of(block["scale"].astype(np.float32))
    sheet.quats[rows] = block["quat"]
    sheet.sh0[rows] = (block["rgba"][:, :3].astype(np.float32) / 255 - 0.5) / np.float32(SH_C0)
    sheet.logit_opacities[rows] = logits_of_bytes()[block["rgba"][:, 3]]
    values = block["sh"].astype(np.float32)
    if level == 2:
        low, high = harmonic_range
        values = (low + values / 255 * (high - low)).astype(np.float32)
    sheet.shN[rows] = 0
    # Bands follow one another, channel by channel within a band.
    for band in range(1, section.degree + 1):
        start, n = band * band - 1, 2 * band + 1
        for c in range(3):
            first = 3 * start + c * n
            sheet.shN[rows, start : start + n, c] = values[:, first : first + n]
