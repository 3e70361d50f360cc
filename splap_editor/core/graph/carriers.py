"""Carriers and followers: which splats make up the surface, and which go along with it."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.graph.options import CARRIERS, GraphOptions
from splap_editor.core.index_spaces import Nodes
from splap_editor.core.splats.occupancy import Ellipses, InertReason
from splap_editor.core.splats.splats import Splats

SOLID = 0.1
"""Least opacity of a carrier: of what lies behind a fainter splat nine tenths are still seen."""

MOST_FAINT = 0.5
"""Where more than this share of the splats is faint, the surface itself is made of faint ones."""


def carriers_of(ellipses: Ellipses, splats: Splats, options: GraphOptions) -> NDArray[np.bool_]:
    """Which nodes of a scene's visible splats carry, by the row of `CARRIERS` that the options name.

    Parameters
    ----------
    ellipses : Ellipses
        Of all n active splats.
    splats : Splats
        The scene's.
    options : GraphOptions
        Splats named by cut and added edges carry too, unless the options say of what the surface is made: who mended
        an edge meant its ends as parts of the surface.

    Returns
    -------
    (n,) bool
        All of them where none would carry.
    """
    carries = CARRIERS[options.carriers].load()(ellipses, splats)
    if options.carriers == "auto" and not carries.all():
        carries[_named(ellipses, (*options.cut, *options.add))] = True
    return carries if carries.any() else np.ones(ellipses.n_nodes, bool)


def carrying(ellipses: Ellipses, carries: NDArray[np.bool_]) -> Ellipses:
    """Leave the followers out of a scene's ellipses.

    Haze lies between surfaces and before them: a way through it is a way
    through the air, and where it hangs together with a surface it drags at it.
    So followers are no nodes. Like inert splats they are moved and turned by
    the blended motion of the nearest carriers, and never dropped.

    Parameters
    ----------
    ellipses : Ellipses
        Of all n active splats.
    carries : (n,) bool

    Returns
    -------
    Ellipses
        The same object where all splats carry.
    """
    if carries.all():
        return ellipses
    inert = ellipses.inert.copy()
    inert[ellipses.rows[~carries]] = InertReason.FOLLOWS
    names = ("rows", "centers", "semi_axes", "normals", "cutoffs", "axes", "opacities")
    return replace(ellipses, inert=inert, **{name: getattr(ellipses, name)[carries] for name in names})


def all_splats(ellipses: Ellipses, splats: Splats) -> NDArray[np.bool_]:
    """Let every active splat carry."""
    return np.ones(ellipses.n_nodes, bool)


def solid_splats(ellipses: Ellipses, splats: Splats) -> NDArray[np.bool_]:
    """(n,) which splats carry: those of opacity 0.1 and more."""
    return ellipses.opacities >= SOLID


def solid_unless_flat(ellipses: Ellipses, splats: Splats) -> NDArray[np.bool_]:
    """(n,) which splats carry: all that are solid, and faint ones where these belong to the surface.

    Discs were trained to lie in the surface: a faint one is a layer of it. Splats
    with a thickness were not, and the faint ones among them fill the air between
    surfaces. Where most splats are faint, opacity does not tell one from the other.
    """
    solid = solid_splats(ellipses, splats)
    if splats.is_flat or np.count_nonzero(solid) < MOST_FAINT * len(solid):
        return all_splats(ellipses, splats)
    return solid


def _named(ellipses: Ellipses, pairs: Iterable[tuple[int, int]]) -> Nodes:
    """Nodes of the rows in some pairs; rows that are none are refused where the graph is mended."""
    rows = np.array([row for pair in pairs for row in pair], np.int64)
    nodes = ellipses.node_of_row[rows[(rows >= 0) & (rows < ellipses.n_splats)]]
    return nodes[nodes >= 0]
