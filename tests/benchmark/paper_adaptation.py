"""How each ellipse follows: the adaptations of the paper's ablation, where the surface itself takes the centres along.

The true mesh of an object is deformed (ARAP, ten plain iterations) and takes the centres along, so that nothing but the
adaptation differs. Of the splats that move it tells how far their ellipses stand off the deformed surface, in
thousandths of s; the share of spikes, which stand off by a splat spacing more than they did at rest; and the PSNR of
pictures against the deformed surface laid with splats anew. Two rows say what can be had: *at rest*, which is all that
two layings have in common, and the ellipse through three corners that the true surface itself took along.
Where the mesh has a crease at the handle even that stands off, and what stretches with it more than what stays small::

    xvfb-run -a python -m tests.benchmark.paper_adaptation --out resources/evidence

Prints one JSON object an adaptation and scene; ``--out`` adds them to ``adaptation.jsonl``, goes on from what is there
and writes ``adaptation.md``.
"""

import argparse
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import igl
import numpy as np
from numpy.typing import NDArray

from splap_editor.core.adaptation.kernel_adaptation import AdaptedKernels, adapt_kernels, adapted_splats
from splap_editor.core.deformer import Deformation
from splap_editor.core.graph.options import GraphOptions
from splap_editor.core.splats.occupancy import occupancy_ellipses
from splap_editor.core.splats.splats import Splats
from splap_editor.engine.surface import Surface as SplatSurface
from splap_editor.engine.surface import surface_of
from splap_editor.io.sample_maker import STYLES, surface_splats
from splap_editor.io.sample_shapes import Surface
from tests.benchmark.ground_truth import GroundTruth, Pull
from tests.benchmark.paper import deformed, mesh_bound
from tests.benchmark.paper_objects import CATEGORIES
from tests.benchmark.paper_pictures import studio_of, view_of
from tests.benchmark.paper_rows import commit
from tests.benchmark.paper_scenes import Case, made_splats, made_subject
from tests.benchmark.peers import note, report

ADAPTATIONS = {
    "ours": ("surface", 1),
    "the paper's": ("paper", 1),
    "affine, 1 hop": ("affine", 1),
    "affine, 2 hops": ("affine", 2),
    "affine, 3 hops": ("affine", 3),
    "none": ("none", 1),
}
"""Method and rings of neighbours, by the name in the table."""
BY_TRUTH = "corners by the true surface"

ANGLES = np.arange(12) * 2.0 * np.pi / 12
SPACINGS = 2.0
DENSER = 3
"""The truth is laid so many times as dense."""
SIZE = 320, 240


