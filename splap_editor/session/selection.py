"""Selections as masks over all splats: modifiers, and growing along the surface."""

from enum import Enum

import numpy as np

from splap_editor.core.graph.splat_graph import SplatGraph
from splap_editor.core.index_spaces import FileMask, NodeMask
from splap_editor.core.splats.occupancy import Ellipses
from splap_editor.core.surface.geodesics import Neighborhoods

_SECTORS, _FREE = 24, 9
"""Directions of neighbours are told in so many sectors; so many free ones in a row are a rim."""


class SelectionMode(Enum):
    """How newly picked splats meet those already selected."""

    REPLACE = "replace"
    ADD = "add"
    REMOVE = "remove"
    INTERSECT = "intersect"


def combined_selection(selection: FileMask, picked: FileMask, mode: SelectionMode) -> FileMask:
    """Apply a picked mask to a selection; every selection tool ends here."""
    if mode is SelectionMode.ADD:
        return selection | picked
    if mode is SelectionMode.REMOVE:
        return selection & ~picked
    if mode is SelectionMode.INTERSECT:
        return selection & picked
    return picked.copy()


def grown_selection(selection: FileMask, ellipses: Ellipses, graph: SplatGraph) -> FileMask:
    """Add the graph neighbours of the selected splats."""
    nodes = selection[ellipses.rows]
    touched = (graph.matrix() @ nodes.astype(np.float64)) > 0
    return _with_nodes(selection, ellipses, nodes | touched)


def shrunk_selection(selection: FileMask, ellipses: Ellipses, graph: SplatGraph) -> FileMask:
    """Drop the selected splats that have a neighbour outside the selection."""
    nodes = selection[ellipses.rows]
    outside = (graph.matrix() @ (~nodes).astype(np.float64)) > 0
    return _with_nodes(selection, ellipses, nodes & ~outside)


def rim_selection(selection: FileMask, ellipses: Ellipses, graph: SplatGraph) -> FileMask:
    """Keep only the selected splats that have a neighbour outside the selection; inert ones have none."""
    return _with_nodes(np.zeros_like(selection), ellipses, selection[ellipses.rows]) & ~shrunk_selection(
        selection, ellipses, graph
    )


def boundary_selection(ellipses: Ellipses, neighborhoods: Neighborhoods) -> FileMask:
    """Select the splats at open rims of the surface: those that have no neighbour along it over 135° of all directions.

    At a straight rim the neighbours leave half of the directions free. Directions are told in sectors of 15°, so a gap
    of up to 165° may go unnoticed where it begins and ends amid one.

    Returns
    -------
    (N,) bool
        By file row; inert splats are at no rim, lonely ones are.
    """
    counts = np.diff(neighborhoods.indptr)
    starts = np.repeat(np.arange(len(counts)), counts)
    normals = ellipses.normals
    u = np.cross(normals, np.eye(3)[np.argmin(np.abs(normals), axis=1)])
    v = np.cross(normals, u / np.linalg.norm(u, axis=1)[:, None]) * np.linalg.norm(u, axis=1)[:, None]
    offsets = ellipses.centers[neighborhoods.indices] - ellipses.centers[starts]
    across, along = (np.einsum("ij,ij->i", offsets, axes[starts]) for axes in (u, v))
    turns = np.arctan2(across, along) / (2.0 * np.pi) + 0.5
    sectors = (_SECTORS * turns).astype(np.int64) % _SECTORS
    taken = np.zeros(len(counts), np.int64)
    has_any = counts > 0
    if len(sectors):
        taken[has_any] = np.bitwise_or.reduceat(np.int64(1) << sectors, neighborhoods.indptr[:-1][has_any])
    everything = (np.int64(1) << _SECTORS) - 1
    free = ~taken & everything
    run = free.copy()
    for k in range(1, _FREE):
        run &= ((free << k) | (free >> (_SECTORS - k))) & everything
    return _with_nodes(np.zeros(len(ellipses.node_of_row), bool), ellipses, run != 0)


def connected_selection(selection: FileMask, ellipses: Ellipses, graph: SplatGraph) -> FileMask:
    """Select every splat in a component of the graph that holds a selected one."""
    nodes = selection[ellipses.rows]
    reached = np.zeros(graph.components.max(initial=-1) + 1, bool)
    reached[graph.components[nodes]] = True
    return _with_nodes(selection, ellipses, reached[graph.components])


def _with_nodes(selection: FileMask, ellipses: Ellipses, nodes: NodeMask) -> FileMask:
    mask = selection.copy()
    mask[ellipses.rows] = nodes
    return mask
