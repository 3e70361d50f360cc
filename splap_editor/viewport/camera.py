"""The camera: what an artist's gestures do to it."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from vtkmodules.vtkCommonMath import vtkMatrix4x4
from vtkmodules.vtkRenderingCore import vtkCamera, vtkRenderer

from splap_editor.core.camera_path import CameraPose
from splap_editor.core.place import Place, file_points, placed_points
from splap_editor.viewport.projection import Projection

# Nearer than this share of the farthest point nothing is drawn: a 24-bit depth buffer resolves no more.
_NEAREST_SHARE = 2e-4
_STEEPEST = np.cos(np.radians(0.5))


@dataclass(frozen=True, eq=False)
class View:
    """Where the camera stands and looks; a value that can be kept, compared and blended.

    Parameters
    ----------
    position, focal_point : (3,) float64
        World positions of the eye and of the point orbited about.
    view_up : (3,) float64
        Unit vector to the top of the screen.
    angle : float
        Vertical opening in degrees.
    is_parallel : bool
        Orthographic. The visible height is then that of the perspective
        camera at the focal point, so that switching keeps the picture.
    """

    position: NDArray[np.float64]
    focal_point: NDArray[np.float64]
    view_up: NDArray[np.float64]
    angle: float = 35.0
    is_parallel: bool = False

    @property
    def distance(self) -> float:
        """From the eye to the focal point."""
        return float(np.linalg.norm(self.focal_point - self.position))

    @property
    def direction(self) -> NDArray[np.float64]:
        """(3,) unit vector from the eye into the scene."""
        return (self.focal_point - self.position) / self.distance

    @property
    def half_height(self) -> float:
        """World height of the upper half of the picture at the focal point."""
        return self.distance * np.tan(np.radians(self.angle) / 2.0)

    def is_near(self, other: "View") -> bool:
        """Whether two views stand and look the same, but for rounding."""
        near = 1e-6 * other.distance
        mine, others = (np.concatenate([view.position, view.focal_point]) for view in (self, other))
        return bool(np.abs(mine - others).max() <= near)


def view_of(pose: CameraPose) -> View:
    """The view from where a keyed camera stands."""
    eye, target, up = (np.array(v, np.float64) for v in (pose.position, pose.target, pose.up))
    return View(eye, target, up / np.linalg.norm(up), pose.angle, pose.is_parallel)


def camera_pose(view: View) -> CameraPose:
    """What a key keeps of a view."""
    eye, target, up = ((float(x), float(y), float(z)) for x, y, z in (view.position, view.focal_point, view.view_up))
    return CameraPose(eye, target, up, float(view.angle), bool(view.is_parallel))


def turn(axis: ArrayLike, angle_rad: float) -> NDArray[np.float64]:
    """(3, 3) rotation about an axis of any length, right-handed (Rodrigues)."""
    x, y, z = np.asarray(axis, np.float64) / np.linalg.norm(axis)
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle_rad) * K + (1.0 - np.cos(angle_rad)) * (K @ K)


def _screen_axes(view: View) -> NDArray[np.float64]:
    right = np.cross(view.direction, view.view_up)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(right, view.direction)])


def _turned(view: View, R: NDArray[np.float64], about: NDArray[np.float64]) -> View:
    return replace(
        view,
        position=about + R @ (view.position - about),
        focal_point=about + R @ (view.focal_point - about),
        view_up=R @ view.view_up,
    )


def orbited(
    view: View, yaw_rad: float, pitch_rad: float, world_up: ArrayLike | None, about: ArrayLike | None = None
) -> View:
    """Go round the focal point, or another point.

    Parameters
    ----------
    view : View
        Where the camera stands.
    yaw_rad, pitch_rad : float
        Positive yaw turns the scene to the right, positive pitch its top towards the viewer.
    world_up : (3,) float, optional
        Turntable: yaw about this axis, stopping short of the poles. None: trackball, about the screen's axes.
    about : (3,) float, optional
        Centre of the turn; it keeps its place on the screen.
    """
    about = view.focal_point if about is None else np.asarray(about, np.float64)
    right, up = _screen_axes(view)
    if world_up is None:
        return _turned(view, turn(up, -yaw_rad) @ turn(right, -pitch_rad), about)
    pole = np.asarray(world_up, np.float64) / np.linalg.norm(world_up)
    # The eye's height over the equator; an upside-down camera keeps turning as its picture suggests.
    sign = 1.0 if up @ pole >= 0.0 else -1.0
    height = np.arcsin(np.clip(-(view.direction @ pole) * sign, -1.0, 1.0))
    limit = np.arcsin(_STEEPEST)
    pitch = np.clip(height + pitch_rad, -max(limit, abs(height)), max(limit, abs(height))) - height
    return _turned(view, turn(pole, -yaw_rad * sign) @ turn(right, -float(pitch)), about)


def panned(view: View, dx: float, dy: float) -> View:
    """Shift eye and focal point by world lengths to the right and to the top of the screen."""
    right, up = _screen_axes(view)
    shift = dx * right + dy * up
    return replace(view, position=view.position + shift, focal_point=view.focal_point + shift)


def zoomed(view: View, factor: float, towards: ArrayLike | None = None) -> View:
    """Multiply the distance by ``factor`` (< 1: nearer); the point ``towards`` (3,) keeps its place on the screen."""
    towards = view.focal_point if towards is None else np.asarray(towards, np.float64)
    return replace(
        view,
        position=towards + (view.position - towards) * factor,
        focal_point=towards + (view.focal_point - towards) * factor,
    )


def framed(view: View, points: ArrayLike, aspect: float, *, room: float = 0.0, margin: float = 1.12) -> View:
    """Keep the direction; go where world points just fill the picture.

    Parameters
    ----------
    view : View
        Where the camera stands.
    points : (N, 3) float
        At least one.
    aspect : float
        Width over height of the picture.
    room : float
        World length to keep around the points.
    margin : float
        Size of the picture over that of the points in it.
    """
    # Coordinate by coordinate: extremes along memory are found ten times as fast as across rows of three.
    columns = np.array(np.asarray(points).T, np.float64, order="C")
    center = (columns.min(axis=1) + columns.max(axis=1)) / 2.0
    columns -= center[:, None]
    right, up = np.abs(_screen_axes(view) @ columns) + room
    slope = np.tan(np.radians(view.angle) / 2.0)
    needed = margin * np.maximum(up, right / aspect) / slope
    if not view.is_parallel:
        needed = needed - view.direction @ columns
    # Far from the origin a smaller step would be lost in rounding, and eye and focal point would be one.
    distance = max(float(needed.max()), 1e-9, 1e-9 * float(np.abs(center).max()))
    return replace(view, focal_point=center, position=center - distance * view.direction)


def box_corners(box: NDArray[np.float64]) -> NDArray[np.float64]:
    """(8, 3) corners of a box ``(low, high)`` (2, 3)."""
    return np.array([[box[i, 0], box[j, 1], box[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])


def axis_view(view: View, axis: ArrayLike, world_up: ArrayLike) -> View:
    """Look at the focal point from the side that ``axis`` (3,) points to; along ``world_up`` the old up decides."""
    axis = np.asarray(axis, np.float64) / np.linalg.norm(axis)
    up = np.asarray(world_up, np.float64) / np.linalg.norm(world_up)
    if abs(axis @ up) > 0.999:
        # The nearest world axis to where "away" pointed, so that top views do not spin.
        candidates = np.concatenate([np.eye(3), -np.eye(3)])
        candidates = candidates[np.abs(candidates @ axis) < 0.5]
        up = candidates[np.argmax(candidates @ (view.view_up + 0.5 * view.direction * -np.sign(axis @ up)))]
    return replace(view, position=view.focal_point + axis * view.distance, view_up=up)


def scene_axes(world_up: ArrayLike) -> NDArray[np.float64]:
    """(3, 3) rows right, away from the viewer in front, and up, of a scene that stands along ``world_up`` (3,).

    Right is X, or Y in a scene that stands along X.
    """
    up = np.asarray(world_up, np.float64) / np.linalg.norm(world_up)
    side = np.eye(3)[0 if abs(up[0]) < 0.9 else 1]
    right = side - (side @ up) * up
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(up, right), up])


def blended(start: View, end: View, share: float) -> View:
    """A view between two, for a short flight: turned along the shorter way, distance blended geometrically."""
    if share >= 1.0:
        return end
    A, B = (np.column_stack([*_screen_axes(v), -v.direction]) for v in (start, end))
    R = B @ A.T
    cosine = np.clip((np.trace(R) - 1.0) / 2.0, -1.0, 1.0)
    axis = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    if np.linalg.norm(axis) < 1e-9:
        axis = A[:, 1]
    frame = turn(axis, np.arccos(cosine) * share) @ A
    focal = start.focal_point + (end.focal_point - start.focal_point) * share
    distance = start.distance ** (1.0 - share) * end.distance**share
    return replace(
        end,
        focal_point=focal,
        position=focal + frame[:, 2] * distance,
        view_up=frame[:, 1],
        angle=start.angle + (end.angle - start.angle) * share,
    )


def _numpy(matrix: vtkMatrix4x4) -> NDArray[np.float64]:
    return np.array(matrix.GetData(), np.float64).reshape(4, 4)


class Camera:
    """A renderer's camera with the gestures of the editor.

    Parameters
    ----------
    renderer : vtkRenderer
        Its active camera is driven.
    world_up : (3,) float
        Axis of the turntable in the placed scene; captures are often y-down: (0, -1, 0).

    Views are in the file's coordinates; up, and the axes looked along, are those of the placed scene.
    """

    def __init__(self, renderer: vtkRenderer, world_up: ArrayLike = (0.0, 0.0, 1.0)):
        self._renderer = renderer
        self.place = Place()
        self.is_turntable = True
        self.world_up = np.asarray(world_up, np.float64)
        self.home = View(np.array([2.0, -3.0, 1.5]), np.zeros(3), self.world_up)
        self.view = self.home

    @property
    def vtk(self) -> vtkCamera:
        """The camera driven."""
        return self._renderer.GetActiveCamera()

    @property
    def view(self) -> View:
        """Where the camera stands; assign to move it."""
        vtk = self.vtk
        return View(
            np.array(vtk.GetPosition()),
            np.array(vtk.GetFocalPoint()),
            np.array(vtk.GetViewUp()),
            vtk.GetViewAngle(),
            bool(vtk.GetParallelProjection()),
        )

    @view.setter
    def view(self, view: View) -> None:
        vtk = self.vtk
        vtk.SetPosition(*view.position)
        vtk.SetFocalPoint(*view.focal_point)
        vtk.SetViewUp(*view.view_up)
        vtk.OrthogonalizeViewUp()
        vtk.SetViewAngle(view.angle)
        vtk.SetParallelProjection(view.is_parallel)
        vtk.SetParallelScale(view.half_height)

    @property
    def axes(self) -> NDArray[np.float64]:
        """(3, 3) rows X, Y, Z of the placed scene in the file's coordinates."""
        return self.place.rotation

    @property
    def up(self) -> NDArray[np.float64]:
        """(3,) where up is in the file's coordinates."""
        return self.world_up @ self.axes

    def show_place(self, place: Place, about: ArrayLike | None = None) -> None:
        """Look at the scene put elsewhere.

        Parameters
        ----------
        place : Place
        about : (3,) float, optional
            Point of the file that keeps its place and size in the picture: the camera goes along with it, but does not
            turn. None: the camera stays where it is in the placed scene, which moves before it.
        """
        before, view, self.place = self.place, self.view, place
        if about is not None:
            self.view = _turned(view, place.rotation.T @ before.rotation, np.asarray(about, np.float64))
            return
        turn = place.rotation.T @ before.rotation
        ends = placed_points(np.stack([view.position, view.focal_point]), before)
        eye, focus = file_points(ends, place)
        self.view = replace(view, position=eye, focal_point=focus, view_up=turn @ view.view_up)

    def orbit(self, dx_px: float, dy_px: float, about: ArrayLike | None = None) -> None:
        """Turn by a pointer move (y down): once across the height of the picture is half a turn."""
        per_px = np.pi / max(self._renderer.GetSize()[1], 1)
        up = self.up if self.is_turntable else None
        self.view = orbited(self.view, dx_px * per_px, dy_px * per_px, up, about)

    def pan(self, dx_px: float, dy_px: float, point: ArrayLike | None = None) -> None:
        """Shift by a pointer move (y down), so that ``point`` (or the focal point) follows the pointer."""
        view = self.view
        unit = self.projection().world_per_pixel(view.focal_point if point is None else point)
        self.view = panned(view, -dx_px * unit, dy_px * unit)

    def zoom(self, factor: float, towards: ArrayLike | None = None) -> None:
        """Go nearer (> 1) or away; ``towards`` (3,) stays under the pointer."""
        self.view = zoomed(self.view, 1.0 / factor, towards)

    def zoom_at(self, factor: float, x: float, y: float, point: ArrayLike | None = None) -> None:
        """Zoom to the pixel under the pointer: to the surface ``point`` there, else to the focal plane."""
        if point is None:
            view = self.view
            point = self.projection().on_plane(x, y, view.focal_point, view.direction)
        self.zoom(factor, point)

    def frame(self, points: ArrayLike, *, room: float = 0.0) -> View:
        """View in which points (N, 3) fill the picture, direction kept; no points: the view as it is."""
        points = np.asarray(points, np.float64).reshape(-1, 3)
        if not len(points):
            return self.view
        width, height = self._renderer.GetSize()
        return framed(self.view, points, max(width, 1) / max(height, 1), room=room)

    def look_from(self, axis: ArrayLike) -> View:
        """View from the side that an axis (3,) of the placed scene points to."""
        R, origin = self.axes, np.zeros(3)
        return _turned(axis_view(_turned(self.view, R, origin), axis, self.world_up), R.T, origin)

    def set_parallel(self, is_parallel: bool) -> None:
        """Orthographic or perspective; what is at the focal point keeps its size."""
        self.view = replace(self.view, is_parallel=is_parallel)

    def fit_clipping(self, bounds: NDArray[np.float64], subject: NDArray[np.float64] | None = None) -> None:
        """Set near and far so that a world box, ``((3,) low, (3,) high)``, lies between.

        Parameters
        ----------
        bounds : (2, 3) float64
            Everything there is to see.
        subject : (n, 3) float64, optional
            Corners of what is looked at. How near the eye may come follows from it, not from far floaters.
        """
        view = self.view
        depths = (box_corners(bounds) - view.position) @ view.direction
        reach = float(np.ptp(depths)) + 1e-6 * view.distance
        far = float(depths.max()) + 0.02 * reach
        near = float(depths.min()) - 0.02 * reach
        if not view.is_parallel:
            far = max(far, 1e-3 * view.distance)
            aim = far if subject is None else float(((subject - view.position) @ view.direction).max())
            # With the subject behind the eye, or very close to it, the far end alone must still be resolved.
            near = max(near, _NEAREST_SHARE * float(np.clip(aim, _NEAREST_SHARE * far, far)))
        self.vtk.SetClippingRange(near, far)

    def projection(self) -> Projection:
        """The matrices of the picture, at the size of the renderer."""
        width, height = (max(n, 1) for n in self._renderer.GetSize())
        return Projection(
            _numpy(self.vtk.GetViewTransformMatrix()),
            _numpy(self.vtk.GetProjectionTransformMatrix(width / height, -1.0, 1.0)),
            width,
            height,
        )

    def ray_through(self, x: float, y: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Origin (3,) and unit direction (3,) of the ray through a pixel, device pixels from the top left."""
        return self.projection().ray(x, y)
