"""How well and how fast splats follow a deformed surface: surface-preserving adaptation against the affine baseline.

A patch of splats is deformed by a map that is known everywhere. Each splat should cover where the points of its
ellipse went: the error is the distance of each point of the adapted rim from the image of its rest point, in
thousandths of the patch, root mean square and 95 % quantile. "ideal" moves the three corners by the map itself.

Run ``python tests/benchmark/adaptation.py [--splats 100000] [--timing-only]``; one JSON line a result.
"""

import argparse
import json
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np
from scipy.spatial.transform import Rotation

from splap_editor.core.adaptation.kernel_adaptation import KernelBinding, adapt_kernels, adapted_splats
from splap_editor.core.arap.rotation_fit import fit_rotations
from splap_editor.core.deformer import Deformation
from splap_editor.core.graph.splat_graph import splat_graph
from splap_editor.core.splats.occupancy import occupancy_ellipses
from splap_editor.core.splats.spherical_harmonics import rotated_sh, view_colors
from splap_editor.core.splats.splats import Splats
from splap_editor.core.surface.geodesics import geodesic_neighbors

ANGLES = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)


def patch(width, height, n, size, aspect, scatter=0.0, tilt=0.0, seed=0):
    """About a flat patch: n splats with a median semi-axis of ``size`` spacings, off it by ``scatter`` and ``tilt``."""
    rng = np.random.default_rng(seed)
    means = rng.uniform(-0.5, 0.5, (n, 3)) * [width, height, 0.0] + [0.0, 0.0, 1.0] * rng.normal(0, 1, (n, 3)) * scatter
    major = size * np.sqrt(width * height / n) * np.exp(0.4 * rng.normal(size=n))
    minor = major / np.maximum(1.0, aspect * np.exp(0.4 * rng.normal(size=n)))
    turn = Rotation.from_rotvec(rng.uniform(0.0, np.pi, (n, 1)) * [0.0, 0.0, 1.0])
    tilts = Rotation.from_rotvec(tilt * rng.normal(size=(n, 3)) * [1.0, 1.0, 0.0])
    # Opacity 0.9: the occupancy ellipse ends at this many standard deviations.
    cutoff = np.sqrt(-2.0 * np.log(1.0 / 255.0 / 0.9))
    return Splats(
        means=means,
        log_scales=np.log(np.stack([major, minor], axis=1) / cutoff),
        quats=(tilts * turn).as_quat()[:, [3, 0, 1, 2]],
        logit_opacities=np.full(n, np.log(9.0)),
        sh0=rng.normal(size=(n, 3)).astype(np.float32),
        shN=rng.normal(size=(n, 15, 3)).astype(np.float32),
    )


SCENES = {
    "thin": lambda: patch(1.0, 1.0, 1600, 1.5, 1.5),
    "layered": lambda: patch(1.0, 1.0, 1600, 4.0, 3.5, scatter=0.01, tilt=0.2),
    "strip": lambda: patch(1.5, 0.08, 800, 3.0, 3.0),
}


def bend(p, radius=0.3):
    x, y, z = p.T
    return np.stack([(radius - z) * np.sin(x / radius), y, radius - (radius - z) * np.cos(x / radius)], axis=1)


def twist(p, rate=2.0):
    return np.einsum("nij,nj->ni", Rotation.from_rotvec(rate * p[:, :1] * [1.0, 0.0, 0.0]).as_matrix(), p)


def stretch(p):
    return p + np.abs(p[:, :1]) * p * [1.0, 0.0, 0.0]


DEFORMATIONS = {"bend": bend, "twist": twist, "stretch": stretch, "scale 2": lambda p: 2.0 * p}


def corners(ellipses):
    major, minor = ellipses.semi_axes.swapaxes(0, 1)
    across = np.sqrt(0.75) * minor
    return ellipses.centers[:, None] + np.stack([major, -0.5 * major + across, -0.5 * major - across], axis=1)


