"""Sound files that the mutations start from, each made from a number."""

import base64
import gzip
import json
import struct
import tempfile
from collections.abc import Callable
from functools import cache
from io import BytesIO
from pathlib import Path

import numpy as np
from hypothesis import strategies as st
from zstandard import ZstdCompressor

from splap_editor.core.progress import no_progress
from splap_editor.core.splats.splats import Splats
from splap_editor.io.formats.splat32 import RECORD
from splap_editor.io.formats.table import FORMATS as FORMATS_OF_SPLATS
from splap_editor.io.formats.table import SplatFormat
from tests.campaign.forks import forked, is_forked
from tests.reference.ply import compressed_bytes, ply_bytes, splat_columns

FORMATS = ("binary_little_endian", "binary_big_endian", "ascii")
BALL = {"center": [0, 0, 0], "radius": 0.5}


def odd_ply(number: int) -> bytes:
    """A splat file that no trainer would write, but some program might."""
    rng = np.random.default_rng(number)
    n = int(rng.integers(1, 12))
    columns = splat_columns(
        n,
        rng,
        n_scales=int(rng.integers(2, 4)),
        n_rest=int(rng.choice([0, 0, 9, 24])),
        normals=bool(rng.integers(2)),
        rgb=bool(rng.integers(2)),
    )
    if not rng.integers(4):
        columns["filter_3D"] = rng.random(n).astype("f4")
    if not rng.integers(4):
        columns["opacity"] = rng.random(n).astype("f4")
    if not rng.integers(3):
        columns["scale_2"] = np.full(n, -1e10, "f4")
    if not rng.integers(4):
        columns["bones"] = [np.arange(i % 4, dtype="i2") for i in range(n)]
    if rng.integers(2):
        name = str(rng.choice([name for name, values in columns.items() if isinstance(values, np.ndarray)]))
        columns[name] = np.clip(columns[name], -1e9, 1e9).astype(str(rng.choice(["f8", "i4", "f4"])))
    if rng.integers(2):
        columns = {name: columns[name] for name in rng.permutation(list(columns)).tolist()}
    faces = {"face": {"vertex_indices": [np.arange(i % 5, dtype="i4") for i in range(6)]}}
    camera = {"camera": {"focal": np.array([1.5, 2.5], "f8"), "id": np.array([1, 2], "u1")}}
    return ply_bytes(
        columns,
        str(rng.choice(FORMATS)),
        comments=("odd: \x0c ü",) if rng.integers(2) else (),
        newline=(b"\n", b"\r\n", b"\r")[int(rng.integers(3))],
        before=[None, None, camera][int(rng.integers(3))],
        after=[None, faces, camera][int(rng.integers(3))],
    )


odd_plys = st.integers(0, 2**32 - 1).map(odd_ply)
"""Hypothesis' way to the same files."""


@cache
def _packed(which: int) -> bytes:
    rng = np.random.default_rng(which)
    return compressed_bytes(splat_columns(3 + 40 * which, rng, n_rest=(0, 9, 24, 45)[which]))


def ply(number: int) -> bytes:
    """A PLY of splats in plain columns."""
    return odd_ply(number)


