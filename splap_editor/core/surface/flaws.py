"""Flaws of a pose: tears, webs and spikes as places that a person would look at, worst first."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from splap_editor.core.index_spaces import Nodes
from splap_editor.core.surface.posed_surface import PosedSurface
from splap_editor.core.surface.spikes import spikes
from splap_editor.core.surface.tears import OPEN, tears
from splap_editor.core.surface.webs import parted_about, webs

LEAST_RIM = 2
"""Splats on either side of a tear: one that comes off, or drifts by, is none however many lie about it."""

SEEN = 1e-5
"""What fills less of a picture is not seen, in units of s²: about three pixels of one 600 wide."""

SURE = np.log(10.0)
"""Odds of a place, those of its signs together, that it is what it is told for: a false alarm is worse than a miss."""

_MOST_STRAIN = 4.0


@dataclass(frozen=True, eq=False)
class Flaw:
    """One place where a pose does to the surface what nobody wants.

    Parameters
    ----------
    kind : str
        ``"tear"``, ``"web"`` or ``"spike"``.
    nodes : (k,) int64
        Splats concerned, ascending.
    first, second : (a,), (b,) int64
        Those on either side, the side that moved more first; without a second side for a spike.
    size : float
        World units: what is open, by how much a web is drawn out, how long a spike is.
    severity : float
        Area that is seen of it in a picture, in units of s², times how many times it is strained.
    """

    kind: str
    nodes: Nodes
    first: Nodes
    second: Nodes
    size: float
    severity: float


class _Signs(NamedTuple):
    """Signs of one kind of flaw.

    Pairs (P, 2) of nodes, by how much they grew in units of s, how many times, and the logarithm of their odds.
    """

    kind: str
    pairs: Nodes
    longer: NDArray[np.float64]
    strains: NDArray[np.float64]
    odds: NDArray[np.float64]


def flaws(posed: PosedSurface, rest_axes: NDArray[np.float32], epsilon: float) -> list[Flaw]:
    """Find where a pose tears, webs and draws out the surface.

    Linear in the number of nodes, and quick where little moved.

    Parameters
    ----------
    posed : PosedSurface
    rest_axes : (n, 2, 3) float32
        In-plane axes at rest, one standard deviation long, in world units.
    epsilon : float
        Tolerance of a contact along the normals in world units.

    Returns
    -------
    list of Flaw
        Worst first; nothing that is too small to be seen, or hidden.
    """
    torn = tears(posed, epsilon)
    drawn = webs(posed, torn.others)
    nodes, growths = spikes(posed, rest_axes)
    alone = ~np.isin(nodes, np.concatenate([torn.pairs.ravel(), drawn.links.ravel()]))
    nodes, growths = nodes[alone], growths[alone]
    lengths = (
        4.0 * np.sqrt(np.square(posed.axes[nodes], dtype=np.float64).sum(axis=2).max(axis=1, initial=0.0)) / posed.scale
    )
    signs = (
        _Signs("tear", torn.pairs, torn.gaps, _strains(posed, torn.pairs), torn.odds),
        _Signs("web", drawn.links, drawn.longer, _strains(posed, drawn.links), drawn.odds),
        _Signs("spike", np.stack([nodes, nodes], axis=1), lengths, growths - 1.0, np.full(len(nodes), np.inf)),
    )
    found = [flaw for each in signs for flaw in _places(posed, each, drawn.parted)]
    return sorted(found, key=lambda flaw: -flaw.severity)


def _strains(posed: PosedSurface, pairs: Nodes) -> NDArray[np.float64]:
    rest, moved = posed.distances(pairs)
    return (moved - rest) / np.maximum(rest, np.finfo(float).tiny)


def _places(posed: PosedSurface, signs: _Signs, parted: Nodes) -> list[Flaw]:
    """Signs that lie beside each other as one flaw each, those too small to be seen left out."""
    pairs = signs.pairs
    if not len(pairs):
        return []
    labels = _labels(posed, pairs)
    strains = np.zeros(posed.n_nodes)
    np.maximum.at(strains, pairs.ravel(), np.repeat(np.minimum(signs.strains, _MOST_STRAIN), 2))
    found = []
    order = np.argsort(labels, kind="stable")
    for own in np.split(order, np.flatnonzero(np.diff(labels[order])) + 1):
        size = float(signs.longer[own].max())
        if size < OPEN or signs.odds[own].sum() < SURE:
            continue
        nodes = np.unique(pairs[own])
        seen = posed.seen[nodes]
        if seen.sum() < SEEN:
            continue
        across = pairs[own]
        if signs.kind == "web":
            # Links of the drawn-out surface on either side are among its own; what parted farthest tells the sides.
            about = parted_about(posed, across, parted)
            across = _farthest(posed, about if len(about) else across)
        first, second = _sides(posed, across)
        if signs.kind == "tear" and min(len(first), len(second)) < LEAST_RIM:
            continue
        severity = float(seen @ strains[nodes])
        found.append(Flaw(signs.kind, nodes, first, second, size * posed.scale, severity))
    return found


def _labels(posed: PosedSurface, pairs: Nodes) -> NDArray[np.integer]:
    """(P,) place of each pair: those whose nodes lie beside each other are of one."""
    n = posed.n_nodes
    marked = np.zeros(n, bool)
    marked[pairs] = True
    beside = np.concatenate([posed.beside.within(marked), pairs])
    together = sp.csr_array((np.ones(len(beside), np.int8), (beside[:, 0], beside[:, 1])), shape=(n, n))
    return np.unique(connected_components(together, directed=False)[1][pairs[:, 0]], return_inverse=True)[1]


def _farthest(posed: PosedSurface, pairs: Nodes) -> Nodes:
    """(F, 2) those of some pairs that grew at least four fifths as much as that which grew most."""
    rest, moved = posed.distances(pairs)
    grown = moved - rest
    return pairs[grown >= 0.8 * grown.max()]


def _sides(posed: PosedSurface, pairs: Nodes) -> tuple[Nodes, Nodes]:
    """Nodes on the side of the pairs that moved more, and on the other; none on both."""
    moved = np.linalg.norm(posed.positions[pairs] - posed.ellipses.centers[pairs], axis=2)
    swapped = moved[:, 1] > moved[:, 0]
    first = np.where(swapped, pairs[:, 1], pairs[:, 0])
    second = np.where(swapped, pairs[:, 0], pairs[:, 1])
    nodes, places = np.unique(np.concatenate([first, second]), return_inverse=True)
    # A node that is on both sides goes to the one on which it is more often.
    votes = np.bincount(places, np.repeat([1.0, -1.0], len(pairs)))
    if (pairs[:, 0] == pairs[:, 1]).all():
        return nodes, np.zeros(0, np.int64)
    return nodes[votes > 0.0], nodes[votes <= 0.0]
