"""Splats whose ellipses keep covering the surface when it is deformed."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.adaptation.carried_ellipses import KernelArrays, adapt_inert, write_kernels
from splap_editor.core.adaptation.kernel_binding import KernelBinding
from splap_editor.core.adaptation.node_motions import STILL_SHARE, find_motions, find_moved, find_ring_motions
from splap_editor.core.adaptation.options import AdaptationOptions
from splap_editor.core.deformer import Deformation
from splap_editor.core.progress import Progress, no_progress, part_of
from splap_editor.core.splats.rotations import matrices_to_quats, quat_products
from splap_editor.core.splats.spherical_harmonics import rotated_sh
from splap_editor.core.splats.splats import Splats

_Floats = NDArray[np.float64]
_Flags = NDArray[np.bool_]
_Nodes = tuple[_Floats, _Floats, _Floats, _Flags, float, _Flags]
"""Rest centres, positions, rotations, which rest, below what shift a node is still, and which have moved."""


@dataclass(frozen=True, eq=False)
class AdaptedKernels:
    """Every splat of a file after a deformation, in file order.

    What a frame of a drag draws is at hand; the rest is put into file order when it is asked for.

    Parameters
    ----------
    binding : KernelBinding
        What was adapted.
    arrays : KernelArrays
        Results in carried order, see there.
    deformation : Deformation
        What they were adapted to.
    """

    binding: KernelBinding
    arrays: KernelArrays
    deformation: Deformation

    @property
    def means_f32(self) -> NDArray[np.float32]:
        """(N, 3) centres to draw, in world units."""
        return self.arrays.means_f32

    @property
    def axes_f32(self) -> NDArray[np.float32]:
        """(N, 2, 3) in-plane principal axes to draw: world vectors one effective standard deviation long."""
        return self.arrays.axes_f32

    @cached_property
    def means(self) -> NDArray[np.float64]:
        """(N, 3) centres in world units."""
        return self._in_file_order(self.arrays.means)

    @cached_property
    def rotations(self) -> NDArray[np.float64]:
        """(N, 3, 3) proper rotation of each splat, rest → deformed: the polar factor of how its ellipse moved.

        It turns normals and colours; it does not hold the turn of the principal axes within the plane.
        """
        return self._in_file_order(self.arrays.rotations)

    @cached_property
    def changed(self) -> NDArray[np.bool_]:
        """(N,) False where nothing that carries the splat has moved: its row is the file's own, bit for bit."""
        return self._in_file_order(self.arrays.changed)

    @property
    def thicknesses(self) -> NDArray[np.float32]:
        """(N,) standard deviation across the surface to draw; deformation does not change it."""
        return self.binding.thicknesses

    @cached_property
    def quats(self) -> NDArray[np.float64]:
        """(N, 4) quaternions w, x, y, z of the file's own lengths; unchanged rows hold the file's own numbers."""
        # Inert splats may hold anything: what is no number stays none, and is not complained of.
        with np.errstate(invalid="ignore", over="ignore"):
            return self._turned_quats()

    def _turned_quats(self) -> NDArray[np.float64]:
        quats = np.array(self.binding.splats.quats, np.float64)
        places = np.flatnonzero(self.arrays.changed)
        rows = self.binding.order[places]
        # The principal axes turn within the rest plane first, then with the surface. Inert splats have no plane.
        n_nodes = self.binding.ellipses.n_nodes
        normals = np.zeros((len(places), 3))
        normals[places < n_nodes] = self.binding.ellipses.normals[places[places < n_nodes]]
        cosines, sines = self.arrays.twists[places].T
        halves = np.sqrt(0.5 * (1.0 + cosines))
        twists = np.concatenate([halves[:, None], normals * (0.5 * sines / halves)[:, None]], axis=1)
        turns = quat_products(matrices_to_quats(self.arrays.rotations[places]), twists)
        quats[rows] = quat_products(turns, quats[rows])
        return quats

    @cached_property
    def log_scales(self) -> NDArray[np.float64]:
        """(N, 2 or 3) stored log-scales; unchanged rows and the axis across the surface hold the file's own numbers.

        With a 3-D filter of radius f the effective variance s² + f² grows, and the filter is taken off again; a
        variance that would fall below the filter's own is held at 1e-12 of the effective one at rest.
        """
        splats, ellipses = self.binding.splats, self.binding.ellipses
        with np.errstate(invalid="ignore"):
            log_scales = np.array(splats.log_scales, np.float64)
        nodes = np.flatnonzero(self.arrays.changed[: ellipses.n_nodes])
        entries = ellipses.rows[nodes][:, None], ellipses.axes[nodes, :2].astype(np.int64)
        growths = self.arrays.growths[nodes]
        if splats.filter_radii is None:
            log_scales[entries] += np.log(growths)
            return log_scales
        scales2 = np.exp(2.0 * log_scales[entries])
        filters2 = np.asarray(splats.filter_radii, np.float64)[entries[0]] ** 2
        variances = growths**2 * scales2 + (growths**2 - 1.0) * filters2
        with np.errstate(divide="ignore"):
            log_scales[entries] = 0.5 * np.log(np.maximum(variances, 1e-12 * (scales2 + filters2)))
        return log_scales

    def _in_file_order(self, values):
        result = np.empty_like(values)
        result[self.binding.order] = values
        return result


