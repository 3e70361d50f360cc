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

from splap_editor.core.index_spaces import FileMask, RowsByPlace
from splap_editor.core.splats.main_subject import MainSubject
from splap_editor.core.twofold_loop import TwofoldLoop
from splap_editor.resources import shader
from splap_editor.viewport.contribution import Contribution, contribution
from splap_editor.viewport.depth_order import depth_order
from splap_editor.viewport.frame_quality import FrameQuality
from splap_editor.viewport.glyphs import Glyphs

_BLOCK = 64
ARRAYS = ("means", "axes_u", "axes_v", "shape", "colors", "flags")


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


def _subtract(points: NDArray[np.floating], origin: NDArray[np.float64], out: NDArray[np.float32]) -> None:
    """Write points (N, 3) relative to an origin to ``out``."""
    if points.flags.c_contiguous:
        n = len(points) - len(points) % _BLOCK
        blocks = (n // _BLOCK, 3 * _BLOCK)
        origins = np.tile(origin, _BLOCK)
        np.subtract(points[:n].reshape(blocks), origins, out=out[:n].reshape(blocks), casting="same_kind")
        points, out = points[n:], out[n:]
    np.subtract(points, origin, out=out, casting="same_kind")


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


mix_colors = TwofoldLoop(_mix_compiled, _mix_plain)


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


class _Cloud:
    """Some splats in the arrays that the graphics card reads: one GL point each, with its axes as attributes."""

    def __init__(self, n: int):
        self.means = np.empty((n, 3), np.float32)
        self.axes_u = np.empty((n, 3), np.float32)
        self.axes_v = np.empty((n, 3), np.float32)
        self.shape = np.empty((n, 2), np.float32)
        self.colors = np.empty((n, 4), np.uint8)
        self.flags = np.zeros(n, np.uint8)
        self._vtk = {name: numpy_to_vtk(getattr(self, name)) for name in ARRAYS}
        self.vtk_points = vtkPoints()
        self.vtk_points.SetData(self._vtk["means"])
        self._poly = vtkPolyData()
        self._poly.SetPoints(self.vtk_points)
        self.mapper = vtkPolyDataMapper()
        self.mapper.SetInputData(self._poly)
        self.mapper.SetVBOShiftScaleMethod(0)
        self.mapper.SetColorModeToDirectScalars()
        for attribute, name in (("axisU", "axes_u"), ("axisV", "axes_v"), ("shape", "shape"), ("flags", "flags")):
            self._vtk[name].SetName(name)
            self._poly.GetPointData().AddArray(self._vtk[name])
            self.mapper.MapDataArrayToVertexAttribute(attribute, name, vtkDataObject.FIELD_ASSOCIATION_POINTS, -1)
        self._poly.GetPointData().SetScalars(self._vtk["colors"])

    def modified(self, *names: str) -> None:
        """Have these arrays uploaded again, and no others."""
        for name in names:
            self._vtk[name].Modified()
        if "means" in names:
            self.vtk_points.Modified()
        self._poly.Modified()

    def draw(self, order: RowsByPlace) -> None:
        """Draw these points, in this order."""
        # One poly-vertex cell with all points: VTK walks through cells one by one, through ids fast.
        self._places = np.ascontiguousarray(order, np.int32)
        self._ends = np.array([0, len(order)], np.int32)
        cells = vtkCellArray()
        cells.SetData(numpy_to_vtk(self._ends, array_type=VTK_INT), numpy_to_vtk(self._places, array_type=VTK_INT))
        self._poly.SetVerts(cells)


class SplatActor:
    """N splats as GL points with their axes as vertex attributes.

    The arrays given are copied once into buffers that VTK reads in place;
    each ``set_*`` overwrites one of them and marks only that one changed, so
    a selection uploads no geometry. All rows are in file order; drawing
    order lives in the index buffer. Buffers are relative to `origin`, which
    keeps float32 exact far from the world's zero. While only some splats are
    drawn they have buffers of their own, so that a moving picture does not
    upload what it does not show.

    Parameters
    ----------
    glyphs : Glyphs
        Shapes at rest or deformed.
    colors : (N, 4) uint8
        Colour and opacity.
    subject : MainSubject
        What counts as the size of the scene, whatever floats about it.
    by_contribution : Contribution, optional
        Which splats give most; found here where the caller does not know it.
    """

    def __init__(
        self,
        glyphs: Glyphs,
        colors: NDArray[np.uint8],
        subject: MainSubject,
        by_contribution: Contribution | None = None,
    ):
        n = len(glyphs.means)
        self.n_splats = n
        self.subject = subject
        self.origin = subject.center
        self.by_contribution = by_contribution or contribution(glyphs, colors)
        self._all = _Cloud(n)
        self._given: tuple[NDArray[np.floating], ...] | None = None
        self.shape, self.colors, self.flags = self._all.shape, self._all.colors, self._all.flags
        self.vtk_points = self._all.vtk_points
        self.n_moves = self.n_looks = 0
        self._box: NDArray[np.float64] | None = None
        self._few_for: tuple[int, int] | None = None
        self._few: _Cloud | None = None
        self._few_rows = np.empty(0, np.int32)
        self._few_sorted_along: NDArray[np.float64] | None = None
        self._coarseness = 1
        self._untinted = np.array(colors, np.uint8)
        self._tints: NDArray[np.uint8] | None = None
        self._order: RowsByPlace | None = None
        self._build()
        self.shape[:, 1] = glyphs.cutoffs
        squares = sum(np.einsum("ij,ij->i", axes, axes) for axes in (glyphs.axes_u, glyphs.axes_v))
        reaches = np.sqrt(squares) * glyphs.cutoffs
        self.reach = float(np.median(reaches)) if n else 0.0
        self.set_subject(subject)
        self._room = float(reaches.max(initial=0.0)) + 1e-6 * self.extent
        self.set_geometry(glyphs.means, glyphs.axes_u, glyphs.axes_v, glyphs.thickness)
        self.set_colors(colors)
        self.look = SplatLook()
        self.set_viewport_size(1, 1)
        self.set_order(None)

    def _build(self) -> None:
        self.actor = vtkActor()
        self.actor.SetMapper(self._all.mapper)
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
        """Overwrite all centres and axes (N, 3), world units, any float type; thickness (N,) only if given.

        The arrays must not change afterwards: while only some splats are drawn, the others are read when wanted.
        """
        self._given = (means, axes_u, axes_v)
        self.n_moves += 1
        self._box = None
        if self._few is None:
            self.settle()
        else:
            rows = self._few_rows
            np.subtract(means[rows], self.origin, out=self._few.means, casting="same_kind")
            self._few.axes_u[:], self._few.axes_v[:] = axes_u[rows], axes_v[rows]
            self._few.modified("means", "axes_u", "axes_v")
            self._few_sorted_along = None
            self.vtk_points.Modified()
        if thickness is not None:
            self.shape[:, 0] = thickness
            self._modified("shape")

    def settle(self) -> None:
        """Take in the geometry of splats that are not drawn, if that was put off."""
        if self._given is None:
            return
        (means, axes_u, axes_v), self._given = self._given, None
        _subtract(means, self.origin, self._all.means)
        self._all.axes_u[:] = axes_u
        self._all.axes_v[:] = axes_v
        self._all.modified("means", "axes_u", "axes_v")

    @property
    def means(self) -> NDArray[np.float32]:
        """(N, 3) centres relative to `origin`."""
        self.settle()
        return self._all.means

    @property
    def axes_u(self) -> NDArray[np.float32]:
        """(N, 3) first in-plane axes, world units."""
        self.settle()
        return self._all.axes_u

    @property
    def axes_v(self) -> NDArray[np.float32]:
        """(N, 3) second in-plane axes, world units."""
        self.settle()
        return self._all.axes_v

    def set_colors(self, colors: NDArray[np.uint8]) -> None:
        """Overwrite all colours and opacities, (N, 4) uint8; tints stay on top."""
        self._untinted[:] = colors
        self._mix_tints()

    @property
    def tints(self) -> NDArray[np.uint8] | None:
        """(N, 4) colours laid over the splats, the fourth their share; None where none are."""
        return self._tints

    def set_tints(self, tints: NDArray[np.uint8] | None) -> None:
        """Lay a colour over each splat: (N, 4) uint8, the fourth the share of it; None takes all away."""
        self.n_looks += tints is not None or self._tints is not None
        self._tints = None if tints is None else np.array(tints, np.uint8)
        self._mix_tints()

    def set_flags(self, flags: NDArray[np.uint8]) -> None:
        """Overwrite the state of all splats, (N,) uint8 of `SplatFlag` bits."""
        if ((self.flags ^ flags) & SplatFlag.HIDDEN).any():
            self._few_for = None
        self.flags[:] = flags
        self._modified("flags")

    @property
    def order(self) -> RowsByPlace | None:
        """(N,) rows as they are drawn, farthest first; None: in file order."""
        return self._order

    def set_order(self, order: RowsByPlace | None) -> None:
        """Draw in this order, a permutation (N,) of the rows, farthest first; None: file order."""
        self._order = order
        self._all.draw(np.arange(self.n_splats, dtype=np.int32) if order is None else order)

    def set_quality(self, quality: FrameQuality) -> None:
        """Draw so many splats, those that give most of what is not hidden, for a picture of so coarse pixels."""
        if quality.coarseness != self._coarseness:
            self._coarseness = quality.coarseness
            self._set_coarseness()
        wanted = quality.n_drawn, self.cut_byte
        if quality.n_drawn >= self.n_splats:
            if self._few is not None:
                self.settle()
                self._few = self._few_for = None
                self.actor.SetMapper(self._all.mapper)
        elif wanted != self._few_for:
            self.settle()
            self._few_for = wanted
            rows = self.by_contribution.rows
            seen = (self.flags & SplatFlag.HIDDEN == 0) & (self._untinted[:, 3] >= self.cut_byte)
            # In file order, which is kinder to the cache.
            self._few_rows = np.sort(rows[seen[rows]][: quality.n_drawn])
            self._few = _Cloud(len(self._few_rows))
            self._fill_few(*ARRAYS)
            self._few.draw(np.arange(len(self._few_rows), dtype=np.int32))
            self.actor.SetMapper(self._few.mapper)

    @property
    def is_thinned(self) -> bool:
        """Whether only some splats are drawn."""
        return self._few is not None

    @property
    def n_drawn(self) -> int:
        """Number of splats sent to the graphics card."""
        return self.n_splats if self._few is None else len(self._few_rows)

    def sort_few(self, direction: NDArray[np.floating]) -> None:
        """Order the splats of a thinned picture along a direction (3,); the order of all is for others to make."""
        along = self._few_sorted_along
        if self._few is not None and (along is None or not np.array_equal(along, direction)):
            self._few.draw(depth_order(self._few.means, direction))
            self._few_sorted_along = np.array(direction)

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
        geometry.SetUniformf("glyphScale", look.size_factor)
        self._set_coarseness()

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
        twin = SplatActor(glyphs, self.colors, self.subject, self.by_contribution)
        twin.set_flags(self.flags)
        twin.look = replace(self._look, point_size_px=self._look.point_size_px * size_in_pixels)
        return twin

    def set_subject(self, subject: MainSubject, removed: FileMask | None = None) -> None:
        """Take another subject as the size of the scene, and leave removed splats (N,) out of its bounds."""
        self.subject = subject
        self.extent = max(2.0 * float(np.linalg.norm(subject.half_axes)) + 2.0 * self.reach, 1e-9)
        self._counted = None if removed is None or removed.all() else np.flatnonzero(~removed)
        self._box = None
        self.n_looks += 1

    def bounds(self, *, of_drawn: bool = False) -> NDArray[np.float64]:
        """(2, 3) box around all splats that are not removed, or those drawn, world units, with room for their size."""
        if of_drawn and self._few is not None:
            return self._with_room(_box(self._few.means))
        if self._box is None:
            self._box = self._with_room(_box(self.means if self._counted is None else self.means[self._counted]))
        return self._box

    # Inside -------------------------------------------------------------------------------------------------------

    def _with_room(self, box: tuple[NDArray[np.float32], NDArray[np.float32]]) -> NDArray[np.float64]:
        """(2, 3) box around means, with room for the size of splats, in the world."""
        return np.array([box[0] - self._room, box[1] + self._room]) + self.origin

    def _set_coarseness(self) -> None:
        for uniforms in (self._shaders.GetGeometryCustomUniforms(), self._shaders.GetFragmentCustomUniforms()):
            uniforms.SetUniformf("coarseness", float(self._coarseness))

    def _modified(self, *names: str) -> None:
        self._all.modified(*names)
        self._fill_few(*names)

    def _fill_few(self, *names: str) -> None:
        if self._few is None:
            return
        for name in names:
            np.take(getattr(self._all, name), self._few_rows, axis=0, out=getattr(self._few, name))
        self._few.modified(*names)
        if "means" in names:
            self._few_sorted_along = None

    def _mix_tints(self) -> None:
        if self._tints is None:
            self.colors[:] = self._untinted
        else:
            mix_colors(self._untinted, self._tints, self.colors)
        self._modified("colors")
