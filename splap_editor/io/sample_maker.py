"""Splats laid on a known surface: samples to open, and ground truth for the tests and the benchmark.

``python -m splap_editor.io.sample_maker bench -o bench.ply --splats 25000 --regime trained`` writes one sample;
``--bundled FOLDER`` writes the small ones that travel with the program.
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.splats.splats import Splats
from splap_editor.io.sample_placement import even_points, fitted_axes, random_points, random_tangents, tilted_normals
from splap_editor.io.sample_shapes import SHAPES, Surface

_SH0 = 0.28209479177387814


@dataclass(frozen=True)
class SplatStyle:
    """How splats lie on their surface; the defaults cover it thinly and cleanly.

    Parameters
    ----------
    coverage : float
        How many times the two-sigma ellipses would cover the surface before any is trimmed.
    jitter : float
        Share of splats placed fully at random, 0 to 1; the others keep their distance.
    aspect : float
        Median ratio of the larger to the smaller scale, at least 1.
    size_spread, aspect_spread : float
        Standard deviation of the logarithm of size and of aspect.
    overhang : float
        How far the rim of an occupancy ellipse may stand in the air: standard deviation of a
        half-normal, in world units. Longer axes are shortened, as training does at borders and
        where the surface curves; inf trims nothing.
    tilt : float
        Median angle between splat and surface normal, in degrees.
    depth : float
        Median distance of a centre below the surface, world units. Ignored for open sheets.
    opacities : tuple of float
        5th, 50th and 95th percentile.
    sh_degree : int
        Degree of the colour coefficients, 0 to 3.
    thickness, thickness_spread : float
        Median ratio of the smallest to the middle scale, at most 1, and standard deviation of its logarithm; 0 makes
        splats of two scales.
    haze, haze_reach : float
        Share of the splats that are haze: faint, turned any way, standing off the surface by a half-normal of this
        standard deviation in world units, on both sides of a sheet.
    haze_opacities : tuple of float
        Between these the opacities of haze lie, evenly in their logarithm.
    floaters : float
        Share of the splats that float about the object, within twice its size.
    """

    coverage: float = 2.0
    jitter: float = 0.3
    aspect: float = 1.5
    size_spread: float = 0.25
    aspect_spread: float = 0.25
    overhang: float = 0.012
    tilt: float = 3.0
    depth: float = 0.0
    opacities: tuple[float, float, float] = (0.8, 0.97, 0.999)
    sh_degree: int = 1
    thickness: float = 0.0
    thickness_spread: float = 0.9
    haze: float = 0.0
    haze_reach: float = 0.03
    haze_opacities: tuple[float, float] = (0.006, 0.1)
    floaters: float = 0.0

    def __post_init__(self) -> None:
        if not 0 <= self.jitter <= 1:
            raise ValueError(f"jitter must lie between 0 and 1, got {self.jitter}")
        if self.coverage <= 0 or self.overhang < 0 or self.aspect < 1:
            raise ValueError("coverage must be positive, overhang at least 0 and aspect at least 1")
        if not 0 < self.opacities[0] <= self.opacities[1] <= self.opacities[2] < 1:
            raise ValueError(f"opacities must rise strictly between 0 and 1, got {self.opacities}")
        if not 0 <= self.thickness <= 1:
            raise ValueError(f"thickness must lie between 0 and 1, got {self.thickness}")
        if self.haze < 0 or self.floaters < 0 or self.haze + self.floaters >= 1:
            raise ValueError(
                f"haze and floaters must leave some splats on the surface, got {self.haze}, {self.floaters}"
            )
        if not 0 <= self.sh_degree <= 3:
            raise ValueError(f"sh_degree must be 0 to 3, got {self.sh_degree}")


THIN = SplatStyle()
"""One clean layer of nearly opaque splats."""

TRAINED = SplatStyle(
    coverage=18.0,
    jitter=0.8,
    aspect=3.0,
    size_spread=0.5,
    aspect_spread=0.65,
    overhang=0.018,
    tilt=18.0,
    depth=0.010,
    opacities=(0.10, 0.60, 0.99),
)
"""Many half-transparent, tilted, sunken layers: what training leaves behind, by the figures of trained 2DGS objects."""

HAZE = SplatStyle(
    coverage=9.0,
    jitter=0.8,
    aspect=2.4,
    size_spread=0.55,
    aspect_spread=0.7,
    overhang=0.02,
    tilt=18.0,
    depth=0.006,
    opacities=(0.13, 0.6, 0.99),
    thickness=0.2,
    haze=0.3,
    floaters=0.01,
)
"""Ordinary 3D Gaussian Splatting: thick splats and needles, a third of them fainter than 0.1 and off the surface."""

STYLES = {"thin": THIN, "trained": TRAINED, "haze": HAZE}


@dataclass(frozen=True, eq=False)
class Sample:
    """Splats, and the surface they were laid on.

    Parameters
    ----------
    splats : Splats
        float32, in no spatial order.
    surface : Surface
        The ground truth.
    faces : (N,) int64
        Face of the surface each splat was laid on; of haze, the one that it stands over; of floaters, any.
    """

    splats: Splats
    surface: Surface
    faces: NDArray[np.int64]


def surface_splats(surface: Surface, n_splats: int, style: SplatStyle = THIN, *, seed: int = 0) -> Sample:
    """Lay splats on a surface.

    Parameters
    ----------
    surface : Surface
        What to cover; needs area.
    n_splats : int
        Number of splats N, at least 1.
    style : SplatStyle
        How they lie.
    seed : int
        The same arguments give the same splats.

    Returns
    -------
    Sample
        Random normal signs, quaternion lengths from 0.4 to 9 and a shuffled order, as trained files have them.
    """
    if n_splats < 1:
        raise ValueError(f"n_splats must be at least 1, got {n_splats}")
    if not surface.areas.sum() > 0:
        raise ValueError("a surface without area cannot be covered")
    rng = np.random.default_rng(seed)
    n_haze, n_floaters = round(style.haze * n_splats), round(style.floaters * n_splats)
    n_laid = max(n_splats - n_haze - n_floaters, 1)
    faces, points, scales, frames, logits = _laid(surface, n_laid, style, rng)
    if n_splats > n_laid:
        hazy = _haze(surface, n_haze, n_splats - n_laid - n_haze, style, rng)
        pairs = zip((faces, points, scales, frames, logits), hazy, strict=True)
        faces, points, scales, frames, logits = (np.concatenate(pair) for pair in pairs)
    if style.thickness > 0:
        ratios = np.minimum(style.thickness * np.exp(style.thickness_spread * rng.standard_normal(n_splats)), 1.0)
        scales = np.column_stack([scales, ratios * scales.min(axis=1)])
    order = rng.permutation(n_splats)
    splats = _splats(points[order], scales[order], frames[order], logits[order], style.sh_degree, rng)
    return Sample(splats, surface, faces[order])


_Laid = tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
"""Faces, centres, two scales, frames and logits of opacity."""


def _laid(surface: Surface, n_splats: int, style: SplatStyle, rng: np.random.Generator) -> _Laid:
    """Splats that cover the surface."""
    faces, points = even_points(surface, n_splats, style.jitter, rng)
    normals = surface.normals[faces]
    if surface.closed and style.depth > 0:
        # The median of |Gaussian| is 0.674 sigma.
        points = points - normals * (style.depth / 0.674 * abs(rng.standard_normal(n_splats)))[:, None]
    normals = tilted_normals(normals, style.tilt, rng)
    logits = _logits(n_splats, style, rng)
    scales = _scales(surface.areas.sum() / n_splats, style, rng, n_splats)
    # Where contributions fall below 1/255 an ellipse ends for the eye: that is what training trims.
    cutoffs = np.sqrt(2 * np.maximum(np.log(255) - np.log1p(np.exp(-logits)), 0.1))[:, None]
    axes, reaches = fitted_axes(surface, points, normals, cutoffs * scales, style.overhang, rng)
    scales = reaches / cutoffs
    return faces, points, scales, np.stack([axes, np.cross(normals, axes), normals], 2), logits


def _haze(surface: Surface, n_haze: int, n_floaters: int, style: SplatStyle, rng: np.random.Generator) -> _Laid:
    """Faint splats off the surface, and some that float far from it."""
    n = n_haze + n_floaters
    faces, points = random_points(surface, n, rng)
    heights = style.haze_reach * abs(rng.standard_normal(n))
    if not surface.closed:
        heights *= np.where(rng.random(n) < 0.5, -1, 1)
    points = points + heights[:, None] * surface.normals[faces]
    size = float(np.ptp(surface.vertices, axis=0).max())
    middle = 0.5 * (surface.vertices.min(axis=0) + surface.vertices.max(axis=0))
    points[n_haze:] = middle + size * rng.uniform(-1, 1, (n_floaters, 3))
    scales = _scales(surface.areas.sum() / n, style, rng, n)
    normals = rng.standard_normal((n, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    axes = random_tangents(normals, rng)
    low, high = np.log(style.haze_opacities)
    opacities = np.exp(rng.uniform(low, high, n))
    logits = np.log(opacities) - np.log1p(-opacities)
    return faces, points, scales, np.stack([axes, np.cross(normals, axes), normals], 2), logits


def shape_sample(name: str, n_splats: int, style: SplatStyle = THIN, *, seed: int = 0) -> Sample:
    """Lay splats on the shape called ``name``."""
    if name not in SHAPES:
        raise ValueError(f"no shape is called {name!r}; there are {', '.join(SHAPES)}")
    return surface_splats(SHAPES[name](), n_splats, style, seed=seed)


def line_splats(n_splats: int) -> Splats:
    """Round splats in a row along x: a scene without any surface."""
    x = np.linspace(-1.3, 1.3, n_splats)
    means = np.stack([x, np.zeros(n_splats), np.zeros(n_splats)], 1)
    scales = np.full((n_splats, 2), 0.5 * 2.6 / max(n_splats, 2))
    frames = np.tile(np.eye(3), (n_splats, 1, 1))
    return _splats(means, scales, frames, np.full(n_splats, 5.0), 0, np.random.default_rng(0))


def big_scene(n_splats: int, *, coverage: float = 3.0, sh_degree: int = 3, seed: int = 0) -> Splats:
    """Lay many splats quickly on a bumpy ball above a rippled floor with a second sheet close to it, shuffled.

    Parameters
    ----------
    n_splats : int
        25,000 to some millions; a million takes seconds.
    coverage : float
        How many times the two-sigma ellipses cover the surfaces.
    sh_degree : int
        Degree of the colour coefficients, 0 to 3.
    seed : int
        The same arguments give the same splats.
    """
    rng = np.random.default_rng(seed)
    n_ball = n_splats // 2
    n_sheets = n_splats - n_ball
    directions = rng.standard_normal((n_ball, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    x, y, z = directions.T
    radii = 0.6 * (1 + 0.12 * np.sin(7 * x) * np.sin(6 * y) + 0.08 * np.cos(9 * z))
    ball = directions * radii[:, None] + [0, 0, 0.55]
    flat = rng.uniform(-1.3, 1.3, (n_sheets, 2))
    gap = np.where(rng.random(n_sheets) < 0.5, 0.0, -0.06)
    wave = 0.06
    heights = -0.5 + gap + wave * np.sin(4 * flat[:, 0]) * np.sin(3 * flat[:, 1])
    slopes = np.stack([
        -4 * wave * np.cos(4 * flat[:, 0]) * np.sin(3 * flat[:, 1]),
        -3 * wave * np.sin(4 * flat[:, 0]) * np.cos(3 * flat[:, 1]),
        np.ones(n_sheets),
    ], 1)  # fmt: skip
    means = np.concatenate([ball, np.column_stack([flat, heights])])
    normals = np.concatenate([directions, slopes / np.linalg.norm(slopes, axis=1, keepdims=True)])
    areas = np.concatenate([np.full(n_ball, 4 * np.pi * 0.38 / n_ball), np.full(n_sheets, 2 * 2.6**2 / n_sheets)])
    style = SplatStyle(coverage=coverage, tilt=4.0, opacities=(0.3, 0.9, 0.99))
    normals = tilted_normals(normals, style.tilt, rng)
    axes = random_tangents(normals, rng)
    frames = np.stack([axes, np.cross(normals, axes), normals], 2)
    scales = _scales(areas, style, rng, n_splats)
    logits = _logits(n_splats, style, rng)
    order = rng.permutation(n_splats)
    return _splats(means[order], scales[order], frames[order], logits[order], sh_degree, rng)


def write_sample(path: Path | str, splats: Splats) -> None:
    """Write splats as a fresh binary PLY in the 2DGS layout, as 2D Gaussian Splatting names and orders its columns."""
    n_rest = splats.shN.shape[1]
    columns = {
        "x y z": splats.means,
        "nx ny nz": np.zeros((splats.n_splats, 3)),
        "f_dc_0 f_dc_1 f_dc_2": splats.sh0,
        # Channel-major: all coefficients of red, then green, then blue.
        " ".join(f"f_rest_{k}" for k in range(3 * n_rest)): splats.shN.transpose(0, 2, 1).reshape(
            splats.n_splats, 3 * n_rest
        ),
        "opacity": splats.logit_opacities[:, None],
        " ".join(f"scale_{k}" for k in range(splats.n_scales)): splats.log_scales,
        "rot_0 rot_1 rot_2 rot_3": splats.quats,
    }
    names = " ".join(columns).split()
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {splats.n_splats}"]
    header += [*(f"property float {name}" for name in names), "end_header", ""]
    table = np.concatenate(list(columns.values()), axis=1).astype("<f4")
    Path(path).write_bytes("\n".join(header).encode("ascii") + table.tobytes())


def _quats(frames: NDArray[np.float64]) -> NDArray[np.float64]:
    """Quaternions w, x, y, z of right-handed frames, from the best conditioned of the four squares."""
    m = frames
    diagonal = np.einsum("nii->ni", m)
    squares = np.column_stack([1 + diagonal.sum(1), 1 + 2 * diagonal - diagonal.sum(1, keepdims=True)])
    x, y, z = m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1]
    xy, xz, yz = m[:, 0, 1] + m[:, 1, 0], m[:, 0, 2] + m[:, 2, 0], m[:, 1, 2] + m[:, 2, 1]
    rows = np.array([
        [squares[:, 0], x, y, z],
        [x, squares[:, 1], xy, xz],
        [y, xy, squares[:, 2], yz],
        [z, xz, yz, squares[:, 3]],
    ])  # fmt: skip
    quats = rows[np.argmax(squares, axis=1), :, np.arange(len(m))]
    return quats / np.linalg.norm(quats, axis=1, keepdims=True)


def _logits(n_splats: int, style: SplatStyle, rng: np.random.Generator) -> NDArray[np.float64]:
    """Logits of opacities with the style's percentiles."""
    low, middle, high = np.log(np.array(style.opacities)) - np.log1p(-np.array(style.opacities))
    normal = rng.standard_normal(n_splats)
    # 5 % and 95 % lie 1.645 standard deviations from the median; each side has its own.
    return middle + normal * np.where(normal < 0, middle - low, high - middle) / 1.645


