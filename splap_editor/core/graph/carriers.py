"""Carriers and followers: which splats make up the surface, and which go along with it."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.graph.options import CARRIERS
from splap_editor.core.splats.occupancy import Ellipses, InertReason

SOLID = 0.1
"""Least opacity of a carrier: of what lies behind a fainter splat nine tenths are still seen."""


def carrying(ellipses: Ellipses, name: str) -> Ellipses:
    """Leave the followers out of a scene's ellipses.

    Haze lies between surfaces and before them: a way through it is a way
    through the air, and where it hangs together with a surface it drags at it.
    So followers are no nodes. Like inert splats they are moved and turned by
    the blended motion of the nearest carriers, and never dropped.

    Parameters
    ----------
    ellipses : Ellipses
        Of all active splats.
    name : str
        Key of `CARRIERS`.

    Returns
    -------
    Ellipses
        The same object where all splats carry, or none would.
    """
    carries = CARRIERS[name].load()(ellipses)
    if carries.all() or not carries.any():
        return ellipses
    inert = ellipses.inert.copy()
    inert[ellipses.rows[~carries]] = InertReason.FOLLOWS
    names = ("rows", "centers", "semi_axes", "normals", "cutoffs", "axes", "opacities")
    return replace(ellipses, inert=inert, **{name: getattr(ellipses, name)[carries] for name in names})


def all_splats(ellipses: Ellipses) -> NDArray[np.bool_]:
    """Let every active splat carry."""
    return np.ones(ellipses.n_nodes, bool)


def solid_splats(ellipses: Ellipses) -> NDArray[np.bool_]:
    """(n,) which splats carry: those of opacity 0.1 and more."""
    return ellipses.opacities >= SOLID
