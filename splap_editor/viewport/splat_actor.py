"""One actor that draws all splats of a scene, one GL point each."""

from dataclasses import dataclass, replace
from enum import Enum, IntFlag

import numba as nb
import numpy as np
from numpy.typing import NDArray
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonCore import VTK_INT, vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkDataObject, vtkPolyData
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

from splap_editor.core.index_spaces import FileMask, FileRows, RowsByPlace
from splap_editor.core.splats.main_subject import MainSubject
from splap_editor.core.twofold_loop import TwofoldLoop
from splap_editor.resources import shader
from splap_editor.viewport.glyphs import Glyphs

_BLOCK = 64


def _box(means: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Least and greatest of each column, (3,) each; ±inf without rows."""
    # Rows of 64 points let the reduction run along memory, three times as fast as along columns of three.
    n = len(means) - len(means) % _BLOCK
    blocks = means[:n].reshape(-1, 3 * _BLOCK)
    ends = []
    for extreme, start in ((np.fmin, np.inf), (np.fmax, -np.inf)):
        of_blocks = extreme.reduce(blocks, axis=0, initial=start).reshape(_BLOCK, 3)
        ends.append(extreme.reduce(np.concatenate([of_blocks, means[n:]]), axis=0, initial=start))
    return ends[0], ends[1]


@nb.njit(nogil=True, cache=True)
def _mix_compiled(colors, tints, mixed):
    """Lay each tint over its colour by the share in its fourth byte; opacities stay."""
    for i in range(colors.shape[0]):
        share = np.int32(tints[i, 3])
        for k in range(3):
            mixed[i, k] = (np.int32(colors[i, k]) * (255 - share) + np.int32(tints[i, k]) * share + 127) // 255
        mixed[i, 3] = colors[i, 3]


def _mix_plain(colors, tints, mixed):
    # Both products and the half that rounds stay below 2¹⁶.
    share = tints[:, 3:].astype(np.uint16)
    mixed[:, :3] = (colors[:, :3] * (255 - share) + tints[:, :3] * share + 127) // 255
    mixed[:, 3] = colors[:, 3]


_mix = TwofoldLoop(_mix_compiled, _mix_plain)


Tint = tuple[float, float, float, float]


class DisplayMode(Enum):
    """How splats are drawn; the value names the shaders."""

    ELLIPSES = "ellipse"
    SPLATS = "splat"
    POINTS = "point"


class SplatFlag(IntFlag):
    """Bits of the per-splat state array."""

    SELECTED = 1
    HIDDEN = 2
    HIGHLIGHTED = 4


@dataclass(frozen=True)
class SplatLook:
    """Display settings of one actor.

    Parameters
    ----------
    mode : DisplayMode
        Ellipses, splats or points.
    size_factor : float
        Glyph size; 1 is the exact occupancy ellipse and the true Gaussian.
    opacity_cut : float
        Splats fainter than this are neither drawn nor picked.
    point_size_px : float
        Diameter in device pixels of the dots of points mode.
    light, rim : float
        Strengths 0..1 of the shading of ellipses and of the darker line around them.
    backface_tint, ghost_tint, select_tint, hover_tint : (float, float, float, float)
        Colour and share of it 0..1 laid over ellipses seen against ``u × v``, over everything,
        over selected and over highlighted splats.
    coverage : float
        Share of the pixels drawn; below 1 the actor is see-through.
    """

    mode: DisplayMode = DisplayMode.ELLIPSES
    size_factor: float = 1.0
    opacity_cut: float = 0.0
    point_size_px: float = 2.5
    light: float = 1.0
    rim: float = 0.8
    backface_tint: Tint = (0.25, 0.32, 0.55, 0.0)
    ghost_tint: Tint = (0.0, 0.0, 0.0, 0.0)
    select_tint: Tint = (0.28, 0.33, 1.0, 0.70)
    hover_tint: Tint = (1.0, 0.98, 0.90, 0.65)
    coverage: float = 1.0


class SplatActor:
    """N splats as GL points with their axes as vertex attributes.

    The arrays given are copied once into buffers that VTK reads in place;
    each ``set_*`` overwrites one of them and marks only that one changed, so
    a selection uploads no geometry. All rows are in file order; drawing
    order lives in the index buffer. Buffers are relative to `origin`, which
    keeps float32 exact far from the world's zero.

    Parameters
    ----------
    glyphs : Glyphs
        Shapes at rest or deformed.
    colors : (N, 4) uint8
        Colour and opacity.
    subject : MainSubject
        What counts as the size of the scene, whatever floats about it.
    """

    def __init__(self, glyphs: Glyphs, colors: NDArray[np.uint8], subject: MainSubject):
        n = len(glyphs.means)
        self.n_splats = n
        self.subject = subject
        self.origin = subject.center
        self.means = np.empty((n, 3), np.float32)
        self.axes_u = np.empty((n, 3), np.float32)
        self.axes_v = np.empty((n, 3), np.float32)
        self.shape = np.empty((n, 2), np.float32)
        self.colors = np.empty((n, 4), np.uint8)
        self.flags = np.zeros(n, np.uint8)
        self._untinted = np.array(colors, np.uint8)
        self._tints: NDArray[np.uint8] | None = None
        self._order: RowsByPlace | None = None
        self._shuffled = np.random.default_rng(0).permutation(n).astype(np.int32)
        self._thinning = 1
        self._build()
        self.shape[:, 1] = glyphs.cutoffs
        reaches = np.linalg.norm(np.hstack([glyphs.axes_u, glyphs.axes_v]), axis=1) * glyphs.cutoffs
        self.reach = float(np.median(reaches)) if n else 0.0
        self.set_subject(subject)
        self._room = float(reaches.max(initial=0.0)) + 1e-6 * self.extent
        self.set_geometry(glyphs.means, glyphs.axes_u, glyphs.axes_v, glyphs.thickness)
        self.set_colors(colors)
        self.look = SplatLook()
        self.set_viewport_size(1, 1)
        self._index()

    def _build(self) -> None:
        self._vtk = {
            name: numpy_to_vtk(getattr(self, name))
            for name in ("means", "axes_u", "axes_v", "shape", "colors", "flags")
        }
        self.vtk_points = vtkPoints()
        self.vtk_points.SetData(self._vtk["means"])
        self._poly = vtkPolyData()
        self._poly.SetPoints(self.vtk_points)
        self._mapper = vtkPolyDataMapper()
        self._mapper.SetInputData(self._poly)
        self._mapper.SetVBOShiftScaleMethod(0)
        self._mapper.SetColorModeToDirectScalars()
        for attribute, name in (("axisU", "axes_u"), ("axisV", "axes_v"), ("shape", "shape"), ("flags", "flags")):
            self._vtk[name].SetName(name)
            self._poly.GetPointData().AddArray(self._vtk[name])
            self._mapper.MapDataArrayToVertexAttribute(attribute, name, vtkDataObject.FIELD_ASSOCIATION_POINTS, -1)
        self._poly.GetPointData().SetScalars(self._vtk["colors"])
        self.actor = vtkActor()
        self.actor.SetMapper(self._mapper)
        self.actor.SetPosition(*self.origin)
        self.actor.GetProperty().LightingOff()
        self.actor.PickableOff()
        self.actor.UseBoundsOff()
        self._shaders = self.actor.GetShaderProperty()
        self._shaders.SetVertexShaderCode(shader("splat.vert"))

    # What is drawn ------------------------------------------------------------------------------------------------

    def set_geometry(
        self,
        means: NDArray[np.floating],
        axes_u: NDArray[np.floating],
        axes_v: NDArray[np.floating],
        thickness: NDArray[np.floating] | None = None,
    ) -> None:
        """Overwrite all centres and axes (N, 3), world units, any float type; thickness (N,) only if given."""
        np.subtract(means, self.origin, out=self.means, casting="same_kind")
        self.axes_u[:] = axes_u
        self.axes_v[:] = axes_v
        self._modified("means", "axes_u", "axes_v")
        if thickness is not None:
            self.shape[:, 0] = thickness
            self._modified("shape")
        self.vtk_points.Modified()

    def set_colors(self, colors: NDArray[np.uint8]) -> None:
        """Overwrite all colours and opacities, (N, 4) uint8; tints stay on top."""
        self._untinted[:] = colors
        self._mix_tints()

    def set_tints(self, tints: NDArray[np.uint8] | None) -> None:
        """Lay a colour over each splat: (N, 4) uint8, the fourth the share of it; None takes all away."""
        self._tints = None if tints is None else np.array(tints, np.uint8)
        self._mix_tints()

    def set_flags(self, flags: NDArray[np.uint8]) -> None:
        """Overwrite the state of all splats, (N,) uint8 of `SplatFlag` bits."""
        self.flags[:] = flags
        self._modified("flags")

    @property
    def is_unordered(self) -> bool:
        """Whether it is drawn in file order."""
        return self._order is None

    def set_order(self, order: RowsByPlace | None) -> None:
        """Draw in this order, a permutation (N,) of the rows, farthest first; None: file order."""
        self._order = order
        self._index()

    def set_thinning(self, k: int) -> None:
        """Draw one splat in ``k`` of a fixed random choice, √k larger; 1 draws all."""
        if k != self._thinning:
            self._thinning = k
            self._index()
            self._set_scale()

    @property
    def n_drawn(self) -> int:
        """Number of splats sent to the graphics card."""
        return -(-self.n_splats // self._thinning)

    # How it is drawn ----------------------------------------------------------------------------------------------

    @property
    def look(self) -> SplatLook:
        """Display settings; assign to change them."""
        return self._look

    @look.setter
    def look(self, look: SplatLook) -> None:
        self._look = look
        self._shaders.SetGeometryShaderCode(shader(f"{look.mode.value}.geom"))
        self._shaders.SetFragmentShaderCode(shader(f"{look.mode.value}.frag"))
        is_blended = look.mode is DisplayMode.SPLATS
        self.actor.SetForceTranslucent(is_blended)
        self.actor.SetForceOpaque(not is_blended)
        geometry, fragment = self._shaders.GetGeometryCustomUniforms(), self._shaders.GetFragmentCustomUniforms()
        # Half a byte below, so that opacities stored as bytes compare as they round.
        geometry.SetUniformf("opacityCut", look.opacity_cut - 0.5 / 255.0)
        geometry.SetUniformf("pointPx", look.point_size_px)
        geometry.SetUniformf("lightShare", look.light)
        for name in ("backface", "ghost", "select", "hover"):
            geometry.SetUniform4f(f"{name}Tint", getattr(look, f"{name}_tint"))
        for uniforms in (geometry, fragment):
            uniforms.SetUniformf("coverage", look.coverage)
        fragment.SetUniformf("rimShare", look.rim)
        self._set_scale()

    def set_viewport_size(self, width: int, height: int) -> None:
        """Size in device pixels of the picture that is drawn next."""
        self._shaders.GetGeometryCustomUniforms().SetUniform2f("viewportPx", (float(width), float(height)))

    @property
    def cutoffs(self) -> NDArray[np.float32]:
        """(N,) radius in standard deviations where each splat ends."""
        return self.shape[:, 1]

    @property
    def base_colors(self) -> NDArray[np.uint8]:
        """(N, 4) colours and opacities without tints."""
        return self._untinted

    @property
    def cut_byte(self) -> int:
        """Least opacity byte that is drawn."""
        return int(np.ceil(self._look.opacity_cut * 255.0 - 0.5))

    def twin(self, size_in_pixels: float = 1.0) -> "SplatActor":
        """A second actor with a copy of the data and the same look, for another window with so much finer pixels."""
        glyphs = Glyphs(self.means + self.origin, self.axes_u, self.axes_v, self.shape[:, 0], self.shape[:, 1])
        twin = SplatActor(glyphs, self.colors, self.subject)
        twin.set_flags(self.flags)
        twin.look = replace(self._look, point_size_px=self._look.point_size_px * size_in_pixels)
        return twin

    def set_subject(self, subject: MainSubject, removed: FileMask | None = None) -> None:
        """Take another subject as the size of the scene, and leave removed splats (N,) out of its bounds."""
        self.subject = subject
        self.extent = max(2.0 * float(np.linalg.norm(subject.half_axes)) + 2.0 * self.reach, 1e-9)
        self._counted = None if removed is None or removed.all() else np.flatnonzero(~removed)

    def bounds(self) -> NDArray[np.float64]:
        """(2, 3) box around all splats that are not removed, world units, with room for their size at rest."""
        low, high = _box(self.means if self._counted is None else self.means[self._counted])
        return np.array([low - self._room, high + self._room]) + self.origin

    # Inside -------------------------------------------------------------------------------------------------------

    def _set_scale(self) -> None:
        self._shaders.GetGeometryCustomUniforms().SetUniformf(
            "glyphScale", self._look.size_factor * self._thinning**0.5
        )

    def _modified(self, *names: str) -> None:
        for name in names:
            self._vtk[name].Modified()
        self._poly.Modified()

    def _mix_tints(self) -> None:
        if self._tints is None:
            self.colors[:] = self._untinted
        else:
            _mix(self._untinted, self._tints, self.colors)
        self._modified("colors")

    def _index(self) -> None:
        rows: FileRows = np.arange(self.n_splats, dtype=np.int32)
        if self._thinning > 1:
            rows = self._shuffled[: self.n_drawn]
        if self._order is not None:
            rows = self._order
            if self._thinning > 1:
                kept = np.zeros(self.n_splats, bool)
                kept[self._shuffled[: self.n_drawn]] = True
                rows = rows[kept[rows]]
        elif self._thinning > 1:
            rows = np.sort(rows)
        # One poly-vertex cell with all points: VTK walks through cells one by one, through ids fast.
        self._rows = np.ascontiguousarray(rows, np.int32)
        self._ends = np.array([0, len(rows)], np.int32)
        cells = vtkCellArray()
        cells.SetData(numpy_to_vtk(self._ends, array_type=VTK_INT), numpy_to_vtk(self._rows, array_type=VTK_INT))
        self._poly.SetVerts(cells)