def compressed_ply(number: int) -> bytes:
    """SuperSplat's packed PLY, as we write it or as its reference does."""
    return _packed(number // 2 % 4) if number % 2 else _written("compressed-ply", number // 2 % 12)


def recipe(number: int) -> bytes:
    """A recipe with a bit of everything."""
    rng = np.random.default_rng(number)
    pose = {"translate": rng.normal(size=3).tolist(), "rotate": rng.normal(size=4).tolist(), "scale": 1.5}
    place = {"center": [0, 0, 0], "translate": rng.normal(size=3).tolist(), "rotate": rng.normal(size=4).tolist()}
    held = {
        "version": 1,
        "method": str(rng.choice(["arap", "bbw"])),
        "graph": {"rule": "touch", "epsilon": 0.005, "k": 12, "cut": [[0, 1]], "add": [[2, 3]]},
        "free_radius": None,
        "handles": [{"name": "ünï", **BALL, **pose}, {"rows": [0, 1, 2]}],
        "pins": [BALL, {"rows": [4]}],
        "solver": {"kind": "converged", "tolerance": 1e-4},
        "adaptation": "affine",
        "hops": 2,
    }
    if number % 3 == 1:
        apart = {"a": [rng.normal(size=3).tolist()], "b": [rng.normal(size=3).tolist(), [0, 0, 0]]}
        held["graph"] |= {"separate": [{**apart, "wider": 1}], "join": [{**apart, "reach": 0.5}], "carriers": "solid"}
        held["remove"] = _removals(rng)
        held["place"] = {**place, "scale": 2.0}
    if number % 3 == 2:
        names = str(rng.choice(["edges", "space", "mahalanobis"])), str(rng.choice(["stars", "robust"]))
        held["graph"] = {"neighborhood": names[0], "laplacian": names[1], "k": 5}
        held |= {"preset": "paper"} if number % 2 else {"blending": "linear", "adaptation": "paper"}
        held["remove"] = _removals(rng)[int(rng.integers(6))]
        ball = {"sphere": {"center": [0, 0, 0], "radius": 0.5}, "outside": bool(rng.integers(2)), "falloff": 0.2}
        held["grade"] = [{"exposure": 0.5, "contrast": 1.2, "opacity": 0.5}, {**ball, "hue": 90, "tint": -0.5}]
    return json.dumps(held).encode()


def _removals(rng: np.random.Generator) -> list[dict]:
    """One of each way to say what goes, some turned round."""
    center = rng.normal(size=3).tolist()
    return [
        {"rows": [0, 7]},
        {"box": {"center": center, "size": [4, 4, 4], "rotate": rng.normal(size=4).tolist()}, "outside": True},
        {"sphere": {"center": center, "radius": 0.2}},
        {"plane": {"point": [0, 0, -2], "normal": [0, 0, -1]}},
        {"quantity": {"name": "alpha", "least": 0.0, "most": 0.01}, "restore": bool(rng.integers(2))},
        {"floaters": {"strength": 0.3}},
    ]


def session(number: int) -> bytes:
    """A session with a bit of everything."""
    held = {
        "format": "splap-session",
        "version": 1,
        "ply": {"path": "scene.ply", "hash": "blake2b:00", "n_splats": 12},
        "recipe": json.loads(recipe(number)),
        "handles": [{"id": 1, "color": "#f2a93b", "enabled": True}, {"id": 4, "color": "#4fb3ff", "enabled": False}],
        "active_handles": [1],
        "timeline": {"frame": 3, "n_frames": 10, "fps": 24.0, "keys": [{"frame": 2, "poses": [{"id": 1, "scale": 2}]}]},
        "view": {"position": [0, 0, 5], "focal_point": [0, 0, 0], "view_up": [0, 1, 0], "angle": 30.0},
        "display": {"mode": "splats", "size": 1.0},
        "selection": "8AA=",
        "selection_sets": [{"name": "a", "splats": "8AA="}],
        "document": "",
    }
    return json.dumps(held, indent=number % 3 or None).encode()


def npz(number: int) -> bytes:
    """A SpikingGS archive of 12 splats."""
    data = BytesIO()
    write = np.savez if number % 2 else np.savez_compressed
    write(data, Vth_pdf=np.linspace(0.01, 0.2, 12, dtype="f4"), Vth_opa=np.array([0.01], "f4"))
    return data.getvalue()


def small_splats(which: int) -> Splats:
    """Up to a dozen splats of any degree."""
    rng = np.random.default_rng(which)
    n, degree = int(rng.integers(1, 12)), which % 4
    quats = rng.normal(size=(n, 4)).astype("f4")
    return Splats(
        means=rng.normal(size=(n, 3)).astype("f4"),
        log_scales=rng.uniform(-6, -1, (n, 3)).astype("f4"),
        quats=quats / np.linalg.norm(quats, axis=1)[:, None],
        logit_opacities=rng.normal(size=n).astype("f4"),
        sh0=rng.normal(size=(n, 3)).astype("f4"),
        shN=rng.normal(size=(n, (degree + 1) ** 2 - 1, 3)).astype("f4"),
    )


@cache
def _written(name: str, which: int) -> bytes:
    """A small file of a format, as we write it; what may crash does so in a process of its own."""

    def encoded() -> bytes:
        out = BytesIO()
        FORMATS_OF_SPLATS[name].write(out, small_splats(which), no_progress)
        return out.getvalue()

    return forked(encoded) if is_forked(FORMATS_OF_SPLATS[name]) else encoded()


@cache
def _spz(which: int) -> bytes:
    """An SPZ of version 1, 2, 3 or 4."""
    packed = _written("spz", which // 4)
    if which % 4 == 2:
        return packed
    splats = small_splats(which // 4)
    n, degree = splats.n_splats, splats.sh_degree
    columns = _columns_of_spz(gzip.decompress(packed), n, degree)
    if which % 4 == 3:
        return _spz_4(columns, n, degree)
    rng = np.random.default_rng(which)
    columns[4] = rng.integers(0, 256, 3 * n, "u1").tobytes()
    if which % 4 == 0:
        columns[0] = splats.means.astype("<f2").tobytes()
    return gzip.compress(struct.pack("<4sIIBBBB", b"NGSP", which % 4 + 1, n, degree, 12, 0, 0) + b"".join(columns))


@cache
def _gltf(which: int) -> bytes:
    """A ``.glb``, or the same as text with its numbers in it."""
    packed = _written("gltf", which // 2)
    if which % 2:
        return packed
    length = int.from_bytes(packed[12:16], "little")
    held = json.loads(packed[20 : 20 + length])
    numbers = base64.b64encode(packed[28 + length :]).decode()
    held["buffers"][0]["uri"] = f"data:application/octet-stream;base64,{numbers}"
    held["nodes"] += [{"children": [0], "translation": [1, 2, 3], "scale": [2, 2, 2]}]
    held["scenes"][0]["nodes"] = [1]
    return json.dumps(held).encode()


@cache
def _usd(which: int) -> bytes:
    """A stage as it is written, or as text."""
    packed = _written("usd", which // 2)
    return packed if which % 2 else forked(lambda: _as_text(packed))


def _as_text(stage: bytes) -> bytes:
    from pxr import Sdf

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "stage.usdc")
        path.write_bytes(stage)
        return Sdf.Layer.FindOrOpen(str(path)).ExportToString().encode()


def splat_records(n: int, rng: np.random.Generator) -> np.ndarray:
    """Rows of a ``.splat``."""
    records = np.zeros(n, RECORD)
    records["mean"] = rng.normal(size=(n, 3))
    records["scale"] = rng.random((n, 3))
    records["rgba"] = rng.integers(0, 256, (n, 4))
    records["quat"] = (255, 128, 128, 128)
    return records


def ksplat_bytes(n: int, rng: np.random.Generator) -> bytes:
    """A ``.ksplat`` of one section, at any level of compression."""
    level = int(rng.integers(3))
    degree = int(rng.integers(3))
    head, section = bytearray(4096), bytearray(1024)
    head[1] = 1
    struct.pack_into("<IIIIH", head, 4, 1, 1, n, n, level)
    struct.pack_into("<IIIIfHxxI", section, 0, n, n, 4, 2 if n > 4 else 1, 5.0, 12, 0)
    n_full = min(n // 4, 1)
    struct.pack_into("<II", section, 32, n_full, 1)
    struct.pack_into("<H", section, 40, degree)
    width = (44, 24, 24)[level] + (4, 2, 1)[level] * (0, 9, 24)[degree]
    partial = struct.pack("<I", n - 4 * n_full)
    centers = rng.normal(size=(2 if n > 4 else 1, 3)).astype("<f4").tobytes()
    return bytes(head + section) + partial + centers + rng.integers(0, 60, n * width).astype("u1").tobytes()


def _columns_of_spz(unpacked: bytes, n: int, degree: int) -> list[bytes]:
    widths = [9, 1, 3, 3, 4, 3 * ((degree + 1) ** 2 - 1)]
    ends = 16 + n * np.cumsum(widths)
    return [unpacked[end - n * width : end] for end, width in zip(ends, widths, strict=True)]


def _spz_4(columns: list[bytes], n: int, degree: int) -> bytes:
    """The same splats as version 4, each column a stream of zstd."""
    columns = [column for column in columns if column]
    packed = [ZstdCompressor().compress(column) for column in columns]
    head = struct.pack("<4sIIBBBBI12x", b"NGSP", 4, n, degree, 12, 0, len(columns), 32)
    sizes = [struct.pack("<QQ", len(a), len(b)) for a, b in zip(packed, columns, strict=True)]
    return head + b"".join(sizes) + b"".join(packed)


_SEEDS: dict[str, Callable[[int], bytes]] = {
    "ply": ply,
    "compressed-ply": compressed_ply,
    "spz": lambda number: _spz(number % 48),
    "gltf": lambda number: _gltf(number % 24),
    "usd": lambda number: _usd(number % 16),
    "ksplat": lambda number: ksplat_bytes(number % 11 + 1, np.random.default_rng(number)),
    "splat": lambda number: splat_records(number % 11 + 1, np.random.default_rng(number)).tobytes(),
}
"""Formats that are only read, or come in more ways than we write them."""


def splat_file(row: SplatFormat) -> Callable[[int], bytes]:
    """What makes files of a format: of its own, or else as we write it."""
    own = _SEEDS.get(row.name)
    if own is None and not row.writes:
        raise LookupError(f"{row.title} is only read: tests/campaign/seeds.py needs a function that makes such files")
    return own or (lambda number: _written(row.name, number % 24))
