"""Pieces that came off the surface: which of them belong to it, and the contacts that tie those."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.graph.splat_graph import SplatGraph
from splap_editor.core.splats.occupancy import Ellipses
from splap_editor.core.surface.joining import contact_order, near_pairs

FRAGMENT_SHARE = 0.05
"""A component of at most such a share of all nodes is a fragment, if it is not the largest."""

JOIN_REACH = 3.0
"""A fragment is joined where centres are no farther apart than so many times both reaches together."""

N_LINKS = 3
"""A fragment is tied by at least so many contacts if it has them: fewer would let it turn freely."""

ORDINARY = 0.9
"""Surface goes on across a contact that differs no more in colour and tangent plane than so many of the edges do."""

LEAST_STEP, LEAST_SINE = 0.05, 0.35
"""Of colours (0 to 1) and of angles (20°): what always goes on, however even the surface is."""

GOES_ON = 0.5
"""A fragment is a piece of surface if such a share of its contacts looks like surface that goes on."""

_MOST_ROUNDS = 16


class FragmentContacts(NamedTuple):
    """What ties fragments to the surface.

    Parameters
    ----------
    pairs : (P, 2) int64
        Nodes of each contact, that of the fragment first.
    n_tied : int
        Fragments that they tie.
    n_far : int
        Fragments left because nothing is near.
    n_unlike : int
        Fragments left because colours or tangents do not go on at what is near.
    """

    pairs: NDArray[np.int64]
    n_tied: int
    n_far: int
    n_unlike: int


def fragments(graph: SplatGraph) -> NDArray[np.int64]:
    """Labels of the components that are small beside the whole, ascending; never the largest."""
    sizes = np.bincount(graph.components) if graph.n_nodes else np.zeros(0, np.int64)
    small = np.flatnonzero(sizes <= max(FRAGMENT_SHARE * graph.n_nodes, 1.0))
    return small[small > 0]


def fragment_contacts(ellipses: Ellipses, graph: SplatGraph, colors: NDArray[np.floating]) -> FragmentContacts:
    """Contacts that tie each fragment that looks like a piece of the surface to what is around it.

    Along the rim of a fragment each splat and the nearest ones beyond choose
    their best contact; those that choose each other tie it, three at least. A
    fragment counts as a piece of the surface if half of these contacts or more
    differ in colour and tangent plane no more than nine in ten edges of the
    graph do; what floats above, or is another thing, is left. What is tied may
    tie the next one.

    Parameters
    ----------
    ellipses : Ellipses
        n nodes.
    graph : SplatGraph
    colors : (n, 3) float
        Red, green and blue, 0 to 1.

    Returns
    -------
    FragmentContacts
    """
    labels = graph.components
    left = np.isin(labels, fragments(graph))
    small = np.unique(labels[left])
    # 0: nothing near, 1: near but unlike, 2: tied.
    fate = np.zeros(int(labels.max(initial=-1)) + 1, np.int64)
    found = [np.empty((0, 2), np.int64)]
    bases = np.flatnonzero(~left)
    for _ in range(_MOST_ROUNDS):
        loose = np.flatnonzero(left)
        if not len(loose) or not len(bases):
            break
        pairs = _rim_contacts(ellipses, graph, loose, bases)
        owners = labels[pairs[:, 0]]
        fate[owners] = 1
        goes_on = _goes_on(ellipses, graph, colors, pairs)
        n_on, n_all = (np.bincount(each, minlength=len(fate)) for each in (owners[goes_on], owners))
        kept = goes_on & (n_on >= GOES_ON * n_all)[owners]
        found.append(pairs[kept])
        fate[owners[kept]] = 2
        is_tied = left & (fate == 2)[labels]
        bases, left = np.flatnonzero(is_tied), left & ~is_tied
    fates = np.bincount(fate[small], minlength=3)
    return FragmentContacts(np.concatenate(found), int(fates[2]), int(fates[0]), int(fates[1]))


def _rim_contacts(
    ellipses: Ellipses, graph: SplatGraph, loose: NDArray[np.int64], bases: NDArray[np.int64]
) -> NDArray[np.int64]:
    """(P, 2) loose nodes and those that would tie them: who choose each other, and the best few of each fragment."""
    pairs = _close(ellipses, near_pairs(ellipses, loose, bases))
    back = _close(ellipses, near_pairs(ellipses, np.unique(pairs[:, 1]), loose)[:, ::-1])
    pairs = np.unique(np.concatenate([pairs, back]), axis=0)
    pairs = pairs[contact_order(ellipses, pairs, graph.epsilon)]
    # The best of each end comes first in the order, and so does the best of each fragment.
    best_of_loose, best_of_base = (np.unique(pairs[:, side], return_index=True)[1] for side in (0, 1))
    owners = graph.components[pairs[:, 0]]
    order = np.argsort(owners, kind="stable")
    counts = np.unique(owners, return_counts=True)[1]
    ranks = np.arange(len(order)) - np.repeat(np.cumsum(counts) - counts, counts)
    return pairs[np.union1d(np.intersect1d(best_of_loose, best_of_base), order[ranks < N_LINKS])]


def _close(ellipses: Ellipses, pairs: NDArray[np.int64]) -> NDArray[np.int64]:
    """Those of pairs (P, 2) whose centres are close for their size."""
    apart = np.linalg.norm(ellipses.centers[pairs[:, 0]] - ellipses.centers[pairs[:, 1]], axis=1)
    return pairs[apart <= JOIN_REACH * ellipses.reaches[pairs].sum(axis=1)]


def _goes_on(
    ellipses: Ellipses, graph: SplatGraph, colors: NDArray[np.floating], pairs: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Whether each of pairs (P, 2) looks as most edges of the graph do."""
    floors = LEAST_STEP, LEAST_SINE, LEAST_SINE
    goes_on = np.ones(len(pairs), bool)
    ordinary = _differences(ellipses, colors, graph.edges)
    for floor, usual, found in zip(floors, ordinary, _differences(ellipses, colors, pairs), strict=True):
        goes_on &= found <= max(floor, float(np.quantile(usual, ORDINARY)) if len(usual) else 0.0)
    return goes_on


def _differences(
    ellipses: Ellipses, colors: NDArray[np.floating], pairs: NDArray[np.integer]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Of pairs (P, 2): step of colour, sine between both normals, and that by which one rises above a plane."""
    a, b = pairs.T
    step = ellipses.centers[b] - ellipses.centers[a]
    length = np.maximum(np.linalg.norm(step, axis=1), np.finfo(float).tiny)
    rise = [np.abs(np.einsum("ij,ij->i", step, ellipses.normals[end])) / length for end in (a, b)]
    turn = np.linalg.norm(np.cross(ellipses.normals[a], ellipses.normals[b]), axis=1)
    return np.linalg.norm(colors[a] - colors[b], axis=1), turn, np.maximum(*rise)
