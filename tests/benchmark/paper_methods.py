"""The systems that the paper compares, each made on the splats of a scene: what is deformed, and what it carries."""

import importlib.util
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import igl
import numpy as np
import robust_laplacian
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonCore import vtkIdList, vtkPoints
from vtkmodules.vtkCommonDataModel import vtkMeanValueCoordinatesInterpolator

from splap_editor.core.adaptation.kernel_adaptation import adapt_kernels
from splap_editor.core.adaptation.kernel_binding import KernelBinding
from splap_editor.core.arap.scene import ArapScene
from splap_editor.core.deformer import Deformation
from splap_editor.core.graph.options import NEIGHBORHOODS, GraphOptions, edges_only
from splap_editor.core.graph.splat_graph import SplatGraph, splat_graph
from splap_editor.core.progress import no_progress
from splap_editor.core.splats.occupancy import Ellipses, occupancy_ellipses
from splap_editor.core.splats.splats import Splats
from splap_editor.core.surface.laplacian import point_cloud_laplacian, star_weights
from splap_editor.core.surface.local_triangulation import local_triangulations
from splap_editor.engine.surface import surface_of
from splap_editor.io.sample_shapes import level_set
from tests.benchmark.fidelity import Scene, bare_binding, oracle

CAGE_CELLS = 40
"""Cells of the cage's grid across the object."""

LOW_OPACITY = 0.1
"""Splats below it are left out where a method filters by opacity; they follow their neighbours."""


Rows = NDArray[np.int64]
Carried = Callable[[Deformation, Rows], NDArray[np.float64]]


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
        Takes the deformation of the nodes to the centres of the splats in some rows of the file.
    binding : KernelBinding, optional
        What adapts the splats, where the nodes are splats with neighbours of their own.
    """

    rest: NDArray[np.float64]
    L: sp.csr_matrix
    M: NDArray[np.float64]
    carried: Carried
    binding: KernelBinding | None = None

    @cached_property
    def graph(self) -> SplatGraph:
        """Graph of what the Laplacian couples."""
        weights = sp.csr_matrix(sp.diags(self.L.diagonal()) - self.L)
        weights.data[weights.data <= 0.0] = 0.0
        weights.eliminate_zeros()
        weights.sort_indices()
        starts = np.repeat(np.arange(len(self.rest)), np.diff(weights.indptr))
        lengths = np.linalg.norm(self.rest[starts] - self.rest[weights.indices], axis=1)
        return SplatGraph(weights.indptr.astype(np.int32), weights.indices.astype(np.int32), lengths, None, 0.0)

    @cached_property
    def arap_scene(self) -> ArapScene:
        """What all handle sets of as-rigid-as-possible deformation share."""
        return ArapScene(self.rest, self.L, self.graph)


class NoProxyError(Exception):
    """The splats gave no mesh to deform."""


@dataclass(frozen=True)
class Method:
    """One row of the table.

    Parameters
    ----------
    title : str
    bind : callable
        Of a scene.
    extra : str
        Module of an extra that it needs; empty for none.
    is_ablation : bool
        Whether it is a choice within a method, compared on fewer scenes.
    """

    title: str
    bind: Callable[[Scene], Bound]
    extra: str = ""
    is_ablation: bool = False

    @property
    def is_missing(self) -> bool:
        """Whether its extra is not installed."""
        return bool(self.extra) and importlib.util.find_spec(self.extra) is None


def _centers_of(binding: KernelBinding) -> Carried:
    return lambda deformation, rows: adapt_kernels(binding, deformation, method="none").means[rows]


def on_editor_surface(options: GraphOptions = GraphOptions()) -> Callable[[Scene], Bound]:
    """Make the surface by the editor's own stages."""

    def bind(scene: Scene) -> Bound:
        surface = surface_of(scene.splats, options, ellipses=scene.ellipses)
        centers = surface.ellipses.centers
        return Bound(centers, sp.csr_matrix(surface.L), surface.M, _centers_of(surface.binding), surface.binding)

    return bind


@lru_cache(maxsize=2)
def _graph_of(ellipses: Ellipses, options: GraphOptions) -> SplatGraph:
    return splat_graph(ellipses, options)


