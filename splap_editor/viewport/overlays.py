"""Marks drawn over the scene: handles, rings on the surface."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkPolyData
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper, vtkRenderer

from splap_editor.resources import shader
from splap_editor.viewport.gizmo_actor import cells_of, set_points, unlit_actor


class MarkShape(IntEnum):
    """What a mark looks like."""

    DOT = 0
    SQUARE = 1
    CROSS = 2


@dataclass(frozen=True, eq=False)
class Mark:
    """A mark of constant size on the screen.

    Parameters
    ----------
    at : (3,) float64
        World position.
    color : (r, g, b)
        0..255.
    shape : MarkShape
    is_chosen : bool
        Rimmed white.
    is_active : bool
        Larger too.
    """

    at: NDArray[np.float64]
    color: tuple[int, int, int]
    shape: MarkShape = MarkShape.DOT
    is_chosen: bool = False
    is_active: bool = False


_CODE_STEP = 28
"""The fourth channel of a mark's colour says shape and state, in steps wide enough to survive rounding."""


class Markers:
    """Marks always seen: handles, pins, the pivot, the ends of axes. Later ones lie over earlier ones.

    Parameters
    ----------
    renderer : vtkRenderer
        The overlay they are drawn into.
    """

    def __init__(self, renderer: vtkRenderer):
        self._renderer = renderer
        self._poly = vtkPolyData()
        mapper = vtkPolyDataMapper()
        mapper.SetInputData(self._poly)
        mapper.SetVBOShiftScaleMethod(0)
        mapper.SetColorModeToDirectScalars()
        self.actor = vtkActor()
        self.actor.SetMapper(mapper)
        self.actor.PickableOff()
        self.actor.UseBoundsOff()
        self.actor.ForceTranslucentOn()
        self._shaders = self.actor.GetShaderProperty()
        self._shaders.SetVertexShaderCode(shader("marker.vert"))
        self._shaders.SetGeometryShaderCode(shader("marker.geom"))
        self._shaders.SetFragmentShaderCode(shader("marker.frag"))
        self.set_size(13.0)
        self.set_viewport_size(1, 1)
        self.clear()
        renderer.AddActor(self.actor)

    def close(self) -> None:
        """Leave the renderer."""
        self._renderer.RemoveActor(self.actor)

    def show(self, marks: Sequence[Mark]) -> None:
        """Show these marks in place of those before."""
        self.clear()
        if not marks:
            return
        points = np.array([mark.at for mark in marks], np.float64)
        self.actor.SetPosition(*points[0])
        vtk_points = vtkPoints()
        vtk_points.SetData(numpy_to_vtk((points - points[0]).astype(np.float32), deep=True))
        codes = [_CODE_STEP * (1 + 3 * mark.shape + mark.is_chosen + mark.is_active) for mark in marks]
        rgba = np.array([(*mark.color, code) for mark, code in zip(marks, codes, strict=True)], np.uint8)
        self._poly.SetPoints(vtk_points)
        self._poly.GetPointData().SetScalars(numpy_to_vtk(rgba, deep=True))
        self._poly.SetVerts(cells_of(np.array([len(points)])))
        self.actor.VisibilityOn()

    def clear(self) -> None:
        """Show no marks."""
        self.actor.VisibilityOff()

    def set_size(self, diameter_px: float) -> None:
        """Diameter in device pixels."""
        self._shaders.GetGeometryCustomUniforms().SetUniformf("pointPx", diameter_px)

    def set_viewport_size(self, width: int, height: int) -> None:
        """Size in device pixels of the picture that is drawn next."""
        self._shaders.GetGeometryCustomUniforms().SetUniform2f("viewportPx", (float(width), float(height)))


class Rings:
    """Closed lines: the disc of a handle on the surface, a free radius.

    Parameters
    ----------
    renderer : vtkRenderer
        The overlay they are drawn into.
    """

    def __init__(self, renderer: vtkRenderer):
        self._renderer = renderer
        self._actors: dict[str, vtkActor] = {}

    def close(self) -> None:
        """Leave the renderer."""
        for name in list(self._actors):
            self.hide(name)

    def show(
        self,
        name: str,
        loops: Sequence[NDArray[np.floating]],
        color: tuple[float, float, float],
        *,
        width_px: float = 2.0,
        opacity: float = 0.9,
        is_closed: bool = True,
    ) -> None:
        """Draw loops of world points, each (K, 3), under a name; a second call replaces them."""
        self.hide(name)
        loops = [np.asarray(loop, np.float64) for loop in loops if len(loop) > 1]
        if not loops:
            return
        if is_closed:
            loops = [np.vstack([loop, loop[:1]]) for loop in loops]
        poly = vtkPolyData()
        set_points(poly, np.vstack(loops))
        poly.SetLines(cells_of(np.array([len(loop) for loop in loops])))
        actor = unlit_actor(poly, color, opacity)
        actor.GetProperty().SetLineWidth(width_px)
        self._actors[name] = actor
        self._renderer.AddActor(actor)

    @property
    def names(self) -> frozenset[str]:
        """Names under which something is drawn."""
        return frozenset(self._actors)

    def hide(self, name: str) -> None:
        """Take the loops of a name away, if there are any."""
        actor = self._actors.pop(name, None)
        if actor is not None:
            self._renderer.RemoveActor(actor)


def circle(center: ArrayLike, normal: ArrayLike, radius: float, n_points: int = 64) -> NDArray[np.float64]:
    """(n_points, 3) circle in world units about a point, across a normal of any length."""
    normal = np.asarray(normal, np.float64) / np.linalg.norm(normal)
    u = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    u /= np.linalg.norm(u)
    angles = np.linspace(0.0, 2.0 * np.pi, n_points, endpoint=False)[:, None]
    return np.asarray(center) + radius * (np.cos(angles) * u + np.sin(angles) * np.cross(normal, u))
