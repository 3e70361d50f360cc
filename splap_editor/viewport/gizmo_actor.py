"""How the gizmo looks."""

import numpy as np
from numpy.typing import NDArray
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkCommonMath import vtkMatrix4x4
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper, vtkRenderer

from splap_editor.viewport.gizmo import Gizmo
from splap_editor.viewport.gizmo_parts import (
    ARROW_END,
    ARROW_START,
    DOT_RADIUS,
    PARTS,
    SCALE_BOX,
    SCALE_BOX_AT,
    Act,
    Lock,
    Part,
    line_of_sight,
    ring_points,
    square_corners,
)
from splap_editor.viewport.projection import Projection

AXIS_COLORS = ((0.93, 0.30, 0.34), (0.52, 0.78, 0.25), (0.28, 0.56, 0.96))
_WHITE = (0.92, 0.92, 0.92)
_HOVER = (1.0, 0.86, 0.35)
_SIDES = 24
_CONE_LENGTH, _CONE_RADIUS = 0.22, 0.062
# World axis guides are so many gizmo sizes long: off the screen on both sides.
_GUIDE_LENGTH = 60.0


def unlit_actor(poly: vtkPolyData, color: tuple[float, float, float] = _WHITE, opacity: float = 1.0) -> vtkActor:
    """A flat-coloured actor that takes no part in picking or in the bounds of the scene."""
    mapper = vtkPolyDataMapper()
    mapper.SetInputData(poly)
    actor = vtkActor()
    actor.SetMapper(mapper)
    appearance = actor.GetProperty()
    appearance.LightingOff()
    appearance.SetColor(*color)
    appearance.SetOpacity(opacity)
    actor.PickableOff()
    actor.UseBoundsOff()
    return actor


def cells_of(sizes: NDArray[np.int64]) -> vtkCellArray:
    """Cells over points numbered through: the first ``sizes[0]`` points are the first cell, and so on."""
    offsets = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
    cells = vtkCellArray()
    cells.SetData(numpy_to_vtk(offsets, deep=True), numpy_to_vtk(np.arange(offsets[-1]), deep=True))
    return cells


def set_points(poly: vtkPolyData, points: NDArray[np.floating]) -> None:
    """Put a copy of points (N, 3) into a mesh."""
    vtk_points = vtkPoints()
    vtk_points.SetData(numpy_to_vtk(np.ascontiguousarray(points, np.float64), deep=True))
    poly.SetPoints(vtk_points)


