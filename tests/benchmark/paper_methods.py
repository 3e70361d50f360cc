"""The systems that the paper compares, each made on the splats of a scene: what is deformed, and what it carries."""

import importlib.util
from collections.abc import Callable
from dataclasses import dataclass, replace

import igl
import numpy as np
import robust_laplacian
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from splap_editor.core.adaptation.kernel_adaptation import adapt_kernels
from splap_editor.core.adaptation.kernel_binding import KernelBinding
from splap_editor.core.deformer import Deformation
from splap_editor.core.graph.options import GraphOptions
from splap_editor.core.splats.occupancy import occupancy_ellipses
from splap_editor.core.splats.splats import Splats
from splap_editor.core.surface.geodesics import Neighborhoods
from splap_editor.core.surface.laplacian import star_weights
from splap_editor.engine.surface import surface_of
from tests.benchmark.fidelity import Scene, oracle

LOW_OPACITY = 0.1
"""Splats below it are left out where a method filters by opacity; they follow their neighbours."""


@dataclass(frozen=True, eq=False)
class Bound:
    """What a method deforms.

    Parameters
    ----------
    rest : (n, 3) float64
        Nodes.
    L : (n, n) sparse float64
        Positive semidefinite.
    M : (n,) float64
    carried : callable
        Takes the deformation of the nodes to the (N, 3) centres of all splats of the file.
    """

    rest: NDArray[np.float64]
    L: sp.csr_matrix
    M: NDArray[np.float64]
    carried: Callable[[Deformation], NDArray[np.float64]]


@dataclass(frozen=True)
class Method:
    """One row of the table.

    Parameters
    ----------
    title : str
    bind : callable
        Of a scene.
    published : (float, float)
        ARAP and BBW averages of the paper's table at τ = .075, on other data; NaN where there are none.
    extra : str
        Module of an extra that it needs; empty for none.
    """

    title: str
    bind: Callable[[Scene], Bound]
    published: tuple[float, float] = (float("nan"), float("nan"))
    extra: str = ""

    @property
    def is_missing(self) -> bool:
        """Whether its extra is not installed."""
        return bool(self.extra) and importlib.util.find_spec(self.extra) is None


def _centers_of(binding: KernelBinding) -> Callable[[Deformation], NDArray[np.float64]]:
    return lambda deformation: adapt_kernels(binding, deformation, method="none").means


def on_graph(options: GraphOptions) -> Callable[[Scene], Bound]:
    """Make the surface by the editor's own stages."""

    def bind(scene: Scene) -> Bound:
        surface = surface_of(scene.splats, options, ellipses=scene.ellipses)
        return Bound(surface.ellipses.centers, sp.csr_matrix(surface.L), surface.M, _centers_of(surface.binding))

    return bind


def on_point_cloud(k: int) -> Callable[[Scene], Bound]:
    """Take the library's Laplacian of the bare centres."""

    def bind(scene: Scene) -> Bound:
        centers = scene.ellipses.centers
        L, M = robust_laplacian.point_cloud_laplacian(centers, n_neighbors=k)
        return Bound(centers, sp.csr_matrix(L), M.diagonal(), _centers_of(_unbound(scene.splats)))

    return bind


def on_mahalanobis(k: int) -> Callable[[Scene], Bound]:
    """Leave out faint splats and take the nearest by each splat's own covariance."""

    def bind(scene: Scene) -> Bound:
        faint = scene.splats.opacities < LOW_OPACITY
        logits = np.where(faint, -np.inf, scene.splats.logit_opacities).astype(scene.splats.logit_opacities.dtype)
        opaque = replace(scene.splats, logit_opacities=logits)
        with np.errstate(over="ignore"):
            surface = surface_of(opaque, GraphOptions(neighborhood="mahalanobis", k=k, laplacian="robust"))
        return Bound(surface.ellipses.centers, sp.csr_matrix(surface.L), surface.M, _centers_of(surface.binding))

    return bind


def on_true_neighbors(scene: Scene) -> Bound:
    """Take neighbours from the true surface: the ceiling."""
    candidate = oracle(scene)
    n = scene.ellipses.n_nodes
    return Bound(scene.ellipses.centers, candidate.L, np.full(n, 1.0 / n), _centers_of(candidate.binding))


