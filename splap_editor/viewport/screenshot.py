"""Pictures of any size, drawn off screen."""

import numpy as np
from numpy.typing import NDArray
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkUnsignedCharArray
from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow

from splap_editor.viewport.camera import Camera
from splap_editor.viewport.depth_order import depth_order
from splap_editor.viewport.edge_lines import EdgeLines
from splap_editor.viewport.splat_actor import DisplayMode
from splap_editor.viewport.viewport import Viewport

LARGEST_PX = 16384
_LARGEST_SMOOTHED_PX = 4096


def window_pixels(window: vtkRenderWindow) -> NDArray[np.uint8]:
    """(H, W, 4) uint8 RGBA of what a window has drawn last, top row first; alpha as blended, colours premultiplied."""
    width, height = window.GetSize()
    pixels = vtkUnsignedCharArray()
    window.GetRGBACharPixelData(0, 0, width - 1, height - 1, 0, pixels, 0)
    return vtk_to_numpy(pixels).reshape(height, width, 4)[::-1].copy()


def screenshot(viewport: Viewport, width: int, height: int, *, is_transparent: bool = False) -> NDArray[np.uint8]:
    """The scene as the viewport shows it, with its edges but without gizmo and marks.

    Drawn into a window of its own with copies of the data, so that nothing
    on the screen changes. Ellipses and points are smoothed (2 × 2 samples).

    Parameters
    ----------
    viewport : Viewport
        Camera, splats and display settings.
    width, height : int
        Size in pixels; the vertical field of view is kept.
    is_transparent : bool
        No background: alpha is the coverage, colours are not premultiplied.

    Returns
    -------
    (H, W, 4) uint8
        RGBA, top row first; alpha is 255 unless transparent.

    Raises
    ------
    ValueError
        The size is not within 1..16384 pixels.
    """
    if not (1 <= width <= LARGEST_PX and 1 <= height <= LARGEST_PX):
        raise ValueError(f"a picture must have 1 to {LARGEST_PX} pixels a side, got {width} x {height}")
    is_smoothed = viewport.splats.mode is not DisplayMode.SPLATS and max(width, height) <= _LARGEST_SMOOTHED_PX
    samples = 2 if is_smoothed else 1
    pixels = _drawn(viewport, samples * width, samples * height, samples, is_transparent).astype(np.float32)
    pixels = pixels.reshape(height, samples, width, samples, 4).mean(axis=(1, 3))
    if is_transparent:
        pixels[..., :3] *= 255.0 / np.maximum(pixels[..., 3:], 1.0)
    else:
        pixels[..., 3] = 255.0
    return np.clip(np.rint(pixels), 0.0, 255.0).astype(np.uint8)


def _drawn(viewport: Viewport, width: int, height: int, samples: int, is_transparent: bool) -> NDArray[np.uint8]:
    window = vtkRenderWindow()
    window.SetOffScreenRendering(True)
    window.SetMultiSamples(0)
    window.SetAlphaBitPlanes(True)
    window.SetSize(width, height)
    renderer = vtkRenderer()
    renderer.SetUseOIT(False)
    renderer.GetCullers().RemoveAllItems()
    shown = viewport.renderer
    if is_transparent:
        renderer.SetBackground(0.0, 0.0, 0.0)
        renderer.SetBackgroundAlpha(0.0)
    else:
        renderer.SetBackground(*shown.GetBackground())
        renderer.SetBackground2(*shown.GetBackground2())
        renderer.SetGradientBackground(shown.GetGradientBackground())
    window.AddRenderer(renderer)
    camera = Camera(renderer)
    camera.view = viewport.camera.view
    boxes, lines = [], viewport.splats.edges
    edges: EdgeLines | None = None
    for actor in viewport.splats.shown_actors():
        twin = actor.twin(size_in_pixels=samples)
        twin.set_viewport_size(width, height)
        renderer.AddActor(twin.actor)
        boxes.append(twin.bounds())
        if viewport.splats.mode is DisplayMode.SPLATS:
            twin.set_order(depth_order(twin.means, camera.projection().direction))
        if lines is not None and lines.n_edges and (actor is viewport.splats.shown):
            edges = lines.twin(twin, renderer, samples)
    if boxes:
        camera.fit_clipping(np.array([np.min(boxes, axis=0)[0], np.max(boxes, axis=0)[1]]))
        if edges is not None:
            edges.refresh(camera.projection())
    window.Render()
    pixels = window_pixels(window)
    window.Finalize()
    return pixels