def adapt_kernels(
    binding: KernelBinding,
    deformation: Deformation,
    *,
    method: str = "surface",
    hops: int = 1,
    out: AdaptedKernels | None = None,
) -> AdaptedKernels:
    """Adapt every splat of a scene to a deformation of its nodes.

    "surface" follows the corners of the triangle inscribed in each occupancy ellipse and takes the Steiner
    circumellipse of the moved triangle [1]_. The paper moves a corner ``t`` by the displacements of its carriers,
    which is not exact under rotation; here each carrier ``j`` moves it as its own neighbourhood moves,
    ``t' = Σ w_j (p'_j + A_j (t - p_j))``, where ``A_j`` is the least-squares affine map of the six nearest geodesic
    neighbours, drawn to a similarity with the node's rotation in directions they do not span. Rigid motions and uniform
    scalings come through exactly.

    "paper" is what the paper writes: corners move by the displacements, weighted by 1/distance, of the splat itself and
    the two nearest along the graph.

    "affine" maps the ellipse by the least-squares affine map of its ``hops``-ring, the baseline of the paper. "none"
    moves the centres and nothing else.

    Inert splats move and turn with the blended motion of the nearest active ones and keep their size, except with
    "none", where they only move. The scale across the surface never changes. What is held at rest stays at rest, and no
    active splat moves farther than its own node and those that carry it.

    Parameters
    ----------
    binding : KernelBinding
        Carriers of the scene.
    deformation : Deformation
        Where its n nodes went and how they turned.
    method : str
        One of `ADAPTATIONS`.
        See above.
    hops : int
        Rings of graph neighbours for "affine", 1 to 3.
    out : AdaptedKernels, optional
        An earlier result whose arrays are written over, which saves their allocation; it must not be used again.

    Returns
    -------
    AdaptedKernels
        In file order. A collapsed ellipse keeps the plane of its node's rotation and 1e-6 of its size; results are
        finite wherever the rest values are.

    Raises
    ------
    ValueError
        Unknown method, ``hops`` outside 1 to 3, "affine" without a graph, or arrays of the wrong shape.

    References
    ----------
    .. [1] SpLap, 3DV 2026, Eq. 9 and 10.
    """
    _validate(binding, deformation, method, hops)
    rest = binding.rest
    arrays = _blank_arrays(binding, out)
    nodes = _nodes_of(binding, deformation, turns=method != "none")
    _, positions, rotations, resting, _, moved = nodes
    if method == "none":
        find_moved(*nodes)
        _move_centers(rest, positions, moved, arrays)
    else:
        carriers, weights, motions, square_shifts = _carrier_motions(binding, method, hops, nodes)
        write_kernels(carriers, weights, motions, square_shifts, moved, resting, rotations, rest, arrays)
        binding.spare_motions.append(motions)
    adapt_inert(binding.inert_carriers, binding.inert_weights, rest, positions, rotations, moved, arrays)
    return AdaptedKernels(binding, arrays, deformation)


def node_motions(kernels: AdaptedKernels) -> NDArray[np.float64]:
    """(n, 12) affine map of the surface around each node, as "surface" carries ellipses.

    Column by column, then what is added: ``t' = A t + b``.
    """
    binding = kernels.binding
    motions, square_shifts = np.empty((binding.ellipses.n_nodes, 12)), np.empty(binding.ellipses.n_nodes)
    nodes = _nodes_of(binding, kernels.deformation)
    find_motions(binding.stencils, binding.inverse_moments, binding.dampings, *nodes, motions, square_shifts)
    return motions


def _nodes_of(binding: KernelBinding, deformation: Deformation, *, turns: bool = True) -> _Nodes:
    """Nodes of a deformation, as the loops over them take them; without turns if these do not count."""
    positions = np.ascontiguousarray(deformation.positions, np.float64)
    rotations = np.ascontiguousarray(deformation.rotations, np.float64)
    if not turns:
        rotations = np.broadcast_to(np.eye(3), rotations.shape).copy()
    resting = deformation.resting if deformation.resting is not None else np.zeros(len(positions), np.bool_)
    still = STILL_SHARE * binding.ellipses.scene_scale
    return binding.rest.means, positions, rotations, resting, still, np.empty(len(positions), np.bool_)


