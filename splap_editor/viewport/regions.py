"""Which splats lie in a region of the screen."""

import numba as nb
import numpy as np
from numpy.typing import ArrayLike, NDArray

from splap_editor.core.index_spaces import FileMask
from splap_editor.core.twofold_loop import TwofoldLoop
from splap_editor.viewport.projection import Projection
from splap_editor.viewport.splat_actor import DisplayMode, SplatActor, SplatFlag

_HIDDEN = int(SplatFlag.HIDDEN)
# What blocks the view in a blended picture: the inner part of splats that are not mere haze.
_SOLID_RADIUS = 1.0
_SOLID_OPACITY = 0.1
_CELL_PX = 3
_BATCH = 4096


@nb.njit(nogil=True, cache=True)
def _project_compiled(means, colors, flags, cut, clip, width, height, screen):
    """Write pixel x, y and depth of each centre to ``screen``; NaN if hidden, fainter than ``cut`` or behind."""
    for i in range(means.shape[0]):
        x, y, z = means[i, 0], means[i, 1], means[i, 2]
        w = clip[3, 0] * x + clip[3, 1] * y + clip[3, 2] * z + clip[3, 3]
        depth = clip[2, 0] * x + clip[2, 1] * y + clip[2, 2] * z + clip[2, 3]
        if flags[i] & _HIDDEN or colors[i, 3] < cut or w <= 0.0 or depth <= 0.0:
            screen[i, 0] = screen[i, 1] = screen[i, 2] = np.nan
            continue
        screen[i, 0] = ((clip[0, 0] * x + clip[0, 1] * y + clip[0, 2] * z + clip[0, 3]) / w + 1.0) * 0.5 * width
        screen[i, 1] = (1.0 - (clip[1, 0] * x + clip[1, 1] * y + clip[1, 2] * z + clip[1, 3]) / w) * 0.5 * height
        screen[i, 2] = depth


def _project_plain(means, colors, flags, cut, clip, width, height, screen):
    x, y, depth, w = (means @ clip[:, :3].T + clip[:, 3]).T
    seen = (flags & _HIDDEN == 0) & (colors[:, 3] >= cut) & (w > 0.0) & (depth > 0.0)
    w = np.where(seen, w, np.float32(np.nan))
    screen[:, 0] = (x / w + 1) * (np.float32(0.5) * width)
    screen[:, 1] = (1 - y / w) * (np.float32(0.5) * height)
    screen[:, 2] = np.where(seen, depth, np.float32(np.nan))


project = TwofoldLoop(_project_compiled, _project_plain)


def _local_matrices(actor: SplatActor, projection: Projection) -> NDArray[np.float32]:
    """Rows x, y and w of clip coordinates, and depth along the view as row z, from the actor's own coordinates."""
    clip = projection.clip_from_world.copy()
    clip[2, :3] = projection.direction
    clip[2, 3] = -projection.direction @ projection.eye
    clip[:, 3] += clip[:, :3] @ actor.origin
    return clip.astype(np.float32)


def screen_points(actor: SplatActor, projection: Projection) -> NDArray[np.float32]:
    """Where the centres are on the screen, for the regions below.

    Returns
    -------
    (N, 3) float32
        Device pixels x, y from the top left and the depth in front of the
        eye in world units; NaN for splats that are hidden, under the opacity
        cut or behind the eye, so that no region contains them.
    """
    screen = np.empty((actor.n_splats, 3), np.float32)
    size = np.float32(projection.width), np.float32(projection.height)
    project(actor.means, actor.colors, actor.flags, actor.cut_byte, _local_matrices(actor, projection), *size, screen)
    return screen


def in_rectangle(screen: NDArray[np.float32], x0: float, y0: float, x1: float, y1: float) -> FileMask:
    """(N,) whether each of the `screen_points` lies in a rectangle given by two opposite corners."""
    xs, ys = sorted((float(x0), float(x1))), sorted((float(y0), float(y1)))
    x, y = screen[:, 0], screen[:, 1]
    return (x >= xs[0]) & (x <= xs[1]) & (y >= ys[0]) & (y <= ys[1])