def on_shared_graph(options: GraphOptions) -> Callable[[Scene], Bound]:
    """Make what the editor's stages make of every visible splat, from a graph that several methods share."""

    def bind(scene: Scene) -> Bound:
        return _on_ellipses(scene.splats, scene.ellipses, options)

    return bind


def _on_ellipses(splats: Splats, ellipses: Ellipses, options: GraphOptions) -> Bound:
    graph = _graph_of(ellipses, edges_only(options))
    neighborhoods = NEIGHBORHOODS[options.neighborhood].load()(ellipses, graph, options.k, no_progress)
    triangles = local_triangulations(ellipses, neighborhoods)
    L, M = point_cloud_laplacian(ellipses.centers, triangles, graph=graph, method=options.laplacian)
    binding = KernelBinding(splats, ellipses, neighborhoods, graph=graph)
    return Bound(ellipses.centers, sp.csr_matrix(L), M, _centers_of(binding), binding)


def on_point_cloud(k: int) -> Callable[[Scene], Bound]:
    """Take the library's Laplacian of the bare centres."""

    def bind(scene: Scene) -> Bound:
        centers = scene.ellipses.centers
        L, M = robust_laplacian.point_cloud_laplacian(centers, n_neighbors=k)
        return Bound(centers, sp.csr_matrix(L), M.diagonal(), _centers_of(bare_binding(scene)))

    return bind


@lru_cache(maxsize=1)
def _opaque(scene: Scene) -> tuple[Splats, Ellipses]:
    """Splats without the faint ones, which follow."""
    faint = scene.splats.opacities < LOW_OPACITY
    logits = np.where(faint, -np.inf, scene.splats.logit_opacities).astype(scene.splats.logit_opacities.dtype)
    splats = replace(scene.splats, logit_opacities=logits)
    with np.errstate(over="ignore"):
        return splats, occupancy_ellipses(splats)


def on_mahalanobis(k: int) -> Callable[[Scene], Bound]:
    """Leave out faint splats and take the nearest by each splat's own covariance."""

    def bind(scene: Scene) -> Bound:
        return _on_ellipses(*_opaque(scene), GraphOptions(neighborhood="mahalanobis", k=k, laplacian="robust"))

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

        def carried(deformation: Deformation, rows: Rows) -> NDArray[np.float64]:
            moved = np.einsum("nc,ncd->nd", weights[rows], deformation.positions[corners[rows]])
            if with_offset:
                turned, grown = _frames(deformation.positions, corners[rows])
                moved += np.einsum("nij,nj->ni", turned, local[rows]) * grown[:, None]
            return moved

        L = sp.csr_matrix(-igl.cotmatrix(vertices, faces))
        weights_of, masses = star_weights(vertices, faces.astype(np.int32))
        if L.data.size and not np.isfinite(L.data).all():
            # Degenerate triangles of the reconstruction have no cotangents.
            L = sp.csr_matrix(sp.diags(np.asarray(weights_of.sum(1)).ravel()) - weights_of)
        return Bound(vertices, L, np.maximum(masses, 1e-2 * np.median(masses)), carried)

    return bind


@lru_cache(maxsize=1)
def _proxy(scene: Scene) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    import pymeshlab

    opaque = np.flatnonzero(scene.splats.opacities[scene.ellipses.rows] >= LOW_OPACITY)
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(scene.ellipses.centers[opaque], v_normals_matrix=scene.ellipses.normals[opaque]))
    # A splat's normal has no sign: the library finds one by going from neighbour to neighbour.
    meshes.compute_normal_for_point_clouds(k=16)
    tree = cKDTree(scene.ellipses.centers[opaque])
    spacing = np.median(tree.query(scene.ellipses.centers[opaque], 2)[0][:, 1])
    # Cells of half a spacing: finer ones cost much and have nothing to show. Threads wait for each other by turning.
    depth = int(np.clip(np.ceil(np.log2(2.0 * scene.truth.size / spacing)), 6, 9))
    meshes.generate_surface_reconstruction_screened_poisson(depth=depth, preclean=True, threads=1)
    meshes.meshing_remove_unreferenced_vertices()
    mesh = meshes.current_mesh()
    vertices, faces = np.array(mesh.vertex_matrix()), np.array(mesh.face_matrix(), np.int64)
    # What Poisson closes far away from any splat is no surface of the object.
    near = tree.query(vertices)[0] <= 6.0 * spacing
    faces = faces[near[faces].all(axis=1)]
    if not len(faces):
        raise NoProxyError("screened Poisson reconstruction leaves no face near a splat")
    used, numbers = np.unique(faces, return_inverse=True)
    return vertices[used], numbers.reshape(-1, 3).astype(np.int64)