def _scales(
    areas: NDArray[np.float64] | float, style: SplatStyle, rng: np.random.Generator, n_splats: int
) -> NDArray[np.float64]:
    """(N, 2) standard deviations of splats that have ``areas`` of surface each to cover."""
    sizes = np.sqrt(areas * style.coverage / 4 / np.pi)
    # The square of a log-normal has its mean at twice the variance: take that off to keep the coverage.
    sizes = sizes * np.exp(style.size_spread * rng.standard_normal(n_splats) - style.size_spread**2)
    aspects = np.maximum(1.0, style.aspect * np.exp(style.aspect_spread * rng.standard_normal(n_splats)))
    return np.stack([sizes * np.sqrt(aspects), sizes / np.sqrt(aspects)], 1)


def _splats(
    means: NDArray[np.float64],
    scales: NDArray[np.float64],
    frames: NDArray[np.float64],
    logits: NDArray[np.float64],
    sh_degree: int,
    rng: np.random.Generator,
) -> Splats:
    """Stored columns in float32: logarithms, unnormalised quaternions, a checked and banded colour."""
    n = len(means)
    lengths = np.exp(rng.uniform(np.log(0.4), np.log(9.0), n))[:, None] * np.where(rng.random(n) < 0.5, -1, 1)[:, None]
    checks = (np.floor(4 * means + 0.01).sum(1) % 2)[:, None]
    bands = 0.5 + 0.5 * np.sin(2.4 * means[:, [2, 0, 1]] + [0.0, 2.1, 4.2])
    colors = np.clip(0.2 + 0.5 * bands + 0.16 * checks + 0.03 * rng.standard_normal((n, 3)), 0, 1)
    n_rest = (sh_degree + 1) ** 2 - 1
    return Splats(
        means=means.astype(np.float32),
        log_scales=np.log(scales).astype(np.float32),
        quats=(_quats(frames) * lengths).astype(np.float32),
        logit_opacities=logits.astype(np.float32),
        sh0=((colors - 0.5) / _SH0).astype(np.float32),
        shN=(0.05 * rng.standard_normal((n, n_rest, 3), dtype=np.float32)),
    )