def _polygon_mask(polygon, height, width):
    """(height, width) bool: the pixels whose centres lie inside, even-odd."""
    (ax, ay), (bx, by) = polygon.T, np.roll(polygon, -1, axis=0).T
    # The rows whose centres an edge passes, from its lower end on and short of its upper end.
    first, last = (
        np.clip(np.ceil(end - 0.5), 0, height).astype(int) for end in (np.minimum(ay, by), np.maximum(ay, by))
    )
    edge = np.repeat(np.arange(len(polygon)), last - first)
    row = np.arange(len(edge)) - np.repeat(np.cumsum(last - first) - (last - first), last - first) + first[edge]
    x = ax[edge] + (row + 0.5 - ay[edge]) / (by[edge] - ay[edge]) * (bx[edge] - ax[edge])
    # Each crossing turns inside and outside about, for all pixels to its right.
    turns = np.zeros((height, width + 1), np.uint8)
    np.bitwise_xor.at(turns, (row, np.clip(np.ceil(x - 0.5), 0, width).astype(int)), 1)
    return np.bitwise_xor.accumulate(turns, axis=1)[:, :width].astype(bool)


def _in_mask(screen, mask, left, top):
    x, y = screen[:, 0] - left, screen[:, 1] - top
    inside = (x >= 0.0) & (x < mask.shape[1]) & (y >= 0.0) & (y < mask.shape[0])
    inside[inside] = mask[y[inside].astype(int), x[inside].astype(int)]
    return inside


def in_lasso(screen: NDArray[np.float32], polygon: ArrayLike) -> FileMask:
    """(N,) whether each of the `screen_points` lies in a closed polygon (K, 2) of pixels, even-odd, to one pixel."""
    polygon = np.ascontiguousarray(polygon, np.float64)
    if polygon.ndim != 2 or polygon.shape[1] != 2:
        raise ValueError(f"polygon must have shape (K, 2), got {polygon.shape}")
    if len(polygon) < 3:
        return np.zeros(len(screen), bool)
    low = np.floor(polygon.min(axis=0))
    width, height = (np.ceil(polygon.max(axis=0)) - low + 1).astype(int)
    return _in_mask(screen, _polygon_mask(polygon - low, height, width), np.float32(low[0]), np.float32(low[1]))


def _near_path_plain(screen, path, radius, inside):
    inside[:] = False
    margin = np.array([radius, radius])
    for a, b in zip(path[np.maximum(np.arange(len(path)) - 1, 0)], path, strict=True):
        low, high = np.minimum(a, b) - margin, np.maximum(a, b) + margin
        near = ~inside & ((screen[:, :2] >= low) & (screen[:, :2] <= high)).all(axis=1)
        from_a, along = screen[near, :2] - a, b - a
        length = along @ along
        t = np.clip(from_a @ along / length, 0.0, 1.0) if length > 0.0 else np.zeros(len(from_a))
        inside[near] = ((from_a - t[:, None] * along) ** 2).sum(axis=1) <= radius * radius


@nb.njit(nogil=True, cache=True)
def _near_path_compiled(screen, path, radius, inside):
    """Whether each point of the screen lies within ``radius`` pixels of a path of straight pieces."""
    low_x = low_y = np.inf
    high_x = high_y = -np.inf
    for k in range(path.shape[0]):
        low_x, high_x = min(low_x, path[k, 0] - radius), max(high_x, path[k, 0] + radius)
        low_y, high_y = min(low_y, path[k, 1] - radius), max(high_y, path[k, 1] + radius)
    for i in range(screen.shape[0]):
        x, y = screen[i, 0], screen[i, 1]
        inside[i] = False
        if not (low_x <= x <= high_x and low_y <= y <= high_y):
            continue
        for k in range(path.shape[0]):
            before = max(k - 1, 0)
            ax, ay, bx, by = path[before, 0], path[before, 1], path[k, 0], path[k, 1]
            ex, ey = bx - ax, by - ay
            length = ex * ex + ey * ey
            t = min(max(((x - ax) * ex + (y - ay) * ey) / length, 0.0), 1.0) if length > 0.0 else 0.0
            if (x - ax - t * ex) ** 2 + (y - ay - t * ey) ** 2 <= radius * radius:
                inside[i] = True
                break


near_path = TwofoldLoop(_near_path_compiled, _near_path_plain)


def in_brush(screen: NDArray[np.float32], path: ArrayLike, radius_px: float) -> FileMask:
    """(N,) whether each of the `screen_points` lies within a radius of a stroke (K, 2) of pixels, K >= 1."""
    path = np.ascontiguousarray(np.atleast_2d(path), np.float64)
    if path.ndim != 2 or path.shape[1] != 2 or not len(path):
        raise ValueError(f"path must have shape (K, 2) with K >= 1, got {path.shape}")
    inside = np.empty(len(screen), bool)
    near_path(screen, path, float(radius_px), inside)
    return inside


