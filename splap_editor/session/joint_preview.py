"""The contacts by which two rims would be tied, found in the background."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist

from splap_editor.core.graph.options import Joint, Point
from splap_editor.core.index_spaces import FileMask, FileRow, FileRows, Nodes
from splap_editor.core.surface.geodesics import geodesic_distances
from splap_editor.core.surface.joining import facing_rims
from splap_editor.engine.strokes import joint_contacts
from splap_editor.engine.surface import Surface

MARGIN = 1.1
"""What is pointed at is at most so much nearer than what is meant to be joined."""

DETOUR = 3.0
"""A stroke goes across a gap if the way along the surface between its ends is so many times as long."""

MOST_POINTS = 16
"""Places kept of each rim of a selection."""


@dataclass(frozen=True, eq=False)
class FoundJoint:
    """What a joint would add.

    Parameters
    ----------
    stroke : Joint
    rows : (E, 2) int64
        File rows of each contact, the best first; without what is joined already.
    """

    stroke: Joint
    rows: FileRows


def found_joint(surface: Surface, stroke: Joint) -> FoundJoint:
    """Find what a joint would add to a surface as it is mended so far; for the worker."""
    contacts = joint_contacts(surface.ellipses, surface.graph, stroke)
    return FoundJoint(stroke, surface.ellipses.rows[contacts])


def default_reach(a: Sequence[Point], b: Sequence[Point]) -> float:
    """Reach in world units that joins all of the shorter one of two strokes to the other."""
    apart = cdist(np.array(a), np.array(b))
    reach = MARGIN * float(min(apart.min(axis=0).max(), apart.min(axis=1).max()))
    # Both at one place: any reach will do, and none must not be.
    return reach or 1.0


def gap_in(surface: Surface, rows: Sequence[FileRow]) -> int | None:
    """Where a stroke over some file rows crosses a gap: the number of rows before it; None if it crosses none."""
    if len(rows) < 2:
        return None
    ellipses = surface.ellipses
    nodes = ellipses.node_of_row[list(rows)]
    nodes, places = nodes[nodes >= 0], np.flatnonzero(nodes >= 0)
    if len(nodes) < 2:
        return None
    length = float(np.linalg.norm(np.diff(ellipses.centers[nodes], axis=0), axis=1).sum())
    apart = geodesic_distances(surface.graph, nodes[:1], limit=DETOUR * length)[nodes]
    if apart[-1] <= DETOUR * length:
        return None
    # What lies beyond the gap is at most the stroke's length nearer than its end.
    return int(places[np.argmax(apart > (DETOUR - 1.0) * length)])


def rims_of(surface: Surface, selection: FileMask) -> tuple[tuple[FileRow, ...], tuple[FileRow, ...]]:
    """File rows on both sides of the gap between a selection and the rest; for the worker.

    Raises
    ------
    ValueError
        All splats with a surface are on one side.
    """
    ellipses = surface.ellipses
    chosen = selection[ellipses.rows]
    if chosen.all() or not chosen.any():
        raise ValueError("select one of two parts: all splats that can be joined are on one side")
    rims = facing_rims(ellipses, np.flatnonzero(chosen), np.flatnonzero(~chosen))
    first, second = (ellipses.rows[_spread(rim)].tolist() for rim in rims)
    return tuple(first), tuple(second)


def _spread(rim: Nodes) -> Nodes:
    """At most so many places of a rim, evenly along the order of nodes, which is one of space."""
    return rim[np.unique(np.linspace(0, len(rim) - 1, MOST_POINTS).round().astype(int))]
