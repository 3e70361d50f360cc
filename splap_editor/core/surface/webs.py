"""Webs: where a contact holds back what should be free, and the surface is drawn out between the two."""

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from splap_editor.core.index_spaces import Nodes
from splap_editor.core.surface.posed_surface import PosedSurface, near_rows
from splap_editor.core.surface.tears import slants

LONGER, STRETCHED = 0.003, 1.15
"""What grew by less, in units of s and of its length, is no web."""

WEIGHTS = (-7.5, 0.2, 0.7, 3.6, 2.3, 2.8)
"""Of 1 and each evidence."""

SURE = np.log(4.0)
"""Odds of at least one link of a place: a false alarm is worse than a web that is missed."""

_MOST_BESIDE = 20.0


class Webs(NamedTuple):
    """Links between two parts that came apart but for them.

    Parameters
    ----------
    links : (W, 2) int
        Nodes i < j.
    longer : (W,) float64
        By how much they grew, in units of s.
    are_sure : (W,) bool
        Those that tell a place; the others, which lie beside, tell how large it is.
    parted : (Q, 2) int
        What rightly parted beside them, and elsewhere.
    """

    links: Nodes
    longer: NDArray[np.float64]
    are_sure: NDArray[np.bool_]
    parted: Nodes


def webs(posed: PosedSurface, torn: Nodes) -> Webs:
    """Find what a pose draws out between two parts.

    A neck that is bent or pulled stretches all through: beside it is nothing.
    Beside a web are the two surfaces that it ties, which came apart. So a link
    that grew is one if, beside it, splats parted of which one is near its one
    end along the surface and the other near its other; if it grew more than all
    around it, is long, and rises out of the tangent planes.

    Parameters
    ----------
    posed : PosedSurface
    torn : (T, 2) int
        Parted pairs that should not have parted: strands across a tear are no webs.

    Returns
    -------
    Webs
    """
    links, grown = grown_links(posed)
    _, rest, moved = posed.links
    longer, parted = (moved - rest)[grown] / posed.scale, rightly_parted(posed, torn)
    if not len(links):
        return Webs(links, longer, np.zeros(0, bool), parted)
    odds = evidence(posed, links, grown, parted) @ np.array(WEIGHTS)
    is_web = odds > 0.0
    return Webs(links[is_web], longer[is_web], odds[is_web] > SURE, parted)


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


def rightly_parted(posed: PosedSurface, torn: Nodes) -> Nodes:
    """(Q, 2) parted pairs but for those that the surface was torn between."""
    n, (pairs, _) = posed.n_nodes, posed.partings
    return pairs[~np.isin(pairs @ np.array([n, 1]), torn @ np.array([n, 1]))]
