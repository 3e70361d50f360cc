"""Splats that are like one: by colour, size and the way they face, everywhere or as far as the surface goes on so."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from splap_editor.core.graph.splat_graph import SplatGraph
from splap_editor.core.index_spaces import FileMask, FileRow, Node, NodeMask
from splap_editor.core.options import option
from splap_editor.core.splats.occupancy import Ellipses
from splap_editor.core.splats.spherical_harmonics import SH_C0
from splap_editor.core.splats.splats import Splats


@dataclass(frozen=True)
class LikenessOptions:
    """What makes two splats alike. A tolerance at its most leaves its property out of account.

    Parameters
    ----------
    color : float
        Difference of the base colours in each channel, as a share of the full range.
    size : float
        Ratio of the larger semi-axes, at least 1.
    angle : float
        Angle between the normals in degrees, whichever way they point.
    floods : bool
        Only what hangs together with the picked splat, along the splat graph.
    """

    color: float = option(
        0.1,
        "How far each channel of the colour may be from that of the picked splat; 100: any colour.",
        label="Colour",
        least=0.0,
        most=1.0,
        is_percent=True,
        step=0.01,
        decimals=2,
    )
    size: float = option(
        100.0,
        "How many times as large or as small it may be; 100: any size.",
        label="Size",
        least=1.0,
        most=100.0,
        step=0.5,
        decimals=1,
    )
    angle: float = option(
        90.0,
        "Degrees that it may face another way than the picked splat, in a flood than its neighbour; 90: any way.",
        label="Normal",
        least=0.0,
        most=90.0,
        step=1.0,
        decimals=0,
    )
    floods: bool = option(
        False, "Only as far as such splats hang together along the surface; else everywhere.", label="Flood"
    )


def alike(
    splats: Splats, ellipses: Ellipses, graph: SplatGraph | None, row: FileRow, options: LikenessOptions
) -> FileMask:
    """Find the splats that are like one, itself among them.

    Colour and size are compared with the picked splat. So are normals, unless the answer is a flood: that goes on
    from splat to splat, round a bend as long as it is smooth.

    Parameters
    ----------
    splats : Splats
    ellipses : Ellipses
        Its n active splats; others have neither size nor normal, and are found by nothing but their colour.
    graph : SplatGraph, optional
        Needed for a flood.
    row : int
        The picked splat.
    options : LikenessOptions

    Returns
    -------
    (N,) bool
    """
    found = _near_color(splats.sh0, row, options.color)
    node = int(ellipses.node_of_row[row])
    is_narrow = options.size < 100.0 or options.angle < 90.0 or options.floods
    if not is_narrow:
        return found
    result = np.zeros(splats.n_splats, bool)
    result[row] = True
    if node < 0:
        return result
    nodes = found[ellipses.rows]
    if options.size < 100.0:
        ratio = ellipses.reaches / ellipses.reaches[node]
        nodes &= (ratio <= options.size) & (ratio >= 1.0 / options.size)
    if options.floods:
        if graph is None:
            raise ValueError("a flood needs the graph: wait until the scene is prepared")
        nodes = flooded(graph, nodes, node, ellipses.normals if options.angle < 90.0 else None, options.angle)
    elif options.angle < 90.0:
        nodes &= np.abs(ellipses.normals @ ellipses.normals[node]) >= np.cos(np.radians(options.angle))
    result[ellipses.rows[nodes]] = True
    return result


def flooded(
    graph: SplatGraph,
    nodes: NodeMask,
    start: Node,
    normals: NDArray[np.floating] | None = None,
    angle: float = 90.0,
) -> NodeMask:
    """Spread from a node along the graph, over some of its nodes.

    Parameters
    ----------
    graph : SplatGraph
    nodes : (n,) bool
        Where it may go.
    start : int
    normals : (n, 3) float, optional
        Unit normals: no step goes between two that are more than an angle apart, whichever way they point.
    angle : float
        Degrees.

    Returns
    -------
    (n,) bool
        The start is always in it.
    """
    i, j = graph.edges[:, 0], graph.edges[:, 1]
    goes = nodes[i] & nodes[j]
    i, j = i[goes], j[goes]
    if normals is not None:
        smooth = np.abs(np.einsum("ij,ij->i", normals[i], normals[j])) >= np.cos(np.radians(angle))
        i, j = i[smooth], j[smooth]
    steps = coo_array((np.ones(len(i), bool), (i, j)), (graph.n_nodes, graph.n_nodes))
    labels = connected_components(steps, directed=False)[1]
    return np.asarray(labels == labels[start])


def _near_color(sh0: NDArray[np.floating], row: FileRow, tolerance: float) -> FileMask:
    """(N,) whose base colour, as it is shown, differs in no channel by more than a tolerance."""
    if tolerance >= 1.0:
        return np.ones(len(sh0), bool)
    near = np.ones(len(sh0), bool)
    for k in range(3):
        shown = np.clip(0.5 + SH_C0 * np.asarray(sh0[:, k], np.float32), 0.0, 1.0)
        near &= np.abs(shown - shown[row]) <= np.float32(tolerance)
    return near
