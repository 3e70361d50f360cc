"""How far a handle's weight reaches: the outline of all points within a distance of its own, as seen by the camera."""

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkFiltersCore import vtkFlyingEdges2D, vtkStripper

from splap_editor.viewport.overlays import Rings
from splap_editor.viewport.projection import Projection

_NAME = "cage"
_GRID = 96
# Balls whose centres are nearer to each other than this share of the radius look like one.
_FINENESS = 32
_MOST_POINTS = 3000
_TURN_COS = np.cos(np.radians(2.0))


class CageOutline:
    """Follows the camera: the silhouette of balls of one radius about given points.

    Parameters
    ----------
    rings : Rings
        Draws the lines.
    """

    def __init__(self, rings: Rings) -> None:
        self._rings = rings
        self._points = np.empty((0, 3))
        self._radius = 0.0
        self._color = (1.0, 1.0, 1.0)
        self._direction: NDArray[np.float64] | None = None
        self.loops: list[NDArray[np.float64]] = []

    @property
    def is_shown(self) -> bool:
        """Whether there is an outline to draw."""
        return len(self._points) > 0

    @property
    def radius(self) -> float:
        """Distance in world units that the outline keeps from the points; 0 while nothing is shown."""
        return self._radius if self.is_shown else 0.0

    def show(self, points: ArrayLike, radius: float, color: tuple[float, float, float]) -> None:
        """Outline what lies within ``radius`` of the world points (K, 3), from the next frame on."""
        points, spacing = np.asarray(points, np.float64).reshape(-1, 3), radius / _FINENESS
        self._points = thinned(points, spacing)
        while len(self._points) > _MOST_POINTS:
            spacing *= 1.5
            self._points = thinned(points, spacing)
        self._radius, self._color = float(radius), color
        self._direction = None

    def hide(self) -> None:
        """Draw no outline."""
        self._points = np.empty((0, 3))
        self.loops = []
        self._rings.hide(_NAME)

    def refresh(self, projection: Projection) -> None:
        """Draw it as seen by a camera; nothing happens until that has turned by a little."""
        if not self.is_shown:
            return
        direction = projection.direction
        if not projection.is_parallel:
            direction = self._points.mean(axis=0) - projection.eye
            direction = direction / max(float(np.linalg.norm(direction)), 1e-300)
        if self._direction is not None and self._direction @ direction > _TURN_COS:
            return
        self._direction = direction
        self.loops = outline(self._points, direction, self._radius)
        self._rings.show(_NAME, self.loops, self._color, width_px=1.6, opacity=0.85, is_closed=False)


def thinned(points: NDArray[np.float64], spacing: float) -> NDArray[np.float64]:
    """Keep one of the points (K, 3) in each cube of a side length."""
    if len(points) < 2 or not spacing > 0:
        return points
    cells = np.floor((points - points.min(axis=0)) / spacing).astype(np.int64)
    return points[np.unique(cells, axis=0, return_index=True)[1]]


def outline(points: NDArray[np.float64], direction: NDArray[np.float64], radius: float) -> list[NDArray[np.float64]]:
    """Silhouette of the balls about some points, along a direction of view.

    Parameters
    ----------
    points : (K, 3) float64
        World units; K > 0.
    direction : (3,) float64
        Unit vector of the view.
    radius : float
        World units, greater than 0.

    Returns
    -------
    list of (P, 3) float64
        Closed lines in the plane across the view through the points' mean; the first point comes again as the last.
    """
    middle = points.mean(axis=0)
    u = np.cross(direction, np.eye(3)[np.argmin(np.abs(direction))])
    u /= np.linalg.norm(u)
    v = np.cross(direction, u)
    flat = (points - middle) @ np.stack([u, v], axis=1)
    low, high = flat.min(axis=0) - 1.1 * radius, flat.max(axis=0) + 1.1 * radius
    step = float((high - low).max()) / _GRID
    nx, ny = np.ceil((high - low) / step).astype(int) + 1
    xs, ys = low[0] + step * np.arange(nx), low[1] + step * np.arange(ny)
    grid = np.stack(np.meshgrid(xs, ys), axis=-1).reshape(-1, 2)
    image = vtkImageData()
    image.SetDimensions(int(nx), int(ny), 1)
    image.SetSpacing(step, step, 1.0)
    image.SetOrigin(float(low[0]), float(low[1]), 0.0)
    distances = cKDTree(flat).query(grid)[0]
    image.GetPointData().SetScalars(numpy_to_vtk(distances, deep=True))
    edges = vtkFlyingEdges2D()
    edges.SetInputData(image)
    edges.SetValue(0, radius)
    stripper = vtkStripper()
    stripper.JoinContiguousSegmentsOn()
    stripper.SetMaximumLength(100_000)
    stripper.SetInputConnection(edges.GetOutputPort())
    stripper.Update()
    poly = stripper.GetOutput()
    if not poly.GetNumberOfPoints():
        return []
    where = vtk_to_numpy(poly.GetPoints().GetData()).astype(np.float64)
    world = middle + where[:, :1] * u + where[:, 1:2] * v
    offsets = vtk_to_numpy(poly.GetLines().GetOffsetsArray())
    joined = vtk_to_numpy(poly.GetLines().GetConnectivityArray())
    return [world[joined[a:b]] for a, b in pairwise(offsets)]
