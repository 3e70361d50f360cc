"""The check of a pose: where it tears, webs or draws out the surface, in file rows and places that can be cured."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.adaptation.kernel_adaptation import AdaptedKernels
from splap_editor.core.deformer import Deformation
from splap_editor.core.graph.options import Joint, Point, Separation
from splap_editor.core.index_spaces import FileRows, NodeMask, Nodes, RowPair
from splap_editor.core.progress import StageProgress, silent
from splap_editor.core.splats.occupancy import Ellipses
from splap_editor.core.surface.flaws import Flaw, flaws
from splap_editor.core.surface.posed_surface import Beside, PosedSurface, pairs_beside
from splap_editor.engine.bound_edit import Posed
from splap_editor.engine.quantities import Snapshot, contributions_of
from splap_editor.engine.surface import Surface

KINDS = {
    "tear": ("tear", "tears", "came apart by up to {size:.3g}"),
    "web": ("web", "webs", "drawn out by up to {size:.3g}"),
    "spike": ("spike", "spikes", "drawn out to {size:.3g}"),
}
"""Kinds of flaws: what one is called, what several are, and what is said of its size."""

MOST_POINTS = 16
"""Places that a cure names on each side."""


@dataclass(frozen=True, eq=False)
class FlawPlace:
    """A place that a pose spoils.

    Parameters
    ----------
    kind : str
        One of `KINDS`.
    rows : (k,) int64
        File rows of the splats concerned, ascending.
    a, b : tuple of Point
        Places at rest on either side, that which moved more first; none on the second side of a spike.
    a_rows, b_rows : (a,), (b,) int64
        File rows of the splats there.
    center : (3,) float64
        Middle of the splats in the pose, in the file's units, before all is put in its place.
    radius : float
        Of the ball about it that holds them.
    size : float
        What is open, or by how much it is drawn out, or how long it is: in the file's units.
    severity : float
        See `splap_editor.core.surface.flaws.Flaw`.
    """

    kind: str
    rows: FileRows
    a: tuple[Point, ...]
    b: tuple[Point, ...]
    a_rows: FileRows
    b_rows: FileRows
    center: NDArray[np.float64]
    radius: float
    size: float
    severity: float

    def __str__(self) -> str:
        x, y, z = self.center
        n = len(self.rows)
        size = KINDS[self.kind][2].format(size=self.size)
        return f"{self.kind} at {x:.3g}, {y:.3g}, {z:.3g}: {n:,} splat{'' if n == 1 else 's'} {size}"

    @property
    def told(self) -> dict[str, object]:
        """What JSON tells of it; a cure can be put into a recipe's ``graph`` as it is."""
        told: dict[str, object] = {
            "kind": self.kind,
            "center": [round(float(x), 6) for x in self.center],
            "radius": self.radius,
            "size": self.size,
            "severity": self.severity,
            "rows": self.rows.tolist(),
        }
        if self.kind == "web":
            told["separate"] = {"a": self.a, "b": self.b}
        elif self.kind == "tear":
            told["join"] = {"a": self.a, "b": self.b, "reach": joint_of(self).reach}
        return told


@dataclass(frozen=True, eq=False)
class DeformationCheck:
    """All places that a pose spoils, worst first.

    Parameters
    ----------
    places : tuple of FlawPlace
    """

    places: tuple[FlawPlace, ...] = ()

    def __str__(self) -> str:
        counts = Counter(place.kind for place in self.places)
        parts = [f"{counts[kind]:,} {words[counts[kind] > 1]}" for kind, words in KINDS.items() if counts[kind]]
        return ", ".join(parts) or "nothing torn or drawn out"

    @property
    def lines(self) -> list[str]:
        """What the command line says."""
        return [f"check: {self}", *(f"  {place}" for place in self.places)]

    @property
    def told(self) -> dict[str, object]:
        """What JSON tells: how many of each kind, and each place."""
        counts = Counter(place.kind for place in self.places)
        return {**{words[1]: counts[kind] for kind, words in KINDS.items()}, "places": [p.told for p in self.places]}


