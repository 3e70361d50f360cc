"""Niantic's SPZ: numbers of one to four bytes in columns, packed by gzip (versions 1 to 3) or zstd (version 4).

The axes of an SPZ are those of OpenGL (y up, z backward) by its specification, those of a PLY point down and
forward: y and z change their sign on the way, and with them the harmonics that are odd in them.
"""

import struct
import zlib
from collections.abc import Iterator
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.progress import Progress, part_of
from splap_editor.core.splats.splats import Splats
from splap_editor.io.formats.bare_splats import alphas_of, as_bytes, logits_of_bytes
from splap_editor.io.formats.source import FormatError, Source
from splap_editor.io.ply_table import PlyTable
from splap_editor.io.splat_cells import blank_table

MAGIC = b"NGSP"
GZIP = b"\x1f\x8b"
LARGEST_DEGREE = 4
_HEAD = "<4sIIBBBB"
_ROTATION_BYTES = {1: 3, 2: 3, 3: 4, 4: 4}
_COLOR_SCALE = 0.15
_BLOCK_ROWS = 1 << 15
_CHUNK = 1 << 20
_PACKED_AT_ONCE = 1 << 18
"""Bytes that are packed in less than a tenth of a second."""

_GZIP_RATIO = 1040
"""No gzip member unpacks to more than this times its bytes."""

_FLIPS = np.array([-1, -1, 1, -1, 1, 1, -1, 1, -1, 1, -1, -1, 1, -1, 1, -1, 1, -1, 1, 1, -1, 1, -1, 1], np.float32)
"""Signs that harmonics of degrees 1 to 4 take when y and z are turned round."""

LOG_SCALES = -10.0, 255 / 16 - 10
"""Smallest and largest log-scale that a byte stands for."""

MOST_FRACTIONAL_BITS = 16
LARGEST_COORDINATE = float((1 << 23) - 1)


def read(source: Source, progress: Progress) -> tuple[PlyTable, list[str]]:
    """Decode an SPZ of any version.

    Raises
    ------
    FormatError
        If it is damaged or of a newer version.
    """
    if source.head(2) == GZIP:
        head, columns = _gunzipped(source, part_of(progress, 0.0, 0.6))
    else:
        head, columns = _unzstd(source, part_of(progress, 0.0, 0.6))
    table, sheet = blank_table(source.name, head.n_splats, head.n_coefficients)
    _fill(sheet, head, columns, part_of(progress, 0.6, 1.0))
    return table, []


class _Head:
    """The numbers at the start of an SPZ, checked."""

    def __init__(self, source: Source, data: bytes) -> None:
        if len(data) < struct.calcsize(_HEAD):
            raise source.cut_short()
        magic, self.version, self.n_splats, self.degree, self.fractional_bits, _, self.n_streams = struct.unpack_from(
            _HEAD, data
        )
        if magic != MAGIC:
            raise source.damaged("it does not begin as an SPZ does")
        if self.version not in _ROTATION_BYTES:
            raise source.refused(
                f"is an SPZ of version {self.version}, and versions 1 to 4 are read", "Export it as one of them."
            )
        if self.degree > LARGEST_DEGREE:
            raise source.damaged(f"no SPZ has harmonics of degree {self.degree}")
        if self.fractional_bits > 24:
            raise source.damaged(f"positions of 24 bits cannot have {self.fractional_bits} of them after the point")
        if self.n_splats == 0:
            raise source.refused("holds zero splats", "Choose a file with splats in it.")
        source.require_room(self.n_splats * (4 * (17 + 3 * self.n_coefficients) + sum(self.widths)))

    @property
    def n_coefficients(self) -> int:
        return (self.degree + 1) ** 2 - 1

    @property
    def widths(self) -> tuple[int, ...]:
        """Bytes a splat of positions, opacities, colours, scales, rotations and harmonics."""
        return (6 if self.version == 1 else 9, 1, 3, 3, _ROTATION_BYTES[self.version], 3 * self.n_coefficients)


def _gunzipped(source: Source, progress: Progress) -> tuple[_Head, list[NDArray[np.uint8]]]:
    """Head and columns of versions 1 to 3; no more is unpacked than the head promises."""
    packed = source.data
    unpacker = zlib.decompressobj(wbits=31)
    try:
        start = unpacker.decompress(packed, struct.calcsize(_HEAD))
        head = _Head(source, start)
        wanted = head.n_splats * sum(head.widths)
        if wanted > _GZIP_RATIO * len(packed) or head.version == 4:
            raise source.damaged(f"its {len(packed):,} bytes cannot hold {head.n_splats:,} splats")
        body = np.empty(wanted, np.uint8)
        done = 0
        while done < wanted:
            piece = unpacker.decompress(unpacker.unconsumed_tail, min(4 * _CHUNK, wanted - done))
            if not piece:
                raise source.cut_short()
            body[done : done + len(piece)] = np.frombuffer(piece, np.uint8)
            done += len(piece)
            progress(done / wanted)
    except zlib.error:
        raise source.damaged("its bytes do not unpack") from None
    ends = head.n_splats * np.cumsum(head.widths)
    return head, [body[end - head.n_splats * width : end] for end, width in zip(ends, head.widths, strict=True)]