def _arguments(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description="Lay splats on a procedural shape and write them as a PLY.")
    parser.add_argument("shape", nargs="?", choices=sorted(SHAPES), help="shape to cover")
    parser.add_argument("-o", "--output", type=Path, help="PLY to write")
    parser.add_argument("--splats", type=int, default=10_000, help="number of splats (10000)")
    parser.add_argument("--regime", choices=sorted(STYLES), default="thin", help="how they lie on the surface (thin)")
    parser.add_argument("--seed", type=int, default=0, help="random seed (0)")
    for name in (
        "coverage",
        "jitter",
        "aspect",
        "size_spread",
        "overhang",
        "tilt",
        "depth",
        "thickness",
        "haze",
        "floaters",
    ):
        option = "--" + name.replace("_", "-")
        parser.add_argument(option, type=float, help=f"{name.replace('_', ' ')}, in place of the regime's")
    parser.add_argument("--bundled", type=Path, metavar="FOLDER", help="write the samples that travel with the program")
    parsed = parser.parse_args(arguments)
    if parsed.bundled is None and (parsed.shape is None or parsed.output is None):
        parser.error("give a shape and -o OUT.ply, or --bundled FOLDER")
    return parsed


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the sample the command line asks for."""
    options = _arguments(arguments)
    if options.bundled is not None:
        for name, n_splats in (("tube", 2500), ("coil", 6000)):
            style = replace(THIN, sh_degree=0)
            write_sample(options.bundled / f"{name}.ply", shape_sample(name, n_splats, style).splats)
        return
    style = STYLES[options.regime]
    own = {name: value for name, value in vars(options).items() if name in vars(style) and value is not None}
    sample = shape_sample(options.shape, options.splats, replace(style, **own), seed=options.seed)
    write_sample(options.output, sample.splats)


if __name__ == "__main__":
    main()
