"""What is seen while something moves: likeness to the picture at rest, and frames a second, as JSON lines.

Draws off screen; software OpenGL will do. Without a display of its own::

    xvfb-run -a python tests/benchmark/moving_picture.py --files guitar.ply --million guitar.ply
"""

import argparse
import os
import sys
import time
from pathlib import Path
from statistics import median

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
from numpy.typing import NDArray
from vtkmodules.vtkRenderingCore import vtkRenderWindow

from splap_editor.core.splats.main_subject import main_subject
from splap_editor.io.ply import read_ply
from splap_editor.resources import resource
from splap_editor.viewport.glyphs import Glyphs, base_colors, splat_glyphs
from splap_editor.viewport.scene_view import suggested_up
from splap_editor.viewport.screenshot import window_pixels
from splap_editor.viewport.splat_actor import DisplayMode
from splap_editor.viewport.viewport import Viewport
from tests.benchmark.peers import machine, note, report
from tests.reference.rasterizer import psnr

SIZE = (900, 700)
N_SETTLING, N_MEASURED, N_VIEWS = 10, 12, 3
MILLION = 1_000_000
LOOKS = {DisplayMode.SPLATS: "splats", DisplayMode.ELLIPSES: "ellipses"}
TARGETS_DB = {"windmill_2dgs": 28.0, "guitar": 26.0, "million": 22.0}
TARGET_FPS = 10.0


def tiled(glyphs: Glyphs, colors: NDArray[np.uint8], n_splats: int) -> tuple[Glyphs, NDArray[np.uint8]]:
    """Copies of a capture side by side in a square, as many splats as asked for or a few more."""
    n_tiles = -(-n_splats // len(glyphs.means))
    subject = main_subject(glyphs.means, colors[:, 3] / 255.0)
    side, step = int(np.ceil(n_tiles**0.5)), float(np.linalg.norm(subject.half_axes))
    shifts = [step * np.array([i % side, 0.0, i // side]) for i in range(n_tiles)]
    means = np.concatenate([glyphs.means + shift for shift in shifts])
    rest = (np.concatenate([getattr(glyphs, name)] * n_tiles) for name in ("axes_u", "axes_v", "thickness", "cutoffs"))
    return Glyphs(means, *rest), np.concatenate([colors] * n_tiles)


def window_of(glyphs: Glyphs, colors: NDArray[np.uint8], up: tuple[float, float, float], scale: int) -> Viewport:
    """A viewport off screen with a scene in it, seen from its home side, its pixels so much finer."""
    window = vtkRenderWindow()
    window.SetOffScreenRendering(True)
    window.SetMultiSamples(0)
    window.SetSize(scale * SIZE[0], scale * SIZE[1])
    viewport = Viewport(window, scale=float(scale))
    viewport.splats.load(glyphs, colors)
    viewport.camera.world_up = np.array(up)
    viewport.reset_camera()
    return viewport


def bench_gesture(viewport: Viewport, gesture: str, **fields: object) -> None:
    """Move the view or the splats frame by frame, and compare some frames with the same at rest."""
    window, splats = viewport.renderer.GetRenderWindow(), viewport.splats
    actor = splats.deformed
    means, u, v = actor.means + actor.origin, actor.axes_u.copy(), actor.axes_v.copy()
    up = viewport.camera.world_up * 0.002 * actor.extent

    def step(i: int) -> None:
        if gesture == "orbit":
            viewport.camera.orbit(4.0, 0.0)
        else:
            splats.move(means + (i % 5) * up, u, v)
        window.Render()

    likeness, seconds, processor = [], [], []
    for _ in range(N_VIEWS):
        viewport.begin_motion()
        for i in range(N_SETTLING + N_MEASURED // N_VIEWS):
            start, worked = time.perf_counter(), time.process_time()
            step(i)
            if i >= N_SETTLING:
                seconds.append(time.perf_counter() - start)
                processor.append(time.process_time() - worked)
        moving, n_drawn = window_pixels(window)[..., :3] / 255.0, actor.n_drawn
        coarseness = getattr(getattr(viewport, "drawn", None), "coarseness", 1)
        viewport.end_motion()
        window.Render()
        likeness.append(psnr(moving, window_pixels(window)[..., :3] / 255.0))
    splats.move(means, u, v)
    report(
        benchmark="moving picture",
        gesture=gesture,
        **fields,
        psnr_db=min(likeness),
        frames_per_second=1.0 / median(seconds),
        target_frames_per_second=TARGET_FPS,
        processor_milliseconds=1000.0 * median(processor),
        n_drawn=n_drawn,
        coarseness=coarseness,
    )


def bench_scene(name: str, path: Path, scale: int, n_splats: int = 0) -> None:
    """Measure one file, tiled if so many splats are asked for, in all looks."""
    splats = read_ply(path).splats
    glyphs, colors = splat_glyphs(splats), base_colors(splats)
    if n_splats:
        glyphs, colors = tiled(glyphs, colors, n_splats)
    viewport = window_of(glyphs, colors, suggested_up(splats), scale)
    for mode, look in LOOKS.items():
        viewport.splats.mode = mode
        for gesture in ("orbit", "drag"):
            note(f"{name}: {look}, {gesture}")
            fields = {"scene": name, "n_splats": len(glyphs.means), "look": look, "target_db": TARGETS_DB.get(name)}
            bench_gesture(viewport, gesture, **fields)
    window = viewport.renderer.GetRenderWindow()
    viewport.close()
    window.Finalize()


def main() -> None:
    """Measure the bundled windmill, the files given, and one of them tiled to a million splats."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    windmill = resource("samples", "windmill_2dgs.ply")
    parser.add_argument("--files", type=Path, nargs="*", default=[])
    parser.add_argument("--million", type=Path, default=windmill, metavar="FILE", help="what is tiled")
    parser.add_argument("--no-million", action="store_true")
    parser.add_argument("--scale", type=int, default=1, help="device pixels per logical pixel")
    options = parser.parse_args()
    report(**machine(), size=SIZE, scale=options.scale)
    for path in (windmill, *options.files):
        bench_scene(path.stem, path, options.scale)
    if not options.no_million:
        bench_scene("million", options.million, options.scale, MILLION)


if __name__ == "__main__":
    main()
