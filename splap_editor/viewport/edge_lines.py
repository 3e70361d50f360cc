"""Graph edges drawn over the splats they join."""

import numba as nb
import numpy as np
from numpy.typing import ArrayLike, NDArray
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkRenderingCore import vtkPolyDataMapper, vtkRenderer

from splap_editor.core.index_spaces import FileRows
from splap_editor.resources import shader
from splap_editor.viewport.frame_quality import FrameQuality
from splap_editor.viewport.gizmo_actor import unlit_actor
from splap_editor.viewport.projection import Projection
from splap_editor.viewport.splat_actor import SplatActor

# Lifted off the surface by this share of the scene, or half of each line would drown in its own ellipses.
_LIFT = 0.008
# More lines than this cannot be told apart on a screen, and would take longer to draw than the splats.
MOST_DRAWN = 100_000


@nb.njit(nogil=True, cache=True)
def _in_view(means, edges, clip, is_in_view):
    """Mark edges with an end inside the picture; how many there are."""
    count = 0
    for e in range(edges.shape[0]):
        is_in_view[e] = False
        for k in range(2):
            i = edges[e, k]
            x, y, z = means[i, 0], means[i, 1], means[i, 2]
            w = clip[3, 0] * x + clip[3, 1] * y + clip[3, 2] * z + clip[3, 3]
            if (
                abs(clip[0, 0] * x + clip[0, 1] * y + clip[0, 2] * z + clip[0, 3]) <= w
                and abs(clip[1, 0] * x + clip[1, 1] * y + clip[1, 2] * z + clip[1, 3]) <= w
            ):
                is_in_view[e] = True
                count += 1
                break
    return count


class EdgeLines:
    """Lines between splat centres, which follow the splats as these move.

    The centres are the splat actor's own buffer: a deformation costs the
    edges nothing. Lines fade towards a colour with depth. Where more than
    `MOST_DRAWN` are in the picture, a fixed random choice of them is drawn:
    nearer views show ever more, and at last all.

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
        mapper = self.actor.GetMapper()
        assert isinstance(mapper, vtkPolyDataMapper)
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
        self.n_edges = self.n_drawn = 0
        self._drawn_for: tuple[object, ...] = ()
        self._width_px = 1.0
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
        self._edges = np.array(edges, np.int32).reshape(-1, 2)
        self.n_edges = len(self._edges)
        self.actor.SetVisibility(self.n_edges > 0)
        self._rgba = np.full((self.n_edges, 4), 255, np.uint8)
        self._rgba[:, :3] = colors
        self._ranks = np.random.default_rng(0).random(self.n_edges)
        self._drawn_for = ()
        self._width_px = width_px
        if self.n_edges:
            self._draw(slice(None))

    def _draw(self, chosen: slice | NDArray[np.bool_]) -> None:
        self._ids = np.ascontiguousarray(self._edges[chosen].ravel())
        self._shown_rgba = np.ascontiguousarray(self._rgba[chosen])
        self.n_drawn = len(self._shown_rgba)
        self._ends = np.arange(0, len(self._ids) + 1, 2, dtype=np.int32)
        lines = vtkCellArray()
        lines.SetData(numpy_to_vtk(self._ends), numpy_to_vtk(self._ids))
        self._poly.SetLines(lines)
        self._poly.GetCellData().SetScalars(numpy_to_vtk(self._shown_rgba))

    def _choose(self, projection: Projection, most: int) -> None:
        """Draw what is in the picture, as much of it as there is time for."""
        if self.n_edges <= most and self.n_drawn == self.n_edges:
            return
        clip = projection.clip_from_world.copy()
        clip[:, 3] += clip[:, :3] @ self._splats.origin
        wanted = (clip.tobytes(), most, self._splats.vtk_points.GetMTime())
        if wanted == self._drawn_for:
            return
        self._drawn_for = wanted
        chosen = np.empty(self.n_edges, bool)
        count = _in_view(self._splats.means, self._edges, clip.astype(np.float32), chosen)
        if count > most:
            chosen &= self._ranks < most / count
        self._draw(chosen)

    @property
    def colors(self) -> NDArray[np.uint8]:
        """(E, 3) colour of each edge."""
        return self._rgba[:, :3]

    def hide(self) -> None:
        """Draw no edges."""
        self.show(np.empty((0, 2), np.int32), np.zeros(3, np.uint8))

    def twin(self, splats: SplatActor, renderer: vtkRenderer, width_px: float) -> "EdgeLines":
        """The same edges between the same splats in another window, so many pixels wide."""
        twin = EdgeLines(splats, renderer)
        twin.near, twin.fade, twin.background = self.near, self.fade, self.background
        twin.show(self._edges, self.colors, width_px)
        return twin

    def refresh(self, projection: Projection, quality: FrameQuality | None = None) -> None:
        """Choose edges and set width, depth fade, near limit and lift for the picture that comes next.

        Of edges as large a share is drawn as of splats; without a quality, all.
        """
        if not self.n_edges:
            return
        self._splats.settle()
        quality = quality or FrameQuality(self._splats.n_splats)
        self._choose(projection, MOST_DRAWN * quality.n_drawn // self._splats.n_splats)
        self.actor.GetProperty().SetLineWidth(max(self._width_px / quality.coarseness, 1.0))
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


def edges_within_hops(edges: FileRows, rows: ArrayLike, n_hops: int, n_splats: int) -> NDArray[np.bool_]:
    """(E,) which edges (E, 2) are reached from the given rows in at most this many steps."""
    reached = np.zeros(n_splats, bool)
    reached[np.asarray(rows, np.intp)] = True
    chosen: NDArray[np.bool_] = np.zeros(len(edges), bool)
    for _ in range(n_hops):
        step = np.asarray(reached[edges].any(axis=1))
        if (step == chosen).all():
            break
        chosen = step
        reached[edges[chosen].ravel()] = True
    return chosen
