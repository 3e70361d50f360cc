"""PlayCanvas' SOG: lossless WebP pictures, each pixel a splat, numbers through tables of 256 values.

The pictures stand beside a ``meta.json``, in a zip or in a folder.
"""

import io
import json
import math
import zipfile
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, BinaryIO, TypeVar

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.progress import Cancelled, Progress, no_progress, part_of
from splap_editor.core.splats.morton import morton_order
from splap_editor.core.splats.splats import Splats
from splap_editor.io.formats.bare_splats import alphas_of, as_bytes, logits_of_bytes, row_blocks
from splap_editor.io.formats.palettes import codebook, palette
from splap_editor.io.formats.source import FormatError, Source
from splap_editor.io.ply_table import PlyTable
from splap_editor.io.splat_cells import blank_table

Result = TypeVar("Result")

_WIDTHS = {3: 192, 8: 512, 15: 960}
"""Pixels across a palette, 64 entries side by side, by the coefficients of an entry."""
_PARTS, _MARKS = (b'"means"', b'"scales"', b'"quats"', b'"sh0"', b'"shN"'), (b'.webp"', b'"codebook"', b'"mins"')
_LARGEST_META = 1 << 22
LARGEST_PICTURE = 1 << 30
_IDENTITY_BELOW = 252
"""Fourth channels of rotations below this name no largest part."""


def read(source: Source, progress: Progress) -> tuple[PlyTable, list[str]]:
    """Decode a SOG of version 1 or 2.

    Raises
    ------
    FormatError
        If it is damaged, or of a newer version.
    """
    return _read(_Bundle(source), progress)


def read_folder(source: Source, progress: Progress) -> tuple[PlyTable, list[str]]:
    """Decode a SOG whose pictures are files beside its ``meta.json``; errors as of `read`."""
    told = 0.0

    def rising(share: float) -> None:
        nonlocal told
        told = max(told, share)
        progress(told)

    return _read(_Folder(source, lambda share: rising(0.0)), rising)


def pictures_beside(source: Source) -> list[str]:
    """Names of the pictures that a ``meta.json`` of a SOG goes by.

    Raises
    ------
    FormatError
        If it is damaged.
    """
    folder = _Folder(source, no_progress)
    meta = folder.meta()
    least = {"means": 2, "scales": 1, "quats": 1, "sh0": 1, "shN": 2}
    parts = [part for part in least if part != "shN" or meta.get(part)]
    return [name for part in parts for name in _files(folder, meta, part, least[part])]


def is_meta(start: bytes) -> bool:
    """Whether a file begins as the ``meta.json`` of a SOG does."""
    is_text = start.lstrip(b"\xef\xbb\xbf \t\r\n")[:1] == b"{"
    return is_text and any(part in start for part in _PARTS) and any(mark in start for mark in _MARKS)


