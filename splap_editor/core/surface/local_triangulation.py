"""Delaunay stars: the triangles around each node in its own tangent plane."""

import numba as nb
import numpy as np
from numpy.typing import NDArray

from splap_editor.core.compressed_rows import with_runs
from splap_editor.core.index_spaces import Nodes
from splap_editor.core.progress import Progress, no_progress
from splap_editor.core.splats.occupancy import Ellipses
from splap_editor.core.surface.geodesics import Neighborhoods, node_runs

_CHUNK = 16384

HORIZON = 16.0
"""Half-side of the square a Voronoi cell is clipped from, in units of the farthest neighbour's distance. A triangle
whose circumcentre lies beyond is a sliver along the border of the surface."""


def local_triangulations(
    ellipses: Ellipses,
    neighborhoods: Neighborhoods,
    *,
    nodes: Nodes | None = None,
    progress: Progress = no_progress,
) -> NDArray[np.int32]:
    """Triangles around each node, among its geodesic neighbours.

    The neighbours are laid into the node's tangent plane, in the direction of
    their projection and at their true distance (so that a curved sheet does not
    shrink). The node's star in their Delaunay triangulation is the dual of its
    Voronoi cell, which is clipped neighbour by neighbour; nothing global is
    triangulated. A cell that reaches the horizon leaves its star open there.

    Parameters
    ----------
    ellipses : Ellipses
        n nodes with centres and normals.
    neighborhoods : Neighborhoods
        Geodesic neighbours of the same nodes.
    nodes : (m,) int, optional
        Ascending; only the stars of these.
    progress : Progress
        Called with the share done.

    Returns
    -------
    (T, 3) int32
        Triangles (i, a, b) of the stars of node i = 0, 1, …, counter-clockwise
        about the normal of i. A triangle on which all its corners agree occurs
        three times. Neighbours that coincide with i, lie on its normal, or lie on
        a nearer neighbour are passed over; a node whose neighbours lie on one
        line has no triangle.
    """
    parts = [np.empty((0, 3), np.int32)]
    n = ellipses.n_nodes
    k = int(np.diff(neighborhoods.indptr).max(initial=0))
    for start, end in node_runs(n, nodes, _CHUNK):
        corners, counts = np.empty((end - start, k + 4, 2), np.int32), np.zeros(end - start, np.int32)
        _stars(start, ellipses.centers, ellipses.normals, neighborhoods.indptr, neighborhoods.indices, corners, counts)
        triangles = np.empty((int(counts.sum()), 3), np.int32)
        triangles[:, 0] = np.repeat(np.arange(start, end, dtype=np.int32), counts)
        triangles[:, 1:] = corners[np.arange(k + 4) < counts[:, None]]
        parts.append(triangles)
        progress(end / n)
    return np.concatenate(parts)


def mended_triangulations(
    ellipses: Ellipses, neighborhoods: Neighborhoods, before: NDArray[np.int32], nodes: Nodes
) -> NDArray[np.int32]:
    """Bring the stars of some nodes up to date: what `local_triangulations` gives.

    Parameters
    ----------
    ellipses : Ellipses
        n nodes.
    neighborhoods : Neighborhoods
        After the change.
    before : (T, 3) int32
        All stars from before it.
    nodes : (m,) int
        Ascending; those whose neighbours have changed.
    """
    found = local_triangulations(ellipses, neighborhoods, nodes=nodes)
    firsts, ends = stars_of(before, nodes)
    return with_runs(before, firsts, ends, found, np.append(stars_of(found, nodes)[0], len(found)))


def stars_of(triangles: NDArray[np.integer], nodes: Nodes) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """(m,) first triangle and last + 1 of the stars of some nodes, among all stars."""
    centers = np.ascontiguousarray(triangles[:, 0])
    asked = nodes.astype(centers.dtype)
    return np.searchsorted(centers, asked), np.searchsorted(centers, asked, side="right")


