"""glTF with Khronos' ``KHR_gaussian_splatting``: a point cloud whose attributes are splats.

glTF's y points up and a PLY's down: the writer turns the node by half a turn about z and leaves the numbers of the
splats as they are; the reader takes every node's turn, and takes that half turn back.
"""

import base64
import binascii
import json
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, BinaryIO
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.progress import Progress, no_progress, part_of
from splap_editor.core.splats.rotations import matrices_to_quats, quat_products, quats_to_matrices
from splap_editor.core.splats.splats import Splats
from splap_editor.io.formats.bare_splats import FAINT, OPAQUE, alphas_of, as_bytes, row_blocks
from splap_editor.io.formats.node_placement import is_in_bounds, turn_and_factor
from splap_editor.io.formats.source import LARGEST_FILE, Source
from splap_editor.io.formats.splat32 import log_scales_of
from splap_editor.io.json_object import parsed_json
from splap_editor.io.ply_table import PlyTable
from splap_editor.io.regular_file import MOST_TEXT_BYTES
from splap_editor.io.splat_cells import blank_table
from splap_editor.io.splat_columns import SH_C0

MAGIC = b"glTF"
EXTENSION = "KHR_gaussian_splatting"
COMPRESSION = "KHR_gaussian_splatting_compression_spz"
"""How the names of a proposed extension begin, which Khronos' registry did not hold on 17 July 2026 (77b44be)."""

_HALF_TURN = (0.0, 0.0, 1.0, 0.0)
"""Rotation x, y, z, w of our node: half a turn about z."""

_JSON, _BIN = b"JSON", b"BIN\0"
_TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}
_MOST_NODES = 1 << 16
_MOST_CLOUDS = 1 << 12
_LOOK_NODES = 256
_MOST_ATTRIBUTES = 20
"""Four, and a coefficient of the harmonics each."""

_BLOCK_BYTES = 1 << 22


@dataclass(frozen=True)
class _Cloud:
    """A primitive of splats, and where its node puts it."""

    attributes: dict[str, Any]
    world: NDArray[np.float64]
    n_splats: int
    degree: int


def is_text(start: bytes) -> bool:
    """Whether a file begins as a ``.gltf`` does."""
    return start.lstrip(b"\xef\xbb\xbf \t\r\n")[:1] == b"{" and b'"asset"' in start


def read(source: Source, progress: Progress) -> tuple[PlyTable, list[str]]:
    """Decode the splats of all nodes of the scene, one after the other.

    Raises
    ------
    FormatError
        If it is damaged, holds no splats, or holds them in a way that is not read.
    """
    document = _Document(source, progress)
    clouds: list[_Cloud] = []
    for cloud in _clouds(document, progress):
        if len(clouds) == _MOST_CLOUDS:
            raise source.damaged(f"it has more than {_MOST_CLOUDS:,} clouds of splats, or nodes within themselves")
        clouds.append(cloud)
    if not clouds:
        raise source.refused("holds no Gaussian splats", f"Choose a file with {EXTENSION} in it.")
    n_splats, degree = sum(cloud.n_splats for cloud in clouds), max(cloud.degree for cloud in clouds)
    n_coefficients = (degree + 1) ** 2 - 1
    source.require_room(8 * n_splats * (17 + 3 * n_coefficients))
    if n_splats == 0:
        raise source.refused("holds zero splats", "Choose a file with splats in it.")
    table, sheet = blank_table(source.name, n_splats, n_coefficients)
    done = 0
    for cloud in clouds:
        start, done = done, done + cloud.n_splats
        part = part_of(progress, start / n_splats, done / n_splats)
        _fill(sheet, slice(start, done), document, cloud, part)
    progress(1.0)
    warnings = []
    if document.held.get("animations") or document.held.get("skins"):
        warnings.append("Its animation is not read: these are the splats at rest.")
    return table, warnings


def buffers_beside(source: Source) -> list[str]:
    """Names of the files that a ``.gltf`` keeps its buffers in; a ``.glb`` holds its own.

    Raises
    ------
    FormatError
        If it is damaged.
    """
    buffers = _Document(source, no_progress).held.get("buffers")
    places = [held.get("uri") for held in buffers if isinstance(held, dict)] if isinstance(buffers, list) else []
    return [unquote(uri) for uri in places if isinstance(uri, str) and not uri.startswith("data:")]