def _read(archive: "_Archive", progress: Progress) -> tuple[PlyTable, list[str]]:
    source = archive.source
    meta = archive.meta()
    version = meta.get("version", 1)
    if version not in (1, 2):
        raise source.refused(f"is a SOG of version {version!r}, and versions 1 and 2 are read", "Export it as one.")
    count = meta.get("count") if version == 2 else _first(meta, "means", "shape")
    if not isinstance(count, int) or isinstance(count, bool) or not 0 <= count < 1 << 28:
        raise source.damaged("it does not say how many splats it holds")
    if count == 0:
        raise source.refused("holds zero splats", "Choose a file with splats in it.")
    harmonics = _harmonics(archive, meta, count, version)
    n_coefficients = 0 if harmonics is None else harmonics[1].shape[1]
    source.require_room(4 * count * (17 + 3 * n_coefficients))
    table, sheet = blank_table(source.name, count, n_coefficients)
    progress(0.1)
    _fill_means(sheet, archive, meta, part_of(progress, 0.1, 0.4))
    quats = archive.pixels(_files(archive, meta, "quats", 1)[0], count)
    for rows in row_blocks(count, part_of(progress, 0.4, 0.5)):
        sheet.quats[rows] = _rotations(quats[rows])
    scales = archive.pixels(_files(archive, meta, "scales", 1)[0], count)
    progress(0.5)
    colors = archive.pixels(_files(archive, meta, "sh0", 1)[0], count)
    tables = [
        _tables(archive, meta, name, version, n) for name, n in (("scales", 3), ("sh0", 3 if version == 2 else 4))
    ]
    logits = logits_of_bytes() if version == 2 else tables[1][3]
    for rows in row_blocks(count, part_of(progress, 0.6, 0.7)):
        for c in range(3):
            sheet.log_scales[rows, c] = tables[0][c][scales[rows, c]]
            sheet.sh0[rows, c] = tables[1][c][colors[rows, c]]
        sheet.logit_opacities[rows] = logits[colors[rows, 3]]
    if harmonics is not None:
        labels, entries = harmonics
        # A label beyond the palette, of which some writers have a few, shows no view-dependence.
        entries = np.concatenate([entries, np.zeros((1, n_coefficients, 3), np.float32)])
        for rows in row_blocks(count, part_of(progress, 0.7, 1.0)):
            sheet.shN[rows] = entries[labels[rows]]
    progress(1.0)
    return table, []


class _Archive(ABC):
    """The pictures of a SOG."""

    def __init__(self, source: Source) -> None:
        self.source = source

    def _guarded(self, call: Callable[[], Result]) -> Result:
        try:
            return call()
        except (FormatError, Cancelled, MemoryError):
            raise
        # zipfile, zlib and pillow raise a dozen kinds, and each version its own.
        except Exception as error:
            raise self.source.damaged(f"its bytes do not unpack ({type(error).__name__})") from error

    @abstractmethod
    def member(self, name: str, most_bytes: int) -> bytes:
        """Bytes of a member of at most that size."""

    def meta(self) -> dict[str, Any]:
        """What ``meta.json`` says."""
        found = self._guarded(lambda: json.loads(self.member("meta.json", _LARGEST_META)))
        if not isinstance(found, dict):
            raise self.source.damaged("its meta.json is no object")
        return found

    def pixels(self, name: str, count: int) -> NDArray[np.uint8]:
        """(count, 4) first pixels of a picture."""
        return self.picture(name, count).reshape(-1, 4)[:count]

    def picture(self, name: str, at_least: int) -> NDArray[np.uint8]:
        """(height, width, 4) pixels; no larger ones are unpacked than the splats call for."""
        from PIL import Image

        data = self.member(name, LARGEST_PICTURE)
        width, height = self._size(data, name)
        if not at_least <= width * height <= 4 * at_least + (1 << 20):
            raise self.source.damaged(f"{name[:80]!r} has {width:,} × {height:,} pixels for {at_least:,} splats")

        def unpacked() -> NDArray[np.uint8]:
            with Image.open(io.BytesIO(data), formats=("WEBP",)) as image:
                return np.asarray(image if image.mode == "RGBA" else image.convert("RGBA"))

        found = self._guarded(unpacked)
        if found.shape != (height, width, 4):
            raise self.source.damaged(f"{name[:80]!r} is not as large as it says")
        return found

    def _size(self, data: bytes, name: str) -> tuple[int, int]:
        """Width and height of a lossless WebP, before anything of that size is made."""
        if data[:4] == b"RIFF" and data[8:12] == b"WEBP" and len(data) >= 30:
            if data[12:16] == b"VP8L" and data[20] == 0x2F:
                bits = int.from_bytes(data[21:25], "little")
                return (bits & 0x3FFF) + 1, (bits >> 14 & 0x3FFF) + 1
            if data[12:16] == b"VP8X":
                return int.from_bytes(data[24:27], "little") + 1, int.from_bytes(data[27:30], "little") + 1
        raise self.source.damaged(f"{name[:80]!r} is no lossless WebP")


