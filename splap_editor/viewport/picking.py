"""What is under the cursor."""

from dataclasses import dataclass

import numba as nb
import numpy as np
from numpy.typing import NDArray

from splap_editor.core.index_spaces import FileRow
from splap_editor.viewport.projection import Projection
from splap_editor.viewport.splat_actor import DisplayMode, SplatActor, SplatFlag

_HIDDEN = int(SplatFlag.HIDDEN)


@dataclass(frozen=True, eq=False)
class Hit:
    """A point of the surface under the cursor.

    Parameters
    ----------
    row : FileRow
        Splat hit, row in the file.
    point : (3,) float64
        Where the ray meets the plane of the splat, world units.
    normal : (3,) float64
        Unit normal of the splat, towards the eye.
    """

    row: FileRow
    point: NDArray[np.float64]
    normal: NDArray[np.float64]


@nb.njit(nogil=True, cache=True)
def _ray_hit(means, axes_u, axes_v, shape, colors, flags, scale, cut, start, direction, is_blended):
    """Row and ray parameter of the first ellipse, or of the splat at which half of the light has been stopped."""
    best, best_row = np.float32(np.inf), -1
    hits = np.empty((64, 2), np.float32)
    rows = np.empty(64, np.int64)
    n_hits = 0
    sx, sy, sz = start
    dx, dy, dz = direction
    for i in range(means.shape[0]):
        cx, cy, cz = means[i, 0] - sx, means[i, 1] - sy, means[i, 2] - sz
        ux, uy, uz = axes_u[i, 0], axes_u[i, 1], axes_u[i, 2]
        vx, vy, vz = axes_v[i, 0], axes_v[i, 1], axes_v[i, 2]
        uu, vv = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz
        reach = shape[i, 1] * scale
        square = reach * reach
        along = cx * dx + cy * dy + cz * dz
        if cx * cx + cy * cy + cz * cz - along * along > square * (uu + vv):
            continue
        if flags[i] & _HIDDEN or colors[i, 3] < cut or square <= 0.0:
            continue
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        gram = nx * nx + ny * ny + nz * nz
        slope = dx * nx + dy * ny + dz * nz
        if gram == 0.0 or slope == 0.0:
            continue
        t = (cx * nx + cy * ny + cz * nz) / slope
        if t <= 0.0 or (t >= best and not is_blended):
            continue
        hx, hy, hz = t * dx - cx, t * dy - cy, t * dz - cz
        # u and v need not be orthogonal once the splat is deformed: solve with their Gram matrix.
        hu, hv, uv = hx * ux + hy * uy + hz * uz, hx * vx + hy * vy + hz * vz, ux * vx + uy * vy + uz * vz
        a, b = (hu * vv - hv * uv) / gram, (hv * uu - hu * uv) / gram
        if a * a + b * b > square:
            continue
        if not is_blended:
            best, best_row = t, i
            continue
        if n_hits == len(rows):
            hits = np.concatenate((hits, np.empty_like(hits)))
            rows = np.concatenate((rows, np.empty_like(rows)))
        hits[n_hits, 0] = t
        hits[n_hits, 1] = colors[i, 3] / np.float32(255.0) * np.exp(-0.5 * (a * a + b * b) / (scale * scale))
        rows[n_hits] = i
        n_hits += 1
    if is_blended and n_hits > 0:
        passed, strongest = 1.0, 0.0
        for k in np.argsort(hits[:n_hits, 0]):
            if hits[k, 1] * passed > strongest:
                strongest = hits[k, 1] * passed
                best, best_row = hits[k, 0], rows[k]
            passed *= 1.0 - hits[k, 1]
            if passed < 0.5:
                return rows[k], hits[k, 0]
    return best_row, best


def surface_hit(actor: SplatActor, projection: Projection, x: float, y: float) -> Hit | None:
    """The surface under a pixel position, as it is drawn.

    Ellipses: the nearest ellipse that the ray meets, exactly. Splats and
    points: the splat at which the accumulated opacity passes one half, else
    the one that shows most. Hidden splats and those under the opacity cut
    are looked through.

    Parameters
    ----------
    actor : SplatActor
        What is drawn.
    projection : Projection
        The camera.
    x, y : float
        Device pixels from the top left corner.
    """
    start, direction = projection.ray(x, y)
    is_blended = actor.look.mode is not DisplayMode.ELLIPSES
    row, t = _ray_hit(
        actor.means,
        actor.axes_u,
        actor.axes_v,
        actor.shape,
        actor.colors,
        actor.flags,
        np.float32(actor.look.size_factor if actor.look.mode is not DisplayMode.POINTS else 1.0),
        actor.cut_byte,
        tuple(np.float32(start - actor.origin)),
        tuple(np.float32(direction)),
        is_blended,
    )
    if row < 0:
        return None
    normal = np.cross(actor.axes_u[row].astype(np.float64), actor.axes_v[row])
    normal *= -np.sign(normal @ direction) / np.linalg.norm(normal)
    return Hit(int(row), start + float(t) * direction, normal)
