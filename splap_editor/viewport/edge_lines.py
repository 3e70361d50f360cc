"""Graph edges drawn over the splats they join."""

import numpy as np
from numpy.typing import ArrayLike, NDArray
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkRenderingCore import vtkPolyDataMapper, vtkRenderer

from splap_editor.resources import shader
from splap_editor.viewport.gizmo_actor import unlit_actor
from splap_editor.viewport.projection import Projection
from splap_editor.viewport.splat_actor import SplatActor

# Lifted off the surface by this share of the scene, or half of each line would drown in its own ellipses.
_LIFT = 0.008


class EdgeLines:
    """Lines between splat centres, which follow the splats as these move.

    The centres are the splat actor's own buffer: a deformation costs the
    edges nothing. Lines fade towards a colour with depth.

    Parameters
    ----------
    splats : SplatActor
        Whose centres are joined.
    renderer : vtkRenderer
        The scene's renderer, so that splats hide edges behind them.
    """

    def __init__(self, splats: SplatActor, renderer: vtkRenderer):
        self._splats, self._renderer = splats, renderer
        self._poly = vtkPolyData()
        self._poly.SetPoints(splats.vtk_points)
        self.actor = unlit_actor(self._poly)
        self.actor.SetPosition(*splats.origin)
        mapper: vtkPolyDataMapper = self.actor.GetMapper()
        mapper.SetVBOShiftScaleMethod(0)
        mapper.SetScalarModeToUseCellData()
        mapper.SetColorModeToDirectScalars()
        self._shaders = self.actor.GetShaderProperty()
        for tag in ("Dec", "Impl"):
            vertex, fragment = (f"//VTK::PositionVC::{tag}", f"//VTK::{'Color' if tag == 'Dec' else 'Light'}::{tag}")
            name = tag.lower()
            self._shaders.AddVertexShaderReplacement(vertex, True, f"{vertex}\n{shader(f'edge_{name}.vert')}", False)
            self._shaders.AddFragmentShaderReplacement(
                fragment, True, f"{fragment}\n{shader(f'edge_{name}.frag')}", False
            )
        self.actor.ForceOpaqueOn()
        self.actor.VisibilityOff()
        self.n_edges = 0
        self.near = 0.0
        self.fade = 0.75
        self.background = (0.1, 0.1, 0.1)
        renderer.AddActor(self.actor)

    def close(self) -> None:
        """Leave the renderer."""
        self._renderer.RemoveActor(self.actor)

    def show(self, edges: ArrayLike, colors: ArrayLike, width_px: float = 1.0) -> None:
        """Draw these edges and no others.

        Parameters
        ----------
        edges : (E, 2) int
            File rows joined; none hides all.
        colors : (E, 3) or (3,) uint8
            Colour of each edge, or of all.
        width_px : float
            In device pixels.
        """
        edges = np.asarray(edges, np.int32).reshape(-1, 2)
        self.n_edges = len(edges)
        self.actor.SetVisibility(bool(len(edges)))
        if not len(edges):
            return
        self._ids = np.ascontiguousarray(edges.ravel())
        self._ends = np.arange(0, 2 * len(edges) + 1, 2, dtype=np.int32)
        rgba = np.full((len(edges), 4), 255, np.uint8)
        rgba[:, :3] = colors
        lines = vtkCellArray()
        lines.SetData(numpy_to_vtk(self._ends), numpy_to_vtk(self._ids))
        self._poly.SetLines(lines)
        self._rgba = rgba
        self._poly.GetCellData().SetScalars(numpy_to_vtk(rgba))
        self.actor.GetProperty().SetLineWidth(width_px)

    def hide(self) -> None:
        """Draw no edges."""
        self.actor.VisibilityOff()
        self.n_edges = 0

    def twin(self, splats: SplatActor, renderer: vtkRenderer, width_px: float) -> "EdgeLines":
        """The same edges between the same splats in another window, so many pixels wide."""
        twin = EdgeLines(splats, renderer)
        twin.near, twin.fade, twin.background = self.near, self.fade, self.background
        twin.show(self._ids.reshape(-1, 2), self._rgba[:, :3], width_px)
        return twin

    def refresh(self, projection: Projection) -> None:
        """Set depth fade, near limit and lift for the picture that comes next."""
        if not self.actor.GetVisibility():
            return
        row = np.append(projection.direction, projection.direction @ (self._splats.origin - projection.eye))
        middle = float(row[3])
        half = 0.5 * self._splats.extent
        clip = projection.clip_from_view
        vertex, fragment = self._shaders.GetVertexCustomUniforms(), self._shaders.GetFragmentCustomUniforms()
        vertex.SetUniform4f("depthRow", tuple(row))
        lift = (
            float(clip[2, 2]),
            float(clip[2, 3]),
            0.0 if projection.is_parallel else 1.0,
            _LIFT * self._splats.extent,
        )
        vertex.SetUniform4f("liftBy", lift)
        fragment.SetUniform4f("fadeTo", (*self.background, self.fade))
        fragment.SetUniform3f("fadeRange", (middle - half, middle + half, self.near))


def edges_within_hops(edges: NDArray[np.integer], rows: ArrayLike, n_hops: int, n_splats: int) -> NDArray[np.bool_]:
    """(E,) which edges (E, 2) are reached from the given rows in at most this many steps."""
    reached = np.zeros(n_splats, bool)
    reached[np.asarray(rows, np.intp)] = True
    chosen = np.zeros(len(edges), bool)
    for _ in range(n_hops):
        step = reached[edges].any(axis=1)
        if (step == chosen).all():
            break
        chosen = step
        reached[edges[chosen].ravel()] = True
    return chosen