def circumellipses(triangles):
    """Centres and conjugate half-diameters of the Steiner circumellipses."""
    centers = triangles.mean(axis=1)
    return centers, triangles[:, 0] - centers, (triangles[:, 1] - triangles[:, 2]) / np.sqrt(3.0)


def displaced_triangles(ellipses, deformation, candidates, turned):
    """Corners moved by their three nearest candidates: as in the paper by displacements, or by rigid motions."""
    result = np.empty((ellipses.n_nodes, 3, 3))
    for i, triangle in enumerate(corners(ellipses)):
        near = np.concatenate([[i], candidates[i]])
        offsets = triangle[:, None] - ellipses.centers[near]
        distances = np.maximum(np.linalg.norm(offsets, axis=2), 1e-12)
        for c in range(3):
            best = np.argsort(distances[c])[:3]
            weights = 1.0 / distances[c, best]
            arms = offsets[c, best]
            if turned:
                arms = np.einsum("jab,jb->ja", deformation.rotations[near[best]], arms)
            result[i, c] = weights / weights.sum() @ (deformation.positions[near[best]] + arms)
    return result


def rims(centers, major, minor):
    return centers[:, None] + np.cos(ANGLES)[:, None] * major[:, None] + np.sin(ANGLES)[:, None] * minor[:, None]


def fidelity(scene_name, splats):
    ellipses = occupancy_ellipses(splats)
    graph = splat_graph(ellipses)
    neighborhoods = geodesic_neighbors(graph, 30)
    binding = KernelBinding(splats, ellipses, neighborhoods, graph=graph)
    rows_of = [np.split(x.indices, x.indptr[1:-1]) for x in (graph, neighborhoods)]
    rest_rim = rims(ellipses.centers, ellipses.semi_axes[:, 0], ellipses.semi_axes[:, 1])
    low, high = ellipses.centers.min(axis=0), ellipses.centers.max(axis=0)
    inside = ((rest_rim >= low) & (rest_rim <= high))[..., :2].all(axis=2)
    for name, mapping in DEFORMATIONS.items():
        positions = mapping(ellipses.centers)
        spans = [(ellipses.centers[near] - p, positions[near] - q)
                 for near, p, q in zip(rows_of[1], ellipses.centers, positions, strict=True)]  # fmt: skip
        deformation = Deformation(positions, fit_rotations(np.array([e.T @ f for e, f in spans])))
        expected = mapping(rest_rim.reshape(-1, 3)).reshape(rest_rim.shape)
        results = {
            "ideal": circumellipses(mapping(corners(ellipses).reshape(-1, 3)).reshape(-1, 3, 3)),
            "paper: displacements of graph neighbours": circumellipses(
                displaced_triangles(ellipses, deformation, rows_of[0], turned=False)
            ),
            "rigid motions of graph neighbours": circumellipses(
                displaced_triangles(ellipses, deformation, rows_of[0], turned=True)
            ),
            "rigid motions of geodesic neighbours": circumellipses(
                displaced_triangles(ellipses, deformation, rows_of[1], turned=True)
            ),
        }
        for label, method, hops in [("none", "none", 1), ("surface", "surface", 1)] + [
            (f"affine {h}", "affine", h) for h in (1, 2, 3)
        ]:
            adapted = adapt_kernels(binding, deformation, method=method, hops=hops)
            results[label] = adapted.means[ellipses.rows], *semi_axis_images(adapted, ellipses)
        for label, ellipse in results.items():
            errors = 1e3 * np.linalg.norm(rims(*ellipse) - expected, axis=2)[inside]
            rms, p95 = np.sqrt(np.mean(errors**2)), np.quantile(errors, 0.95)
            print(json.dumps({"scene": scene_name, "deformation": name, "method": label,
                              "rms": round(float(rms), 2), "p95": round(float(p95), 2)}))  # fmt: skip


