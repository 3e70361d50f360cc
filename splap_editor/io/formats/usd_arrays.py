"""The process that opens a USD stage for its arrays: ``python -m splap_editor.io.formats.usd_arrays STAGE OUT.npz``.

Ends with 2 and ``what is wrong|what to do`` on standard output where the stage is sound but of no use.
"""

import contextlib
import sys
from pathlib import Path
from typing import Any

import numpy as np

from splap_editor.core.splats.rotations import matrices_to_quats, quat_products
from splap_editor.io.formats.node_placement import turn_and_factor
from splap_editor.io.ply_reader import available_memory

_BYTES, _TIMES = 3 << 29, 32
"""Address space for a stage of any size, most of it never used, and more for each byte."""

_SECONDS, _BYTES_A_SECOND = 20, 1 << 19
"""The same of processor time."""


def main(stage_path: str, out: str) -> int:
    """Write the arrays of all splats of a stage, in the axes of a PLY."""
    from pxr import Usd, UsdGeom

    limit(Path(stage_path).stat().st_size)
    layers: list[Any] = []
    if not _opened(stage_path, layers):
        return _told("names a layer that is no regular file", "Export it again.")
    stage = Usd.Stage.Open(stage_path)
    prims = [prim for prim in stage.Traverse() if prim.GetTypeName() == "ParticleField3DGaussianSplat"]
    if not prims:
        return _told("holds no Gaussian splats", "Choose a file with a ParticleField3DGaussianSplat in it.")
    first = stage.GetStartTimeCode() if stage.HasAuthoredTimeCodeRange() else 0.0
    time = Usd.TimeCode(first)
    upright = np.diag([-1.0, -1.0, 1.0, 1.0])
    if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z:
        upright = upright @ np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1.0]])
    found = []
    for prim in prims:
        world = np.array(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(time)).T
        arrays = _arrays(prim, time, upright @ world)
        if isinstance(arrays, str):
            return _told(arrays, "Export it again.")
        found.append(arrays)
    widest = max(arrays["harmonics"].shape[1] for arrays in found)
    for arrays in found:
        held = arrays["harmonics"]
        arrays["harmonics"] = np.pad(held, ((0, 0), (0, widest - held.shape[1]), (0, 0)))
    joined = {name: np.concatenate([arrays[name] for arrays in found]) for name in found[0]}
    if not len(joined["means"]):
        return _told("holds zero splats", "Choose a file with splats in it.")
    names = ("positions", "orientations", "scales", "opacities", "radiance:sphericalHarmonicsCoefficients")
    moves = any(prim.GetAttribute(name).ValueMightBeTimeVarying() for prim in prims for name in names)
    part = Path(out).with_suffix(".part.npz")
    joined["is_animated"] = np.array([int(moves)])
    np.savez(part, allow_pickle=False, **joined)
    part.rename(out)
    return 0


def _opened(stage_path: str, layers: list[Any]) -> bool:
    """Open the layers that a stage is composed of; whether all are files, which would not keep their reader waiting."""
    from pxr import Sdf

    seen, left = {stage_path}, [stage_path]
    while left:
        path = left.pop()
        # What stands in a package is named after it: scene.usdz[layer.usdc].
        file = Path(path.partition("[")[0])
        if file.exists() and not file.is_file():
            return False
        layer = None
        # What is wrong with a layer is told where the stage is opened.
        with contextlib.suppress(Exception):
            layer = Sdf.Layer.FindOrOpen(path)
        if layer:
            layers.append(layer)
            found = {layer.ComputeAbsolutePath(named) for named in layer.GetCompositionAssetDependencies() if named}
            left += found - seen
            seen |= found
    return True


