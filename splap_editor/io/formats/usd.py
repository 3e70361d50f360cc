"""OpenUSD's ``ParticleField3DGaussianSplat``, still or as an animation; its library, ``usd-core``, is an extra.

A stage's y points up and a PLY's down: the writer turns the prim by half a turn about z, as in a ``.glb``. Reading is
done by another process: what a damaged file does to a large C++ library stays there.
"""

import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from splap_editor.core.camera_path import CameraTrack
from splap_editor.core.progress import FrameProgress, Progress, part_of
from splap_editor.core.splats.splats import Splats
from splap_editor.io.formats.bare_splats import FAINT, OPAQUE, alphas_of, row_blocks
from splap_editor.io.formats.source import FormatError, Source
from splap_editor.io.formats.splat32 import log_scales_of
from splap_editor.io.formats.usd_package import copy_bytes, write_package
from splap_editor.io.npz import NpzError, NpzFile
from splap_editor.io.ply_table import PlyTable
from splap_editor.io.splat_cells import blank_table

_ROOT, _PRIM, _CAMERA = "/World", "/World/Splats", "/World/Camera"
_APERTURE, _ASPECT = 15.2908, 16 / 9
"""Height of a camera's film in tenths of a unit, USD's own default, and its width by its height."""

_SECONDS = 600.0
_MOST_BYTES = 1 << 34
_MISSING = "OpenUSD files need the package usd-core: install it with pip install 'splap-editor[usd]'."


def _require_library() -> None:
    try:
        import pxr.UsdVol  # noqa: F401
    except ImportError:
        raise FormatError(_MISSING) from None


def read(source: Source, progress: Progress) -> tuple[PlyTable, list[str]]:
    """Decode the splats of all prims of a stage, at its first frame.

    Raises
    ------
    FormatError
        If it is damaged or holds no splats, takes too long, or the library is missing.
    """
    _require_library()
    with tempfile.TemporaryDirectory() as folder:
        held = Path(folder) / "splats.npz"
        told = unpacked(source, held, progress)
        if not held.exists():
            raise source.refused(*told) if told else source.damaged("its library gave up on it")
        try:
            with held.open("rb") as file:
                archive = NpzFile(file, _MOST_BYTES, lambda share: progress(0.5))
                arrays = {name: archive.array(name) for name in archive.names}
        except NpzError as error:
            raise source.damaged(str(error)) from None
    means, harmonics = arrays["means"], arrays["harmonics"]
    n, n_coefficients = len(means), harmonics.shape[1] - 1
    table, sheet = blank_table(source.name, n, n_coefficients)
    for rows in row_blocks(n, part_of(progress, 0.5, 1.0)):
        sheet.means[rows] = means[rows]
        sheet.log_scales[rows] = log_scales_of(arrays["scales"][rows])
        sheet.quats[rows] = arrays["quats"][rows]
        alphas = arrays["alphas"][rows].astype(np.float64)
        sheet.logit_opacities[rows] = np.clip(np.log(alphas) - np.log1p(-alphas), FAINT, OPAQUE)
        sheet.sh0[rows] = harmonics[rows, 0]
        sheet.shN[rows] = harmonics[rows, 1:]
    progress(1.0)
    return table, ["It is animated: these are the splats of its first frame."] if arrays["is_animated"] else []


def unpacked(source: Source, held: Path, progress: Progress) -> tuple[str, str] | None:
    """Let another process put the arrays of a stage into an archive; what it says where it does not."""
    command = [sys.executable, "-m", "splap_editor.io.formats.usd_arrays", str(source.path.resolve()), str(held)]
    process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    try:
        until = time.monotonic() + _SECONDS
        while True:
            try:
                out, _ = process.communicate(timeout=0.1)
                break
            except subprocess.TimeoutExpired:
                progress(0.5)
            if time.monotonic() > until:
                raise source.refused("takes too long to read", "Export it again, with fewer splats.")
    finally:
        if process.poll() is None:
            process.kill()
            process.communicate()
    what, mark, advice = out.decode("utf-8", "replace").strip().partition("|")
    return (what, advice) if mark and process.returncode == 2 else None