class _Document:
    """The JSON of a glTF and its buffers."""

    def __init__(self, source: Source, progress: Progress) -> None:
        self.source = source
        self._progress = progress
        self._binary: memoryview | None = None
        text: bytes | memoryview = source.data
        if source.data[:4] == MAGIC:
            text = self._chunks()
        held = parsed_json(bytes(text), source.damaged, lambda: progress(0.0))
        if not isinstance(held, dict):
            raise source.damaged("its JSON is no object")
        self.held: dict[str, Any] = held
        self._buffers: dict[int, memoryview] = {}

    def _chunks(self) -> memoryview:
        """The JSON chunk of a ``.glb``; its binary chunk is kept."""
        version, length = self.source.unpack("<II", 4)
        if version != 2:
            raise self.source.refused(f"is glTF {version}, and glTF 2 is read", "Export it as glTF 2.")
        at, text = 12, None
        end = min(length, len(self.source.data))
        while at + 8 <= end:
            n_bytes, kind = self.source.unpack("<I4s", at)
            piece = self.source.piece(at + 8, n_bytes)
            if kind == _JSON and text is None:
                if n_bytes > MOST_TEXT_BYTES:
                    raise self.source.damaged(
                        f"its JSON has {n_bytes:,} bytes and at most {MOST_TEXT_BYTES:,} are read"
                    )
                text = piece
            elif kind == _BIN and self._binary is None:
                self._binary = piece
            at += 8 + n_bytes
        if text is None:
            raise self.source.cut_short()
        return text

    def item(self, kind: str, number: Any) -> dict[str, Any]:
        """An object of one of the lists."""
        held = self.held.get(kind)
        if isinstance(held, list) and isinstance(number, int) and 0 <= number < len(held):
            item = held[number]
            if isinstance(item, dict):
                return item
        raise self.source.damaged(f"it has no {kind} {str(number)[:40]}")

    def whole(self, item: dict[str, Any], key: str, default: int | None = None) -> int:
        """A number of an object that counts something."""
        value = item.get(key, default)
        if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < 1 << 48:
            raise self.source.damaged(f"{key} is {str(value)[:40]} in its JSON")
        return value

    def buffer(self, number: int) -> memoryview:
        """Bytes of a buffer: of the file itself, written into its JSON, or in a file beside it."""
        if number not in self._buffers:
            self._buffers[number] = self._loaded(number)
        return self._buffers[number]

    def _loaded(self, number: int) -> memoryview:
        uri = self.item("buffers", number).get("uri")
        if uri is None:
            if number or self._binary is None:
                raise self.source.damaged("a buffer says nowhere where its bytes are")
            return self._binary
        if not isinstance(uri, str):
            raise self.source.damaged("the place of a buffer is no text")
        if uri.startswith("data:"):
            try:
                return memoryview(base64.b64decode(uri.partition(",")[2], validate=True))
            except (binascii.Error, ValueError):
                raise self.source.damaged("the bytes of a buffer are not base64") from None
        return memoryview(self.source.beside(unquote(uri), LARGEST_FILE, lambda share: self._progress(0.0)))

    def numbers(self, accessor: int, width: int, name: str) -> NDArray:
        """(N, width) numbers of an accessor, as floats; normalised integers become shares."""
        item = self.item("accessors", accessor)
        component = self.whole(item, "componentType")
        if _WIDTHS.get(str(item.get("type"))) != width or component not in _TYPES:
            raise self.source.damaged(f"{name} is of the wrong type")
        if "sparse" in item or "bufferView" not in item:
            raise self.source.refused(f"keeps {name} in a sparse accessor, which is not read", "Export it without.")
        dtype = np.dtype(_TYPES[component])
        view = self.item("bufferViews", item["bufferView"])
        n, size = self.whole(item, "count"), dtype.itemsize * width
        start, length = self.whole(view, "byteOffset", 0), self.whole(view, "byteLength")
        stride = self.whole(view, "byteStride", 0) or size
        at = self.whole(item, "byteOffset", 0)
        data = self.buffer(self.whole(view, "buffer"))
        used = at + stride * (n - 1) + size if n else 0
        if stride < size or used > length or start + length > len(data):
            raise self.source.damaged(f"{name} reaches beyond its bytes")
        piece = np.frombuffer(data, np.uint8, used - at if n else 0, start + at)
        rows = np.lib.stride_tricks.as_strided(piece, (n, size), (stride, 1), writeable=False)
        values = np.ascontiguousarray(rows).view(dtype)
        if dtype.kind == "f" or not item.get("normalized"):
            return values.astype(np.float32, copy=False)
        return np.maximum(values.astype(np.float32) / np.iinfo(dtype).max, -1 if dtype.kind == "i" else 0)