class GizmoActor:
    """Draws a `Gizmo` into an overlay renderer; `refresh` before each frame.

    Parameters
    ----------
    gizmo : Gizmo
        The model; only read.
    renderer : vtkRenderer
        The overlay.
    """

    def __init__(self, gizmo: Gizmo, renderer: vtkRenderer):
        self._gizmo = gizmo
        self._parts = {part: self._part_actor(part) for part in PARTS}
        guide = vtkPolyData()
        set_points(guide, np.array([[0, 0, -_GUIDE_LENGTH], [0, 0, _GUIDE_LENGTH]]))
        guide.SetLines(cells_of(np.array([2])))
        self._guide = unlit_actor(guide, opacity=0.7)
        self._actors = [self._guide, *self._parts.values()]
        for actor in self._actors:
            renderer.AddActor(actor)
        self._renderer = renderer

    def close(self) -> None:
        """Leave the renderer."""
        for actor in self._actors:
            self._renderer.RemoveActor(actor)

    def _part_actor(self, part: Part) -> vtkActor:
        poly = vtkPolyData()
        if part.act is Act.ROTATE:
            poly.SetLines(cells_of(np.array([65])))
            set_points(poly, np.zeros((65, 3)))
            return unlit_actor(poly)
        if part.lock is Lock.PLANE:
            set_points(poly, square_corners(part.axis))
            poly.SetPolys(cells_of(np.array([4])))
            return unlit_actor(poly, opacity=0.65)
        if part.lock is Lock.VIEW:
            half = 5.0 / self._gizmo.size_px
            turn = np.linspace(0.0, 2.0 * np.pi, _SIDES, endpoint=False)
            circle = DOT_RADIUS * np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])
            square = half * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) + [SCALE_BOX_AT, SCALE_BOX_AT, 0]
            outline = square if part == SCALE_BOX else circle
            set_points(poly, outline)
            poly.SetPolys(cells_of(np.array([len(outline)])))
            return unlit_actor(poly, opacity=0.95)
        points, lines, polys = _arrow(part.axis)
        set_points(poly, points)
        poly.SetLines(lines)
        poly.SetPolys(polys)
        return unlit_actor(poly)

    def refresh(self, projection: Projection) -> None:
        """Place, size and colour all parts for the picture that comes next."""
        gizmo = self._gizmo
        for part, actor in self._parts.items():
            actor.SetVisibility(gizmo.is_shown and gizmo.is_part_shown(part, projection))
        dragged = gizmo.dragged
        self._guide.SetVisibility(dragged is not None and dragged.lock is Lock.AXIS)
        if not gizmo.is_shown:
            return
        origin = gizmo.shown_frame[:3, 3]
        size = gizmo.arm_length(projection)
        screen = np.column_stack([projection.right, projection.up, -projection.direction])
        sight = line_of_sight(projection, origin)
        for part, actor in self._parts.items():
            is_hot = part in (gizmo.hovered, dragged)
            base = _WHITE if part.lock is Lock.VIEW else AXIS_COLORS[part.axis]
            actor.GetProperty().SetColor(*(_HOVER if is_hot else base))
            actor.GetProperty().SetLineWidth((3.0 if is_hot else 2.0) * gizmo.scale)
            axes = gizmo.axes
            if part.act is Act.ROTATE:
                line = ring_points(part, gizmo.axes, sight, projection, part == dragged)
                set_points(actor.GetMapper().GetInput(), line)
                axes = np.eye(3)
            elif part.lock is Lock.VIEW:
                axes = screen
            _place(actor, origin, size * axes)
        if dragged is not None and dragged.lock is Lock.AXIS:
            self._guide.GetProperty().SetColor(*AXIS_COLORS[dragged.axis])
            self._guide.GetProperty().SetLineWidth(1.0 * gizmo.scale)
            _place(self._guide, origin, size * np.roll(gizmo.axes, 2 - dragged.axis, axis=1))


def _arrow(axis: int) -> tuple[NDArray[np.float64], vtkCellArray, vtkCellArray]:
    """Points, shaft line and cone of an arrow along an axis, in gizmo units."""
    angles = np.linspace(0.0, 2.0 * np.pi, _SIDES, endpoint=False)
    base = np.column_stack(
        [np.full(_SIDES, ARROW_END - _CONE_LENGTH), _CONE_RADIUS * np.cos(angles), _CONE_RADIUS * np.sin(angles)]
    )
    shaft = np.array([[ARROW_START, 0, 0], [ARROW_END - _CONE_LENGTH, 0, 0], [ARROW_END, 0, 0]])
    points = np.roll(np.vstack([shaft, base]), axis, axis=1)
    rim = np.arange(_SIDES) + 3
    sides = np.column_stack([np.full(_SIDES, 2), rim, np.roll(rim, -1)])
    lines, polys = vtkCellArray(), vtkCellArray()
    lines.SetData(2, numpy_to_vtk(np.array([0, 1], np.int64), deep=True))
    polys.SetData(
        3,
        numpy_to_vtk(
            np.vstack([sides, np.column_stack([np.full(_SIDES - 2, 3), rim[1:-1], rim[2:]])]).ravel(), deep=True
        ),
    )
    return points, lines, polys


def _place(actor: vtkActor, origin: NDArray[np.float64], axes: NDArray[np.float64]) -> None:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = axes, origin
    vtk_matrix = vtkMatrix4x4()
    vtk_matrix.DeepCopy(matrix.ravel().tolist())
    actor.SetUserMatrix(vtk_matrix)
