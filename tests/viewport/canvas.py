"""Off-screen windows and random splats for the drawing tests."""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from vtkmodules.vtkRenderingCore import vtkRenderWindow

from splap_editor.viewport.camera import View
from splap_editor.viewport.glyphs import Glyphs, cutoff_radii, rgba_bytes
from splap_editor.viewport.screenshot import window_pixels
from splap_editor.viewport.viewport import Viewport

BACKGROUND = (0.1, 0.1, 0.1)
VIEW = View(np.array([2.0, -3.0, 1.5]), np.zeros(3), np.array([0.0, 0.0, 1.0]))


def random_splats(n: int, seed: int = 1, *, is_sheared: bool = False, size: float = 0.2) -> tuple[Glyphs, np.ndarray]:
    """Splats in a cube of side 2 and their (n, 4) colours in 0..1, already rounded to bytes."""
    rng = np.random.default_rng(seed)
    frames = np.linalg.qr(rng.normal(size=(n, 3, 3)))[0]
    sizes = rng.uniform(0.1 * size, size, (n, 2))
    u, v = frames[:, 0] * sizes[:, :1], frames[:, 1] * sizes[:, 1:]
    if is_sheared:
        v = v + 0.6 * u
    rgba = np.rint(rng.uniform(0.1, 1.0, (n, 4)) * 255.0) / 255.0
    glyphs = Glyphs(rng.uniform(-1.0, 1.0, (n, 3)), u, v, np.full(n, 0.01), cutoff_radii(rgba[:, 3]))
    return glyphs, rgba


@contextmanager
def canvas(
    glyphs: Glyphs | None = None, rgba: np.ndarray | None = None, size: tuple[int, int] = (240, 180)
) -> Iterator[Viewport]:
    """An off-screen viewport on a plain grey ground without corner axes; `drawn` renders it."""
    window = vtkRenderWindow()
    window.SetOffScreenRendering(True)
    window.SetMultiSamples(0)
    window.SetSize(*size)
    viewport = Viewport(window)
    viewport.set_background(BACKGROUND, BACKGROUND)
    viewport.triad.is_shown = False
    viewport.camera.view = VIEW
    if glyphs is not None:
        viewport.splats.load(glyphs, rgba_bytes(rgba[:, :3], rgba[:, 3]))
    try:
        yield viewport
    finally:
        viewport.close()
        window.Finalize()


def drawn(viewport: Viewport) -> np.ndarray:
    """(H, W, 3) picture in 0..1 of one frame."""
    window = viewport.renderer.GetRenderWindow()
    window.Render()
    return window_pixels(window)[..., :3] / 255.0
