"""How near a drawn-out surface comes to what became of it, with and without its splats split.

A sheet, and the neck of a captured guitar, are drawn out to three times their length and bent by a map that is known
everywhere. Truth is the same scene sampled anew: each splat is 25 small ones that look like it at rest, and every one
of these goes exactly where the map brings it. PSNR of pictures from all around, in dB over what truth covers, of the
pose as it is exported without a repair and with one::

    xvfb-run -a python -m tests.benchmark.repair [--capture ../shared/data/guitar.ply] [--pictures FOLDER]

One JSON line a scene and limit.
"""

import argparse
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from splap_editor.core.adaptation.kernel_adaptation import adapt_kernels, adapted_splats
from splap_editor.core.adaptation.repair import child_offsets, child_opacities, child_width, repaired
from splap_editor.core.deformer import Deformation
from splap_editor.core.graph.splat_graph import GraphOptions
from splap_editor.core.splats.rotations import matrices_to_quats, quats_to_matrices
from splap_editor.core.splats.splats import Splats
from splap_editor.engine.surface import surface_of
from splap_editor.io.splat_files import read_splats
from splap_editor.viewport.camera import View
from tests.benchmark.paper_pictures import studio_of

Points = NDArray[np.float64]
Map = Callable[[Points], Points]

SIZE = 900, 700
SPLIT_AT_REST = 5
LIMITS = (1.5, 2.0)
VIEWS = ((0.3, 0.2), (1.4, 0.5), (2.6, -0.3), (4.4, 0.4))


def textured_sheet(n: int = 1500, seed: int = 0) -> Splats:
    """A sheet of overlapping flat splats at random, with stripes some splats wide."""
    rng = np.random.default_rng(seed)
    means = np.column_stack([rng.uniform(-1.0, 1.0, n), rng.uniform(-0.6, 0.6, n), np.zeros(n)])
    # The 255th part of an opacity of .9 is reached at 3.3 standard deviations.
    size = 0.6 * np.sqrt(2.4 / n) * np.exp(0.3 * rng.normal(size=(n, 2)))
    turns = np.column_stack([np.cos(a := rng.uniform(0.0, np.pi, n)), np.zeros((n, 2)), np.sin(a)])
    stripes = np.sin(9.0 * means[:, :1]) * np.cos(9.0 * means[:, 1:2]) > [-0.2, 0.0, 0.2]
    return Splats(
        means=means,
        log_scales=np.log(np.column_stack([size, np.full(n, 1e-4)])),
        quats=turns,
        logit_opacities=np.full(n, np.log(9.0)),
        sh0=(np.where(stripes, 0.85, 0.15) - 0.5) / 0.28209479,
        shN=np.zeros((n, 0, 3)),
    )


def neck_of(path: Path) -> Splats:
    """The neck of the captured guitar, its length along x about the origin and two units long."""
    splats = read_splats(path).splats
    along = np.asarray(splats.means, np.float64)[:, 1]
    held = splats.at((along > -3.6) & (along < -2.2))
    turn = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    scale = 2.0 / 1.4
    means = scale * (np.asarray(held.means, np.float64) - np.median(held.means, axis=0)) @ turn.T
    quats = matrices_to_quats(turn @ quats_to_matrices(np.asarray(held.quats, np.float64)))
    return replace(held, means=means, quats=quats, log_scales=np.float64(held.log_scales) + np.log(scale))


def drawn_out(bend: float) -> Map:
    """Draw x out to three times its length, most in the middle, and roll it up with a radius."""

    def mapping(points: Points) -> Points:
        x, y, z = points.T
        far = 3.0 * x + 0.35 * np.sin(np.pi * x)
        return np.stack([(bend - z) * np.sin(far / bend), y, bend - (bend - z) * np.cos(far / bend)], axis=1)

    return mapping


def derivatives(mapping: Map, points: Points, step: float = 1e-5) -> Points:
    """(n, 3, 3) derivative of a map."""
    columns = [(mapping(points + step * e) - mapping(points - step * e)) / (2.0 * step) for e in np.eye(3)]
    return np.stack(columns, axis=2)


