"""Sound files that the mutations start from, each made from a number."""

import json
from collections.abc import Callable
from functools import cache
from io import BytesIO

import numpy as np
from hypothesis import strategies as st

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
    """Any splat file; one in eight is packed."""
    return _packed(number // 8 % 4) if number % 8 == 0 else odd_ply(number)


def recipe(number: int) -> bytes:
    """A recipe with a bit of everything."""
    rng = np.random.default_rng(number)
    pose = {"translate": rng.normal(size=3).tolist(), "rotate": rng.normal(size=4).tolist(), "scale": 1.5}
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
    return json.dumps(held).encode()


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


KINDS: dict[str, Callable[[int], bytes]] = {"ply": ply, "recipe": recipe, "session": session, "npz": npz, "cache": npz}
"""What is read, and what makes it; a cache entry is made from its archive by the check."""