def _clouds(document: _Document, progress: Progress) -> Iterator[_Cloud]:
    """Primitives of splats of the scene's nodes, in order."""
    if not document.held.get("scenes"):
        nodes = document.held.get("nodes")
        starts: Any = range(len(nodes)) if isinstance(nodes, list) else []
    else:
        starts = document.item("scenes", document.held.get("scene", 0)).get("nodes", [])
    if not isinstance(starts, list | range):
        raise document.source.damaged("its scene names no nodes")
    todo: list[tuple[Any, NDArray[np.float64]]] = []
    n_known = n_seen = 0

    def add(numbers: list[Any] | range, parent: NDArray[np.float64]) -> None:
        nonlocal n_known
        n_known += len(numbers)
        if n_known > _MOST_NODES:
            raise document.source.damaged(f"it has more than {_MOST_NODES:,} nodes, or nodes within themselves")
        todo.extend((number, parent) for number in reversed(numbers))

    add(starts, np.eye(4))
    while todo:
        if n_seen % _LOOK_NODES == 0:
            progress(0.0)
        n_seen += 1
        number, parent = todo.pop()
        node = document.item("nodes", number)
        world = parent @ _local(document, node)
        if not is_in_bounds(world):
            raise document.source.damaged("its nodes put things farther away than anything is read from")
        children = node.get("children", [])
        add(children if isinstance(children, list) else [], world)
        if "mesh" in node:
            primitives = document.item("meshes", node["mesh"]).get("primitives")
            for primitive in primitives if isinstance(primitives, list) else []:
                cloud = _cloud(document, primitive, world)
                if cloud is not None:
                    yield cloud


def _local(document: _Document, node: dict[str, Any]) -> NDArray[np.float64]:
    """Where a node puts what it holds."""

    def numbers(key: str, default: tuple[float, ...]) -> NDArray[np.float64]:
        value = node.get(key, default)
        good = isinstance(value, list | tuple) and len(value) == len(default)
        if not good or not all(isinstance(v, int | float) and abs(v) < 1e15 for v in value):
            raise document.source.damaged(f"a node has {key} of {str(value)[:40]}")
        return np.array(value, np.float64)

    if "matrix" in node:
        return numbers("matrix", tuple(np.eye(4).ravel())).reshape(4, 4).T
    x, y, z, w = numbers("rotation", (0, 0, 0, 1))
    local = np.eye(4)
    if x or y or z or w:
        local[:3, :3] = quats_to_matrices(np.array([[w, x, y, z]]))[0]
    local[:3, :3] *= numbers("scale", (1, 1, 1))
    local[:3, 3] = numbers("translation", (0, 0, 0))
    return local


def _cloud(document: _Document, primitive: Any, world: NDArray[np.float64]) -> _Cloud | None:
    """A primitive if it is of splats."""
    extensions = primitive.get("extensions") if isinstance(primitive, dict) else None
    held = extensions.get(EXTENSION) if isinstance(extensions, dict) else None
    if not isinstance(held, dict):
        return None
    within = held.get("extensions")
    if isinstance(within, dict) and any(str(name).startswith(COMPRESSION) for name in within):
        raise document.source.refused("holds splats packed as SPZ, which is not read", "Export it without compression.")
    attributes = primitive.get("attributes")
    if not isinstance(attributes, dict):
        raise document.source.damaged("its splats have no attributes")
    for name in ("POSITION", *(f"{EXTENSION}:{part}" for part in ("ROTATION", "SCALE", "OPACITY"))):
        if name not in attributes:
            raise document.source.damaged(f"its splats have no {name}")
    degree = 0
    while degree < 3 and f"{EXTENSION}:SH_DEGREE_{degree + 1}_COEF_0" in attributes:
        degree += 1
    n = document.whole(document.item("accessors", attributes["POSITION"]), "count")
    return _Cloud(attributes, world, n, degree)


