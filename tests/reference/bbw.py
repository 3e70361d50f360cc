"""Slow twin of the bounded biharmonic weights, and small meshes to hold them against."""

import igl
import numpy as np
import scipy.sparse as sp
from scipy.optimize import lsq_linear

from splap_editor.core.deformer import Handles
from splap_editor.core.graph.splat_graph import SplatGraph


def box_qp_dense(A, c, lower, upper):
    """Exact minimiser of ``½ wᵀA w + cᵀw`` in a box, by bounded-variable least squares on the Cholesky factor."""
    R = np.linalg.cholesky(A).T
    b = -np.linalg.solve(R.T, c)
    return lsq_linear(R, b, (lower, upper), method="bvls", tol=1e-15, max_iter=20 * len(c)).x


def weights_dense(rest, L, M, handles, mass_floor=0.1):
    """Weights before the partition of unity, (n, H): the definition, handle by handle, with dense matrices.

    For scenes of one connected component in which something is held at zero for each handle.
    """
    L = L.toarray()
    M = np.maximum(M, mass_floor * np.median(M[M > 0]))
    energy = L.T @ np.diag(1 / M) @ L
    label = np.full(len(rest), -2)
    label[handles.indices] = handles.labels
    weights = np.zeros((len(rest), handles.n_handles))
    for h in range(handles.n_handles):
        own = np.flatnonzero(label == h)
        distance = np.linalg.norm(rest[:, None] - rest[own][None], axis=2).min(axis=1)
        free = np.flatnonzero((label == -2) & (distance <= handles.cage_radii[h]))
        weights[own, h] = 1.0
        A = energy[np.ix_(free, free)]
        c = energy[np.ix_(free, own)].sum(axis=1)
        scale = A.diagonal().mean()
        weights[free, h] = box_qp_dense(A / scale, c / scale, np.zeros(len(free)), np.ones(len(free)))
    return weights


def operators(points, triangles):
    """Positive semidefinite cotangent Laplacian and Voronoi masses of a mesh."""
    triangles = np.asarray(triangles, np.int64)
    L = sp.csr_array(-igl.cotmatrix(points, triangles))
    L.sort_indices()
    return L, igl.massmatrix(points, triangles).diagonal()


def mesh_graph(points, L):
    """Graph along the off-diagonal entries of a Laplacian."""
    edges = sp.coo_array(L)
    i, j = edges.row[edges.row != edges.col], edges.col[edges.row != edges.col]
    lengths = np.linalg.norm(points[i] - points[j], axis=1)
    graph = sp.csr_array((lengths, (i, j)), shape=L.shape)
    graph.sort_indices()
    return SplatGraph(graph.indptr.astype(np.int32), graph.indices.astype(np.int32), graph.data, None, 0.0)


def sheet(nx, ny, spacing=0.1, jitter=0.2, seed=0):
    """Jittered rectangle in the xy plane: points (nx ny, 3) with x slowest, and triangles."""
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij")
    points = spacing * np.stack([x.ravel(), y.ravel(), np.zeros(nx * ny)], axis=1).astype(np.float64)
    points[:, :2] += jitter * spacing * rng.uniform(-1, 1, (nx * ny, 2))
    node = np.arange(nx * ny).reshape(nx, ny)
    a, b, c, d = node[:-1, :-1].ravel(), node[1:, :-1].ravel(), node[1:, 1:].ravel(), node[:-1, 1:].ravel()
    return points, np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def tube(n_along, n_around, length=3.0, radius=0.3):
    """Open cylinder about the x axis: points (n_along n_around, 3) with x slowest, and triangles."""
    x, a = np.meshgrid(np.linspace(0.0, length, n_along), 2 * np.pi * np.arange(n_around) / n_around, indexing="ij")
    points = np.stack([x.ravel(), radius * np.cos(a).ravel(), radius * np.sin(a).ravel()], axis=1)
    node = np.arange(n_along * n_around).reshape(n_along, n_around)
    node = np.hstack([node, node[:, :1]])
    a, b, c, d = node[:-1, :-1].ravel(), node[1:, :-1].ravel(), node[1:, 1:].ravel(), node[:-1, 1:].ravel()
    return points, np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def handles_of(rest, regions, cage=np.inf, pins=()):
    """Handles from lists of node arrays; centres are their means, or the origin for a handle without nodes."""
    regions = [np.asarray(r, np.int64) for r in regions]
    pins = np.asarray(pins, np.int64)
    indices = np.concatenate([*regions, pins])
    labels = np.concatenate([*[np.full(len(r), h) for h, r in enumerate(regions)], np.full(len(pins), -1)])
    order = np.argsort(indices)
    centers = np.array([rest[r].mean(axis=0) if len(r) else np.zeros(3) for r in regions]).reshape(-1, 3)
    cages = np.broadcast_to(np.asarray(cage, np.float64), len(regions)).copy()
    return Handles(indices[order], labels[order].astype(np.int32), centers, cages)


def rigid(axis, angle, shift=(0.0, 0.0, 0.0), about=(0.0, 0.0, 0.0)):
    """4 × 4 rotation by ``angle`` about an axis through a point, then a shift."""
    axis = np.asarray(axis, np.float64) / np.linalg.norm(axis)
    K = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    T = np.eye(4)
    T[:3, :3] = np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K
    about = np.asarray(about, np.float64)
    T[:3, 3] = about - T[:3, :3] @ about + np.asarray(shift)
    return T