def sampled_anew(splats: Splats) -> Splats:
    """The same picture of splats 25 times as many: each split along both of its larger axes."""
    k, n = SPLIT_AT_REST, splats.n_splats
    order = np.argsort(-splats.scales, axis=1)
    frames = quats_to_matrices(np.asarray(splats.quats, np.float64))
    axes = np.take_along_axis(frames * splats.scales[:, None], order[:, None], axis=2)
    offsets = child_offsets(k)
    shift = axes[:, None, None, :, 0] * offsets[:, None, None] + axes[:, None, None, :, 1] * offsets[None, :, None]
    opacities = child_opacities(k, child_opacities(k, splats.opacities).ravel()).ravel()
    log_scales = np.log(splats.scales)
    np.put_along_axis(
        log_scales, order[:, :2], np.take_along_axis(log_scales, order[:, :2], 1) + np.log(child_width(k)), 1
    )
    many = splats.at(np.repeat(np.arange(n), k * k))
    return replace(
        many,
        means=(np.asarray(splats.means, np.float64)[:, None, None] + shift).reshape(-1, 3),
        log_scales=np.repeat(log_scales, k * k, axis=0),
        logit_opacities=np.log(opacities / (1.0 - opacities)),
        filter_radii=None,
    )


def mapped(splats: Splats, mapping: Map) -> Splats:
    """Splats that go exactly where a map brings them, each as its derivative at the centre says."""
    means = np.asarray(splats.means, np.float64)
    axes = quats_to_matrices(np.asarray(splats.quats, np.float64)) * splats.scales[:, None]
    left, sizes, _ = np.linalg.svd(derivatives(mapping, means) @ axes)
    left[:, :, 2] *= np.linalg.det(left)[:, None]
    return replace(
        splats, means=mapping(means), quats=matrices_to_quats(left), log_scales=np.log(np.maximum(sizes, 1e-9))
    )


def pictures(splats: Splats, views: list[View]) -> NDArray[np.float64]:
    """(v, H, W, 4) in [0, 1] of splats from some views, on nothing."""
    with studio_of(splats, SIZE) as studio:
        return np.stack([studio.picture(view, is_transparent=True) for view in views]) / 255.0


def views_round(points: Points) -> list[View]:
    """Views of points from all around."""
    low, high = np.percentile(points, [1.0, 99.0], axis=0)
    focus, size = 0.5 * (low + high), float(np.linalg.norm(high - low))
    found = []
    for around, above in VIEWS:
        out = np.array([np.cos(around) * np.cos(above), np.sin(above), np.sin(around) * np.cos(above)])
        found.append(View(focus + 1.2 * size * out, focus, np.array([0.0, 1.0, 0.0])))
    return found


def psnr(shown: NDArray[np.float64], truth: NDArray[np.float64]) -> float:
    """Of pictures on white, over the pixels that truth covers."""
    on_white = [each[..., :3] * each[..., 3:] + 1.0 - each[..., 3:] for each in (shown, truth)]
    covered = truth[..., 3] > 0.02
    return float(-10.0 * np.log10(np.square(on_white[0] - on_white[1])[covered].mean()))


def bench(name: str, splats: Splats, mapping: Map, folder: Path | None) -> None:
    """Compare one scene with its truth."""
    surface = surface_of(splats, GraphOptions())
    binding = surface.binding
    rest = binding.ellipses.centers
    left, _, right = np.linalg.svd(derivatives(mapping, rest))
    kernels = adapt_kernels(binding, Deformation(mapping(rest), left @ right))
    fine = sampled_anew(splats)
    views = views_round(mapping(rest))
    truth = pictures(mapped(fine, mapping), views)
    at_rest = psnr(pictures(fine, views_round(rest)), pictures(splats, views_round(rest)))
    posed = adapted_splats(splats, kernels)
    for limit in (0.0, *LIMITS):
        repair = repaired(posed, kernels, limit) if limit else None
        shown = pictures(posed if repair is None else repair.splats, views)
        told = {
            "scene": name,
            "limit": limit,
            "psnr": round(psnr(shown, truth), 2),
            "splats": splats.n_splats,
            "split": 0 if repair is None else repair.n_split,
            "new": 0 if repair is None else len(repair.copied),
            "truth_at_rest": round(at_rest, 2),
        }
        print(json.dumps(told), flush=True)
        if folder is not None:
            Image.fromarray((shown[1] * 255).astype(np.uint8)).save(folder / f"{name}_{limit:g}.png")
    if folder is not None:
        Image.fromarray((truth[1] * 255).astype(np.uint8)).save(folder / f"{name}_truth.png")


def main() -> None:
    """Compare the sheet and, where there is a capture, its neck."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--capture", type=Path, help="guitar.ply")
    parser.add_argument("--pictures", type=Path, help="keep a picture of each")
    options = parser.parse_args()
    bench("sheet", textured_sheet(), drawn_out(2.0), options.pictures)
    bench("flat sheet", textured_sheet(seed=1), drawn_out(1e4), options.pictures)
    if options.capture is not None:
        bench("neck", neck_of(options.capture), drawn_out(2.0), options.pictures)


if __name__ == "__main__":
    main()
