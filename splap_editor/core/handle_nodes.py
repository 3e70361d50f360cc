"""From handles and pins as a person places them to constrained nodes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from splap_editor.core.deformer import FREE, PIN, Handles
from splap_editor.core.index_spaces import FileRows, Nodes
from splap_editor.core.splats.occupancy import Ellipses


@dataclass(frozen=True, eq=False)
class Region:
    """A set of splats, by place or by file row.

    Parameters
    ----------
    center : (3,) float64
        Centre in world units; for a handle also the point its pose turns about.
    radius : float
        Every active splat within this distance of the centre belongs; if there is none, the nearest one. World units.
        Ignored where rows are given.
    rows : (k,) int64, optional
        File rows; the inert ones among them are passed over, and if all are inert the active splat nearest to the
        centre is taken.
    """

    center: NDArray[np.float64]
    radius: float = 0.0
    rows: FileRows | None = None


def handle_nodes(
    ellipses: Ellipses,
    handles: Sequence[Region],
    pins: Sequence[Region] = (),
    *,
    free_radius: float | None = None,
    cage_radii: NDArray[np.float64] | Sequence[float] | None = None,
    frees: NDArray[np.bool_] | Sequence[bool] | None = None,
) -> Handles:
    """Find the nodes that each handle and pin holds.

    A splat in several regions belongs to the earliest handle; handles win over pins.

    Parameters
    ----------
    ellipses : Ellipses
        The scene's active splats.
    handles, pins : sequence of Region
        Handles in order, and pins, which stay put.
    free_radius : float, optional
        World units. Splats farther than this from every splat of every handle are pinned too; None leaves everything
        that no pin holds free. Without handles nothing is added.
    cage_radii : (H,) float, optional
        Reach of each handle's bounded biharmonic weight in world units; inf, the default, for the whole object.
    frees : (H,) bool, optional
        Which handles the free radius is measured from, by default all; where none is, all are.

    Returns
    -------
    Handles
        A handle whose splats all belong to earlier ones holds nothing and stays in the list, without nodes.

    Raises
    ------
    ValueError
        If the scene has no active splat, a centre is not three finite numbers, a radius is negative, a row is outside
        the file, or ``cage_radii`` or ``frees`` has another length than ``handles``.
    """
    if ellipses.n_nodes == 0:
        raise ValueError("no splat of this scene is active, so there is nothing to hold")
    if free_radius is not None and not free_radius >= 0:
        raise ValueError(f"free_radius must not be negative, got {free_radius}")
    cages = np.full(len(handles), np.inf) if cage_radii is None else np.asarray(cage_radii, np.float64)
    if cages.shape != (len(handles),):
        raise ValueError(f"cage_radii must have shape ({len(handles)},), got {cages.shape}")
    from_ = np.ones(len(handles), bool) if frees is None else np.asarray(frees, bool)
    if from_.shape != (len(handles),):
        raise ValueError(f"frees must have shape ({len(handles)},), got {from_.shape}")
    tree = cKDTree(ellipses.centers)
    labels = np.full(ellipses.n_nodes, FREE, np.int32)
    for pin in pins:
        labels[region_nodes(pin, ellipses, tree)] = PIN
    for label in range(len(handles) - 1, -1, -1):
        labels[region_nodes(handles[label], ellipses, tree)] = label
    if free_radius is not None and (labels >= 0).any():
        is_moved = np.isin(labels, np.flatnonzero(from_))
        moved = cKDTree(ellipses.centers[is_moved if is_moved.any() else labels >= 0])
        others = np.flatnonzero(labels == FREE)
        distances, _ = moved.query(ellipses.centers[others], distance_upper_bound=np.nextafter(free_radius, np.inf))
        labels[others[~np.isfinite(distances)]] = PIN
    indices = np.flatnonzero(labels != FREE)
    centers = np.array([handle.center for handle in handles], np.float64).reshape(len(handles), 3)
    return Handles(indices=indices, labels=labels[indices], centers=centers, cage_radii=cages)


def region_nodes(region: Region, ellipses: Ellipses, tree: cKDTree | None = None) -> Nodes:
    """Nodes of one region, ascending: at least one.

    Parameters
    ----------
    region : Region
    ellipses : Ellipses
        The scene's active splats; at least one.
    tree : cKDTree, optional
        Over their centres, where it is there already.

    Raises
    ------
    ValueError
        If the centre is not three finite numbers, the radius is negative or a row is outside the file.
    """
    center = np.asarray(region.center, np.float64)
    if center.shape != (3,) or not np.isfinite(center).all():
        raise ValueError(f"a region's center must be three finite numbers, got {region.center}")
    if region.rows is not None:
        rows = np.asarray(region.rows, np.int64).ravel()
        outside = (rows < 0) | (rows >= ellipses.n_splats)
        if outside.any():
            raise ValueError(f"row {rows[outside][0]} is outside the file, which has {ellipses.n_splats} splats")
        nodes = ellipses.node_of_row[rows]
        nodes = nodes[nodes >= 0]
    else:
        if not region.radius >= 0:
            raise ValueError(f"a region's radius must not be negative, got {region.radius}")
        tree = tree or cKDTree(ellipses.centers)
        nodes = np.asarray(tree.query_ball_point(center, region.radius), np.int64)
    if len(nodes) == 0:
        tree = tree or cKDTree(ellipses.centers)
        nodes = np.array([tree.query(center)[1]], np.int64)
    return np.unique(nodes)