class _Bundle(_Archive):
    """All in a zip."""

    def __init__(self, source: Source) -> None:
        super().__init__(source)
        self._zip = self._guarded(lambda: zipfile.ZipFile(io.BytesIO(source.data)))
        self._members = {info.filename: info for info in self._zip.infolist()}

    def member(self, name: str, most_bytes: int) -> bytes:
        """Bytes of a member of at most that size."""
        info = self._members.get(name)
        if info is None:
            raise self.source.damaged(f"it holds no {name[:80]!r}")
        if info.file_size > most_bytes:
            raise self.source.damaged(f"{name[:80]!r} is larger than {most_bytes:,} bytes")
        return self._guarded(lambda: self._zip.read(info))


class _Folder(_Archive):
    """Files beside each other; ``progress`` is asked while they are read."""

    def __init__(self, source: Source, progress: Progress) -> None:
        super().__init__(source)
        self._progress = progress

    def member(self, name: str, most_bytes: int) -> bytes:
        """Bytes of a file of at most that size."""
        # Of any name, the words are those of the file that was opened.
        return self.source.beside(self.source.name if name == "meta.json" else name, most_bytes, self._progress)


def _files(archive: _Archive, meta: dict[str, Any], part: str, n: int) -> list[str]:
    """Names of a part's pictures."""
    held = meta.get(part)
    files = held.get("files") if isinstance(held, dict) else None
    if not isinstance(files, list) or len(files) < n or not all(isinstance(name, str) for name in files):
        raise archive.source.damaged(f"its meta.json does not say where its {part} are")
    return files


def _first(meta: dict[str, Any], part: str, key: str) -> Any:
    held = meta.get(part)
    value = held.get(key) if isinstance(held, dict) else None
    return value[0] if isinstance(value, list) and value else None


def _numbers(archive: _Archive, meta: dict[str, Any], part: str, key: str, n: int) -> NDArray[np.float64]:
    """Numbers of a part; a single one stands for a list of one."""
    value = meta[part].get(key)
    value = [value] if n == 1 and not isinstance(value, list) else value
    good = isinstance(value, list) and len(value) >= n
    if not good or not all(isinstance(v, int | float) and abs(v) < 1e30 for v in value[:n]):
        raise archive.source.damaged(f"its meta.json does not give {n} numbers as {key} of its {part}")
    return np.array(value[:n], np.float64)


def _tables(archive: _Archive, meta: dict[str, Any], part: str, version: int, n: int) -> list[NDArray[np.float32]]:
    """What each byte stands for, channel by channel."""
    if version == 2:
        known = meta[part].get("codebook")
        size = len(known) if isinstance(known, list) else 0
        if not 0 < size <= 256:
            raise archive.source.damaged(f"its meta.json has no table of up to 256 values for its {part}")
        values = np.zeros(256, np.float32)
        values[:size] = _numbers(archive, meta, part, "codebook", size)
        return [values] * n
    low, high = (_numbers(archive, meta, part, key, n) for key in ("mins", "maxs"))
    return [np.linspace(a, b, 256).astype(np.float32) for a, b in zip(low, high, strict=True)]


def _fill_means(sheet: Splats, archive: _Archive, meta: dict[str, Any], progress: Progress) -> None:
    """Positions: 16 bits between bounds, on a scale that is linear near the origin and logarithmic far from it."""
    low_name, high_name = _files(archive, meta, "means", 2)[:2]
    low = archive.pixels(low_name, sheet.n_splats)
    progress(0.3)
    high = archive.pixels(high_name, sheet.n_splats)
    least, most = (_numbers(archive, meta, "means", key, 3) for key in ("mins", "maxs"))
    for rows in row_blocks(sheet.n_splats, part_of(progress, 0.6, 1.0)):
        for c in range(3):
            share = (low[rows, c] + high[rows, c].astype(np.uint16) * 256) / 65535
            value = least[c] + ((most[c] - least[c]) or 1.0) * share
            sheet.means[rows, c] = np.sign(value) * np.expm1(np.abs(value))