@dataclass(frozen=True, eq=False)
class Carried:
    """A mesh and what it carries, at rest or deformed.

    Parameters
    ----------
    rest : GroundTruth
    vertices : (V, 3) float64
        Where the vertices went.
    rotations : (V, 3, 3) float64
        How the surface turned about each.
    """

    rest: GroundTruth
    vertices: NDArray[np.float64]
    rotations: NDArray[np.float64]

    @property
    def surface(self) -> Surface:
        """The deformed mesh."""
        return Surface(self.vertices, self.rest.surface.faces)

    def carry(self, points: NDArray[np.float64]) -> Deformation:
        """Take points along: with the foot on their nearest face, off it as the face's first corner turns."""
        faces, weights, feet = _feet(points, self.rest.surface)
        moved = np.einsum("nc,ncd->nd", weights, self.vertices[faces])
        turns = self.rotations[np.take_along_axis(faces, weights.argmax(1)[:, None], 1)[:, 0]]
        return Deformation(moved + np.einsum("nij,nj->ni", turns, points - feet), turns)

    def origins(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Where on the resting surface the feet of points on the deformed one come from."""
        faces, weights, _ = _feet(points, self.surface)
        return np.einsum("nc,ncd->nd", weights, self.rest.vertices[faces])


def _feet(
    points: NDArray[np.float64], surface: Surface
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """(n, 3) corners of the nearest faces, (n, 3) weights in them of the nearest points, and (n, 3) those points."""
    _, nearest, feet = igl.point_mesh_squared_distance(points, surface.vertices, surface.faces)
    corners = surface.faces[nearest]
    weights = igl.barycentric_coordinates(feet, *(surface.vertices[corners[:, c]] for c in range(3)))
    return corners, weights, feet


def painted(splats: Splats, origins: NDArray[np.float64]) -> Splats:
    """Splats coloured by where on the resting object they belong, the same from all sides."""
    bands = 0.5 + 0.4 * np.sin(7.0 * origins[:, [2, 0, 1]] + [0.0, 2.1, 4.2])
    colors = ((bands - 0.5) / 0.28209479177387814).astype(np.float32)
    return replace(splats, sh0=colors, shN=np.zeros((splats.n_splats, 0, 3), np.float32))


def corners_of(centers: NDArray[np.float64], axes: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, 3, 3) corners of the triangles inscribed in ellipses with (n, 2, 3) half-diameters."""
    angles = 2.0 * np.pi * np.arange(3) / 3
    return centers[:, None] + np.stack([np.cos(angles), np.sin(angles)], 1) @ axes


def steiner(corners: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(n, 3) centres and (n, 2, 3) conjugate half-diameters of the ellipses around (n, 3, 3) triangles."""
    angles = 2.0 * np.pi * np.arange(3) / 3
    return corners.mean(axis=1), (2.0 / 3.0) * np.stack([np.cos(angles), np.sin(angles)]) @ corners


def rim_distances(centers: NDArray[np.float64], axes: NDArray[np.float64], surface: Surface) -> NDArray[np.float64]:
    """(n, 12) distances of the rims of ellipses with (n, 2, 3) half-diameters from a surface."""
    rims = centers[:, None] + np.stack([np.cos(ANGLES), np.sin(ANGLES)], 1) @ axes
    squares, _, _ = igl.point_mesh_squared_distance(rims.reshape(-1, 3), surface.vertices, surface.faces)
    return np.sqrt(np.maximum(squares, 0.0)).reshape(len(rims), -1)


def psnr(one: NDArray[np.uint8], other: NDArray[np.uint8]) -> float:
    """Peak signal-to-noise ratio of two pictures, in decibels, where either shows anything."""
    shown = (one[..., 3] > 0) | (other[..., 3] > 0)
    errors = (one[shown].astype(float) - other[shown].astype(float)) / 255.0
    return float(-10.0 * np.log10(np.mean(np.square(errors))))


def compared(case: Case, n_pulls: int) -> Iterator[dict[str, object]]:
    """Score every adaptation on every pull of a scene."""
    subject = made_subject(case.category, case.seed, n_pulls)
    truth, made = subject.truth, subject.made
    assert made is not None, "only made objects have a surface to be laid anew"
    splats = made_splats(made, case)
    splats = painted(splats, np.asarray(splats.means, np.float64))
    surface = surface_of(splats, GraphOptions())
    spacing = made.gap / made.spacings(splats.n_splats)
    still = Carried(truth, truth.vertices, np.broadcast_to(np.eye(3), (len(truth.vertices), 3, 3)))
    for number, pull in enumerate(subject.pulls):
        handle = np.zeros(len(truth.vertices), bool)
        handle[pull.handle] = True
        mesh = deformed("arap", mesh_bound(truth), handle, pull, truth.size)
        carried = Carried(truth, mesh.positions, mesh.rotations)
        for name, figures in _pulled(case, surface, carried, still, pull, spacing):
            yield {
                "category": case.category,
                "seed": case.seed,
                "regime": case.regime,
                "pull": number,
                "adaptation": name,
                "commit": commit(),
            } | {key: round(value, 4) for key, value in figures.items()}


def _pulled(
    case: Case, surface: SplatSurface, carried: Carried, still: Carried, pull: Pull, spacing: float
) -> Iterator[tuple[str, dict[str, float]]]:
    """Figures of each adaptation of one pull, of the resting object and, without a picture, of the truth."""
    splats, ellipses, s = surface.binding.splats, surface.ellipses, still.rest.size
    view, rest_view = view_of(pull.center + 0.5 * pull.move, pull, still.rest), view_of(pull.center, pull, still.rest)
    centers, axes = ellipses.centers, ellipses.semi_axes
    deformation = carried.carry(centers)
    moved = np.linalg.norm(deformation.positions - centers, axis=1) > 1e-3 * s
    at_rest = rim_distances(centers[moved], axes[moved], still.surface)

    def figures(distances: NDArray[np.float64]) -> dict[str, float]:
        spiky = distances.max(axis=1) > at_rest.max(axis=1) + spacing
        return {"distance": 1e3 * distances.mean() / s, "spikes": float(spiky.mean())}

    with studio_of(_laid(case, still, splats.n_splats), SIZE) as studio:
        rest_truth = studio.picture(rest_view, is_transparent=True)
    with studio_of(_laid(case, carried, splats.n_splats), SIZE) as studio:
        truth = studio.picture(view, is_transparent=True)
    taken = carried.carry(corners_of(centers[moved], axes[moved]).reshape(-1, 3)).positions.reshape(-1, 3, 3)
    yield BY_TRUTH, figures(rim_distances(*steiner(taken), carried.surface))
    with studio_of(splats, SIZE) as studio:
        yield "at rest", figures(at_rest) | {"psnr": psnr(studio.picture(rest_view, is_transparent=True), rest_truth)}
        for name, (method, hops) in ADAPTATIONS.items():
            kernels = adapt_kernels(surface.binding, deformation, method=method, hops=hops)
            studio.pose(kernels)
            standing = rim_distances(*_ellipses_of(surface, kernels, moved), carried.surface)
            yield name, figures(standing) | {"psnr": psnr(studio.picture(view, is_transparent=True), truth)}


def _ellipses_of(
    surface: SplatSurface, kernels: AdaptedKernels, nodes: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Centres and half-diameters of the nodes' occupancy ellipses after an adaptation."""
    ellipses = occupancy_ellipses(adapted_splats(surface.binding.splats, kernels))
    places = ellipses.node_of_row[surface.ellipses.rows[nodes]]
    return ellipses.centers[places], ellipses.semi_axes[places]


def _laid(case: Case, carried: Carried, n_splats: int) -> Splats:
    """Lay splats on a deformed object anew, more densely, and paint them by where they belong."""
    splats = surface_splats(carried.surface, DENSER * n_splats, STYLES[case.regime], seed=case.seed + 1).splats
    return painted(splats, carried.origins(np.asarray(splats.means, np.float64)))


def table(rows: Sequence[dict[str, object]]) -> str:
    """Means by adaptation, over everything and by regime."""
    regimes = list(dict.fromkeys(row["regime"] for row in rows))
    head = ["adaptation", *(f"{regime}: off the surface · spikes · PSNR" for regime in regimes)]
    lines = [f"| {' | '.join(head)} |", f"| {' | '.join(['---'] * len(head))} |"]
    for name in ("at rest", BY_TRUTH, *ADAPTATIONS):
        cells = []
        for regime in regimes:
            here = [row for row in rows if row["adaptation"] == name and row["regime"] == regime]
            off, spikes = (np.mean([float(row[key]) for row in here]) for key in ("distance", "spikes"))
            decibels = [float(row["psnr"]) for row in here if "psnr" in row]
            drawn = f"{np.mean(decibels):.1f} dB" if decibels else "–"
            cells.append(f"{off:.2f} · {100 * spikes:.2f} % · {drawn}")
        lines.append(f"| {' | '.join([name, *cells])} |")
    scenes = {(row["category"], row["seed"], row["regime"], row["pull"]) for row in rows}
    lead = f"{len(scenes)} pulls, at {', '.join(sorted({str(row['commit']) for row in rows}))}; distances in ‰ of s."
    return "\n".join(["# How each ellipse follows", "", lead, "", *lines]) + "\n"


def main(given: list[str] | None = None) -> list[dict[str, object]]:
    """Run the comparison that the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--categories", nargs="*", choices=list(CATEGORIES), default=list(CATEGORIES))
    parser.add_argument("--regime", nargs="*", choices=sorted(STYLES), default=["thin", "trained"])
    parser.add_argument("--pulls", type=int, default=1, help="handles an object (1)")
    parser.add_argument("--out", type=Path, metavar="FOLDER", help="where rows are kept and the table is written")
    options = parser.parse_args(given)
    kept = options.out / "adaptation.jsonl" if options.out else None
    lines = kept.read_text(encoding="utf-8").splitlines() if kept and kept.exists() else []
    rows = [json.loads(line) for line in lines]
    known = {(row["category"], row["regime"]) for row in rows}
    for category in options.categories:
        for regime in options.regime:
            if (category, regime) in known:
                continue
            note(f"{category}, {regime}")
            found = list(compared(Case(category, 0, regime, SPACINGS), options.pulls))
            rows += found
            for row in found:
                report(**row)
            if kept:
                kept.parent.mkdir(parents=True, exist_ok=True)
                with kept.open("a", encoding="utf-8") as file:
                    file.writelines(json.dumps(row) + "\n" for row in found)
    if options.out and rows:
        (options.out / "adaptation.md").write_text(table(rows), encoding="utf-8")
    return rows


if __name__ == "__main__":
    main()
