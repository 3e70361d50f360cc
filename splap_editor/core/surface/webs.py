"""Webs: where a contact holds back what should be free, and the surface is drawn out between the two."""

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import dijkstra

from splap_editor.core.index_spaces import Nodes
from splap_editor.core.surface.posed_surface import PosedSurface, near_rows
from splap_editor.core.surface.tears import slants

LONGER, STRETCHED = 0.003, 1.15
"""What grew by less, in units of s and of its length, is no web."""

WEIGHTS = (-5.35, 0.26, 0.72, 2.56, 2.36, 2.25)
"""Of 1 and each evidence."""

LOOKED_AT = -1.0
"""Odds from which a link is looked at again,"""

LOOKED_AGAIN = (-2.29, 0.56, 2.03)
"""by 1, these odds and the logarithm of the way round; that is looked for up to"""

MOST_DETOUR = 6.0
"""so many times the link's length."""

_MOST_BESIDE = 20.0
_AT_ONCE = 64


class Webs(NamedTuple):
    """Links between two parts that came apart but for them.

    Parameters
    ----------
    links : (W, 2) int
        Nodes i < j.
    longer : (W,) float64
        By how much they grew, in units of s.
    odds : (W,) float64
        Logarithm of how many times likelier each is a web than none; all above 0.
    parted : (Q, 2) int
        What rightly parted beside them, and elsewhere.
    """

    links: Nodes
    longer: NDArray[np.float64]
    odds: NDArray[np.float64]
    parted: Nodes


def webs(posed: PosedSurface, parted: Nodes) -> Webs:
    """Find what a pose draws out between two parts.

    A neck that is bent or pulled stretches all through: beside it is nothing.
    Beside a web are the two surfaces that it ties, which came apart. So a link
    that grew is one if, beside it, splats parted of which one is near its one
    end along the surface and the other near its other; if it grew more than all
    around it, is long, and rises out of the tangent planes. What passes for one
    by all that is looked at again, together: without them, a web's two ends are
    far apart.

    Parameters
    ----------
    posed : PosedSurface
    parted : (Q, 2) int
        Pairs of two surfaces that parted: strands across a tear are no webs.

    Returns
    -------
    Webs
    """
    links, grown = grown_links(posed)
    _, rest, moved = posed.links
    longer = (moved - rest)[grown] / posed.scale
    if not len(links):
        return Webs(links, longer, np.zeros(0), parted)
    weighed = evidence(posed, links, grown, parted) @ np.array(WEIGHTS)
    odds = np.column_stack([np.ones(len(links)), weighed, detours(posed, links, weighed)]) @ np.array(LOOKED_AGAIN)
    is_web = (weighed > LOOKED_AT) & (odds > 0.0)
    return Webs(links[is_web], longer[is_web], odds[is_web], parted)


def grown_links(posed: PosedSurface) -> tuple[Nodes, NDArray[np.bool_]]:
    """(W, 2) links that may be webs, since they grew; which of all they are, (E,)."""
    links, rest, moved = posed.links
    grown = (moved - rest > LONGER * posed.scale) & (moved > STRETCHED * rest) & ~posed.tied[links].all(axis=1)
    return links[grown], grown


def evidence(posed: PosedSurface, links: Nodes, grown: NDArray[np.bool_], parted: Nodes) -> NDArray[np.float64]:
    """(W, 6) what the model weighs of those links that grew; all logarithms but 1 and the sine.

    1, stretch, how many pairs beside it parted, how much more it is stretched than all around, how much longer it was
    at rest than those around, sine of its step out of the tangent planes.
    """
    every, rest, moved = posed.links
    strain = np.abs(moved / rest - 1.0)
    around = _around(posed, every, strain), _around(posed, every, rest)
    strains, lengths = (each[links].mean(axis=1) for each in around)
    rest, strain = rest[grown], strain[grown]
    return np.column_stack(
        [
            np.ones(len(links)),
            np.log1p(strain),
            np.log1p(np.minimum(_parted_beside(posed, links, parted), _MOST_BESIDE)),
            np.log((strain + 0.02) / (strains + 0.02)),
            np.log(rest / lengths),
            slants(posed, links),
        ]
    )


def detours(posed: PosedSurface, links: Nodes, weighed: NDArray[np.float64]) -> NDArray[np.float64]:
    """(W,) logarithm of how many times as long the way is from one end to the other without what may be a web.

    What a web ties hangs together by it alone, for some way around; a link of one surface has its neighbours beside.

    Parameters
    ----------
    posed : PosedSurface
    links : (W, 2) int
    weighed : (W,) float64
        Their odds by `evidence`: 0 is given to those below `LOOKED_AT`, which are none, and are left in the way.
    """
    n, found = posed.n_nodes, np.zeros(len(links))
    asked = np.flatnonzero(weighed > LOOKED_AT)
    if not len(asked):
        return found
    links = links[asked]
    nodes = np.unique(links)
    for _ in range(2):
        nodes = np.union1d(nodes, near_rows(posed.neighborhoods, nodes).indices)
    ways = posed.ways[nodes][:, nodes].tocoo()
    keys = np.minimum(ways.row, ways.col).astype(np.int64) * n + np.maximum(ways.row, ways.col)
    own = np.sort(np.searchsorted(nodes, links), axis=1)
    kept = ~np.isin(keys, own @ np.array([n, 1]))
    left = sp.csr_array((ways.data[kept], (ways.row[kept], ways.col[kept])), shape=ways.shape)
    lengths = np.maximum(posed.distances(links)[0] / posed.scale, np.finfo(float).tiny)
    limit = MOST_DETOUR * float(lengths.max())
    for start in range(0, len(own), _AT_ONCE):
        run = slice(start, start + _AT_ONCE)
        sources, places = np.unique(own[run, 0], return_inverse=True)
        apart = dijkstra(left, directed=False, indices=sources, limit=limit)[places, own[run, 1]]
        found[asked[run]] = np.log(np.clip(apart / lengths[run], 1.0, MOST_DETOUR))
    return found


def _around(posed: PosedSurface, links: Nodes, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n,) mean of the links' values at each node's neighbours and itself."""
    n = posed.n_nodes
    sums, counts = np.bincount(links.ravel(), np.repeat(values, 2), n), np.bincount(links.ravel(), minlength=n)
    means = sums / np.maximum(counts, 1.0)
    more = np.bincount(links[:, 0], means[links[:, 1]], n) + np.bincount(links[:, 1], means[links[:, 0]], n)
    return (means + more) / (1.0 + counts)


def _parted_beside(posed: PosedSurface, links: Nodes, pairs: Nodes) -> NDArray[np.float64]:
    """(W,) number of parted pairs of which one node is near the one end along the surface and one near the other."""
    n, both = posed.n_nodes, np.concatenate([pairs, pairs[:, ::-1]])
    parted = sp.csr_array((np.ones(len(both)), (both[:, 0], both[:, 1])), shape=(n, n))
    near = [near_rows(posed.neighborhoods, links[:, end]) for end in (0, 1)]
    return np.asarray((near[0] @ parted).multiply(near[1]).sum(axis=1)).ravel()


def parted_about(posed: PosedSurface, links: Nodes, parted: Nodes) -> Nodes:
    """(Q, 2) parted pairs near some links: what lies on either side of a web, where its own nodes may be of both."""
    near = np.zeros(posed.n_nodes, bool)
    near[near_rows(posed.neighborhoods, np.unique(links)).indices] = True
    return parted[near[parted[:, 0]] & near[parted[:, 1]]]
