"""What there is to know about one splat, and about one edge."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.graph.ellipse_offset import normal_offsets, touch_scales
from splap_editor.core.graph.splat_graph import SplatGraph
from splap_editor.core.index_spaces import FileRow, RowPair
from splap_editor.core.splats.occupancy import Ellipses, InertReason
from splap_editor.core.splats.splats import Splats

INERT_WORDS = {
    InertReason.ACTIVE: "",
    InertReason.TRANSPARENT: "too faint to be seen",
    InertReason.THRESHOLD: "its threshold is never reached",
    InertReason.NON_FINITE: "a number of it is not finite, or too large",
    InertReason.ZERO_QUATERNION: "its rotation is all zero",
    InertReason.ZERO_SIZE: "it has no size",
    InertReason.REMOVED: "it is removed",
    InertReason.FOLLOWS: "it is faint, and follows the splats around it",
}
"""Why a splat takes no part in the graph."""


@dataclass(frozen=True)
class SplatCard:
    """One splat.

    Parameters
    ----------
    row : FileRow
        In the file.
    opacity : float
    threshold : float, optional
        Cut-off of the kernel, where the trainer has one.
    inert : str
        Why it takes no part in the graph; empty if it does. The rest is None then.
    semi_axes : 2 floats, optional
        Of the occupancy ellipse, world units.
    degree, component, component_size : int, optional
        None while there is no graph, too. Component 0 is the largest.
    n_components : int, optional
    """

    row: FileRow
    opacity: float
    threshold: float | None
    inert: str
    semi_axes: tuple[float, float] | None = None
    degree: int | None = None
    component: int | None = None
    component_size: int | None = None
    n_components: int | None = None


def splat_card(splats: Splats, ellipses: Ellipses, graph: SplatGraph | None, row: FileRow) -> SplatCard:
    """Gather the facts of the splat in a file row."""
    threshold = None if splats.thresholds is None else float(splats.thresholds[row])
    inert = INERT_WORDS[InertReason(int(ellipses.inert[row]))]
    card = SplatCard(row, float(splats.opacities[row]), threshold, inert)
    node = int(ellipses.node_of_row[row])
    if node < 0:
        return card
    card = replace(card, semi_axes=tuple(np.linalg.norm(ellipses.semi_axes[node], axis=1).tolist()))
    if graph is None:
        return card
    component = int(graph.components[node])
    return replace(
        card,
        degree=int(graph.degrees[node]),
        component=component,
        component_size=int(np.count_nonzero(graph.components == component)),
        n_components=int(graph.components.max()) + 1,
    )


@dataclass(frozen=True)
class EdgeCard:
    """One pair of active splats, joined or not.

    Parameters
    ----------
    rows : 2 ints
        In the file.
    length : float
        Between the centres, world units.
    offsets : 2 floats
        Normal-wise offset of the second seen from the first, and of the first from the second; world units, inf
        where they never meet.
    epsilon : float
        Tolerance, world units.
    touch : float
        Touch scale at that tolerance.
    """

    rows: RowPair
    length: float
    offsets: tuple[float, float]
    epsilon: float
    touch: float

    @property
    def is_within(self) -> bool:
        """Whether the paper's rule joins the two at this tolerance."""
        return min(self.offsets) <= self.epsilon


def edge_card(ellipses: Ellipses, rows: RowPair, epsilon: float) -> EdgeCard:
    """Measure a pair of splats at a tolerance in units of the scene scale.

    Raises
    ------
    ValueError
        A splat of the pair is inert.
    """
    nodes = ellipses.node_of_row[np.array(rows)]
    if (nodes < 0).any():
        raise ValueError(f"rows {rows[0]} and {rows[1]} must be active splats")
    world = epsilon * ellipses.scene_scale
    offsets: NDArray[np.float64] = normal_offsets(ellipses, nodes[None])[0]
    return EdgeCard(
        (int(rows[0]), int(rows[1])),
        float(np.linalg.norm(np.subtract(*ellipses.centers[nodes]))),
        (float(offsets[0]), float(offsets[1])),
        world,
        float(touch_scales(ellipses, nodes[None], world)[0]),
    )


def has_edge(ellipses: Ellipses, graph: SplatGraph, rows: RowPair) -> bool:
    """Whether the graph joins two file rows."""
    a, b = (int(node) for node in ellipses.node_of_row[np.array(rows)])
    if a < 0 or b < 0:
        return False
    return bool(np.isin(b, graph.indices[graph.indptr[a] : graph.indptr[a + 1]]))