def on_cage(scene: Scene) -> Bound:
    """Deform a coarse cage around the splats, which follow it by mean-value coordinates."""
    vertices, faces = _cage(scene)
    points, triangles = vtkPoints(), vtkIdList()
    points.SetData(numpy_to_vtk(vertices, deep=True))
    for corner in faces.ravel():
        triangles.InsertNextId(int(corner))
    means = np.asarray(scene.splats.means, np.float64)
    kept: dict[int, NDArray[np.float64]] = {}

    def weights(row: int) -> NDArray[np.float64]:
        if row not in kept:
            kept[row] = np.empty(len(vertices))
            vtkMeanValueCoordinatesInterpolator.ComputeInterpolationWeights(means[row], points, triangles, kept[row])
        return kept[row]

    def carried(deformation: Deformation, rows: Rows) -> NDArray[np.float64]:
        return np.array([weights(int(row)) for row in rows]) @ deformation.positions

    L = sp.csr_matrix(-igl.cotmatrix(vertices, faces))
    _, masses = star_weights(vertices, faces.astype(np.int32))
    return Bound(vertices, L, masses, carried)


def _cage(scene: Scene) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """What lies within a fortieth of the size of a splat, its surface at that coarseness."""
    opaque = scene.ellipses.centers[scene.splats.opacities[scene.ellipses.rows] >= LOW_OPACITY]
    middle, tree = 0.5 * (scene.truth.vertices.min(axis=0) + scene.truth.vertices.max(axis=0)), cKDTree(opaque)
    step = scene.truth.size / CAGE_CELLS
    around = level_set(
        lambda points: tree.query(points + middle, distance_upper_bound=4.0 * step)[0].clip(max=4.0 * step) - step,
        spacing=step,
        reach=0.5 * scene.truth.size + 3.0 * step,
    )
    return around.vertices + middle, around.faces


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


PAPER = GraphOptions(rule="paper", k=30, laplacian="robust", carriers="all")

METHODS: dict[str, Method] = {
    "ours": Method("SpLap Editor", on_editor_surface()),
    "paper": Method("Paper's rule, geodesic k = 30", on_shared_graph(PAPER)),
    "raw graph": Method("Raw splat graph", on_shared_graph(replace(PAPER, neighborhood="edges"))),
    "knn10": Method("kNN, k = 10", on_point_cloud(10)),
    "knn30": Method("kNN, k = 30", on_point_cloud(30)),
    "mahalanobis10": Method("Mahalanobis, k = 10", on_mahalanobis(10)),
    "mahalanobis30": Method("Mahalanobis, k = 30", on_mahalanobis(30)),
    "mani-gs": Method("Mesh proxy, Mani-GS-like", on_proxy(True), "pymeshlab"),
    "sugar": Method("Mesh proxy, SuGaR-like", on_proxy(False), "pymeshlab"),
    "cage": Method("Cage proxy, mean-value coordinates", on_cage),
    "ours10": Method("SpLap Editor, k = 10", on_editor_surface(GraphOptions(k=10)), is_ablation=True),
    "ours50": Method("SpLap Editor, k = 50", on_editor_surface(GraphOptions(k=50)), is_ablation=True),
    "geodesic10": Method("Paper's rule, geodesic k = 10", on_shared_graph(replace(PAPER, k=10)), is_ablation=True),
    "geodesic50": Method("Paper's rule, geodesic k = 50", on_shared_graph(replace(PAPER, k=50)), is_ablation=True),
    "knn50": Method("kNN, k = 50", on_point_cloud(50), is_ablation=True),
    "oracle": Method("True-surface neighbours (ceiling)", on_true_neighbors),
}
"""Rows by name."""

NOT_RUN = {
    "gaussianmesh": ("GaussianMesh", "needs its own training on a mesh"),
    "nelo": (
        "NeLO",
        "no licence: looked up on 2026-11-30, IntelligentGeometry/NeLo at 1c952f2 of 2024-12-20 has none; its "
        "one checkpoint lies elsewhere",
    ),
}
"""Methods of the paper's table that no row is made for, and why."""
