"""The splat graph: which ellipses belong to the same piece of surface."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from splap_editor.core.compressed_rows import gathered, with_rows
from splap_editor.core.graph.ellipse_offset import touch_scales
from splap_editor.core.graph.ellipse_tree import ellipse_tree
from splap_editor.core.graph.options import GRAPH_RULES, GraphOptions
from splap_editor.core.graph.touch_rule import edge_keys, labels_by_size
from splap_editor.core.index_spaces import FileRows, RowPair
from splap_editor.core.progress import Progress, no_progress
from splap_editor.core.splats.occupancy import Ellipses

__all__ = ["GraphOptions", "SplatGraph", "mended_graph", "require_mendable", "splat_graph"]

_LENGTH_FLOOR = 1e-9


@dataclass(frozen=True, eq=False)
class SplatGraph:
    """Undirected graph on the nodes of `Ellipses` as symmetric compressed rows.

    Parameters
    ----------
    indptr : (n + 1,) int32
        Row starts.
    indices : (nnz,) int32
        Neighbours, ascending in each row; each edge appears at both ends.
    lengths : (nnz,) float64
        Distance of the centres in world units, at least 1e-9 of the scene
        scale (coinciding centres).
    touch : (nnz,) float64 or None
        Touch scale of each entry if the rule is made from them.
    epsilon : float
        Tolerance in world units.
    """

    indptr: NDArray[np.int32]
    indices: NDArray[np.int32]
    lengths: NDArray[np.float64]
    touch: NDArray[np.float64] | None
    epsilon: float

    @property
    def n_nodes(self) -> int:
        """Number of nodes n."""
        return len(self.indptr) - 1

    @property
    def n_edges(self) -> int:
        """Number of edges, each counted once."""
        return len(self.indices) // 2

    @cached_property
    def degrees(self) -> NDArray[np.int32]:
        """(n,) number of neighbours."""
        return np.diff(self.indptr)

    @cached_property
    def components(self) -> NDArray[np.int32]:
        """(n,) component of each node, numbered by falling size from 0; equal sizes by their first node."""
        return labels_by_size(connected_components(self.matrix(), directed=False)[1])

    @cached_property
    def edges(self) -> NDArray[np.int32]:
        """(n_edges, 2) nodes i < j of each edge, ascending."""
        starts = np.repeat(np.arange(self.n_nodes, dtype=np.int32), self.degrees)
        upper = starts < self.indices
        return np.stack([starts[upper], self.indices[upper]], axis=1)

    def matrix(self) -> sp.csr_array:
        """Edge lengths as an (n, n) sparse matrix that shares this graph's arrays."""
        return sp.csr_array((self.lengths, self.indices, self.indptr), shape=(self.n_nodes, self.n_nodes))


def splat_graph(
    ellipses: Ellipses, options: GraphOptions = GraphOptions(), *, progress: Progress = no_progress
) -> SplatGraph:
    """Connect ellipses that lie on the same piece of surface.

    The paper's rule [1]_ joins every two whose normal-wise offset is at most ε
    in one direction at least. Where two surfaces pass near each other, or splats
    overhang the border of theirs, it also joins what only touches with its rim.

    The touch rule, see `touch_edges`, keeps each splat's best contacts instead.

    Parameters
    ----------
    ellipses : Ellipses
        Occupancy ellipses of n nodes.
    options : GraphOptions
        Rule, tolerance and mended edges; strokes become such in `splap_editor.engine.strokes`.
    progress : Progress
        Called with the share done.

    Returns
    -------
    SplatGraph
        Isolated nodes have no neighbours.

    Raises
    ------
    ValueError
        If a row of ``options.cut`` or ``options.add`` is not in the file or
        belongs to an inert splat, or a pair joins a splat to itself.

    References
    ----------
    .. [1] SpLap, 3DV 2026, Sec. 4.1 and supplement B.
    """
    epsilon = options.epsilon * ellipses.scene_scale
    cut = _node_pairs(ellipses, options.cut, "cut")
    add = _node_pairs(ellipses, options.add, "add")
    tree = ellipse_tree(ellipses)
    edges, touch = GRAPH_RULES[options.rule].load()(tree, epsilon, progress)
    graph = _symmetric(ellipses, *_mended(ellipses, edges, touch, epsilon, cut, add), epsilon)
    progress(1.0)
    return graph