def write_usdc(out: BinaryIO, splats: Splats, progress: Progress) -> None:
    """Encode bare splats as a ``.usdc``."""
    _write(out, [(1, splats)], 24.0, _halves(progress), is_package=False)
    progress(1.0)


def write_usdz(out: BinaryIO, splats: Splats, progress: Progress) -> None:
    """Encode bare splats as a ``.usdz``."""
    _write(out, [(1, splats)], 24.0, _halves(progress), is_package=True)
    progress(1.0)


def _halves(progress: Progress) -> FrameProgress:
    """Progress of a single frame, and of what follows it."""
    return lambda place: part_of(progress, place / 2, (place + 1) / 2)


def write_usdc_frames(
    out: BinaryIO,
    frames: Iterable[tuple[int, Splats]],
    rate: float,
    camera: CameraTrack | None,
    progress_of: FrameProgress,
) -> None:
    """Encode an animation, and the camera that films it, as a ``.usdc``."""
    _write(out, frames, rate, progress_of, is_package=False, camera=camera)


def write_usdz_frames(
    out: BinaryIO,
    frames: Iterable[tuple[int, Splats]],
    rate: float,
    camera: CameraTrack | None,
    progress_of: FrameProgress,
) -> None:
    """Encode an animation, and the camera that films it, as a ``.usdz``."""
    _write(out, frames, rate, progress_of, is_package=True, camera=camera)


def _write(
    out: BinaryIO,
    frames: Iterable[tuple[int, Splats]],
    rate: float,
    progress_of: FrameProgress,
    *,
    is_package: bool,
    camera: CameraTrack | None = None,
) -> None:
    """Encode bare splats as a stage, time-sampled where there is more than one frame.

    Parameters
    ----------
    out : BinaryIO
    frames : iterable of (frame, Splats)
        The same splats at each frame; opacities and colours of degree 0 are those of the first.
    rate : float
        Frames per second.
    progress_of : FrameProgress
        Told between arrays of each frame, and for each MiB written after the last.
    is_package : bool
        A ``.usdz``, which wraps a ``.usdc``.
    camera : CameraTrack, optional
        At each frame.
    """
    _require_library()
    from pxr import Usd, UsdGeom

    with tempfile.TemporaryDirectory() as folder:
        layer = Path(folder) / "splats.usdc"
        stage = Usd.Stage.CreateNew(str(layer))
        UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
        stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, _ROOT).GetPrim())
        prim = stage.DefinePrim(_PRIM, "ParticleField3DGaussianSplat")
        UsdGeom.Xformable(prim).AddRotateZOp().Set(180.0)
        stage.SetFramesPerSecond(rate)
        stage.SetTimeCodesPerSecond(rate)
        numbers: list[int] = []
        kept: dict[str, Any] = {}
        for place, (number, splats) in enumerate(frames):
            progress = progress_of(place)
            if len(numbers) == 1:
                # A second frame: what stood for all times was the first.
                for name, values in kept.items():
                    attribute = prim.GetAttribute(name)
                    attribute.Clear()
                    attribute.Set(values, numbers[0])
            arrays = _moving(splats, part_of(progress, 0.0, 0.6))
            for name, values in arrays.items():
                prim.GetAttribute(name).Set(values, number) if numbers else prim.GetAttribute(name).Set(values)
            kept = arrays if not numbers else {}
            progress(0.8)
            if not numbers:
                _set_still(prim, splats)
            progress(1.0)
            numbers.append(number)
        progress = progress_of(len(numbers))
        progress(0.0)
        if camera is not None:
            _add_camera(stage, camera, numbers)
        if len(numbers) > 1:
            stage.SetStartTimeCode(numbers[0])
            stage.SetEndTimeCode(numbers[-1])
        stage.GetRootLayer().Save()
        progress(0.5)
        copied = part_of(progress, 0.5, 1.0)
        if is_package:
            write_package(out, layer, copied)
        else:
            with layer.open("rb") as file:
                copy_bytes(file, out.write, layer.stat().st_size, copied)


