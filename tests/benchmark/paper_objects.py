"""Objects of the paper's ten categories, made anew by each seed: how many bars, how thick, how far apart.

Every object is one watertight part of about 2.6 with neighbours that nearly touch; how near is said with it, so that
the density of the splats can be given in units of that gap.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from splap_editor.io.sample_shapes import Box, Surface, box_union, level_set, swept_tube

Points = NDArray[np.float64]
Distance = Callable[[Points], NDArray[np.float64]]


@dataclass(frozen=True, eq=False)
class MadeObject:
    """One object of a category.

    Parameters
    ----------
    category : str
    surface : Surface
        Watertight mesh, one part.
    gap : float
        Width of the air between neighbouring parts, in world units.
    """

    category: str
    surface: Surface
    gap: float

    def n_splats(self, spacings: float) -> int:
        """Number of splats at which the gap is so many splat spacings wide."""
        return int(self.surface.areas.sum() * (spacings / self.gap) ** 2)

    def spacings(self, n_splats: int) -> float:
        """How many splat spacings wide the gap is among so many splats."""
        return float(self.gap / np.sqrt(self.surface.areas.sum() / n_splats))


def _rod(a: Sequence[float], b: Sequence[float], radius: float) -> Distance:
    """A round bar from a to b."""
    start, along = np.array(a, np.float64), np.subtract(b, a).astype(np.float64)

    def distance(points: Points) -> NDArray[np.float64]:
        share = np.clip((points - start) @ along / (along @ along), 0.0, 1.0)
        return np.linalg.norm(points - start - share[:, None] * along, axis=1) - radius

    return distance


def _ring(center: Sequence[float], normal: int, radius: float, thickness: float) -> Distance:
    """A torus about an axis."""
    others = [axis for axis in range(3) if axis != normal]

    def distance(points: Points) -> NDArray[np.float64]:
        steps = points - np.array(center)
        out = np.hypot(*steps[:, others].T)
        return np.hypot(out - radius, steps[:, normal]) - thickness

    return distance


def _bow(center: Sequence[float], radius: float, thickness: float) -> Distance:
    """The upper half of a ring in the plane y = 0, its ends round."""
    ends = [_rod(np.add(center, (x, 0, -1e-9)), np.add(center, (x, 0, 0)), thickness) for x in (-radius, radius)]
    whole = _ring(center, 1, radius, thickness)

    def distance(points: Points) -> NDArray[np.float64]:
        return np.where(points[:, 2] > center[2], whole(points), np.minimum(ends[0](points), ends[1](points)))

    return distance


def _disc(center: Sequence[float], normal: int, radius: float, thickness: float) -> Distance:
    """A round plate with a round rim about an axis."""
    others = [axis for axis in range(3) if axis != normal]

    def distance(points: Points) -> NDArray[np.float64]:
        steps = points - np.array(center)
        out = np.maximum(np.hypot(*steps[:, others].T) - radius, 0.0)
        return np.hypot(out, steps[:, normal]) - thickness

    return distance


def _union(parts: Sequence[Distance], spacing: float) -> Surface:
    """Surface of several bodies melted together."""

    def distance(points: Points) -> NDArray[np.float64]:
        nearest = parts[0](points)
        for part in parts[1:]:
            np.minimum(nearest, part(points), out=nearest)
        return nearest

    return level_set(distance, spacing=spacing, is_distance=True)


def _row(n: int, width: float, gap: float) -> NDArray[np.float64]:
    """Low ends of n things of a width in a row, centred at zero."""
    return (width + gap) * np.arange(n) - ((width + gap) * n - gap) / 2


def bench(rng: np.random.Generator) -> MadeObject:
    """Slats on a frame with a back."""
    n, gap = int(rng.integers(4, 8)), float(rng.uniform(0.045, 0.07))
    width = (1.1 - gap * (n - 1)) / n
    boxes: list[Box] = [(-1.25, 1.25, low, low + width, -0.15, -0.07) for low in _row(n, width, gap)]
    back = [-0.05 + (0.14 + gap) * place for place in range(int(rng.integers(3, 5)))]
    boxes += [(-1.25, 1.25, 0.57, 0.64, low + 0.12, low + 0.26) for low in back]
    for x in (-0.95, 0.95):
        boxes += [(x - 0.05, x + 0.05, -0.65, 0.72, -0.26, -0.14), (x - 0.05, x + 0.05, 0.63, 0.72, -0.26, 0.95)]
        boxes += [(x - 0.05, x + 0.05, y - 0.05, y + 0.05, -0.9, -0.2) for y in (-0.5, 0.5)]
    return MadeObject("bench", box_union(boxes, 0.0235), gap)


def bed(rng: np.random.Generator) -> MadeObject:
    """A mattress hovering over slats, and a head of bars."""
    n, gap = int(rng.integers(8, 13)), float(rng.uniform(0.045, 0.07))
    boxes: list[Box] = [(-1.2, 1.2, y - 0.05, y + 0.05, -0.35, -0.2) for y in (-0.75, 0.75)]
    boxes += [(x - 0.05, x + 0.05, -0.8, 0.8, -0.35, -0.2) for x in (-1.2, 1.2)]
    width = (2.2 - gap * 2.0 * (n + 1)) / n
    boxes += [(low, low + width, -0.75, 0.75, -0.3, -0.24) for low in _row(n, width, 2.0 * gap)]
    # The mattress rests on the foot alone.
    boxes += [(-1.1, 1.15, -0.68, 0.68, -0.2 + gap, gap), (1.15, 1.25, -0.5, 0.5, -0.3, gap)]
    boxes += [(-1.25, -1.17, y - 0.05, y + 0.05, -0.8, 0.9) for y in (-0.75, 0.75)]
    boxes += [(1.15, 1.25, y - 0.05, y + 0.05, -0.8, -0.2) for y in (-0.75, 0.75)]
    boxes += [(-1.25, -1.17, -0.8, 0.8, 0.8, 0.9)]
    bars = int(rng.integers(7, 11))
    width = (1.4 - gap * (bars + 1)) / bars
    boxes += [(-1.25, -1.17, low, low + width, -0.3, 0.85) for low in _row(bars, width, gap)]
    return MadeObject("bed", box_union(boxes, 0.026), gap)


def headphone(rng: np.random.Generator) -> MadeObject:
    """Two bands one above the other, and two cups of two plates each."""
    gap, thick = float(rng.uniform(0.05, 0.08)), float(rng.uniform(0.035, 0.05))
    inner = 0.85
    outer = inner + 2 * thick + gap
    parts = [_bow((0, 0, -0.1), radius, thick) for radius in (inner, outer)]
    for side in (-1.0, 1.0):
        parts.append(_rod((side * inner, 0, -0.1), (side * outer, 0, -0.1), thick))
        plates = side * (inner - np.array([0.0, 2 * thick + gap]))
        parts += [_disc((x, 0, -0.5), 0, float(rng.uniform(0.3, 0.4)), thick) for x in plates]
        parts.append(_rod((side * inner, 0, -0.1), (side * inner, 0, -0.5), thick))
        parts.append(_rod((plates[0], 0, -0.5), (plates[1], 0, -0.5), 2 * thick))
    return MadeObject("headphone", _union(parts, 0.016), gap)


def basket(rng: np.random.Generator) -> MadeObject:
    """Staves around a floor, held by rings, and a bail over them."""
    gap, thick = float(rng.uniform(0.05, 0.08)), float(rng.uniform(0.032, 0.042))
    low, high = 0.65, float(rng.uniform(0.85, 0.95))
    n = int(2 * np.pi * low / (2 * thick + gap))
    angles = np.arange(n) * 2 * np.pi / n
    parts: list[Distance] = [_disc((0, 0, -0.7), 2, low, thick), _ring((0, 0, 0.2), 2, high, thick)]
    parts += [
        _rod((low * np.cos(a), low * np.sin(a), -0.7), (high * np.cos(a), high * np.sin(a), 0.2), thick) for a in angles
    ]
    parts.append(_bow((0, 0, 0.2), high, thick))
    return MadeObject("basket", _union(parts, 0.0225), gap)


def coil(rng: np.random.Generator) -> MadeObject:
    """A spring wound tight."""
    turns, wire = int(rng.integers(7, 12)), float(rng.uniform(0.07, 0.1))
    gap, radius = float(rng.uniform(0.03, 0.06)), float(rng.uniform(0.5, 0.7))
    pitch = 2 * wire + gap
    length = turns * np.hypot(2 * np.pi * radius, pitch)
    angle = np.linspace(0, 2 * np.pi * turns, round(length / 0.025))
    heights = pitch * (angle / (2 * np.pi) - turns / 2)
    curve = np.stack([radius * np.cos(angle), radius * np.sin(angle), heights], 1)
    return MadeObject("coil", swept_tube(curve, wire, spacing=0.025), gap)


def birdcage(rng: np.random.Generator) -> MadeObject:
    """Bars between rings under a pointed roof."""
    gap, thick, radius = float(rng.uniform(0.06, 0.09)), float(rng.uniform(0.03, 0.038)), float(rng.uniform(0.5, 0.65))
    n = int(2 * np.pi * radius / (2 * thick + gap))
    angles = np.arange(n) * 2 * np.pi / n
    parts: list[Distance] = [_ring((0, 0, z), 2, radius, thick) for z in (-0.9, -0.1, 0.7)]
    for a in angles:
        x, y = radius * np.cos(a), radius * np.sin(a)
        parts.append(_rod((x, y, -0.9), (x, y, 0.7), thick))
    parts += [
        _rod((radius * np.cos(a), radius * np.sin(a), 0.7), (0, 0, 1.2), thick) for a in angles[:: max(1, n // 6)]
    ]
    return MadeObject("birdcage", _union(parts, 0.0225), gap)


def windmill(rng: np.random.Generator) -> MadeObject:
    """A tower, and in front of it sails of slats."""
    gap, thick = float(rng.uniform(0.05, 0.08)), 0.035
    n, turned = int(rng.integers(4, 6)), float(rng.uniform(0, 1))
    tower = 0.2
    front = -(tower + gap + thick)
    parts: list[Distance] = [_rod((0, 0, -1.1), (0, 0, 0.35), tower), _rod((0, 0, 0.3), (0, front, 0.3), 0.07)]
    for a in turned + np.arange(n) * 2 * np.pi / n:
        out, side = np.array([np.cos(a), 0, np.sin(a)]), np.array([-np.sin(a), 0, np.cos(a)])
        hub = np.array([0, front, 0.3])
        parts.append(_rod(hub, hub + 0.95 * out, thick))
        reaches = np.arange(0.25, 0.95, 2 * thick + gap)
        parts += [_rod(hub + r * out, hub + r * out + 0.28 * side, thick) for r in reaches]
    return MadeObject("windmill", _union(parts, 0.0155), gap)


def ferris_wheel(rng: np.random.Generator) -> MadeObject:
    """Two rims side by side, spokes, and cabins between them."""
    gap, thick = float(rng.uniform(0.06, 0.09)), 0.035
    half = 0.5 * gap + thick
    n = int(rng.integers(8, 13))
    around = [(np.cos(a), np.sin(a)) for a in np.arange(n) * 2 * np.pi / n]
    parts: list[Distance] = [_rod((0, -0.3, 0), (0, 0.3, 0), 0.08)]
    for y in (-half, half):
        parts.append(_ring((0, y, 0), 1, 1.0, thick))
        parts += [_rod((0, y, 0), (x, y, z), thick) for x, z in around]
    for x, z in around:
        parts += [_rod((x, -half, z), (x, half, z), thick), _disc((1.16 * x, 0, 1.16 * z), 1, 0.06, 0.05)]
        parts.append(_rod((x, 0, z), (1.16 * x, 0, 1.16 * z), thick))
    return MadeObject("ferris wheel", _union(parts, 0.021), gap)


def harp(rng: np.random.Generator) -> MadeObject:
    """A three-cornered frame with strings side by side."""
    gap, thick = float(rng.uniform(0.05, 0.08)), float(rng.uniform(0.03, 0.036))
    foot, top, head = np.array([-0.7, 0, -1.1]), np.array([-0.8, 0, 1.1]), np.array([0.9, 0, 0.9])
    parts: list[Distance] = [_rod(a, b, 0.08) for a, b in ((foot, top), (top, head), (head, foot))]
    pitch = 2 * thick + gap
    for x in np.arange(-0.65 + pitch, 0.75, pitch):
        low = foot + (x - foot[0]) / (head[0] - foot[0]) * (head - foot)
        high = top + (x - top[0]) / (head[0] - top[0]) * (head - top)
        parts.append(_rod(low, high, thick))
    return MadeObject("harp", _union(parts, 0.0155), gap)


def fence(rng: np.random.Generator) -> MadeObject:
    """Pickets on two rails."""
    n, gap = int(rng.integers(12, 19)), float(rng.uniform(0.045, 0.07))
    width = (2.5 - gap * (n - 1)) / n
    heights = 0.5 + 0.15 * rng.uniform(0, 1, n)
    boxes: list[Box] = [
        (low, low + width, -0.1, -0.03, -0.7, high) for low, high in zip(_row(n, width, gap), heights, strict=True)
    ]
    boxes += [(-1.25, 1.25, -0.03, 0.05, z - 0.06, z + 0.06) for z in (-0.4, 0.25)]
    return MadeObject("fence", box_union(boxes, 0.0175), gap)


CATEGORIES: dict[str, Callable[[np.random.Generator], MadeObject]] = {
    "bench": bench,
    "bed": bed,
    "headphone": headphone,
    "basket": basket,
    "coil": coil,
    "birdcage": birdcage,
    "windmill": windmill,
    "ferris wheel": ferris_wheel,
    "harp": harp,
    "fence": fence,
}
"""The paper's categories, each made from a random generator."""


def made_object(category: str, seed: int) -> MadeObject:
    """Make an object; the same seed gives the same one."""
    return CATEGORIES[category](np.random.default_rng([list(CATEGORIES).index(category), seed]))
