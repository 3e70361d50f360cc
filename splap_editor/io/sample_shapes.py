"""Procedural surfaces, of the size of the paper's objects, for samples, tests and the benchmark."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Box = tuple[float, float, float, float, float, float]
"""An axis-aligned box: low and high x, low and high y, low and high z, in world units."""


@dataclass(frozen=True, eq=False)
class Surface:
    """A triangle mesh that splats are laid on, and that says how far apart two of them truly are.

    Parameters
    ----------
    vertices : (V, 3) float64
        World units; the shapes of this module lie within [-1.3, 1.3].
    faces : (F, 3) int64
        Counter-clockwise seen from outside.
    closed : bool
        Whether the mesh bounds a solid. A sheet does not.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    closed: bool = True

    @cached_property
    def _crosses(self) -> NDArray[np.float64]:
        a, b, c = (self.vertices[self.faces[:, corner]] for corner in range(3))
        return np.cross(b - a, c - a)

    @cached_property
    def areas(self) -> NDArray[np.float64]:
        """(F,) area of each face."""
        return np.linalg.norm(self._crosses, axis=1) / 2

    @cached_property
    def normals(self) -> NDArray[np.float64]:
        """(F, 3) unit outward normal of each face; zero for a face without area."""
        return self._crosses / np.maximum(2 * self.areas, np.finfo(float).tiny)[:, None]

    @property
    def volume(self) -> float:
        """Enclosed volume, positive when faces turn outward; without meaning for a sheet."""
        corners = self.vertices[self.faces]
        return float(np.einsum("fi,fi->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6)


def _grid_faces(n_rows: int, n_columns: int, *, wrap: bool = False) -> NDArray[np.int64]:
    """Triangles of a row-major grid of vertices; ``wrap`` joins the last column to the first."""
    row, column = np.mgrid[: n_rows - 1, : n_columns - (not wrap)].reshape(2, -1)
    a, b = row * n_columns + column, row * n_columns + (column + 1) % n_columns
    c, d = a + n_columns, b + n_columns
    # Alternating diagonals keep the mesh from preferring a direction.
    even = ((row + column) % 2 == 0)[:, None]
    first = np.where(even, np.stack([a, b, d], 1), np.stack([a, b, c], 1))
    second = np.where(even, np.stack([a, d, c], 1), np.stack([b, d, c], 1))
    return np.concatenate([first, second])


def _ticks(lows_and_highs: NDArray[np.float64], spacing: float) -> NDArray[np.float64]:
    """All coordinates, with steps above ``spacing`` split evenly."""
    marks = np.unique(np.round(lows_and_highs, 9))
    pieces = [
        np.linspace(low, high, max(1, round((high - low) / spacing)), endpoint=False) for low, high in pairwise(marks)
    ]
    return np.concatenate([*pieces, marks[-1:]])


def box_union(boxes: Sequence[Box], spacing: float = 0.04) -> Surface:
    """Outer surface of a union of axis-aligned boxes; boxes must not meet in an edge or a corner alone."""
    corners = np.asarray(boxes, np.float64)
    ticks = [_ticks(corners[:, 2 * axis : 2 * axis + 2].ravel(), spacing) for axis in range(3)]
    middles = [(values[1:] + values[:-1]) / 2 for values in ticks]
    solid = np.zeros([len(values) for values in middles], bool)
    for box in corners:
        inside = [(m > low) & (m < high) for m, (low, high) in zip(middles, box.reshape(3, 2), strict=True)]
        solid[np.ix_(*inside)] = True
    padded = np.pad(solid, 1).astype(np.int8)
    shape = np.array([len(values) for values in ticks])
    strides = np.array([shape[1] * shape[2], shape[2], 1])
    faces = []
    for axis in range(3):
        u, v = strides[(axis + 1) % 3], strides[(axis + 2) % 3]
        inner = tuple(slice(None) if other == axis else slice(1, -1) for other in range(3))
        step = np.diff(padded[inner], axis=axis)
        cells = np.argwhere(step != 0)
        outward = -step[tuple(cells.T)]  # +1 where the solid lies below the face
        a = cells @ strides
        b, c, d = a + u, a + u + v, a + v
        flip = (outward < 0)[:, None]
        even = (cells.sum(1) % 2 == 0)[:, None]
        for one, other in (((a, b, c), (a, b, d)), ((a, c, d), (b, c, d))):
            triangle = np.where(even, np.stack(one, 1), np.stack(other, 1))
            faces.append(np.where(flip, triangle[:, ::-1], triangle))
    used, numbering = np.unique(np.concatenate(faces), return_inverse=True)
    grid = np.stack(np.unravel_index(used, shape), 1)
    vertices = np.stack([ticks[axis][grid[:, axis]] for axis in range(3)], 1)
    return Surface(vertices, numbering.reshape(-1, 3))


def swept_tube(curve: NDArray[np.float64], radius: float, *, spacing: float = 0.04) -> Surface:
    """Closed tube around an open polyline with even steps, its ends capped; frames turn as little as possible."""
    tangents = np.gradient(curve, axis=0)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    normal = np.cross(tangents[0], np.eye(3)[np.argmin(abs(tangents[0]))])
    normals = np.empty_like(tangents)
    for step, tangent in enumerate(tangents):
        normal = normal - tangent * (normal @ tangent)
        normal /= np.linalg.norm(normal)
        normals[step] = normal
    n_around = max(6, round(2 * np.pi * radius / spacing))
    angles = np.arange(n_around) * 2 * np.pi / n_around
    around = np.cos(angles)[:, None] * normals[:, None] + np.sin(angles)[:, None] * np.cross(tangents, normals)[:, None]
    rings = curve[:, None] + radius * around
    n_rings = len(curve)
    vertices = np.concatenate([rings.reshape(-1, 3), curve[[0, -1]]])
    ring = np.arange(n_around)
    following = (ring + 1) % n_around
    first, last = n_rings * n_around, (n_rings - 1) * n_around
    caps = [
        np.stack([following, ring, np.full(n_around, first)], 1),
        np.stack([last + ring, last + following, np.full(n_around, first + 1)], 1),
    ]
    return Surface(vertices, np.concatenate([_grid_faces(n_rings, n_around, wrap=True), *caps]))


def extruded_sheet(profile: NDArray[np.float64], depth: float, *, spacing: float = 0.04) -> Surface:
    """Open sheet: a polyline in x, z drawn out along y, centred."""
    across = np.linspace(-depth / 2, depth / 2, max(2, round(depth / spacing) + 1))
    vertices = np.empty((len(profile), len(across), 3))
    vertices[:, :, 0], vertices[:, :, 2] = profile[:, :1], profile[:, 1:]
    vertices[:, :, 1] = across
    return Surface(vertices.reshape(-1, 3), _grid_faces(len(profile), len(across))[:, ::-1], closed=False)


def level_set(
    distance: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    *,
    spacing: float,
    reach: float = 1.36,
    is_distance: bool = False,
) -> Surface:
    """Zero set of a signed distance-like function, negative inside, with well-shaped triangles.

    Marching cubes leaves slivers; a few rounds of averaging over neighbours, each followed by a step back onto
    the zero set, round them out. What nowhere changes faster than by the way gone (``is_distance``) is asked near the
    zero set alone, with the same result.
    """
    import igl

    ticks = np.arange(-reach, reach + spacing, spacing)
    n = len(ticks)
    # The first coordinate varies fastest: igl's order of grid corners.
    grid = np.stack(np.meshgrid(ticks, ticks, ticks, indexing="ij"), -1).transpose(2, 1, 0, 3).reshape(-1, 3)
    values = _values_near_zero(distance, ticks) if is_distance else distance(grid)
    vertices, faces, _ = igl.marching_cubes(values, np.ascontiguousarray(grid), n, n, n, 0.0)
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    counts = np.bincount(edges[:, 0], minlength=len(vertices))[:, None]
    for _ in range(10):
        averages = np.stack(
            [np.bincount(edges[:, 0], vertices[edges[:, 1], axis], len(vertices)) for axis in range(3)], 1
        )
        vertices = _projected(distance, 0.4 * vertices + 0.6 * averages / counts, spacing)
    surface = Surface(vertices, faces.astype(np.int64))
    return surface if surface.volume > 0 else Surface(vertices, surface.faces[:, ::-1])


def _values_near_zero(
    distance: Callable[[NDArray[np.float64]], NDArray[np.float64]], ticks: NDArray[np.float64], block: int = 8
) -> NDArray[np.float64]:
    """Values on a cubic grid, first coordinate fastest; of a block that the zero set stays clear of, its middle's."""
    n, spacing = len(ticks), ticks[1] - ticks[0]
    lows = np.arange(0, n, block)
    middles = ticks[0] + spacing * (lows + 0.5 * (block - 1))
    coarse = distance(np.stack(np.meshgrid(middles, middles, middles, indexing="ij"), -1).reshape(-1, 3))
    coarse = coarse.reshape([len(lows)] * 3)
    values = coarse.repeat(block, axis=0).repeat(block, axis=1).repeat(block, axis=2)[:n, :n, :n]
    # From the middle to a corner of the block, and on to the far corner of a cell that reaches beyond it.
    near = np.argwhere(abs(coarse) <= np.sqrt(3.0) * spacing * (0.5 * (block - 1) + 1.0))
    within = np.stack(np.meshgrid(*[np.arange(block)] * 3, indexing="ij"), -1).reshape(-1, 3)
    places = (near[:, None] * block + within).reshape(-1, 3)
    places = places[(places < n).all(axis=1)]
    values[tuple(places.T)] = distance(ticks[places])
    return values.transpose(2, 1, 0).reshape(-1)


def _projected(
    distance: Callable[[NDArray[np.float64]], NDArray[np.float64]], points: NDArray[np.float64], spacing: float
) -> NDArray[np.float64]:
    """Points moved onto the zero set along the gradient, by at most a third of the spacing."""
    small = 1e-4
    gradient = np.stack([distance(points + small * axis) - distance(points - small * axis) for axis in np.eye(3)], 1)
    gradient /= 2 * small
    steepness = np.maximum((gradient**2).sum(1), 1e-6)
    step = -(distance(points) / steepness)[:, None] * gradient
    length = np.linalg.norm(step, axis=1, keepdims=True)
    return points + step * np.minimum(1, spacing / 3 / np.maximum(length, 1e-12))


def bench(spacing: float = 0.04) -> Surface:
    """A park bench of nine slats 0.05 apart on a frame: the object the bundled trained bench was captured from."""
    boxes: list[Box] = [(-1.3, 1.3, y - 0.08, y + 0.08, -0.15, -0.07) for y in (-0.475, -0.265, -0.055, 0.155, 0.37)]
    boxes += [(-1.3, 1.3, 0.46, 0.535, z - 0.08, z + 0.08) for z in (0.11, 0.32, 0.53, 0.745)]
    for x in (-0.975, 0.975):
        sides = (x - 0.04, x + 0.04)
        boxes += [(*sides, -0.61, 0.61, -0.26, -0.14), (*sides, 0.53, 0.61, -0.26, 0.915)]
        boxes += [(*sides, y - 0.05, y + 0.05, -0.915, -0.2) for y in (-0.5, 0.5)]
    return box_union(boxes, spacing)


def comb(spacing: float = 0.035) -> Surface:
    """A spine with 24 long teeth, 0.045 apart."""
    pitch, width = 0.11, 0.065
    teeth: list[Box] = [(x, x + width, -0.05, 0.05, -0.8, 0.4) for x in -1.3 + pitch * np.arange(24)]
    return box_union([(-1.3, -1.3 + 23 * pitch + width, -0.07, 0.07, 0.35, 0.7), *teeth], spacing)


def birdcage(spacing: float = 0.03) -> Surface:
    """Twenty-eight thin bars, 0.07 apart, held by three rings."""
    n_bars, radius, thickness, height = 28, 0.6, 0.032, 1.0

    def distance(points: NDArray[np.float64]) -> NDArray[np.float64]:
        x, y, z = points.T
        angle = np.arctan2(y, x)
        turned = angle - np.round(angle * n_bars / (2 * np.pi)) * 2 * np.pi / n_bars
        out = np.hypot(x, y)
        beyond = np.maximum(abs(z) - height, 0)
        bars = np.sqrt((out * np.cos(turned) - radius) ** 2 + (out * np.sin(turned)) ** 2 + beyond**2)
        rings = np.min([np.hypot(out - radius, z - level) for level in (-height, 0, height)], axis=0)
        return np.minimum(bars, rings) - thickness

    return level_set(distance, spacing=spacing, reach=height + 0.12)


def cheese(spacing: float = 0.05) -> Surface:
    """A ball riddled with a labyrinth of tunnels (a gyroid of period 0.95)."""

    def distance(points: NDArray[np.float64]) -> NDArray[np.float64]:
        scale = 2 * np.pi / 0.95
        s, c = np.sin(scale * points), np.cos(scale * points)
        gyroid = (s[:, 0] * c[:, 1] + s[:, 1] * c[:, 2] + s[:, 2] * c[:, 0]) / scale
        # A soft maximum rounds the rims, where a sharp one would leave marching cubes a saw edge.
        ball, soft = np.linalg.norm(points, axis=1) - 1.25, 0.02
        return soft * np.logaddexp(ball / soft, 0.8 * gyroid / soft)

    return level_set(distance, spacing=spacing)


def coil(spacing: float = 0.045) -> Surface:
    """A spring of ten turns wound so tight that 0.03 of air is left between them."""
    turns, radius, wire, pitch = 10, 0.62, 0.09, 0.21
    length = turns * np.hypot(2 * np.pi * radius, pitch)
    angle = np.linspace(0, 2 * np.pi * turns, round(length / spacing))
    heights = pitch * (angle / (2 * np.pi) - turns / 2)
    curve = np.stack([radius * np.cos(angle), radius * np.sin(angle), heights], 1)
    return swept_tube(curve, wire, spacing=spacing)


def book(spacing: float = 0.045) -> Surface:
    """Five curved pages, 0.05 apart, bound in a spine."""
    pitch, thickness = 0.085, 0.035
    pages: list[Box] = [(-0.9, 0.9, -0.7, 0.7, z, z + thickness) for z in pitch * (np.arange(5) - 2) - thickness / 2]
    surface = box_union([*pages, (-1.0, -0.85, -0.72, 0.72, -0.24, 0.24)], spacing)
    x, y, z = surface.vertices.T
    bent = z * (1 + 0.35 * np.clip((x + 0.85) / 1.75, 0, 1) ** 2) + 0.18 * np.sin(1.7 * (x + 0.9))
    return Surface(np.stack([x * 1.25, y * 1.25, bent], 1), surface.faces)


def figure(spacing: float = 0.03) -> Surface:
    """A person with legs 0.06 apart, one arm stretched out and the hand of the other 0.012 from the hip."""
    limbs: list[tuple[Sequence[float], Sequence[float], float]]
    limbs = [((0, 0, -0.2), (0, 0, 0.5), 0.27), ((0, 0, 0.5), (0, 0, 0.9), 0.1), ((0, 0, 1.02), (0, 0, 1.05), 0.2)]
    limbs += [((0.15 * side, 0, -0.2), (0.15 * side, 0, -1.15), 0.12) for side in (-1, 1)]
    limbs += [((0.2 * side, 0, 0.5), (1.15 * side, 0, 0.5), 0.1) for side in (-1, 1)]

    def distance(points: NDArray[np.float64]) -> NDArray[np.float64]:
        soft = 0.025
        return -soft * np.logaddexp.reduce([-_to_capsule(points, *limb) / soft for limb in limbs], axis=0)

    surface = level_set(distance, spacing=spacing)
    # Laid on with the arm away from the body, where marching cubes see the air between, and bent to the hip then.
    shoulder, elbow, bend = np.array([0.3, 0.0, 0.5]), np.array([0.72, 0.0, 0.5]), 0.12
    vertices = _bent(surface.vertices, elbow, np.radians(44.0), bend)
    return Surface(_bent(vertices, shoulder, np.radians(61.0), bend), surface.faces)


def _to_capsule(
    points: NDArray[np.float64], start: Sequence[float], end: Sequence[float], radius: float
) -> NDArray[np.float64]:
    """Signed distance to what is within a radius of a stretch."""
    a, ab = np.asarray(start, np.float64), np.subtract(end, start)
    along = np.clip((points - a) @ ab / (ab @ ab), 0.0, 1.0)
    return np.linalg.norm(points - a - along[:, None] * ab, axis=1) - radius


def _bent(points: NDArray[np.float64], joint: NDArray[np.float64], angle: float, reach: float) -> NDArray[np.float64]:
    """Turn what lies beyond a joint in x about it, from x towards -z; within ``reach`` of it, by a part."""
    share = np.clip(0.5 + 0.5 * (points[:, 0] - joint[0]) / reach, 0.0, 1.0)
    # Of the trunk below and above the joint nothing turns.
    beside = np.clip((0.3 - abs(points[:, 2] - joint[2])) / 0.15, 0.0, 1.0)
    share = np.where(share < 1.0, share * beside, share)
    angles = angle * share**2 * (3.0 - 2.0 * share)
    x, y, z = (points - joint).T
    c, s = np.cos(angles), np.sin(angles)
    return joint + np.stack([c * x + s * z, y, c * z - s * x], 1)


def strap(spacing: float = 0.03) -> Surface:
    """A flat strap in a loop; its ends run side by side, 0.03 apart, for a third of its length."""
    t = np.linspace(-1.0, 1.0, 801)
    # From one end down the neck, round the loop and up again.
    far = np.sqrt(t**2 + 0.01)
    opening = 0.55 * np.sqrt(np.clip(1.0 - far / 0.75, 0.0, 1.0)) * np.sin(np.pi * np.clip(1.4 * far, 0.0, 1.0)) ** 2
    curve = np.stack([np.tanh(t / 0.1) * (0.055 + opening), np.zeros_like(t), 2.4 * far - 1.2], 1)
    lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
    even = np.linspace(0.0, lengths[-1], round(lengths[-1] / spacing))
    curve = np.stack([np.interp(even, lengths, curve[:, axis]) for axis in range(3)], 1)
    surface = swept_tube(curve, 0.04, spacing=spacing)
    return Surface(surface.vertices * [1.0, 2.5, 1.0], surface.faces)


def tube(spacing: float = 0.05) -> Surface:
    """A bent arm: a thick tube with an elbow, 2.5 long."""
    t = np.linspace(-1, 1, round(2.9 / spacing))
    curve = np.stack([1.1 * t, np.zeros_like(t), 0.55 * np.sqrt(t**2 + 0.06) - 0.3], 1)
    return swept_tube(curve, 0.16, spacing=spacing)


def folded_sheet(gap: float = 0.06, spacing: float = 0.04) -> Surface:
    """A sheet folded once, its halves parallel and ``gap`` apart, joined by a half circle."""
    straight = np.linspace(0, 1.6, round(1.6 / spacing) + 1)
    angle = np.linspace(0, np.pi, max(6, round(np.pi * gap / 2 / spacing) + 1))
    profile = np.concatenate(
        [
            np.stack([-0.8 + straight, np.full_like(straight, -gap / 2)], 1),
            np.stack([0.8 + gap / 2 * np.sin(angle[1:-1]), -gap / 2 * np.cos(angle[1:-1])], 1),
            np.stack([0.8 - straight, np.full_like(straight, gap / 2)], 1),
        ]
    )
    return extruded_sheet(profile, 1.6, spacing=spacing)


def two_sheets(gap: float = 0.06, spacing: float = 0.05) -> Surface:
    """Two parallel square sheets, ``gap`` apart, that never meet."""
    sheet = plane(spacing)
    lift = np.array([0, 0, gap / 2])
    vertices = np.concatenate([sheet.vertices - lift, sheet.vertices + lift])
    return Surface(vertices, np.concatenate([sheet.faces, sheet.faces + len(sheet.vertices)]), closed=False)


def slats(gap: float = 0.05, n_slats: int = 5, spacing: float = 0.05) -> Surface:
    """Slats 0.16 wide and ``gap`` apart, each a part of its own."""
    lows = (0.16 + gap) * np.arange(n_slats) - ((0.16 + gap) * n_slats - gap) / 2
    return box_union([(-1.3, 1.3, low, low + 0.16, -0.04, 0.04) for low in lows], spacing)


def plane(spacing: float = 0.05) -> Surface:
    """A square sheet, 2.6 wide, at z = 0."""
    return extruded_sheet(np.stack([np.linspace(-1.3, 1.3, round(2.6 / spacing) + 1)] * 2, 1) * [1, 0], 2.6)


SHAPES: dict[str, Callable[[], Surface]] = {
    shape.__name__: shape
    for shape in (
        bench,
        comb,
        birdcage,
        cheese,
        coil,
        book,
        figure,
        strap,
        tube,
        folded_sheet,
        two_sheets,
        slats,
        plane,
    )
}
"""Every shape by name."""
