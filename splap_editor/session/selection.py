"""Selections as masks over all splats: modifiers, and growing along the surface."""

from enum import Enum

import numpy as np

from splap_editor.core.graph.splat_graph import SplatGraph
from splap_editor.core.index_spaces import FileMask, NodeMask
from splap_editor.core.splats.occupancy import Ellipses


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