def semi_axis_images(adapted, ellipses):
    """Images of the rest semi-axes, so that each point of a rim is compared with its own image.

    In the plane the adapted ellipse has the moments S D² S with the symmetric stretch S and the rest lengths D, hence
    S = D⁻¹ (D S D² S D)^½ D⁻¹.
    """
    lengths = np.linalg.norm(ellipses.semi_axes, axis=2)
    axes = adapted.axes_f32[ellipses.rows].astype(float) * ellipses.cutoffs[:, None, None]
    plane = np.einsum("nij,nkj->nki", adapted.rotations[ellipses.rows], ellipses.semi_axes / lengths[:, :, None])
    local = np.einsum("nkj,nlj->nkl", axes, plane)
    scaled = lengths[:, :, None] * np.einsum("nka,nkb->nab", local, local) * lengths[:, None, :]
    values, vectors = np.linalg.eigh(scaled)
    root = np.einsum("nab,nb,ncb->nac", vectors, np.sqrt(np.maximum(values, 0.0)), vectors)
    images = np.einsum("nab,nac->nbc", root / lengths[:, :, None], plane)
    return images[:, 0], images[:, 1]


def shell(n, seed=0):
    """Tangent splats on a unit sphere in random file order, one in fifty transparent, with colour of degree 3."""
    rng = np.random.default_rng(seed)
    normals = rng.normal(size=(n, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    tangents = np.cross(normals, rng.normal(size=(n, 3)))
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    frames = np.stack([tangents, np.cross(normals, tangents), normals], axis=2)
    return Splats(
        means=normals.astype(np.float32),
        log_scales=np.log(np.sqrt(4.0 * np.pi / n) * np.exp(0.3 * rng.normal(size=(n, 2))) * [0.6, 0.3]).astype("f4"),
        quats=Rotation.from_matrix(frames).as_quat()[:, [3, 0, 1, 2]].astype(np.float32),
        logit_opacities=np.where(np.arange(n) % 50 == 0, -8.0, 2.0).astype(np.float32),
        sh0=rng.normal(size=(n, 3)).astype(np.float32),
        shN=rng.normal(size=(n, 15, 3)).astype(np.float32),
    )


def timing(n_splats, repeats=40):
    splats = shell(n_splats)
    ellipses = occupancy_ellipses(splats)
    neighborhoods = geodesic_neighbors(splat_graph(ellipses), 30)
    binding = KernelBinding(splats, ellipses, neighborhoods)
    # Everything moves, and everything turns by another rotation.
    vectors = ellipses.centers[:, [1, 2, 0]]
    turns = Rotation.from_rotvec(vectors).as_matrix()
    deformation = Deformation(np.einsum("nij,nj->ni", turns, ellipses.centers) + 0.1 * vectors, turns)
    adapted = adapt_kernels(binding, deformation)
    camera = np.array([4.0, 0.0, 1.0])
    everything = np.ones(n_splats, np.bool_)
    tasks = {
        "binding": lambda: KernelBinding(splats, ellipses, neighborhoods),
        "adaptation": lambda: adapt_kernels(binding, deformation, out=adapted),
        "adaptation into new arrays": lambda: adapt_kernels(binding, deformation),
        "adaptation + SH rotation": lambda: rotated_sh(
            splats.shN, adapt_kernels(binding, deformation, out=adapted).rotations, everything
        ),
        "SH rotation": lambda: rotated_sh(splats.shN, adapted.rotations, everything),
        "view colours": lambda: view_colors(splats.sh0, splats.shN, adapted.means, adapted.rotations, camera),
        "splats to write": lambda: adapted_splats(splats, adapt_kernels(binding, deformation, out=adapted)),
    }
    for name, task in tasks.items():
        task()
        times = []
        for _ in range(3 if name == "binding" else repeats):
            start = time.perf_counter()
            task()
            times.append(1e3 * (time.perf_counter() - start))
        print(json.dumps({"task": name, "n_splats": n_splats, "best_ms": round(min(times), 2),
                          "median_ms": round(float(np.median(times)), 2)}))  # fmt: skip


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--splats", type=int, default=100_000)
    parser.add_argument("--timing-only", action="store_true")
    arguments = parser.parse_args()
    if not arguments.timing_only:
        for name, scene in SCENES.items():
            fidelity(name, scene())
    timing(arguments.splats)


if __name__ == "__main__":
    main()