def _depth_grid_plain(
    screen, axes_u, axes_v, shape, colors, clip, size, scale, solid_radius, solid_cut, left, top, grid
):
    reach = np.minimum(shape[:, 1] * scale, solid_radius)
    rows = np.flatnonzero((screen[:, 2] > 0.0) & (reach > 0.0) & (colors[:, 3] >= solid_cut))
    for start in range(0, len(rows), _BATCH):
        _fill_cells(screen, axes_u, axes_v, reach, clip, size, left, top, grid, rows[start : start + _BATCH])


def _fill_cells(screen, axes_u, axes_v, reach, clip, size, left, top, grid, rows):
    (px, py, depth), reach = screen[rows].T, reach[rows]
    half_x, half_y = np.float32(0.5) * size[0], np.float32(-0.5) * size[1]
    is_perspective = clip[3, :3].any()
    w = depth if is_perspective else np.float32(1.0)
    (ux, uy, uz, uw), (vx, vy, vz, vw) = (clip[:, :3] @ axes[rows].T for axes in (axes_u, axes_v))
    nx, ny = px / half_x - 1, py / half_y + 1
    ax, ay = half_x / w * (ux - nx * uw), half_y / w * (uy - ny * uw)
    bx, by = half_x / w * (vx - nx * vw), half_y / w * (vy - ny * vw)
    det = ax * by - ay * bx
    hx, hy = reach * np.sqrt(ax * ax + bx * bx), reach * np.sqrt(ay * ay + by * by)

    def cells(low, high, n):
        first = np.clip(np.trunc(low / _CELL_PX), 0, n).astype(int)
        return first, np.clip(np.trunc(high / _CELL_PX) + 1, first, n).astype(int)

    c0, c1 = cells(px - hx - left, px + hx - left, grid.shape[1])
    r0, r1 = cells(py - hy - top, py + hy - top, grid.shape[0])
    count = np.where(np.abs(det) < 1e-9, 0, (c1 - c0) * (r1 - r0))
    i = np.repeat(np.arange(len(rows)), count)
    k = np.arange(len(i)) - np.repeat(np.cumsum(count) - count, count)
    r, c = r0[i] + k // (c1 - c0)[i], c0[i] + k % (c1 - c0)[i]
    y, x = (r + 0.5) * _CELL_PX + top - py[i], (c + 0.5) * _CELL_PX + left - px[i]
    inverse = 1 / det[i]
    a, b = (by[i] * x - bx[i] * y) * inverse, (ax[i] * y - ay[i] * x) * inverse
    z = depth[i] + a * uz[i] + b * vz[i]
    covers = (a * a + b * b <= reach[i] ** 2) & (z > 0.0)
    np.minimum.at(grid, (r[covers], c[covers]), z[covers].astype(np.float32))


@nb.njit(nogil=True, cache=True)
def _depth_grid_compiled(
    screen, axes_u, axes_v, shape, colors, clip, size, scale, solid_radius, solid_cut, left, top, grid
):
    """Nearest depth of each cell over the ellipses that cover its centre, each ellipse projected affinely."""
    rows, columns = grid.shape
    half_x, half_y = np.float32(0.5) * size[0], np.float32(-0.5) * size[1]
    right, bottom = left + columns * _CELL_PX, top + rows * _CELL_PX
    is_perspective = clip[3, 0] != 0.0 or clip[3, 1] != 0.0 or clip[3, 2] != 0.0
    # Largest pixels per world unit at unit depth, to pass over what is far from the region.
    zoom_x = half_x * np.sqrt(clip[0, 0] * clip[0, 0] + clip[0, 1] * clip[0, 1] + clip[0, 2] * clip[0, 2])
    zoom_y = -half_y * np.sqrt(clip[1, 0] * clip[1, 0] + clip[1, 1] * clip[1, 1] + clip[1, 2] * clip[1, 2])
    zoom = np.float32(2.0) * max(zoom_x, zoom_y)
    for i in range(screen.shape[0]):
        reach = min(shape[i, 1] * scale, solid_radius)
        depth, px, py = screen[i, 2], screen[i, 0], screen[i, 1]
        if not depth > 0.0 or reach <= 0.0 or colors[i, 3] < solid_cut:
            continue
        # In perspective w is the depth itself; an orthographic camera has w = 1 everywhere.
        w = depth if is_perspective else np.float32(1.0)
        ux, uy, uz = axes_u[i, 0], axes_u[i, 1], axes_u[i, 2]
        vx, vy, vz = axes_v[i, 0], axes_v[i, 1], axes_v[i, 2]
        far = zoom / w * reach * np.sqrt(ux * ux + uy * uy + uz * uz + vx * vx + vy * vy + vz * vz)
        if px + far < left or px - far > right or py + far < top or py - far > bottom:
            continue
        nx, ny = px / half_x - 1.0, py / half_y + 1.0
        uw = clip[3, 0] * ux + clip[3, 1] * uy + clip[3, 2] * uz
        vw = clip[3, 0] * vx + clip[3, 1] * vy + clip[3, 2] * vz
        ax = half_x / w * (clip[0, 0] * ux + clip[0, 1] * uy + clip[0, 2] * uz - nx * uw)
        ay = half_y / w * (clip[1, 0] * ux + clip[1, 1] * uy + clip[1, 2] * uz - ny * uw)
        bx = half_x / w * (clip[0, 0] * vx + clip[0, 1] * vy + clip[0, 2] * vz - nx * vw)
        by = half_y / w * (clip[1, 0] * vx + clip[1, 1] * vy + clip[1, 2] * vz - ny * vw)
        az = clip[2, 0] * ux + clip[2, 1] * uy + clip[2, 2] * uz
        bz = clip[2, 0] * vx + clip[2, 1] * vy + clip[2, 2] * vz
        det = ax * by - ay * bx
        if abs(det) < 1e-9:
            continue
        inverse = np.float32(1.0) / det
        hx, hy = reach * np.sqrt(ax * ax + bx * bx), reach * np.sqrt(ay * ay + by * by)
        c0, c1 = max(int((px - hx - left) / _CELL_PX), 0), min(int((px + hx - left) / _CELL_PX) + 1, columns)
        r0, r1 = max(int((py - hy - top) / _CELL_PX), 0), min(int((py + hy - top) / _CELL_PX) + 1, rows)
        for r in range(r0, r1):
            y = (r + 0.5) * _CELL_PX + top - py
            for c in range(c0, c1):
                x = (c + 0.5) * _CELL_PX + left - px
                a, b = (by * x - bx * y) * inverse, (ax * y - ay * x) * inverse
                if a * a + b * b <= reach * reach:
                    z = depth + a * az + b * bz
                    if 0.0 < z < grid[r, c]:
                        grid[r, c] = z


