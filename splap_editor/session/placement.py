"""Where a new handle or pin goes: a disc on the surface, held at the pose it has on screen."""

from dataclasses import replace

import numpy as np

from splap_editor.core.arap.rotation_fit import fit_rotations
from splap_editor.core.handle_nodes import Region, region_nodes
from splap_editor.core.index_spaces import FileRow, FileRows
from splap_editor.core.pose import Pose
from splap_editor.core.splats.rotations import matrices_to_quats
from splap_editor.core.surface.geodesics import geodesic_distances
from splap_editor.engine.edit import Pin
from splap_editor.session.scene import Scene


def disc_rows(scene: Scene, row: FileRow, radius: float) -> FileRows:
    """File rows of the active splats within a geodesic radius of one.

    Measured along the splat graph, so a disc on one slat does not reach the
    next; as the crow flies while there is no graph yet.

    Parameters
    ----------
    scene : Scene
    row : FileRow
        The splat in the middle; an inert one gives itself alone.
    radius : float
        World units.

    Returns
    -------
    (k,) int64
        Ascending, never empty.
    """
    ellipses = scene.ellipses
    node = int(ellipses.node_of_row[row])
    if node < 0:
        return np.array([row], np.int64)
    near = np.linalg.norm(ellipses.centers - ellipses.centers[node], axis=1) <= radius
    if scene.surface is not None:
        near = geodesic_distances(scene.surface.graph, np.array([node]), limit=radius) <= radius
    near[node] = True
    return np.sort(ellipses.rows[near])


def rows_region(scene: Scene, rows: FileRows) -> Region:
    """Region of given file rows about the mean of their rest positions, as a recipe has it."""
    rows = np.unique(np.asarray(rows, np.int64))
    return Region(np.asarray(scene.splats.means, np.float64)[rows].mean(axis=0), 0.0, rows)


def moved_pin(scene: Scene, pin: Pin, row: FileRow) -> Pin:
    """Pin that is the disc of the same reach about another splat; one that is no disc stays where it is."""
    if pin.reach is None:
        return pin
    return replace(pin, region=rows_region(scene, disc_rows(scene, row, pin.reach)))


def pin_with_reach(scene: Scene, pin: Pin, reach: float) -> Pin:
    """Pin that is the disc of another reach, in world units, about the splat nearest to its centre."""
    center = np.asarray(pin.region.center, np.float64)
    rows = scene.ellipses.rows[region_nodes(pin.region, scene.ellipses)]
    middle = int(rows[np.argmin(np.linalg.norm(scene.splats.means[rows] - center, axis=1))])
    # The centre stays, so that growing and shrinking come back to where they began.
    return replace(pin, region=Region(center, 0.0, disc_rows(scene, middle, reach)), reach=reach)


def held_pose(scene: Scene, region: Region) -> Pose:
    """Find the rigid pose that holds a region where it is on screen, so that a handle placed there moves nothing."""
    if scene.kernels is None or region.rows is None:
        return Pose()
    rest = np.asarray(scene.splats.means, np.float64)[region.rows]
    posed = scene.kernels.means[region.rows]
    if np.allclose(rest, posed, rtol=0.0, atol=1e-9 * scene.ellipses.scene_scale):
        return Pose()
    center, moved = rest.mean(axis=0), posed.mean(axis=0)
    covariance = (rest - center).T @ (posed - moved)
    # The splats' own turns decide where their positions do not: one splat, or several in a line.
    spread = np.trace((rest - center).T @ (rest - center))
    covariance += (0.01 * spread + 1e-12) * scene.kernels.rotations[region.rows].mean(axis=0).T
    rotation = fit_rotations(covariance[None])[0]
    quat = matrices_to_quats(rotation[None])[0]
    return Pose(tuple((moved - center).tolist()), tuple(quat.tolist()))