def deformation_check(surface: Surface, kernels: AdaptedKernels, deformation: Deformation) -> DeformationCheck:
    """Look at a pose for tears, webs and spikes.

    What was cut by hand may come apart, and what was tied by hand may be drawn out: neither is told.

    Parameters
    ----------
    surface : Surface
    kernels : AdaptedKernels
        The pose, of this surface.
    deformation : Deformation
        Where it took the nodes.

    Returns
    -------
    DeformationCheck
        The same whatever handles and deformer made the pose.
    """
    ellipses, rows = surface.ellipses, surface.ellipses.rows
    posed = posed_surface(surface, kernels, deformation)
    rest_axes = surface.binding.rest.axes_f32[: ellipses.n_nodes]
    found = flaws(posed, rest_axes, surface.graph.epsilon)
    places = (_place(ellipses, np.asarray(kernels.means_f32[rows], np.float64), flaw) for flaw in found)
    return DeformationCheck(tuple(places))


def posed_check(posed: Posed, *, stages: StageProgress = silent) -> DeformationCheck:
    """Check what was posed; nothing is spoilt where nothing moved."""
    if posed.surface is None or posed.kernels is None or posed.deformation is None:
        return DeformationCheck()
    stages("check")
    return deformation_check(posed.surface, posed.kernels, posed.deformation)


def posed_surface(surface: Surface, kernels: AdaptedKernels, deformation: Deformation) -> PosedSurface:
    """Put together what the searches look at."""
    ellipses, mends = surface.ellipses, surface.stages.mends
    beside = beside_of(ellipses)
    seen = np.zeros(ellipses.n_splats)
    visible = contributions_of(Snapshot(surface.binding.splats, ellipses, surface))
    seen[surface.visible.rows] = visible.weights
    return PosedSurface(
        ellipses,
        beside,
        surface.neighborhoods,
        surface.L,
        deformation.positions,
        kernels.axes_f32[ellipses.rows],
        seen[ellipses.rows],
        _about(ellipses, beside, mends.cut),
        _about(ellipses, beside, mends.add),
    )


def beside_of(ellipses: Ellipses) -> Beside:
    """Which nodes lie beside each other, found once per scene."""
    known = _BESIDE.get(ellipses)
    if known is None:
        known = _BESIDE[ellipses] = pairs_beside(ellipses)
    return known


_BESIDE: WeakKeyDictionary[Ellipses, Beside] = WeakKeyDictionary()
"""Of the scenes that are open."""


def separation_of(place: FlawPlace) -> Separation:
    """The stroke that takes the two sides of a web apart."""
    return Separation(place.a, place.b)


def joint_of(place: FlawPlace) -> Joint:
    """The stroke that ties the two sides of a tear."""
    a, b = (np.array(points, np.float64) for points in (place.a, place.b))
    apart = np.linalg.norm(a[:, None] - b[None], axis=2)
    reach = 1.1 * float(min(apart.min(axis=0).max(), apart.min(axis=1).max()))
    return Joint(place.a, place.b, reach or 1.0)


def _about(ellipses: Ellipses, beside: Beside, pairs: Iterable[RowPair]) -> NodeMask:
    """(n,) the ends of some pairs of file rows, and what lies beside them."""
    mask = np.zeros(ellipses.n_nodes, bool)
    nodes = ellipses.node_of_row[np.array([row for pair in pairs for row in pair], np.int64)]
    mask[nodes[nodes >= 0]] = True
    if mask.any():
        around = beside.pairs
        mask[around[mask[around[:, 0]] | mask[around[:, 1]]]] = True
    return mask


def _place(ellipses: Ellipses, positions: NDArray[np.float64], flaw: Flaw) -> FlawPlace:
    concerned = positions[flaw.nodes]
    center = 0.5 * (concerned.min(axis=0) + concerned.max(axis=0))
    radius = float(np.linalg.norm(concerned - center, axis=1).max()) + 0.5 * flaw.size
    first, second = _spread(flaw.first), _spread(flaw.second)
    return FlawPlace(
        flaw.kind,
        np.sort(ellipses.rows[flaw.nodes]),
        _points(ellipses, first),
        _points(ellipses, second),
        ellipses.rows[first],
        ellipses.rows[second],
        center,
        radius,
        flaw.size,
        flaw.severity,
    )


def _spread(nodes: Nodes) -> Nodes:
    """At most so many, evenly along their order, which is one of space."""
    return nodes[np.unique(np.linspace(0, len(nodes) - 1, MOST_POINTS).round().astype(int))] if len(nodes) else nodes


def _points(ellipses: Ellipses, nodes: Nodes) -> tuple[Point, ...]:
    return tuple((float(x), float(y), float(z)) for x, y, z in ellipses.centers[nodes])