def limit(n_bytes: int) -> None:
    """Take no more memory and processor time than a stage of that size needs: a damaged one asks for any amount."""
    with contextlib.suppress(ImportError):
        import resource

        statm = Path("/proc/self/statm")
        held = int(statm.read_text().split()[0]) * resource.getpagesize() if statm.exists() else _BYTES
        more = min(_BYTES + _TIMES * n_bytes, available_memory() or 1 << 36)
        for kind, most in (
            (resource.RLIMIT_AS, held + more),
            (resource.RLIMIT_CPU, _SECONDS + n_bytes // _BYTES_A_SECOND),
        ):
            _, hard = resource.getrlimit(kind)
            if hard == resource.RLIM_INFINITY or most < hard:
                resource.setrlimit(kind, (most, most))


def _told(what: str, advice: str) -> int:
    print(f"{what}|{advice}")
    return 2


def _value(prim: Any, name: str, time: Any, width: int) -> np.ndarray | None:
    """An attribute as (N, width) floats; its half-precision twin where there is no other."""
    for each in (name, name + "h"):
        value = prim.GetAttribute(each).Get(time) if prim.HasAttribute(each) else None
        if value is not None and len(value):
            return np.array(value, np.float32).reshape(len(value), -1)[:, :width]
    return None


def _arrays(prim: Any, time: Any, world: np.ndarray) -> dict[str, np.ndarray] | str:
    """The arrays of a prim, put where it is; a clause where it is of no use."""
    means = _value(prim, "positions", time, 3)
    if means is None:
        means = np.zeros((0, 3), np.float32)
    n = len(means)
    held = {"scales": _value(prim, "scales", time, 3), "alphas": _value(prim, "opacities", time, 1)}
    held["quats"] = _quats(prim, time)
    usual = {"scales": np.ones((n, 3)), "alphas": np.ones((n, 1)), "quats": np.tile([1.0, 0, 0, 0], (n, 1))}
    arrays = {}
    for name, values in held.items():
        # Too many are cut off and too few ignored, as the schema has it.
        arrays[name] = (usual[name] if values is None or len(values) < n else values[:n]).astype(np.float32)
    degree = prim.GetAttribute("radiance:sphericalHarmonicsDegree").Get(time)
    n_coefficients = (degree + 1) ** 2 if isinstance(degree, int) and 0 <= degree <= 3 else 0
    if not n_coefficients:
        return f"has harmonics of degree {degree}, and 0 to 3 are read"
    colors = _value(prim, "radiance:sphericalHarmonicsCoefficients", time, 3)
    if colors is None or len(colors) < n * n_coefficients:
        colors, n_coefficients = np.zeros((n, 3), np.float32), 1
    harmonics = colors[: n * n_coefficients].reshape(n, n_coefficients, 3)
    placed = turn_and_factor(world)
    if placed is None:
        return "has a prim that mirrors or stretches its splats, or puts them beyond any place"
    turn, factor = placed
    if np.abs(world - np.eye(4)).max() > 1e-12:
        means = (means.astype(np.float64) @ world[:3, :3].T + world[:3, 3]).astype(np.float32)
        arrays["scales"] = arrays["scales"] * np.float32(factor)
        turned = quat_products(matrices_to_quats(turn[None]), arrays["quats"].astype(np.float64))
        arrays["quats"] = turned.astype(np.float32)
        if n_coefficients > 1:
            from splap_editor.core.splats.spherical_harmonics import rotated_sh

            rest = rotated_sh(np.ascontiguousarray(harmonics[:, 1:]), np.broadcast_to(turn, (n, 3, 3)))
            harmonics = np.concatenate([harmonics[:, :1], rest], axis=1)
    return {"means": means, **arrays, "alphas": arrays["alphas"][:, 0], "harmonics": harmonics}


def _quats(prim: Any, time: Any) -> np.ndarray | None:
    """Orientations w, x, y, z."""
    for name in ("orientations", "orientationsh"):
        value = prim.GetAttribute(name).Get(time) if prim.HasAttribute(name) else None
        if value is not None and len(value):
            # The array protocol of USD's quaternions gives x, y, z, w.
            return np.array(value, np.float32).reshape(-1, 4)[:, [3, 0, 1, 2]]
    return None


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:3]))