def _unzstd(source: Source, progress: Progress) -> tuple[_Head, list[NDArray[np.uint8]]]:
    """Head and columns of version 4, each a stream of its own whose sizes stand in a table."""
    from zstandard import ZstdDecompressor, ZstdError

    head = _Head(source, source.data[:32])
    if head.version != 4:
        raise source.damaged(f"version {head.version} is packed by gzip, and this is not")
    (at,) = source.unpack("<I", 16)
    widths = [width for width in head.widths if width]
    if head.n_streams != len(widths):
        raise source.damaged(f"it has {head.n_streams} streams and needs {len(widths)}")
    start = at + 16 * len(widths)
    columns = []
    for number, width in enumerate(widths):
        n_packed, n_bytes = source.unpack("<QQ", at + 16 * number)
        if n_bytes != head.n_splats * width:
            raise source.damaged(f"one of its streams has {n_bytes:,} bytes and needs {head.n_splats * width:,}")
        column = np.empty(n_bytes, np.uint8)
        try:
            with ZstdDecompressor().stream_reader(source.piece(start, n_packed)) as stream:
                done = 0
                while done < n_bytes:
                    piece = stream.read(min(4 * _CHUNK, n_bytes - done))
                    if not piece:
                        raise source.cut_short()
                    column[done : done + len(piece)] = np.frombuffer(piece, np.uint8)
                    done += len(piece)
                    progress((number + done / n_bytes) / len(widths))
        except ZstdError:
            raise source.damaged("its bytes do not unpack") from None
        columns.append(column)
        start += n_packed
    columns += [np.empty(0, np.uint8)] * (len(head.widths) - len(columns))
    return head, columns


def _fill(sheet: Splats, head: _Head, columns: list[NDArray[np.uint8]], progress: Progress) -> None:
    """Write what the columns stand for, block by block."""
    positions, opacities, colors, scales, rotations, harmonics = (
        column.reshape(head.n_splats, width) for column, width in zip(columns, head.widths, strict=True)
    )
    byte = np.arange(256)
    logits = logits_of_bytes()
    color = ((byte / 255 - 0.5) / _COLOR_SCALE).astype(np.float32)
    scale = (byte / 16 - 10).astype(np.float32)
    coefficient = ((byte - 128) / 128).astype(np.float32)
    flips = _FLIPS[: head.n_coefficients]
    for lo in range(0, head.n_splats, _BLOCK_ROWS):
        rows = slice(lo, lo + _BLOCK_ROWS)
        sheet.means[rows] = _positions(positions[rows], head)
        sheet.logit_opacities[rows] = logits[opacities[rows, 0]]
        sheet.sh0[rows] = color[colors[rows]]
        sheet.log_scales[rows] = scale[scales[rows]]
        sheet.quats[rows] = _first_three(rotations[rows]) if head.version < 3 else _smallest_three(rotations[rows])
        # A coefficient's three channels are neighbours in the file, and a channel's coefficients in the table.
        coefficients = coefficient[harmonics[rows]].reshape(len(harmonics[rows]), head.n_coefficients, 3)
        for c in range(3):
            np.multiply(coefficients[:, :, c], flips, out=sheet.shN[rows, :, c])
        progress(min((lo + _BLOCK_ROWS) / head.n_splats, 1.0))


def _positions(packed: NDArray[np.uint8], head: _Head) -> NDArray[np.float32]:
    """Positions in the axes of a PLY, of half floats in version 1 and of fixed point after it."""
    if head.version == 1:
        means = np.ascontiguousarray(packed).view("<f2").astype(np.float32)
    else:
        wide = np.zeros((len(packed), 3, 4), np.uint8)
        wide[:, :, 1:] = packed.reshape(-1, 3, 3)
        # The sign is in the highest of the three bytes.
        fixed = wide.view("<i4")[:, :, 0] >> 8
        means = fixed.astype(np.float32) * np.float32(2.0**-head.fractional_bits)
    means *= np.array([1, -1, -1], np.float32)
    return means