def on_proxy(with_offset: bool) -> Callable[[Scene], Bound]:
    """Deform a mesh by screened Poisson reconstruction, and splats with their nearest triangles.

    With an offset a splat keeps its place in the frame of its triangle, which grows with the triangle, as Mani-GS
    binds; without, it lies on the triangle at fixed barycentric coordinates, as SuGaR binds.
    """

    def bind(scene: Scene) -> Bound:
        vertices, faces = _proxy(scene)
        means = np.asarray(scene.splats.means, np.float64)
        _, nearest, feet = igl.point_mesh_squared_distance(means, vertices, faces)
        corners = faces[nearest]
        weights = igl.barycentric_coordinates(feet, *(vertices[corners[:, c]] for c in range(3)))
        frames, sizes = _frames(vertices, corners)
        local = np.einsum("nji,nj->ni", frames, means - feet) / sizes[:, None]

        def carried(deformation: Deformation) -> NDArray[np.float64]:
            moved = np.einsum("nc,ncd->nd", weights, deformation.positions[corners])
            if with_offset:
                turned, grown = _frames(deformation.positions, corners)
                moved += np.einsum("nij,nj->ni", turned, local) * grown[:, None]
            return moved

        L = sp.csr_matrix(-igl.cotmatrix(vertices, faces))
        weights_of, masses = star_weights(vertices, faces.astype(np.int32))
        if L.data.size and not np.isfinite(L.data).all():
            # Degenerate triangles of the reconstruction have no cotangents.
            L = sp.csr_matrix(sp.diags(np.asarray(weights_of.sum(1)).ravel()) - weights_of)
        return Bound(vertices, L, np.maximum(masses, 1e-2 * np.median(masses)), carried)

    return bind


def _proxy(scene: Scene) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    import pymeshlab

    opaque = np.flatnonzero(scene.splats.opacities[scene.ellipses.rows] >= LOW_OPACITY)
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(scene.ellipses.centers[opaque], v_normals_matrix=scene.ellipses.normals[opaque]))
    # A splat's normal has no sign: the library finds one by going from neighbour to neighbour.
    meshes.compute_normal_for_point_clouds(k=16)
    meshes.generate_surface_reconstruction_screened_poisson(depth=9, preclean=True)
    meshes.meshing_remove_unreferenced_vertices()
    mesh = meshes.current_mesh()
    vertices, faces = np.array(mesh.vertex_matrix()), np.array(mesh.face_matrix(), np.int64)
    # What Poisson closes far away from any splat is no surface of the object.
    spacing = np.median(cKDTree(scene.ellipses.centers[opaque]).query(scene.ellipses.centers[opaque], 2)[0][:, 1])
    near = cKDTree(scene.ellipses.centers[opaque]).query(vertices)[0] <= 6.0 * spacing
    faces = faces[near[faces].all(axis=1)]
    used, numbers = np.unique(faces, return_inverse=True)
    return vertices[used], numbers.reshape(-1, 3).astype(np.int64)


def _frames(
    vertices: NDArray[np.float64], corners: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(n, 3, 3) frames of triangles, their first edge first and their normal last, and (n,) square roots of areas."""
    a, b, c = (vertices[corners[:, corner]] for corner in range(3))
    normal = np.cross(b - a, c - a)
    doubled = np.linalg.norm(normal, axis=1)
    first = (b - a) / np.maximum(np.linalg.norm(b - a, axis=1), 1e-12)[:, None]
    normal = normal / np.maximum(doubled, 1e-12)[:, None]
    return np.stack([first, np.cross(normal, first), normal], axis=2), np.sqrt(0.5 * np.maximum(doubled, 1e-18))


def _unbound(splats: Splats) -> KernelBinding:
    """Splats of which each moves with itself."""
    ellipses = occupancy_ellipses(splats)
    none = Neighborhoods(np.zeros(ellipses.n_nodes + 1, np.int32), np.empty(0, np.int32), np.empty(0))
    return KernelBinding(splats, ellipses, none)


PAPER = GraphOptions(rule="paper", k=30, laplacian="robust", carriers="all")

METHODS: dict[str, Method] = {
    "ours": Method("SpLap Editor", on_graph(GraphOptions())),
    "paper": Method("Paper's rule, geodesic k = 30", on_graph(PAPER), (0.985, 0.988)),
    "raw graph": Method("Raw splat graph", on_graph(replace(PAPER, neighborhood="edges")), (0.973, 0.981)),
    "knn10": Method("kNN, k = 10", on_point_cloud(10), (0.927, 0.948)),
    "knn30": Method("kNN, k = 30", on_point_cloud(30), (0.876, 0.904)),
    "mahalanobis10": Method("Mahalanobis, k = 10", on_mahalanobis(10), (0.893, 0.955)),
    "mahalanobis30": Method("Mahalanobis, k = 30", on_mahalanobis(30), (0.884, 0.942)),
    "mani-gs": Method("Mesh proxy, Mani-GS-like", on_proxy(True), (0.800, 0.891), "pymeshlab"),
    "sugar": Method("Mesh proxy, SuGaR-like", on_proxy(False), (0.893, 0.758), "pymeshlab"),
    "geodesic10": Method("Paper's rule, geodesic k = 10", on_graph(replace(PAPER, k=10))),
    "geodesic50": Method("Paper's rule, geodesic k = 50", on_graph(replace(PAPER, k=50))),
    "oracle": Method("True-surface neighbours (ceiling)", on_true_neighbors),
}
"""Rows by name. NeLO (.905, .901 in the paper) has none: its repository, looked up on 2026-11-24, has no licence."""
