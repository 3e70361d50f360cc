"""Writing SuperSplat's compressed PLY, of any splats; it is read as a layout (`splap_editor.io.compressed_ply`)."""

from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.progress import Progress
from splap_editor.core.splats.morton import morton_order
from splap_editor.core.splats.splats import Splats
from splap_editor.io.compressed_ply import CHUNK
from splap_editor.io.formats.bare_splats import alphas_of, as_bytes
from splap_editor.io.splat_columns import SH_C0

_BOUNDS = [
    f"{end}_{name}"
    for names in (("x", "y", "z"), ("scale_x", "scale_y", "scale_z"), ("r", "g", "b"))
    for end in ("min", "max")
    for name in names
]
_PACKED = ("packed_position", "packed_rotation", "packed_scale", "packed_color")


def write(out: BinaryIO, splats: Splats, progress: Progress) -> None:
    """Encode bare splats, rows along a Z-order curve: the smaller its chunks, the finer their steps."""
    _write(out, splats, morton_order(splats.means.astype(np.float64)), progress)


def write_in_order(out: BinaryIO, splats: Splats, progress: Progress) -> None:
    """Encode bare splats in their own order."""
    _write(out, splats, np.arange(splats.n_splats), progress)


def _write(out: BinaryIO, splats: Splats, order: NDArray[np.int64], progress: Progress) -> None:
    n, n_rest = splats.n_splats, 3 * splats.shN.shape[1]
    n_chunks = -(-n // CHUNK)
    lines = ["ply", "format binary_little_endian 1.0", "comment Written by SpLap Editor", f"element chunk {n_chunks}"]
    lines += [f"property float {name}" for name in _BOUNDS]
    lines += [f"element vertex {n}", *(f"property uint {name}" for name in _PACKED)]
    if n_rest:
        lines += [f"element sh {n}", *(f"property uchar f_rest_{i}" for i in range(n_rest))]
    out.write("\n".join([*lines, "end_header", ""]).encode())
    bounds = np.empty((n_chunks, len(_BOUNDS)), "<f4")
    words = np.empty((n, len(_PACKED)), "<u4")
    # Chunks are packed many at a time.
    step = 1 << 7
    for lo in range(0, n_chunks, step):
        rows = order[lo * CHUNK : (lo + step) * CHUNK]
        to = slice(lo * CHUNK, lo * CHUNK + len(rows))
        chunks = slice(lo, lo + step)
        words[to, 0], bounds[chunks, 0:6] = _packed_11_10_11(splats.means[rows])
        words[to, 1] = _packed_rotations(splats.quats[rows])
        words[to, 2], bounds[chunks, 6:12] = _packed_11_10_11(splats.log_scales[rows])
        colors = splats.sh0[rows] * np.float32(SH_C0) + np.float32(0.5)
        share, bounds[chunks, 12:18] = _shares(colors)
        share = np.column_stack([share, alphas_of(splats.logit_opacities[rows])])
        words[to, 3] = as_bytes(share * 255).astype(np.uint32) @ np.array([1 << 24, 1 << 16, 1 << 8, 1], np.uint32)
        progress(0.8 * min((lo + step) / n_chunks, 1.0))
    out.write(bounds.tobytes())
    out.write(words.tobytes())
    for lo in range(0, n if n_rest else 0, step * CHUNK):
        rest = splats.shN[order[lo : lo + step * CHUNK]].transpose(0, 2, 1).reshape(-1, n_rest)
        out.write(np.clip(np.floor((rest / 8 + 0.5) * 256), 0, 255).astype(np.uint8).tobytes())
        progress(0.8 + 0.2 * min((lo + step * CHUNK) / n, 1.0))
    progress(1.0)


def _shares(values: NDArray[np.float32]) -> tuple[NDArray[np.float64], NDArray[np.float32]]:
    """Where values lie between the least and the largest of their chunk, and these, least of all parts first."""
    starts = np.arange(0, len(values), CHUNK)
    low, high = np.minimum.reduceat(values, starts), np.maximum.reduceat(values, starts)
    sizes = np.minimum(CHUNK, len(values) - starts)
    base = np.repeat(low, sizes, axis=0).astype(np.float64)
    width = np.repeat(high, sizes, axis=0) - base
    return (values - base) / np.where(width > 0, width, 1), np.concatenate([low, high], axis=1)


def _packed_11_10_11(values: NDArray[np.float32]) -> tuple[NDArray[np.uint32], NDArray[np.float32]]:
    share, bounds = _shares(values)
    x, y, z = (np.rint(share[:, c] * most).astype(np.uint32) for c, most in enumerate((2047, 1023, 2047)))
    return x << np.uint32(21) | y << np.uint32(11) | z, bounds


def _packed_rotations(quats: NDArray[np.float32]) -> NDArray[np.uint32]:
    largest = np.abs(quats).argmax(axis=1)
    quats = quats * np.where(quats[np.arange(len(quats)), largest] < 0, -1, 1)[:, None]
    word = largest.astype(np.uint32)
    for part in range(4):
        bits = np.clip(np.rint((quats[:, part] * np.sqrt(0.5) + 0.5) * 1023), 0, 1023).astype(np.uint32)
        word = np.where(largest != part, word << np.uint32(10) | bits, word)
    return word