def _fill(sheet: Splats, rows: slice, document: _Document, cloud: _Cloud, progress: Progress) -> None:
    """Write a primitive's splats to some rows, in the axes of a PLY."""
    n_read = 0

    def numbers(name: str, width: int) -> NDArray:
        nonlocal n_read
        progress(0.5 * n_read / _MOST_ATTRIBUTES)
        n_read += 1
        values = document.numbers(cloud.attributes[name], width, name)
        if len(values) != cloud.n_splats:
            raise document.source.damaged(f"{name} has {len(values):,} rows for {cloud.n_splats:,} splats")
        return values

    half_turn = np.diag([-1.0, -1.0, 1.0, 1.0])
    world = half_turn @ cloud.world
    placed = turn_and_factor(world)
    if placed is None:
        raise document.source.refused(
            "has a node that mirrors or stretches its splats", "Apply its scale, then export."
        )
    turn, factor = placed
    means, quats = numbers("POSITION", 3), numbers(f"{EXTENSION}:ROTATION", 4)[:, [3, 0, 1, 2]]
    n_coefficients = sheet.shN.shape[1]
    shN = np.zeros((cloud.n_splats, n_coefficients, 3), np.float32)
    at = 0
    for degree in range(1, cloud.degree + 1):
        for number in range(2 * degree + 1):
            name = f"{EXTENSION}:SH_DEGREE_{degree}_COEF_{number}"
            if name not in cloud.attributes:
                raise document.source.damaged(f"its splats have no {name}")
            shN[:, at] = numbers(name, 3)
            at += 1
    scales, alphas = numbers(f"{EXTENSION}:SCALE", 3), numbers(f"{EXTENSION}:OPACITY", 1)[:, 0]
    has_colors = f"{EXTENSION}:SH_DEGREE_0_COEF_0" in cloud.attributes
    colors = numbers(f"{EXTENSION}:SH_DEGREE_0_COEF_0", 3) if has_colors else None
    is_moved = np.abs(world - np.eye(4)).max() > 1e-12
    for block in row_blocks(cloud.n_splats, part_of(progress, 0.5, 1.0)):
        to = slice(rows.start + block.start, rows.start + block.stop)
        sheet.log_scales[to] = log_scales_of(scales[block]) + np.float32(np.log(factor))
        exact = alphas[block].astype(np.float64)
        sheet.logit_opacities[to] = np.clip(np.log(exact) - np.log1p(-exact), FAINT, OPAQUE)
        sheet.sh0[to] = 0 if colors is None else colors[block]
        parts = means[block], quats[block], shN[block]
        sheet.means[to], sheet.quats[to], sheet.shN[to] = _moved(*parts, world, turn) if is_moved else parts
    progress(1.0)


def _moved(
    means: NDArray, quats: NDArray, shN: NDArray, world: NDArray[np.float64], turn: NDArray[np.float64]
) -> tuple[NDArray, NDArray, NDArray]:
    """Splats where their node puts them; positions that overflow are refused by row."""
    means = means.astype(np.float64) @ world[:3, :3].T + world[:3, 3]
    quats = quat_products(matrices_to_quats(turn[None]), quats.astype(np.float64))
    if shN.shape[1]:
        from splap_editor.core.splats.spherical_harmonics import rotated_sh

        shN = rotated_sh(shN, np.broadcast_to(turn, (len(shN), 3, 3)))
    return means.astype(np.float32), quats.astype(np.float32), shN


def write(out: BinaryIO, splats: Splats, progress: Progress) -> None:
    """Encode bare splats as a ``.glb``, every number as a float."""
    builder = GlbBuilder()
    attributes = splat_attributes(builder, splats, part_of(progress, 0.0, 0.5))
    builder.write(out, splat_document(attributes), part_of(progress, 0.5, 1.0))
    progress(1.0)


