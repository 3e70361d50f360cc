"""Where a whole scene stands: moved, turned and scaled about a point after everything else.

Graph, handles, pins, removals and poses stay in the file's coordinates, so nothing of them is made anew when the place
changes, and a placed scene bends as it would at rest: ``place(deform(x))``. A view shows the place by standing
elsewhere itself, which turns view-dependent colour and splats of two scales rightly and costs nothing per splat.
Numbers that a person sees and types are those of the placed scene (`placed_pose`, `placed_points`); recipes hold the
file's.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.pose import SCALES, Pose
from splap_editor.core.progress import Progress, no_progress, part_of
from splap_editor.core.splats.rotations import matrices_to_quats, quat_products, quats_to_matrices
from splap_editor.core.splats.splats import LARGEST_COORDINATE, Splats


@dataclass(frozen=True)
class Place:
    """A similarity of the whole scene: ``x → center + translate + scale R (x - center)``.

    Handles, pins, mends and removals are in the file's coordinates: the place comes after them.

    Parameters
    ----------
    center, translate : 3 floats
        In the file's units.
    rotate : 4 floats
        Unit quaternion, w x y z.
    scale : float
        Greater than 0.
    """

    center: tuple[float, float, float] = (0.0, 0.0, 0.0)
    translate: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rotate: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    scale: float = 1.0

    @property
    def is_identity(self) -> bool:
        """Whether everything stays where it is."""
        return (self.translate, self.rotate, self.scale) == (Place.translate, Place.rotate, Place.scale)

    @property
    def rotation(self) -> NDArray[np.float64]:
        """(3, 3) the turn."""
        return quats_to_matrices(np.array([self.rotate]))[0]

    @property
    def matrix(self) -> NDArray[np.float64]:
        """(4, 4) from the file's coordinates to those it is written in."""
        transform, center = np.eye(4), np.array(self.center)
        transform[:3, :3] = self.scale * self.rotation
        transform[:3, 3] = center + self.translate - transform[:3, :3] @ center
        return transform

    def followed_by(self, delta: NDArray[np.float64]) -> "Place":
        """Go on by a similarity (4, 4) of what is written, about the same center; kept within the limits of a place.

        Parameters
        ----------
        delta : (4, 4) float64
            Rotation times a positive scale, and a translation.
        """
        scale = float(np.cbrt(np.linalg.det(delta[:3, :3])))
        turn = delta[:3, :3] / scale @ self.rotation
        center = np.array(self.center)
        moved = delta[:3, :3] @ (center + self.translate) + delta[:3, 3] - center
        quat = matrices_to_quats(turn[None])[0]
        return replace(
            self,
            translate=tuple(np.clip(moved, -LARGEST_COORDINATE, LARGEST_COORDINATE).tolist()),
            rotate=tuple(quat.tolist()),
            scale=float(np.clip(self.scale * scale, *SCALES)),
        )


def placed_points(points: NDArray[np.floating], place: Place) -> NDArray[np.float64]:
    """(n, 3) points where the place puts them."""
    center = np.array(place.center)
    return (np.asarray(points, np.float64) - center) @ (place.scale * place.rotation).T + center + place.translate


def file_points(points: NDArray[np.floating], place: Place) -> NDArray[np.float64]:
    """(n, 3) points of the file that a place puts where these are: the inverse of `placed_points`."""
    center = np.array(place.center)
    moved = np.asarray(points, np.float64) - center - place.translate
    return moved @ place.rotation / place.scale + center


def placed_pose(pose: Pose, place: Place) -> Pose:
    """The pose of a handle as seen in the placed scene: moved along and turned about its axes, in its units.

    Scales along three axes stay those of the file: along others they would be no pose.
    """
    if place.is_identity:
        return pose
    return _turned_pose(pose, place.rotate, place.scale)


def pose_in_file(pose: Pose, place: Place) -> Pose:
    """The pose that `placed_pose` shows so."""
    if place.is_identity:
        return pose
    w, x, y, z = place.rotate
    return _turned_pose(pose, (w, -x, -y, -z), 1.0 / place.scale)


def _turned_pose(pose: Pose, turn: tuple[float, float, float, float], scale: float) -> Pose:
    back = np.array(turn) * [1.0, -1.0, -1.0, -1.0]
    moved = scale * quats_to_matrices(np.array([turn]))[0] @ np.array(pose.translate)
    quat = quat_products(quat_products(np.array([turn]), np.array([pose.rotate])), back[None])[0]
    quat /= np.linalg.norm(quat)
    return replace(pose, translate=tuple(moved.tolist()), rotate=tuple(quat.tolist()))


def recentred_on(place: Place, center: NDArray[np.floating]) -> Place:
    """The same similarity, written about another center (3,) of the file."""
    at = placed_points(np.asarray(center)[None], place)[0]
    return replace(
        place, center=tuple(np.asarray(center, np.float64).tolist()), translate=tuple((at - center).tolist())
    )


def stood_up(
    place: Place, before: NDArray[np.floating], after: NDArray[np.floating], center: NDArray[np.floating]
) -> Place:
    """Turn a place by as little as brings one direction (3,) to another, about a point (3,) of the file."""
    a, b = (np.asarray(each, np.float64) / np.linalg.norm(each) for each in (before, after))
    return place.followed_by(about(placed_points(np.asarray(center)[None], place)[0], turn=_turn_between(a, b)))


