"""Small surfaces, graphs and handle sets for the deformation tests."""

import igl
import numpy as np
import scipy.sparse as sp
from scipy.spatial.transform import Rotation

from splap_editor.core.arap.binding import arap_deformer
from splap_editor.core.arap.options import ArapOptions
from splap_editor.core.deformer import Handles
from splap_editor.core.graph.splat_graph import SplatGraph


class Scene:
    """A triangle mesh with its Laplacian, areas and edge graph."""

    def __init__(self, rest, triangles):
        self.rest, self.triangles = rest, triangles
        self.L = sp.csr_matrix(-igl.cotmatrix(rest, triangles))
        self.L.data = np.where(np.abs(self.L.data) < 1e-12, 0.0, self.L.data)
        self.L.eliminate_zeros()
        areas = np.repeat(igl.doublearea(rest, triangles) / 6.0, 3)
        self.M = np.bincount(triangles.ravel(), areas, minlength=len(rest))
        self.scene_scale = float(np.ptp(rest, axis=0).max())
        self.graph = edge_graph(rest, triangles)

    def deformer(self, handles, scene=None, **options):
        """A deformer of this scene."""
        return arap_deformer(
            self.rest, self.L, handles, scene_scale=self.scene_scale, M=self.M, graph=self.graph,
            triangles=self.triangles, options=ArapOptions(**options), scene=scene,
        )  # fmt: skip


def edge_graph(rest, triangles):
    ends = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    ends = np.unique(np.concatenate([ends, ends[:, ::-1]]), axis=0)
    lengths = np.linalg.norm(rest[ends[:, 0]] - rest[ends[:, 1]], axis=1)
    G = sp.csr_matrix((lengths, (ends[:, 0], ends[:, 1])), shape=(len(rest), len(rest)))
    G.sort_indices()
    return SplatGraph(G.indptr.astype(np.int32), G.indices.astype(np.int32), G.data, None, 0.01)


def strip(nx=24, ny=7, length=1.0, width=0.25, bump=0.04):
    """A bumpy strip along x."""
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(0, length, nx), np.linspace(0, width, ny), indexing="ij"))
    index = np.arange(nx * ny).reshape(nx, ny)
    a, b, c, d = (m.ravel() for m in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]))
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    rest = np.stack([x, y, bump * np.sin(7 * x) * np.cos(9 * y)], axis=1)
    return Scene(rest, triangles)


def joined(first, second):
    """Two scenes side by side, not connected."""
    return Scene(
        np.concatenate([first.rest, second.rest]),
        np.concatenate([first.triangles, second.triangles + len(first.rest)]),
    )


def holding(rest, handles, pins=None):
    """Handles from masks of nodes; each turns about the mean of its nodes."""
    labels = np.full(len(rest), -2, np.int32)
    if pins is not None:
        labels[pins] = -1
    for label, mask in enumerate(handles):
        labels[mask] = label
    indices = np.flatnonzero(labels != -2)
    centers = np.array([rest[mask].mean(axis=0) for mask in handles]).reshape(-1, 3)
    return Handles(indices, labels[indices], centers, np.full(len(handles), np.inf))


def rigid(degrees, axis, center, shift=(0.0, 0.0, 0.0), scale=1.0):
    """World transform that turns about a centre and then shifts."""
    axis = np.asarray(axis, np.float64)
    T = np.eye(4)
    T[:3, :3] = scale * Rotation.from_rotvec(np.deg2rad(degrees) * axis / np.linalg.norm(axis)).as_matrix()
    T[:3, 3] = center - T[:3, :3] @ center + shift
    return T


def moved(T, points):
    return points @ T[:3, :3].T + T[:3, 3]
