"""Where world points land on the screen, and where the ray under a pixel goes."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

# Planes are followed so many times farther than their origin, no farther.
_HORIZON = 50.0


@dataclass(frozen=True, eq=False)
class Projection:
    """The camera of one picture, as plain matrices.

    Pixels are device pixels from the top left corner of the picture; a
    pixel's centre is at half numbers, so the pixel in column 3 spans x from
    3 to 4.

    Parameters
    ----------
    view_from_world : (4, 4) float64
        Eye coordinates: x right, y up, the scene at negative z.
    clip_from_view : (4, 4) float64
        OpenGL projection.
    width, height : int
        Size of the picture in device pixels.
    """

    view_from_world: NDArray[np.float64]
    clip_from_view: NDArray[np.float64]
    width: int
    height: int

    @cached_property
    def clip_from_world(self) -> NDArray[np.float64]:
        """(4, 4) world to OpenGL clip coordinates."""
        return np.asarray(self.clip_from_view @ self.view_from_world, np.float64)

    @cached_property
    def _world_from_clip(self) -> NDArray[np.float64]:
        return np.asarray(np.linalg.inv(self.clip_from_world), np.float64)

    @property
    def is_parallel(self) -> bool:
        """Orthographic rather than perspective."""
        return self.clip_from_view[3, 2] == 0.0

    @cached_property
    def eye(self) -> NDArray[np.float64]:
        """(3,) position of the camera."""
        return -self.view_from_world[:3, :3].T @ self.view_from_world[:3, 3]

    @property
    def direction(self) -> NDArray[np.float64]:
        """(3,) unit vector from the eye into the scene."""
        return -self.view_from_world[2, :3]

    @property
    def right(self) -> NDArray[np.float64]:
        """(3,) unit vector to the right of the screen."""
        return self.view_from_world[0, :3]

    @property
    def up(self) -> NDArray[np.float64]:
        """(3,) unit vector to the top of the screen."""
        return self.view_from_world[1, :3]

    def pixels(self, points: ArrayLike) -> NDArray[np.float64]:
        """(N, 2) pixels of world points (N, 3); a point behind the eye yields NaN."""
        clip = (
            np.atleast_2d(np.asarray(points, np.float64)) @ self.clip_from_world[:, :3].T + self.clip_from_world[:, 3]
        )
        w = np.where(clip[:, 3] > 0.0, clip[:, 3], np.nan)
        return np.stack([(clip[:, 0] / w + 1.0) * 0.5 * self.width, (1.0 - clip[:, 1] / w) * 0.5 * self.height], axis=1)

    def pixel(self, point: ArrayLike) -> NDArray[np.float64]:
        """(2,) pixel of one world point."""
        return self.pixels(point)[0]

    def depths(self, points: ArrayLike) -> NDArray[np.float64]:
        """(N,) distances of world points (N, 3) in front of the eye, along the viewing direction."""
        return (np.atleast_2d(np.asarray(points, np.float64)) - self.eye) @ self.direction

    def ray(self, x: float, y: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Origin (3,) on the near plane and unit direction (3,) of the ray through a pixel position."""
        ndc = (2.0 * x / self.width - 1.0, 1.0 - 2.0 * y / self.height)
        ends = np.array([[*ndc, -1.0, 1.0], [*ndc, 1.0, 1.0]]) @ self._world_from_clip.T
        near, far = ends[:, :3] / ends[:, 3:]
        return near, (far - near) / np.linalg.norm(far - near)

    def world_per_pixel(self, point: ArrayLike) -> float:
        """World length of one pixel at the depth of a world point (3,)."""
        scale = 2.0 / (self.height * self.clip_from_view[1, 1])
        return scale if self.is_parallel else scale * abs(float(self.depths(point)[0]))

    def on_line(self, x: float, y: float, origin: ArrayLike, axis: ArrayLike) -> float:
        """Parameter ``t`` of the point ``origin + t axis`` nearest to the ray through a pixel; 0 if parallel."""
        start, direction = self.ray(x, y)
        axis = np.asarray(axis, np.float64)
        normal = np.cross(axis, direction)
        square = float(normal @ normal)
        if square < 1e-6 * float(np.square(axis).sum()):
            return 0.0
        return float(np.cross(start - np.asarray(origin, np.float64), direction) @ normal / square)

    def on_plane(self, x: float, y: float, origin: ArrayLike, normal: ArrayLike) -> NDArray[np.float64]:
        """(3,) point where the ray through a pixel meets a plane.

        ``origin`` itself when the plane is seen edge-on. Past the plane's
        horizon, where they meet behind the eye, it is the point of the plane
        nearest to one far out on the ray.
        """
        start, direction = self.ray(x, y)
        at, across = np.array(origin, np.float64), np.asarray(normal, np.float64)
        across = across / np.linalg.norm(across)
        slope = direction @ across
        if abs(slope) < 1e-4:
            return at
        farthest = _HORIZON * np.linalg.norm(at - start)
        t = (at - start) @ across / slope
        if not self.is_parallel and not 0.0 <= t <= farthest:
            far = start + direction * farthest
            return far - across * ((far - at) @ across)
        return start + direction * t