def _carrier_motions(
    binding: KernelBinding, method: str, hops: int, nodes: _Nodes
) -> tuple[NDArray[np.int32], NDArray[np.float32], _Floats, _Floats]:
    """Nodes that carry the corners of each splat, with their weights; the affine map by which each node moves.

    Says in the last of ``nodes`` which of them have moved; (n,) squares of how far come last.
    """
    means, positions, *_, moved = nodes
    motions, square_shifts = _spare_motions(binding), np.empty(len(positions))
    if method == "surface":
        find_motions(binding.stencils, binding.inverse_moments, binding.dampings, *nodes, motions, square_shifts)
        return binding.carriers, binding.weights, motions, square_shifts
    if method == "paper":
        find_moved(*nodes)
        motions[:, :9] = np.eye(3).ravel()
        motions[:, 9:] = np.where(moved[:, None], positions - means[: len(positions)], 0.0)
        return *binding.published_carriers, motions, np.square(motions[:, 9:]).sum(axis=1)
    assert binding.graph is not None, "asked for at the door"
    find_ring_motions(hops, binding.graph.indptr, binding.graph.indices, *nodes, motions, square_shifts)
    # Each splat carries itself.
    carriers = np.repeat(np.arange(len(positions), dtype=np.int32)[:, None], 9, axis=1)
    weights = np.tile(np.array([1.0, 0.0], np.float32), (len(positions), 3))
    return carriers, weights, motions, square_shifts


def adapted_splats(splats: Splats, adapted: AdaptedKernels, progress: Progress = no_progress) -> Splats:
    """Splats to write to a file: those of the scene, with the changed rows replaced.

    Parameters
    ----------
    splats : Splats
        The scene that was bound.
    adapted : AdaptedKernels
        Its adapted kernels.
    progress : Progress
        Told the share done; may cancel.

    Returns
    -------
    Splats
        New arrays of the same types. Unchanged rows, opacities and the constant colour are the file's own, bit for
        bit; view-dependent colour is turned where the splat is.

    Raises
    ------
    ValueError
        If the number of splats differs.
    """
    if splats.n_splats != len(adapted.means):
        raise ValueError(f"adapted kernels are of {len(adapted.means)} splats, the scene has {splats.n_splats}")
    changed = adapted.changed

    def replaced(old, new):
        """A copy of (N, …) old values with the changed rows new."""
        result = np.array(old)
        result[changed] = new[changed]
        return result

    means = replaced(splats.means, adapted.means)
    log_scales = replaced(splats.log_scales, adapted.log_scales)
    progress(0.1)
    quats = replaced(splats.quats, adapted.quats)
    shN = rotated_sh(splats.shN, adapted.rotations, changed, part_of(progress, 0.2, 1.0))
    return Splats(
        means=means,
        log_scales=log_scales,
        quats=quats,
        logit_opacities=splats.logit_opacities,
        sh0=splats.sh0,
        shN=shN.astype(splats.shN.dtype, copy=False),
        thresholds=splats.thresholds,
        filter_radii=splats.filter_radii,
        normal_axis=splats.normal_axis,
    )


def _validate(binding, deformation, method, hops):
    n = binding.ellipses.n_nodes
    AdaptationOptions(method, hops)
    if method == "affine" and binding.graph is None:
        raise ValueError("affine adaptation needs a KernelBinding made with the splat graph")
    if np.shape(deformation.positions) != (n, 3):
        raise ValueError(f"deformation.positions must have shape ({n}, 3), got {np.shape(deformation.positions)}")
    if np.shape(deformation.rotations) != (n, 3, 3):
        raise ValueError(f"deformation.rotations must have shape ({n}, 3, 3), got {np.shape(deformation.rotations)}")


def _blank_arrays(binding: KernelBinding, out: AdaptedKernels | None) -> KernelArrays:
    """Arrays yet to be written, those of ``out`` if given."""
    N = binding.splats.n_splats
    if out is None:
        return KernelArrays(
            means=np.empty((N, 3)),
            rotations=np.empty((N, 3, 3)),
            growths=np.empty((N, 2)),
            twists=np.empty((N, 2)),
            changed=np.empty(N, np.bool_),
            means_f32=np.empty((N, 3), np.float32),
            axes_f32=np.empty((N, 2, 3), np.float32),
        )
    if len(out.arrays.means) != N:
        raise ValueError(f"out holds {len(out.arrays.means)} splats, the scene has {N}")
    return out.arrays


def _spare_motions(binding):
    try:
        return binding.spare_motions.pop()
    except IndexError:
        return np.empty((binding.ellipses.n_nodes, 12))


def _move_centers(rest, positions, moved, arrays):
    arrays.means[:] = rest.means
    arrays.rotations[:] = np.eye(3)
    arrays.growths[:] = 1.0
    arrays.twists[:] = (1.0, 0.0)
    arrays.changed[:] = False
    nodes = np.flatnonzero(moved)
    arrays.means[nodes] = positions[nodes]
    arrays.changed[nodes] = True
    arrays.means_f32[rest.order] = arrays.means
    arrays.axes_f32[rest.order] = rest.axes_f32