def _rotations(pixels: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Rotations w, x, y, z: three parts of eight bits, the number of the largest part in the fourth channel."""
    three = (pixels[:, :3].astype(np.float32) / 127.5 - 1) * np.float32(np.sqrt(0.5))
    largest = pixels[:, 3].astype(np.intp) - _IDENTITY_BELOW
    three[largest < 0] = 0
    largest = np.maximum(largest, 0)
    quats = np.empty((len(pixels), 4), np.float32)
    for which in range(4):
        rows = largest == which
        quats[rows, which] = np.sqrt(np.maximum(1 - (three[rows] ** 2).sum(axis=1), 0))
        quats[np.ix_(rows, [c for c in range(4) if c != which])] = three[rows]
    return quats


def _harmonics(
    archive: _Archive, meta: dict[str, Any], count: int, version: int
) -> tuple[NDArray[np.intp], NDArray[np.float32]] | None:
    """Which palette entry each splat has, and the (P, K, 3) entries; None without view-dependent colour."""
    if not meta.get("shN"):
        return None
    entries_name, labels_name = _files(archive, meta, "shN", 2)[:2]
    labels = archive.pixels(labels_name, count).astype(np.intp)
    labels = labels[:, 0] + 256 * labels[:, 1]
    n_held = meta["shN"].get("count", 1 << 16) if version == 2 else 1 << 16
    if not isinstance(n_held, int) or not 0 < n_held <= 1 << 16:
        raise archive.source.damaged("it does not say how many palette entries it has")
    picture = archive.picture(entries_name, 1)
    height, width, _ = picture.shape
    n_coefficients = next((k for k, w in _WIDTHS.items() if w == width), 0)
    if n_coefficients == 0:
        raise archive.source.damaged(f"a palette cannot be {width:,} pixels wide")
    values = _tables(archive, meta, "shN", version, 1)[0]
    entries = values[picture[:, :, :3]].reshape(height * 64, n_coefficients, 3).astype(np.float32)
    entries = entries[:n_held]
    return np.minimum(labels, len(entries)), entries


def write(out: BinaryIO, splats: Splats, progress: Progress) -> None:
    """Encode bare splats as version 2, rows along a Z-order curve so that neighbours in a picture are alike."""
    share = 0.0

    def told(done: float) -> None:
        nonlocal share
        share = done
        progress(share)

    def again() -> None:
        progress(share)

    order = morton_order(splats.means.astype(np.float64))
    n = splats.n_splats
    width = math.ceil(math.sqrt(n) / 4) * 4
    height = math.ceil(n / width / 4) * 4
    meta: dict[str, Any] = {"version": 2, "asset": {"generator": "SpLap Editor"}, "count": n}
    with zipfile.ZipFile(out, "w", zipfile.ZIP_STORED) as archive:

        def put(name: str, pixels: NDArray[np.uint8], size: tuple[int, int] = (width, height)) -> str:
            full = np.zeros((size[0] * size[1], 4), np.uint8)
            full[:, 3] = 255
            full[: len(pixels), : pixels.shape[1]] = pixels
            again()
            # A fixed date: the same splats give the same bytes.
            archive.writestr(zipfile.ZipInfo(name), _webp(full.reshape(size[1], size[0], 4)))
            return name

        meta["means"] = _put_means(put, splats.means, order, part_of(told, 0.0, 0.2))
        rotations = np.empty((n, 4), np.uint8)
        for rows in row_blocks(n, part_of(told, 0.2, 0.25)):
            rotations[rows] = _packed_rotations(splats.quats[order[rows]])
        meta["quats"] = {"files": [put("quats.webp", rotations)]}
        told(0.3)
        values, labels = codebook(splats.log_scales[order], part_of(told, 0.3, 0.35))
        meta["scales"] = {"codebook": values.tolist(), "files": [put("scales.webp", labels)]}
        told(0.4)
        values, labels = codebook(splats.sh0[order], part_of(told, 0.4, 0.45))
        alphas = as_bytes(alphas_of(splats.logit_opacities[order]) * 255)
        pixels = np.column_stack([labels, alphas])
        meta["sh0"] = {"codebook": values.tolist(), "files": [put("sh0.webp", pixels)]}
        if splats.shN.shape[1]:
            meta["shN"] = _put_harmonics(put, splats.shN, order, part_of(told, 0.5, 0.95))
        archive.writestr(zipfile.ZipInfo("meta.json"), json.dumps(meta))
    progress(1.0)


def _put_means(
    put: Callable[..., str], means: NDArray[np.float32], order: NDArray[np.int64], progress: Progress
) -> dict[str, Any]:
    """Write positions, low bytes and high ones; what ``meta.json`` says of them."""
    logarithms = np.empty((len(order), 3))
    for rows in row_blocks(len(order), part_of(progress, 0.0, 0.4)):
        exact = means[order[rows]].astype(np.float64)
        logarithms[rows] = np.sign(exact) * np.log1p(np.abs(exact))
    low, high = logarithms.min(axis=0), logarithms.max(axis=0)
    width = np.where(high > low, high - low, 1)
    cells = np.empty((len(order), 3), np.uint16)
    for rows in row_blocks(len(order), part_of(progress, 0.4, 0.6)):
        cells[rows] = np.rint(65535 * (logarithms[rows] - low) / width)
    names = [put("means_l.webp", (cells & 255).astype(np.uint8))]
    progress(0.8)
    names.append(put("means_u.webp", (cells >> 8).astype(np.uint8)))
    progress(1.0)
    return {"mins": low.tolist(), "maxs": high.tolist(), "files": names}


def _put_harmonics(
    put: Callable[..., str], shN: NDArray[np.float32], order: NDArray[np.int64], progress: Progress
) -> dict[str, Any]:
    """Write palette and labels; what ``meta.json`` says of them."""
    n, n_coefficients, _ = shN.shape
    vectors = np.empty((n, 3 * n_coefficients), np.float32)
    for rows in row_blocks(n, part_of(progress, 0.0, 0.1)):
        vectors[rows] = shN[order[rows]].reshape(-1, 3 * n_coefficients)
    entries, chosen = palette(vectors, part_of(progress, 0.1, 0.8))
    values, labels = codebook(entries, part_of(progress, 0.8, 0.85))
    n_lines = math.ceil(len(entries) / 64)
    names = [put("shN_centroids.webp", labels.reshape(-1, 3), (64 * n_coefficients, n_lines))]
    progress(0.9)
    pixels = np.column_stack([chosen & 255, chosen >> 8, np.zeros(n, chosen.dtype)]).astype(np.uint8)
    names.append(put("shN_labels.webp", pixels))
    degree = math.isqrt(n_coefficients + 1) - 1
    return {"count": len(entries), "bands": degree, "codebook": values.tolist(), "files": names}


def _packed_rotations(quats: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Inverse of `_rotations`."""
    largest = np.abs(quats).argmax(axis=1)
    rows = np.arange(len(quats))
    quats = quats * np.where(quats[rows, largest] < 0, -1, 1)[:, None]
    others = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])[largest]
    three = np.take_along_axis(quats, others, axis=1)
    return np.column_stack([as_bytes((three * np.sqrt(2) + 1) * 127.5), (largest + _IDENTITY_BELOW).astype(np.uint8)])


def _webp(pixels: NDArray[np.uint8]) -> bytes:
    from PIL import Image

    out = io.BytesIO()
    # Without "exact", colours under an opacity of zero would be changed. Of captures, more effort than this saves no
    # hundredth of the bytes and takes five times as long, of which nobody hears anything.
    Image.fromarray(pixels).save(out, "WEBP", lossless=True, exact=True, quality=0, method=1)
    return out.getvalue()
