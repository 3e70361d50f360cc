"""Small axes in a corner that show how the scene is turned; a click on an end looks from there."""

import numpy as np
from numpy.typing import NDArray
from vtkmodules.vtkCommonDataModel import vtkPolyData
from vtkmodules.vtkRenderingCore import vtkActor, vtkRenderer
from vtkmodules.vtkRenderingFreeType import vtkVectorText

from splap_editor.viewport.gizmo_actor import AXIS_COLORS, cells_of, set_points, unlit_actor
from splap_editor.viewport.overlays import Mark, Markers
from splap_editor.viewport.projection import Projection

_ARM_PX = 36.0
_BALL_PX = 18.0
_MARGIN_PX = 56.0
_ENDS = np.vstack([np.eye(3), -np.eye(3)])


class AxesTriad:
    """Three coloured axes with lettered balls at the positive ends, in the top right corner.

    Parameters
    ----------
    renderer : vtkRenderer
        Kept by the triad alone: its camera measures pixels.
    scale : float
        Device pixels per logical pixel.
    """

    def __init__(self, renderer: vtkRenderer, scale: float = 1.0):
        self._renderer = renderer
        self.scale = scale
        self.axes = np.eye(3)
        """(3, 3) rows X, Y, Z as directions of the scene that is drawn."""
        self.hovered: int | None = None
        self._lines = []
        for color in AXIS_COLORS:
            poly = vtkPolyData()
            poly.SetLines(cells_of(np.array([2])))
            self._lines.append(unlit_actor(poly, color))
        self._letters = [_letter(name) for name in "XYZ"]
        for actor in (*self._lines, *self._letters):
            renderer.AddActor(actor)
        self._balls = Markers(renderer)
        self.is_shown = True

    def close(self) -> None:
        """Leave the renderer."""
        for actor in (*self._lines, *self._letters):
            self._renderer.RemoveActor(actor)
        self._balls.close()

    def ends(self, projection: Projection) -> NDArray[np.float64]:
        """(6, 3) ends +X +Y +Z -X -Y -Z: pixels from the top left, and height towards the viewer in pixels."""
        scale = self.scale
        turned = _ENDS @ self.axes @ projection.view_from_world[:3, :3].T * [1.0, -1.0, 1.0] * _ARM_PX * scale
        return np.add(turned, (projection.width - _MARGIN_PX * scale, _MARGIN_PX * scale, 0.0))

    def hit(self, projection: Projection, x: float, y: float) -> NDArray[np.float64] | None:
        """Unit axis (3,) whose end is under the cursor, the nearer to the viewer of two; None beside all."""
        self.hovered = None
        if self.is_shown:
            ends = self.ends(projection)
            near = np.hypot(ends[:, 0] - x, ends[:, 1] - y) <= 0.65 * _BALL_PX * self.scale
            if near.any():
                self.hovered = int(np.argmax(np.where(near, ends[:, 2], -np.inf)))
        return None if self.hovered is None else _ENDS[self.hovered]

    def refresh(self, projection: Projection) -> None:
        """Turn with the camera for the picture that comes next."""
        for actor in (*self._lines, *self._letters):
            actor.SetVisibility(self.is_shown)
        if not self.is_shown:
            self._balls.clear()
            return
        self._look_at_pixels(projection)
        ends = self.ends(projection) * [1.0, -1.0, 1.0] + [0.0, projection.height, 0.0]
        center = 0.5 * (ends[0] + ends[3])
        for line, letter, end in zip(self._lines, self._letters, ends[:3], strict=True):
            set_points(line.GetMapper().GetInput(), np.array([center, end]))
            line.GetProperty().SetLineWidth(2.0 * self.scale)
            letter.SetPosition(end[0], end[1], end[2] + 1.0)
            letter.SetScale(8.5 * self.scale)
        colors = np.array(AXIS_COLORS)
        colors = np.vstack([colors, 0.55 * colors])
        if self.hovered is not None:
            colors[self.hovered] = 0.35 * colors[self.hovered] + 0.65
        order = np.argsort(ends[:, 2])
        self._balls.set_size(_BALL_PX * self.scale)
        self._balls.set_viewport_size(projection.width, projection.height)
        rgb = np.rint(255.0 * colors).astype(int)
        self._balls.show([Mark(ends[i], tuple(rgb[i].tolist())) for i in order])

    def _look_at_pixels(self, projection: Projection) -> None:
        camera = self._renderer.GetActiveCamera()
        x, y = projection.width / 2.0, projection.height / 2.0
        camera.ParallelProjectionOn()
        camera.SetParallelScale(y)
        camera.SetFocalPoint(x, y, 0.0)
        camera.SetPosition(x, y, 1000.0)
        camera.SetViewUp(0.0, 1.0, 0.0)
        camera.SetClippingRange(1.0, 2000.0)


def _letter(name: str) -> vtkActor:
    source = vtkVectorText()
    source.SetText(name)
    source.Update()
    poly = vtkPolyData()
    poly.ShallowCopy(source.GetOutput())
    x0, x1, y0, y1, _, _ = poly.GetBounds()
    actor = unlit_actor(poly, (0.06, 0.06, 0.07))
    actor.SetOrigin(0.0, 0.0, 0.0)
    center = np.array([(x0 + x1) / 2.0, (y0 + y1) / 2.0, 0.0])
    points = np.array([poly.GetPoint(i) for i in range(poly.GetNumberOfPoints())]) - center
    set_points(poly, points)
    return actor