def mended_graph(ellipses: Ellipses, graph: SplatGraph, options: GraphOptions) -> SplatGraph:
    """Cut and add edges: what `splat_graph` gives with these options, without a search.

    Parameters
    ----------
    ellipses : Ellipses
        Occupancy ellipses of n nodes.
    graph : SplatGraph
        Theirs, made with the same rule and tolerance and with nothing cut or added.
    options : GraphOptions
        Names the edges; of those in both lists none stays.

    Raises
    ------
    ValueError
        As `splat_graph` does.
    """
    cut = _node_pairs(ellipses, options.cut, "cut")
    add = _node_pairs(ellipses, options.add, "add")
    n, rows = graph.n_nodes, np.unique(np.concatenate([cut.ravel(), add.ravel()]))
    _, places, owners = gathered(graph.indptr, rows)
    keys = owners.astype(np.int64) * n + graph.indices[places]
    # What is there already keeps its touch scale.
    gone, come = edge_keys(cut, n), edge_keys(add, n)
    come = np.setdiff1d(come, np.concatenate([gone, keys]))
    kept = ~np.isin(keys, np.concatenate([gone, _turned(gone, n)]))
    places, keys = places[kept], np.concatenate([keys[kept], come, _turned(come, n)])
    order = np.argsort(keys)
    owners, columns = np.divmod(keys[order], n)
    added = np.stack(np.divmod(come, n), axis=1).astype(np.int32)

    def entries(old: NDArray[np.float64], new: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values of what stays and of what comes, either way round, in the order of their keys."""
        return np.concatenate([old[places], new, new])[order]

    old: list[NDArray] = [graph.indices, graph.lengths]
    new: list[NDArray] = [columns.astype(graph.indices.dtype), entries(graph.lengths, _lengths(ellipses, added))]
    if graph.touch is not None:
        old.append(graph.touch)
        new.append(entries(graph.touch, touch_scales(ellipses, added, graph.epsilon)))
    starts = np.searchsorted(owners, np.append(rows, n))
    indptr, arrays = with_rows(graph.indptr, tuple(old), rows, starts, tuple(new))
    return SplatGraph(indptr, arrays[0], arrays[1], None if graph.touch is None else arrays[2], graph.epsilon)


def require_mendable(ellipses: Ellipses, options: GraphOptions) -> None:
    """Raise the ValueError that mending would, before any work."""
    _node_pairs(ellipses, options.cut, "cut")
    _node_pairs(ellipses, options.add, "add")


def _mended(
    ellipses: Ellipses,
    edges: NDArray[np.int32],
    touch: NDArray[np.float64] | None,
    epsilon: float,
    cut: NDArray[np.int32],
    add: NDArray[np.int32],
) -> tuple[NDArray[np.int32], NDArray[np.float64] | None]:
    """Edges (E, 2) with some added and then some cut, and their touch scales if there are any."""
    if len(add):
        edges = np.concatenate([edges, add])
        touch = None if touch is None else np.concatenate([touch, touch_scales(ellipses, add, epsilon)])
    if len(cut):
        kept = ~np.isin(edge_keys(edges, ellipses.n_nodes), edge_keys(cut, ellipses.n_nodes))
        edges, touch = edges[kept], None if touch is None else touch[kept]
    return edges, touch


def _node_pairs(ellipses: Ellipses, rows: tuple[RowPair, ...], name: str) -> NDArray[np.int32]:
    """(E, 2) nodes of pairs of file rows."""
    pairs = np.array(rows, np.int64).reshape(-1, 2)
    flat = pairs.ravel()
    unknown = flat[(flat < 0) | (flat >= ellipses.n_splats)]
    if len(unknown):
        raise ValueError(f"{name}: rows {_listed(unknown)} are not in the file, which has {ellipses.n_splats} splats")
    nodes = ellipses.node_of_row[pairs]
    inert = pairs[nodes < 0]
    if len(inert):
        raise ValueError(f"{name}: rows {_listed(inert)} are inert splats, which no edge can join")
    if (pairs[:, 0] == pairs[:, 1]).any():
        raise ValueError(f"{name}: row {pairs[pairs[:, 0] == pairs[:, 1]][0, 0]} is paired with itself")
    return np.sort(nodes, axis=1).astype(np.int32)


def _listed(rows: FileRows) -> str:
    rows = np.unique(rows)
    return ", ".join(map(str, rows[:5])) + (f" and {len(rows) - 5} more" if len(rows) > 5 else "")


def _symmetric(
    ellipses: Ellipses, edges: NDArray[np.int32], touch: NDArray[np.float64] | None, epsilon: float
) -> SplatGraph:
    """Lay undirected edges out as compressed rows, each at both ends."""
    n = ellipses.n_nodes
    _, once = np.unique(edge_keys(edges, n), return_index=True)
    edges = edges[once]
    # Zero is a legal touch scale but no legal entry of a sparse matrix: carry edge numbers instead.
    numbers = np.arange(len(edges), dtype=np.int32)
    both = sp.coo_array(
        (
            np.concatenate([numbers, numbers]),
            (np.concatenate([edges[:, 0], edges[:, 1]]), np.concatenate([edges[:, 1], edges[:, 0]])),
        ),
        shape=(n, n),
    ).tocsr()
    both.sort_indices()
    lengths = _lengths(ellipses, edges)
    return SplatGraph(
        indptr=both.indptr.astype(np.int32, copy=False),
        indices=both.indices.astype(np.int32, copy=False),
        lengths=lengths[both.data],
        touch=None if touch is None else touch[once][both.data],
        epsilon=epsilon,
    )


def _lengths(ellipses: Ellipses, edges: NDArray[np.int32]) -> NDArray[np.float64]:
    """(E,) distances of the ends of edges in world units, with their floor."""
    lengths = np.linalg.norm(ellipses.centers[edges[:, 0]] - ellipses.centers[edges[:, 1]], axis=1)
    return np.maximum(lengths, _LENGTH_FLOOR * ellipses.scene_scale)


def _turned(keys: NDArray[np.int64], n: int) -> NDArray[np.int64]:
    """Keys i · n + j of pairs as keys j · n + i."""
    i, j = np.divmod(keys, n)
    return j * n + i
