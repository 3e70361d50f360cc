"""What is under the cursor."""

from dataclasses import dataclass

import numba as nb
import numpy as np
from numpy.typing import NDArray

from splap_editor.core.index_spaces import FileRow
from splap_editor.core.twofold_loop import TwofoldLoop
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
def _hits_compiled(means, axes_u, axes_v, shape, colors, flags, scale, cut, start, direction, rows, hits):
    """Write the rows that a ray meets, and where along the ray and how opaque; how many, even if fewer have room."""
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
        if t <= 0.0:
            continue
        hx, hy, hz = t * dx - cx, t * dy - cy, t * dz - cz
        # u and v need not be orthogonal once the splat is deformed: solve with their Gram matrix.
        hu, hv, uv = hx * ux + hy * uy + hz * uz, hx * vx + hy * vy + hz * vz, ux * vx + uy * vy + uz * vz
        a, b = (hu * vv - hv * uv) / gram, (hv * uu - hu * uv) / gram
        if a * a + b * b > square:
            continue
        if n_hits < len(rows):
            rows[n_hits], hits[n_hits, 0] = i, t
            hits[n_hits, 1] = colors[i, 3] / np.float32(255.0) * np.exp(-0.5 * (a * a + b * b) / (scale * scale))
        n_hits += 1
    return n_hits


def _hits_plain(means, axes_u, axes_v, shape, colors, flags, scale, cut, start, direction, rows, hits):
    d = np.array(direction, np.float32)
    c, square = means - np.array(start, np.float32), (shape[:, 1] * scale) ** 2
    spread = (axes_u * axes_u).sum(axis=1) + (axes_v * axes_v).sum(axis=1)
    near = (c * c).sum(axis=1) - (c @ d) ** 2 <= square * spread
    near &= (flags & _HIDDEN == 0) & (colors[:, 3] >= cut) & (square > 0.0)
    i = np.flatnonzero(near)
    c, u, v = c[i], axes_u[i], axes_v[i]
    n = np.cross(u, v)
    gram, slope = (n * n).sum(axis=1), n @ d
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (c * n).sum(axis=1) / slope
        h = t[:, None] * d - c
        hu, hv, uv = ((p * q).sum(axis=1) for p, q in ((h, u), (h, v), (u, v)))
        a = (hu * (v * v).sum(axis=1) - hv * uv) / gram
        b = (hv * (u * u).sum(axis=1) - hu * uv) / gram
        met = (t > 0.0) & (a * a + b * b <= square[i])
    met[(gram == 0.0) | (slope == 0.0)] = False
    found = np.flatnonzero(met)
    kept = found[: len(rows)]
    rows[: len(kept)], hits[: len(kept), 0] = i[kept], t[kept]
    falloff = np.exp(-0.5 * (a[kept] ** 2 + b[kept] ** 2) / (scale * scale))
    hits[: len(kept), 1] = colors[i[kept], 3] / np.float32(255.0) * falloff
    return len(found)


ray_hits = TwofoldLoop(_hits_compiled, _hits_plain)


def _all_hits(*arguments):
    """(K,) rows that a ray meets, (K,) where along it and (K,) how opaque, in file order."""
    room = 1024
    while True:
        rows, hits = np.empty(room, np.int64), np.empty((room, 2), np.float32)
        n = ray_hits(*arguments, rows, hits)
        if n <= room:
            return rows[:n], hits[:n, 0], hits[:n, 1]
        room = n


def _seen(at, opaque, is_blended):
    """Which of some hits is seen: the nearest, or where half of the light has been stopped; there is at least one."""
    if not is_blended:
        return int(np.argmin(at))
    order = np.argsort(at)
    passed = np.cumprod(1.0 - opaque[order].astype(np.float64))
    if passed[-1] < 0.5:
        return int(order[np.argmax(passed < 0.5)])
    return int(order[np.argmax(opaque[order] * np.concatenate([[1.0], passed[:-1]]))])


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
    rows, at, opaque = _all_hits(
        actor.means,
        actor.axes_u,
        actor.axes_v,
        actor.shape,
        actor.colors,
        actor.flags,
        np.float32(actor.look.size_factor if actor.look.mode is not DisplayMode.POINTS else 1.0),
        actor.cut_byte,
        tuple((start - actor.origin).astype(np.float32)),
        tuple(direction.astype(np.float32)),
    )
    if not len(rows):
        return None
    hit = _seen(at, opaque, is_blended)
    row, t = int(rows[hit]), at[hit]
    normal = np.cross(actor.axes_u[row].astype(np.float64), actor.axes_v[row])
    normal *= -np.sign(normal @ direction) / np.linalg.norm(normal)
    return Hit(row, start + float(t) * direction, normal)