@nb.njit(nogil=True, cache=True)
def _stars(first, centers, normals, indptr, indices, corners, counts):
    """Stars of nodes ``first``, ``first + 1`` …: pairs of neighbours and how many there are."""
    k = corners.shape[1]
    x, y, node = np.empty(k), np.empty(k), np.empty(k, np.int32)
    # The polygon's corners, and the neighbour whose bisector is the side that leaves each corner; -1: the horizon.
    px, py, side = np.empty(k + 4), np.empty(k + 4), np.empty(k + 4, np.int32)
    qx, qy, label = np.empty(k + 4), np.empty(k + 4), np.empty(k + 4, np.int32)
    for row in range(len(corners)):
        i = first + row
        begin, end = indptr[i], indptr[i + 1]
        m, farthest = _tangent_layout(i, centers, normals, indices[begin:end], x, y, node)
        edge = HORIZON * farthest
        px[0], py[0], px[1], py[1] = -edge, -edge, edge, -edge
        px[2], py[2], px[3], py[3] = edge, edge, -edge, edge
        n = 4
        for a in range(n):
            side[a] = -1
        for t in range(m):
            half = 0.5 * (x[t] * x[t] + y[t] * y[t])
            # On a nearer neighbour's spot rounding alone would decide which of the two gets the side.
            slack = half * (1.0 + 1e-12)
            kept, cut = 0, False
            for a in range(n):
                b = a + 1 if a + 1 < n else 0
                here, there = x[t] * px[a] + y[t] * py[a], x[t] * px[b] + y[t] * py[b]
                if here <= slack:
                    qx[kept], qy[kept], label[kept] = px[a], py[a], side[a]
                    kept += 1
                if (here <= slack) != (there <= slack):
                    s = (half - here) / (there - here)
                    qx[kept], qy[kept] = px[a] + s * (px[b] - px[a]), py[a] + s * (py[b] - py[a])
                    label[kept] = t if here <= slack else side[a]
                    kept += 1
                    cut = True
            if cut:
                n = kept
                for a in range(n):
                    px[a], py[a], side[a] = qx[a], qy[a], label[a]
        count = 0
        for a in range(n):
            b = a + 1 if a + 1 < n else 0
            if side[a] >= 0 and side[b] >= 0 and side[a] != side[b]:
                corners[row, count, 0], corners[row, count, 1] = node[side[a]], node[side[b]]
                count += 1
        counts[row] = count


@nb.njit(nogil=True, cache=True)
def _tangent_layout(i, centers, normals, neighbors, x, y, node):
    """Neighbours in the tangent plane of node i at their true distance; their number and the farthest distance."""
    nx, ny, nz = normals[i, 0], normals[i, 1], normals[i, 2]
    # A right-handed frame without a branch on the neighbours: the coordinate axis least along the normal, projected.
    if abs(nx) <= abs(ny) and abs(nx) <= abs(nz):
        ux, uy, uz = 1.0 - nx * nx, -nx * ny, -nx * nz
    elif abs(ny) <= abs(nz):
        ux, uy, uz = -ny * nx, 1.0 - ny * ny, -ny * nz
    else:
        ux, uy, uz = -nz * nx, -nz * ny, 1.0 - nz * nz
    length = np.sqrt(ux * ux + uy * uy + uz * uz)
    ux, uy, uz = ux / length, uy / length, uz / length
    vx, vy, vz = ny * uz - nz * uy, nz * ux - nx * uz, nx * uy - ny * ux
    m, farthest = 0, 0.0
    for j in neighbors:
        dx, dy, dz = centers[j, 0] - centers[i, 0], centers[j, 1] - centers[i, 1], centers[j, 2] - centers[i, 2]
        a, b = dx * ux + dy * uy + dz * uz, dx * vx + dy * vy + dz * vz
        flat, full = np.sqrt(a * a + b * b), np.sqrt(dx * dx + dy * dy + dz * dz)
        if flat <= 1e-6 * full or full <= 1e-9 * farthest:
            continue
        x[m], y[m], node[m] = a * full / flat, b * full / flat, j
        farthest = max(farthest, full)
        m += 1
    return m, farthest
