"""Quantities: one number for each splat, by which it is coloured, selected and exported."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import ArrayLike, NDArray

from splap_editor.core.index_spaces import FileRow
from splap_editor.core.splats.occupancy import Ellipses
from splap_editor.core.splats.splats import Splats

if TYPE_CHECKING:
    # Those bring the compiler with them, which the command line shall not wait for to list its columns.
    import scipy.sparse as sp

    from splap_editor.core.adaptation.kernel_adaptation import AdaptedKernels
    from splap_editor.core.deformer import Handles
    from splap_editor.core.graph.splat_graph import SplatGraph
    from splap_editor.core.splats.contributions import Contributions
    from splap_editor.engine.surface import Surface

    Weights: TypeAlias = NDArray[np.float64] | sp.csr_array
    """(n, H) handle weights."""


@dataclass(frozen=True, eq=False)
class Snapshot:
    """What quantities are worked out from: values only, so that a worker reads them while the scene goes on.

    Parameters
    ----------
    splats : Splats
        At rest.
    ellipses : Ellipses
    surface : Surface, optional
        Graph and all that is made of it.
    kernels : AdaptedKernels, optional
        The pose; at rest without.
    handles : Handles, optional
        What is held, once a deformer is bound.
    weights : (n, H) sparse or dense float64, optional
        Handle weights, where the deformer has some.
    handle : int, optional
        Column of ``weights`` that is asked for.
    picked : int, optional
        File row of the splat that distances count from.
    bare_graph : SplatGraph, optional
        The graph alone, where there is no surface.
    """

    splats: Splats
    ellipses: Ellipses
    surface: Surface | None = None
    kernels: AdaptedKernels | None = None
    handles: Handles | None = None
    weights: Weights | None = None
    handle: int | None = None
    picked: FileRow | None = None
    bare_graph: SplatGraph | None = None

    @property
    def graph(self) -> SplatGraph | None:
        """The graph, of the surface where there is one."""
        return self.surface.graph if self.surface is not None else self.bare_graph


@dataclass(frozen=True)
class Quantity:
    """One number for each splat.

    Parameters
    ----------
    name : str
        As on the command line and in the header of an exported PLY.
    label : str
        As in the window.
    unit : str
        ``"length"`` (the file's units), ``"°"``, ``"×"`` or empty.
    values : callable
        ``values(snapshot)`` gives (N,) float64 in file order, NaN where the quantity is not defined.
    needs : str
        Attribute of `Snapshot` without which there are no values; empty: none.
    labels : tuple of str, optional
        Words for the values 0, 1 …; empty for numbers.
    is_whole : bool
        The values are whole numbers.
    is_label : bool
        The values are names, not amounts: they have colours of their own rather than a place on a scale.
    middle : float, optional
        Value at which nothing has changed; shown in the middle of a two-sided colour map.
    is_of_rest : bool
        It depends on the file alone, so that splats can be removed by it.
    """

    name: str
    label: str
    unit: str
    values: Callable[[Snapshot], NDArray[np.float64]]
    needs: str = ""
    labels: tuple[str, ...] = ()
    is_whole: bool = False
    is_label: bool = False
    middle: float | None = None
    is_of_rest: bool = False


WANTS = {
    "surface": "the surface, which is being prepared",
    "graph": "the surface, which is being prepared",
    "picked": "a splat: click one with the Inspect tool (I)",
    "handles": "a handle or a pin",
    "weights": "bounded biharmonic weights: choose them as deformer and place a handle",
}
"""What a quantity without values waits for, by what it needs."""


def missing(quantity: Quantity, snapshot: Snapshot) -> str:
    """What a quantity lacks to be worked out, in words; empty when nothing."""
    needed = {"picked": ("surface", "picked"), "weights": ("weights", "handle")}
    for name in needed.get(quantity.needs, (quantity.needs,)):
        if name and getattr(snapshot, name) is None:
            return WANTS.get(name, WANTS["weights"])
    return ""


def values_of(quantity: Quantity, snapshot: Snapshot) -> NDArray[np.float64]:
    """(N,) values in file order; NaN where the quantity is not defined and for splats that are removed."""
    values, removed = quantity.values(snapshot), snapshot.ellipses.removed
    if removed is not None:
        values[removed] = np.nan
    return values


def opacity(snapshot: Snapshot) -> NDArray[np.float64]:
    """Effective opacity in [0, 1]."""
    return np.array(snapshot.splats.opacities, np.float64)


def size(snapshot: Snapshot) -> NDArray[np.float64]:
    """Larger semi-axis of the occupancy ellipse at rest, world units; NaN for inert splats."""
    return _of_nodes(snapshot.ellipses, snapshot.ellipses.reaches)


def flatness(snapshot: Snapshot) -> NDArray[np.float64]:
    """Smallest by middle scale: 0 is a disc, 1 a ball. Splats of two scales are discs."""
    splats = snapshot.splats
    if splats.n_scales == 2:
        return np.zeros(splats.n_splats)
    logs = np.sort(np.asarray(splats.log_scales, np.float64), axis=1)
    with np.errstate(invalid="ignore", over="ignore"):
        return np.exp(logs[:, 0] - logs[:, 1])


def contribution(snapshot: Snapshot) -> NDArray[np.float64]:
    """What the splat contributes to pictures from all around, in units of the mean of all active splats.

    0 for inert splats and those far beyond the subject, see `splap_editor.core.splats.contributions`.
    """
    weights = contributions_of(snapshot).weights
    values = np.zeros(snapshot.splats.n_splats)
    total = weights.sum()
    if total > 0.0:
        values[_visible(snapshot).rows] = weights * (len(weights) / total)
    return values


def contributions_of(snapshot: Snapshot) -> Contributions:
    """What the active splats contribute, made once per scene: no pose changes it."""
    from splap_editor.core.splats.contributions import contributions

    visible = _visible(snapshot)
    known = _CONTRIBUTIONS.get(visible)
    if known is None:
        known = _CONTRIBUTIONS[visible] = contributions(snapshot.splats, visible)
    return known


def _visible(snapshot: Snapshot) -> Ellipses:
    """Ellipses of all active splats, whichever the surface is made of."""
    return snapshot.ellipses if snapshot.surface is None else snapshot.surface.visible


_CONTRIBUTIONS: WeakKeyDictionary[Ellipses, Contributions] = WeakKeyDictionary()
"""Of the scenes that are open."""


def degree(snapshot: Snapshot) -> NDArray[np.float64]:
    """Number of graph neighbours; NaN for inert splats."""
    assert snapshot.graph is not None
    return _of_nodes(snapshot.ellipses, snapshot.graph.degrees)


def component(snapshot: Snapshot) -> NDArray[np.float64]:
    """Component of the graph, 0 the largest; NaN for inert splats."""
    assert snapshot.graph is not None
    return _of_nodes(snapshot.ellipses, snapshot.graph.components)


def geodesic_distance(snapshot: Snapshot) -> NDArray[np.float64]:
    """Length of the shortest path from the picked splat; NaN where none leads, everywhere if that splat is inert."""
    from splap_editor.core.surface.geodesics import geodesic_distances

    assert snapshot.surface is not None and snapshot.picked is not None
    node = int(snapshot.ellipses.node_of_row[snapshot.picked])
    if node < 0:
        return np.full(snapshot.splats.n_splats, np.nan)
    distances = geodesic_distances(snapshot.surface.graph, np.array([node]))
    distances[np.isinf(distances)] = np.nan
    return _of_nodes(snapshot.ellipses, distances)


def displacement(snapshot: Snapshot) -> NDArray[np.float64]:
    """Distance of the centre from its place at rest."""
    if snapshot.kernels is None:
        return np.zeros(snapshot.splats.n_splats)
    return np.linalg.norm(snapshot.kernels.means - np.asarray(snapshot.splats.means, np.float64), axis=1)


def stretch(snapshot: Snapshot) -> NDArray[np.float64]:
    """Largest principal stretch of the surface at the splat; 1 at rest, NaN for inert splats."""
    return principal_stretches(snapshot)[:, 0]


def least_stretch(snapshot: Snapshot) -> NDArray[np.float64]:
    """Smallest principal stretch within the surface; below 1 where it is squeezed, NaN for inert splats."""
    return principal_stretches(snapshot)[:, 1]


def principal_stretches(snapshot: Snapshot) -> NDArray[np.float64]:
    """Principal stretches of how each ellipse moved.

    The map of an ellipse's plane is ``R U`` with a rotation R and a symmetric
    stretch U. With C the ellipse's matrix at rest and S the moved one's, turned
    back by R, ``U C U = S`` has one positive definite solution,
    ``U = C^-½ (C^½ S C^½)^½ C^-½``; its eigenvalues are wanted. They are not the
    growths of the semi-axes unless these lie along the stretch.

    Returns
    -------
    (N, 2) float64
        Largest and smallest; 1 where nothing moved, NaN for inert splats.
    """
    kernels = snapshot.kernels
    # While another surface is new, the pose shown is still one of the last.
    ellipses = snapshot.ellipses if kernels is None else kernels.binding.ellipses
    n = ellipses.n_nodes
    stretches = np.ones((n, 2))
    if kernels is not None:
        moved = np.flatnonzero(kernels.arrays.changed[:n])
        a, b = np.linalg.norm(ellipses.semi_axes[moved], axis=2).T
        g, h = kernels.arrays.growths[moved].T
        c, s = kernels.arrays.twists[moved].T
        # In units of a, so that nothing leaves the range of float64: semi-axes 1 and b, grown to g and h b.
        b = b / a
        s00, s11 = (c * g) ** 2 + (s * h * b) ** 2, (s * g) ** 2 + (c * h * b) ** 2
        s01 = c * s * (g**2 - (h * b) ** 2)
        area = b * b * g * h
        scale = np.sqrt(s00 + b * b * s11 + 2.0 * area)
        u00, u01, u11 = (s00 + area) / scale, s01 / scale, (s11 + area / b**2) / scale
        largest = 0.5 * (u00 + u11) + np.hypot(0.5 * (u00 - u11), u01)
        stretches[moved] = np.stack([largest, g * h / largest], axis=1)
    result = np.full((ellipses.n_splats, 2), np.nan)
    result[ellipses.rows] = stretches
    return result


def rotation_angle(snapshot: Snapshot) -> NDArray[np.float64]:
    """Angle of the splat's rotation from rest, degrees in [0, 180]."""
    if snapshot.kernels is None:
        return np.zeros(snapshot.splats.n_splats)
    R = snapshot.kernels.rotations
    # The sine as well as the cosine: the arc cosine alone loses half of the digits of small angles.
    axial = np.stack([R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], axis=1)
    return np.degrees(np.arctan2(np.linalg.norm(axial, axis=1), np.trace(R, axis1=1, axis2=2) - 1.0))


def free(snapshot: Snapshot) -> NDArray[np.float64]:
    """0 for what is pinned or out of reach, 1 for what a handle holds, 2 for what is free; NaN for inert splats."""
    assert snapshot.handles is not None
    states = np.full(snapshot.ellipses.n_nodes, 2.0)
    states[snapshot.handles.indices] = snapshot.handles.labels >= 0
    return _of_nodes(snapshot.ellipses, states)


def handle_weight(snapshot: Snapshot) -> NDArray[np.float64]:
    """Weight of the chosen handle, see `splat_weights`."""
    assert snapshot.weights is not None and snapshot.handle is not None and snapshot.surface is not None
    return splat_weights(snapshot.surface, snapshot.weights, snapshot.handle)


def splat_weights(surface: Surface, weights: Weights, handle: int) -> NDArray[np.float64]:
    """Weight of one handle at every splat of the file.

    Parameters
    ----------
    surface : Surface
    weights : (n, H) sparse or dense float64
    handle : int
        Column of the weights.

    Returns
    -------
    (N,) float64
        In 0..1; inert splats have the mean of the nodes that carry them, by which they move.
    """
    column = weights[:, [handle]]
    of_nodes = (column if isinstance(column, np.ndarray) else column.toarray())[:, 0]
    ellipses, binding = surface.ellipses, surface.binding
    values = _of_nodes(ellipses, of_nodes)
    carried = np.sum(of_nodes[binding.inert_carriers] * binding.inert_weights, axis=1)
    values[ellipses.node_of_row < 0] = carried
    return values


QUANTITIES: dict[str, Quantity] = {
    quantity.name: quantity
    for quantity in (
        Quantity("alpha", "Opacity", "", opacity, is_of_rest=True),
        Quantity("size", "Size", "length", size, is_of_rest=True),
        Quantity("flatness", "Flatness", "", flatness, is_of_rest=True),
        Quantity("contribution", "Contribution to the picture", "×", contribution, is_of_rest=True),
        Quantity("degree", "Degree", "", degree, "graph", is_whole=True, is_of_rest=True),
        Quantity("component", "Component", "", component, "graph", is_whole=True, is_label=True, is_of_rest=True),
        Quantity("geodesic", "Distance along the surface", "length", geodesic_distance, "picked"),
        Quantity("displacement", "Displacement", "length", displacement),
        Quantity("stretch", "Largest stretch", "×", stretch, middle=1.0),
        Quantity("least_stretch", "Smallest stretch", "×", least_stretch, middle=1.0),
        Quantity("rotation", "Rotation", "°", rotation_angle),
        Quantity("free", "Free or fixed", "", free, "handles", ("fixed", "held", "free"), is_whole=True, is_label=True),
        Quantity("weight", "Weight of the handle", "", handle_weight, "weights"),
    )
}


def column_names(text: str) -> tuple[str, ...]:
    """Read names of quantities, with commas between them; ValueError for one that there is not."""
    names = tuple(name.strip() for name in text.split(",") if name.strip())
    for name in names:
        if name not in QUANTITIES:
            raise ValueError(f"there is no quantity {name!r}; there are {', '.join(QUANTITIES)}")
    return names


def columns_of(names: Iterable[str], snapshot: Snapshot) -> dict[str, NDArray[np.float64]]:
    """Work out quantities to be written as columns of a PLY, by name.

    Raises
    ------
    ValueError
        What a quantity needs is not there.
    """
    columns = {}
    for name in names:
        lack = missing(QUANTITIES[name], snapshot)
        if lack:
            raise ValueError(f"the column {name!r} needs {lack}")
        columns[name] = values_of(QUANTITIES[name], snapshot)
    return columns


def _of_nodes(ellipses: Ellipses, values: ArrayLike) -> NDArray[np.float64]:
    """(N,) values of the nodes in file order, NaN for inert splats."""
    result = np.full(ellipses.n_splats, np.nan)
    result[ellipses.rows] = values
    return result