def placed_splats(splats: Splats, place: Place, progress: Progress = no_progress) -> Splats:
    """Move, turn and scale splats as one body, their view-dependent colour and their normals' axes with them.

    Parameters
    ----------
    splats : Splats
    place : Place
    progress : Progress
        Told the share done; may cancel.

    Returns
    -------
    Splats
        Arrays of the same types; those that the place does not change are the same. Splats of two scales keep two.
    """
    if place.is_identity:
        return splats
    turns, grows = place.rotate != Place.rotate, place.scale != 1.0
    changed = replace(splats, means=placed_points(splats.means, place).astype(splats.means.dtype))
    progress(0.1)
    if grows:
        radii = splats.filter_radii
        changed = replace(
            changed,
            log_scales=(np.asarray(splats.log_scales, np.float64) + np.log(place.scale)).astype(
                splats.log_scales.dtype
            ),
            filter_radii=None if radii is None else (np.asarray(radii, np.float64) * place.scale).astype(radii.dtype),
        )
    if turns:
        # A product of stored quaternions keeps their lengths.
        quats = quat_products(np.array([place.rotate]), np.asarray(splats.quats, np.float64))
        progress(0.3)
        n = splats.n_splats
        shN = splats.shN
        if shN.shape[1]:
            # It brings the compiler with it, which who only reads a recipe shall not wait for.
            from splap_editor.core.splats.spherical_harmonics import rotated_sh

            rotations = np.broadcast_to(place.rotation, (n, 3, 3))
            shN = rotated_sh(shN, rotations, progress=part_of(progress, 0.3, 1.0)).astype(shN.dtype, copy=False)
        changed = replace(changed, quats=quats.astype(splats.quats.dtype), shN=shN)
    return changed


def fitted_plane(points: NDArray[np.floating]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Middle (3,) of points (n, 3) and unit normal (3,) of the plane that lies closest to them; its side means nothing.

    Raises
    ------
    ValueError
        The points are fewer than three, or lie on a line.
    """
    points = np.asarray(points, np.float64)
    middle = points.mean(axis=0) if len(points) else np.zeros(3)
    if len(points) >= 3:
        _, lengths, axes = np.linalg.svd(points - middle, full_matrices=False)
        if lengths[1] > 1e-9 * lengths[0]:
            return middle, axes[2]
    raise ValueError("a plane needs three points that do not lie on a line: choose others")


def laid_level(
    place: Place,
    middle: NDArray[np.floating],
    normal: NDArray[np.floating],
    up: NDArray[np.floating],
    above: NDArray[np.floating],
) -> Place:
    """Turn a place by as little as makes a plane level, about a point of it.

    Parameters
    ----------
    place : Place
    middle, normal : (3,) float
        The plane, in the file's coordinates; the side of its unit normal means nothing.
    up : (3,) float
        Where up is in what is written, of any length but zero.
    above : (3,) float
        A point over the plane, such as the middle of the subject, in the file's coordinates.
    """
    at = placed_points(np.asarray(middle)[None], place)[0]
    toward = place.rotation @ normal
    upward = np.asarray(up, np.float64) / np.linalg.norm(up)
    if toward @ (placed_points(np.asarray(above)[None], place)[0] - at) < 0.0:
        toward = -toward
    return place.followed_by(about(at, turn=_turn_between(toward, upward)))


def _turn_between(a: NDArray[np.float64], b: NDArray[np.float64]) -> tuple[float, float, float, float]:
    """Unit quaternion of the smallest turn from one unit vector to another; half a turn about any axis across them."""
    if a @ b < -1.0 + 1e-12:
        across = np.cross(a, np.eye(3)[np.argmin(np.abs(a))])
        quat = np.concatenate([[0.0], across])
    else:
        quat = np.concatenate([[1.0 + a @ b], np.cross(a, b)])
    w, x, y, z = (quat / np.linalg.norm(quat)).tolist()
    return w, x, y, z


def sized(place: Place, a: NDArray[np.floating], b: NDArray[np.floating], length: float) -> Place:
    """Scale a place about the first of two points (3,), in the file's coordinates, so that they are ``length`` apart.

    Raises
    ------
    ValueError
        The points coincide, the length is not positive, or the scale would leave the limits of a place.
    """
    ends = placed_points(np.array([a, b]), place)
    apart = float(np.linalg.norm(ends[1] - ends[0]))
    if not (apart > 0.0 and 0.0 < length < np.inf):
        raise ValueError("a true size needs two points apart from each other and a length above 0")
    if not SCALES[0] <= place.scale * length / apart <= SCALES[1]:
        raise ValueError(f"a length of {length:g} would scale the scene beyond {SCALES[0]:g} to {SCALES[1]:g} times")
    return place.followed_by(about(ends[0], scale=length / apart))


def recentred(place: Place, center: NDArray[np.floating]) -> Place:
    """Move a place so that a point (3,) of the file, such as the middle of the subject, is written at the origin."""
    delta = np.eye(4)
    delta[:3, 3] = -placed_points(np.asarray(center)[None], place)[0]
    return place.followed_by(delta)


def about(
    center: NDArray[np.float64], *, turn: tuple[float, float, float, float] = Place.rotate, scale: float = 1.0
) -> NDArray[np.float64]:
    """(4, 4) turn and scale about a point."""
    x, y, z = np.asarray(center, np.float64).tolist()
    return Place((x, y, z), rotate=turn, scale=scale).matrix