depth_grid = TwofoldLoop(_depth_grid_compiled, _depth_grid_plain)


def _keep_nearest(screen, grid, slack, left, top, inside):
    rows = np.flatnonzero(inside)
    # Towards zero, as the grid was filled.
    c, r = (((screen[rows, k] - start) / _CELL_PX).astype(int) for k, start in ((0, left), (1, top)))
    in_grid = (r >= 0) & (r < grid.shape[0]) & (c >= 0) & (c < grid.shape[1])
    rows, r, c = rows[in_grid], r[in_grid], c[in_grid]
    inside[rows] = screen[rows, 2] <= grid[r, c] + slack


def visible_only(
    actor: SplatActor,
    projection: Projection,
    screen: NDArray[np.float32],
    inside: FileMask,
    *,
    slack: float = 0.015,
) -> FileMask:
    """Those splats of a region that nothing else hides.

    The ellipses are drawn into a coarse depth grid over the region, so the
    answer does not hang on a frame having been shown. In a blended picture
    only the inner standard deviation of splats above 0.1 opacity hides what
    is behind.

    Parameters
    ----------
    actor, projection
        What is drawn, and the camera.
    screen : (N, 3) float32
        `screen_points` of the two.
    inside : (N,) bool
        The region.
    slack : float
        How far behind the nearest surface still counts as on it, as a share
        of the actor's extent; layers of one surface lie that far apart.

    Returns
    -------
    (N,) bool
        A subset of ``inside``, a new array.
    """
    visible = inside.copy()
    if not inside.any():
        return visible
    points = screen[inside, :2]
    low = np.maximum(np.floor(points.min(axis=0)), 0.0)
    high = np.minimum(np.ceil(points.max(axis=0)) + 1.0, [projection.width, projection.height])
    columns, rows = np.maximum((high - low) / _CELL_PX + 1, 1).astype(int)
    grid = np.full((rows, columns), np.inf, np.float32)
    is_ellipses = actor.look.mode is DisplayMode.ELLIPSES
    depth_grid(
        screen,
        actor.axes_u,
        actor.axes_v,
        actor.shape,
        actor.colors,
        _local_matrices(actor, projection),
        np.array([projection.width, projection.height], np.float32),
        np.float32(actor.look.size_factor if is_ellipses else 1.0),
        np.float32(np.inf if is_ellipses else _SOLID_RADIUS),
        actor.cut_byte if is_ellipses else int(_SOLID_OPACITY * 255),
        np.float32(low[0]),
        np.float32(low[1]),
        grid,
    )
    _keep_nearest(screen, grid, np.float32(slack * actor.extent), np.float32(low[0]), np.float32(low[1]), visible)
    return visible