class GlbBuilder:
    """Collects arrays for the binary chunk of a ``.glb``."""

    def __init__(self) -> None:
        self._pieces: list[NDArray] = []
        self._views: list[dict[str, Any]] = []
        self._accessors: list[dict[str, Any]] = []
        self._length = 0

    def add(self, values: NDArray, **more: Any) -> int:
        """Add an array, one row an element; gives the number of its accessor. ``more`` stands in the accessor."""
        values = np.ascontiguousarray(values)
        width = 1 if values.ndim == 1 else values.shape[1]
        types = {"<f4": 5126, "|u1": 5121, "<u2": 5123}
        kind = {1: "SCALAR", 3: "VEC3", 4: "VEC4", 16: "MAT4"}[width]
        self._views.append({"buffer": 0, "byteOffset": self._length, "byteLength": values.nbytes})
        component = types[values.dtype.str]
        view = len(self._views) - 1
        self._accessors.append(
            {"bufferView": view, "componentType": component, "count": len(values), "type": kind, **more}
        )
        self._pieces.append(values)
        self._length += values.nbytes + -values.nbytes % 4
        return len(self._accessors) - 1

    def write(self, out: BinaryIO, document: dict[str, Any], progress: Progress = no_progress) -> None:
        """Write the file, with accessors, views and buffer added to a document."""
        document |= {"accessors": self._accessors, "bufferViews": self._views}
        document["buffers"] = [{"byteLength": self._length}]
        text = json.dumps(document, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        out.write(struct.pack("<4sII", MAGIC, 2, 12 + 8 + len(text) + 8 + self._length))
        out.write(struct.pack("<I4s", len(text), _JSON) + text)
        out.write(struct.pack("<I4s", self._length, _BIN))
        done = 0
        for piece in self._pieces:
            held = piece.data.cast("B")
            for lo in range(0, len(held), _BLOCK_BYTES):
                out.write(held[lo : lo + _BLOCK_BYTES])
                progress((done + lo) / self._length)
            out.write(bytes(-piece.nbytes % 4))
            done += piece.nbytes


def splat_attributes(builder: GlbBuilder, splats: Splats, progress: Progress = no_progress) -> dict[str, int]:
    """Add the arrays of bare splats; gives the attributes of their primitive."""
    n = splats.n_splats
    means = splats.means.astype("<f4")
    alphas, colors = np.empty(n, "<f4"), np.empty((n, 4), np.uint8)
    quats, scales = np.empty((n, 4), "<f4"), np.empty((n, 3), "<f4")
    for rows in row_blocks(n, part_of(progress, 0.0, 0.3)):
        exact = alphas_of(splats.logit_opacities[rows])
        alphas[rows] = exact
        colors[rows] = as_bytes(np.column_stack([splats.sh0[rows] * SH_C0 + 0.5, exact]) * 255)
        quats[rows] = splats.quats[rows][:, [1, 2, 3, 0]]
        scales[rows] = np.exp(splats.log_scales[rows])
    bounds = {"min": means.min(axis=0).tolist(), "max": means.max(axis=0).tolist()}
    attributes = {
        "POSITION": builder.add(means, **bounds),
        "COLOR_0": builder.add(colors, normalized=True),
        f"{EXTENSION}:ROTATION": builder.add(quats),
        f"{EXTENSION}:SCALE": builder.add(scales),
        f"{EXTENSION}:OPACITY": builder.add(alphas),
        f"{EXTENSION}:SH_DEGREE_0_COEF_0": builder.add(splats.sh0.astype("<f4")),
    }
    progress(0.3)
    at = 0
    for degree in range(1, splats.sh_degree + 1):
        for number in range(2 * degree + 1):
            name = f"{EXTENSION}:SH_DEGREE_{degree}_COEF_{number}"
            attributes[name] = builder.add(splats.shN[:, at].astype("<f4"))
            at += 1
            progress(0.3 + 0.7 * at / splats.shN.shape[1])
    progress(1.0)
    return attributes


def splat_document(attributes: dict[str, int]) -> dict[str, Any]:
    """The JSON of a glTF with one primitive of splats, in node 0."""
    held = {
        "kernel": "ellipse",
        "colorSpace": "srgb_rec709_display",
        "sortingMethod": "cameraDistance",
        "projection": "perspective",
    }
    primitive = {"attributes": attributes, "mode": 0, "extensions": {EXTENSION: held}}
    return {
        "asset": {"version": "2.0", "generator": "SpLap Editor"},
        "extensionsUsed": [EXTENSION],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "rotation": list(_HALF_TURN)}],
        "meshes": [{"primitives": [primitive]}],
    }