def _first_three(packed: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Rotations w, x, y, z in the axes of a PLY, of x, y and z as bytes."""
    three = packed.astype(np.float32) / 127.5 - 1
    w = np.sqrt(np.maximum(1 - np.einsum("nc,nc->n", three, three), 0))
    return np.column_stack([w, three * np.array([1, -1, -1], np.float32)])


def _smallest_three(packed: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Rotations w, x, y, z in the axes of a PLY, of the three smallest parts with ten bits each."""
    word = np.ascontiguousarray(packed).view("<u4")[:, 0]
    largest = word >> 30
    quats = np.empty((len(word), 4), np.float32)
    rest = np.zeros(len(word), np.float32)
    step = np.float32(np.sqrt(0.5) / 511)
    # From z down to x, then w: each part takes the lowest bits left, but for the largest.
    for part in (3, 2, 1, 0):
        held = largest != part
        value = (word & 511).astype(np.float32) * step
        np.negative(value, out=value, where=(word & 512) != 0)
        value *= held
        rest += value * value
        quats[:, part] = value
        word = np.where(held, word >> 10, word)
    quats[np.arange(len(word)), largest] = np.sqrt(np.maximum(1 - rest, 0))
    # x, y, z, w in the file.
    return quats[:, [3, 0, 1, 2]] * np.array([1, 1, -1, -1], np.float32)


def write(out: BinaryIO, splats: Splats, progress: Progress) -> None:
    """Encode bare splats as version 3, which every reader of SPZ knows.

    Positions get as many bits after the point as the largest of them leaves room for, at most 16; harmonics are
    rounded to 5 bits in degree 1 and to 4 above it, as Niantic's own writer does.

    Raises
    ------
    FormatError
        If a position is too far from the origin.
    """
    reach = float(np.abs(splats.means).max())
    if reach > LARGEST_COORDINATE:
        raise FormatError(
            f"an SPZ holds positions up to {LARGEST_COORDINATE:,.0f} and one of these is {reach:,.0f} from the origin. "
            "Save it as a PLY."
        )
    bits = MOST_FRACTIONAL_BITS
    while np.rint(reach * 2.0**bits) > LARGEST_COORDINATE:
        bits -= 1
    packer = zlib.compressobj(6, zlib.DEFLATED, 31)
    head = struct.pack(_HEAD, MAGIC, 3, splats.n_splats, splats.sh_degree, bits, 0, 0)
    out.write(packer.compress(head))
    n_blocks = 6 * -(-splats.n_splats // _BLOCK_ROWS)
    for done, block in enumerate(_blocks(splats, bits)):
        held = memoryview(block.tobytes())
        for lo in range(0, len(held), _PACKED_AT_ONCE):
            out.write(packer.compress(held[lo : lo + _PACKED_AT_ONCE]))
            progress((done + min((lo + _PACKED_AT_ONCE) / len(held), 1.0)) / n_blocks)
    out.write(packer.flush())


def _blocks(splats: Splats, bits: int) -> Iterator[NDArray[np.uint8]]:
    """Bytes of the columns, one after the other."""
    starts = range(0, splats.n_splats, _BLOCK_ROWS)
    blocks = [slice(lo, lo + _BLOCK_ROWS) for lo in starts]
    for rows in blocks:
        fixed = np.rint(splats.means[rows].astype(np.float64) * [1, -1, -1] * 2.0**bits).astype("<i4")
        yield np.ascontiguousarray(fixed[:, :, None].view(np.uint8)[:, :, :3])
    for rows in blocks:
        yield as_bytes(alphas_of(splats.logit_opacities[rows]) * 255)
    for rows in blocks:
        yield as_bytes((splats.sh0[rows] * _COLOR_SCALE + 0.5) * 255)
    for rows in blocks:
        yield as_bytes((splats.log_scales[rows] + 10) * 16)
    for rows in blocks:
        yield _packed_rotations(splats.quats[rows])
    n_coefficients = splats.shN.shape[1]
    steps = np.where(np.arange(n_coefficients) < 3, 8, 16)[:, None]
    for rows in blocks:
        values = np.rint(splats.shN[rows] * _FLIPS[:n_coefficients, None] * 128 + 128)
        yield as_bytes(np.floor((values + steps // 2) / steps) * steps)


def _packed_rotations(quats: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Four bytes a rotation: which part is largest, and the other three with sign and nine bits."""
    parts = (quats * np.array([1, 1, -1, -1], np.float32))[:, [1, 2, 3, 0]]
    largest = np.abs(parts).argmax(axis=1)
    parts = parts * np.where(parts[np.arange(len(parts)), largest] < 0, -1, 1)[:, None]
    word = largest.astype(np.uint32)
    for part in range(4):
        held = largest != part
        size = np.clip(np.rint(np.abs(parts[:, part]) * (511 / np.sqrt(0.5))), 0, 511).astype(np.uint32)
        bits = size | np.where(parts[:, part] < 0, 512, 0).astype(np.uint32)
        word = np.where(held, word << np.uint32(10) | bits, word)
    return word.astype("<u4").view(np.uint8)