def _add_camera(stage: Any, camera: CameraTrack, numbers: list[int]) -> None:
    """Define a camera beside the splats, time-sampled at frames where there is more than one."""
    from pxr import Gf, UsdGeom

    prim = UsdGeom.Camera.Define(stage, _CAMERA)
    prim.CreateClippingRangeAttr(Gf.Vec2f(*camera.clipping))
    if camera.is_parallel:
        prim.CreateProjectionAttr(UsdGeom.Tokens.orthographic)
    place = prim.AddTransformOp()
    focal = prim.CreateFocalLengthAttr()
    across, high = prim.CreateHorizontalApertureAttr(), prim.CreateVerticalApertureAttr()
    half_turn = np.diag([-1.0, -1.0, 1.0, 1.0])
    for k, number in enumerate(numbers):
        when = (number,) if len(numbers) > 1 else ()
        # USD's vectors are rows, and its apertures and focal lengths tenths of a unit.
        place.Set(Gf.Matrix4d((half_turn @ camera.matrices[k]).T.tolist()), *when)
        height = 10.0 * float(camera.heights[k]) if camera.is_parallel else _APERTURE
        high.Set(height, *when)
        across.Set(height * _ASPECT, *when)
        if not camera.is_parallel:
            focal.Set(height / 2 / float(np.tan(np.radians(camera.angles[k]) / 2)), *when)


def _moving(splats: Splats, progress: Progress) -> dict[str, Any]:
    """Attributes that change from frame to frame."""
    from pxr import Vt

    found = {
        "positions": Vt.Vec3fArray.FromNumpy(_floats(splats.means)),
        "scales": Vt.Vec3fArray.FromNumpy(_floats(np.exp(splats.log_scales))),
    }
    progress(0.1)
    found["orientations"] = Vt.QuatfArray.FromNumpy(_floats(splats.quats[:, [1, 2, 3, 0]]))
    progress(0.2)
    n_coefficients = splats.shN.shape[1]
    if n_coefficients:
        harmonics = np.empty((splats.n_splats, 1 + n_coefficients, 3), np.float32)
        for rows in row_blocks(splats.n_splats, part_of(progress, 0.2, 0.8)):
            harmonics[rows, 0], harmonics[rows, 1:] = splats.sh0[rows], splats.shN[rows]
        progress(0.8)
        found["radiance:sphericalHarmonicsCoefficients"] = Vt.Vec3fArray.FromNumpy(harmonics.reshape(-1, 3))
    progress(1.0)
    return found


def _set_still(prim: Any, splats: Splats) -> None:
    """Set attributes that stay, and those that are wanted of the whole."""
    from pxr import Vt

    prim.GetAttribute("opacities").Set(Vt.FloatArray.FromNumpy(_floats(alphas_of(splats.logit_opacities))))
    prim.GetAttribute("radiance:sphericalHarmonicsDegree").Set(splats.sh_degree)
    if not splats.shN.shape[1]:
        colors = Vt.Vec3fArray.FromNumpy(_floats(splats.sh0))
        prim.GetAttribute("radiance:sphericalHarmonicsCoefficients").Set(colors)
    prim.GetAttribute("sortingModeHint").Set("cameraDistance")
    reach = 3 * np.exp(splats.log_scales.max(axis=1, keepdims=True))
    ends = [(splats.means - reach).min(axis=0), (splats.means + reach).max(axis=0)]
    prim.GetAttribute("extent").Set(Vt.Vec3fArray.FromNumpy(_floats(np.array(ends))))


def _floats(values: Any) -> Any:
    return np.ascontiguousarray(values, np.float32)
