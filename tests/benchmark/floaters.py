"""Benchmark of the floater finder: precision and recall on scenes whose floaters are known.

::

    python -m tests.benchmark.floaters                       # objects, kinds and seeds that nothing was fitted on
    python -m tests.benchmark.floaters --captures FOLDER     # the captures of a folder among them, and as they are
    python -m tests.benchmark.floaters --many                # by pictures as of more than 200,000 splats
    python -m tests.benchmark.floaters --large 260000        # scenes that truly have that many
    python -m tests.benchmark.floaters --fit                 # print the numbers of core/splats/floater_weights.py
"""

import argparse
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from splap_editor.core.splats import contributions
from splap_editor.core.splats.floater_evidence import EVIDENCE, floater_evidence
from splap_editor.core.splats.floaters import Floaters, floaters
from splap_editor.core.splats.main_subject import main_subject
from splap_editor.core.splats.occupancy import Ellipses, occupancy_ellipses
from splap_editor.core.splats.splats import Splats
from splap_editor.io.ply import read_ply
from splap_editor.io.sample_maker import STYLES, shape_sample, surface_splats
from splap_editor.resources import resource
from tests.benchmark.floater_scenes import KINDS
from tests.benchmark.paper_objects import made_object

STRENGTH = 0.5

CAUTION = 1.5
"""How much surer than even it must be that a splat floats (logit): losing a part is worse than leaving some haze."""

FITTED = (
    "bench_2dgs",
    *("bench thin", "bench trained", "birdcage trained", "cheese thin", "book trained", "figure thin"),
    *("figure trained", "folded_sheet thin", "comb trained", "coil thin", "slats trained"),
)
HELD_OUT = (
    *("windmill_2dgs", "tube", "coil", "two_sheets trained", "harp thin", "ferris wheel trained", "fence thin"),
    *("headphone trained", "basket trained", "bed thin"),
)
"""Objects, no shape in both: bundled samples by their file, made ones by shape or category and style."""

_CATEGORIES = ("harp", "ferris wheel", "fence", "headphone", "basket", "bed")
_FIRST_SEED = {FITTED: 100, HELD_OUT: 900}
_LARGE_SEED = 1900


def with_floaters(splats: Splats, seed: int) -> tuple[Splats, NDArray[np.bool_]]:
    """Add haze, clumps and far specks to a clean scene; also says which splats they are, inert ones left out."""
    rng = np.random.default_rng(seed)
    means = np.asarray(splats.means, np.float64)
    subject = main_subject(means, splats.opacities)
    s, usual = subject.size, np.median(np.asarray(splats.log_scales, np.float64)[:, :2])
    n = splats.n_splats
    haze = int(rng.uniform(0.01, 0.06) * n)
    specks = int(rng.uniform(0.005, 0.03) * n)
    places = [_off(rng, means, subject, haze, 1.3, 0.04 * s), _off(rng, means, subject, specks, 4.0, 0.15 * s)]
    sizes = [usual + rng.uniform(0.5, 3.2, haze), usual + rng.normal(0.5, 0.8, specks)]
    logits = [
        _logit(rng.uniform(0.02, 0.9, haze) ** rng.uniform(1.0, 3.0, haze)),
        _logit(rng.uniform(0.05, 0.95, specks)),
    ]
    for _ in range(int(rng.integers(3, 9))):
        k = int(rng.integers(6, max(7, n // 150)))
        middle = _off(rng, means, subject, 1, 1.8, 0.1 * s)
        places.append(middle + rng.normal(0.0, rng.uniform(0.005, 0.025) * s, (k, 3)))
        sizes.append(usual + rng.normal(0.0, 0.5, k))
        logits.append(_logit(rng.uniform(0.1, 0.98, k)))
    added = np.concatenate(places)
    rows = rng.choice(n, len(added))
    log_scales = np.concatenate(sizes)[:, None] + rng.normal(0.0, 0.4, (len(added), splats.n_scales))
    quats = rng.normal(size=(len(added), 4))
    grown = {"means": added, "log_scales": log_scales, "quats": quats, "logit_opacities": np.concatenate(logits)}
    parts = {name: np.concatenate([np.asarray(getattr(splats, name)), part]) for name, part in grown.items()}
    parts |= {
        name: np.concatenate([(held := np.asarray(getattr(splats, name))), held[rows]]) for name in ("sh0", "shN")
    }
    if splats.thresholds is not None:
        parts["thresholds"] = np.concatenate([np.asarray(splats.thresholds), np.zeros(len(added))])
    return replace(splats, **parts), np.arange(n + len(added)) >= n


def _off(rng, means, subject, n, reach, least):
    """(n, 3) places about the subject, none of them nearer to it than ``least``."""
    from scipy.spatial import cKDTree

    tree, found = cKDTree(means), np.empty((0, 3))
    while len(found) < n:
        tried = subject.center + rng.uniform(-reach, reach, (4 * n + 8, 3)) @ subject.half_axes
        tried += rng.normal(0.0, 0.1 * (reach - 1.0) * subject.size, tried.shape)
        found = np.concatenate([found, tried[tree.query(tried)[0] > least]])
    return found[:n]


def _logit(opacity):
    return np.log(opacity / (1.0 - opacity))


def found_in(splats: Splats) -> tuple[Ellipses, Floaters]:
    """Floaters of a scene."""
    ellipses = occupancy_ellipses(splats)
    return ellipses, floaters(splats, ellipses)


def clean_object(name: str) -> Splats:
    """An object without floaters, but for a trained one's own haze."""
    if name.endswith("_2dgs") or " " not in name:
        return read_ply(resource("samples", f"{name}.ply")).splats
    shape, style = name.rsplit(" ", 1)
    if shape in _CATEGORIES:
        return surface_splats(made_object(shape, 5).surface, 9000, STYLES[style], seed=5).splats
    return shape_sample(shape, 9000 if style == "thin" else 12_000, STYLES[style], seed=3).splats


def made_scenes(names: tuple[str, ...], folder: Path | None) -> Iterator[tuple[str, str, Splats, NDArray[np.bool_]]]:
    """Each object in each kind of scene, with floaters of its own."""
    objects = {name: clean_object(name) for name in names}
    for path in sorted(folder.glob("*_3dgs.ply")) if folder is not None else ():
        objects[path.stem] = read_ply(path).splats
    for number, (name, clean) in enumerate(objects.items()):
        for place, (kind, made) in enumerate(KINDS.items()):
            seed = _FIRST_SEED[names] + 2 * (17 * number + place)
            yield name, kind, *with_floaters(made(clean, np.random.default_rng(seed)), seed)


def large_scenes(n: int) -> Iterator[tuple[str, str, Splats, NDArray[np.bool_]]]:
    """An object that nothing was fitted on of n splats, in two kinds of scene."""
    clean = surface_splats(made_object("bed", 5).surface, n, STYLES["trained"], seed=5).splats
    for kind in ("even", "thin bars"):
        made = KINDS[kind](clean, np.random.default_rng(_LARGE_SEED))
        yield f"bed trained of {n:,}", kind, *with_floaters(made, _LARGE_SEED)


def fitted_model(scenes: list[tuple[NDArray[np.float64], NDArray[np.bool_]]]) -> tuple[NDArray[np.float64], ...]:
    """Centres, spreads and weights of the logistic model: every scene counts alike, its floaters for a quarter."""
    rng = np.random.default_rng(3)
    parts = []
    for evidence, truth in scenes:
        for is_floater, share, most in ((False, 0.75, 533), (True, 0.25, 266)):
            rows = np.flatnonzero(truth == is_floater)
            rows = rng.choice(rows, min(len(rows), most), replace=False)
            parts.append((evidence[rows], truth[rows], np.full(len(rows), share / len(rows))))
    x, truth, weight = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    weight /= weight.sum()
    centers = weight @ x
    spreads = np.sqrt(weight @ (x - centers) ** 2) + 1e-6
    standard = np.clip((x - centers) / spreads, -3.0, 3.0)
    i, j = np.triu_indices(x.shape[1])
    terms, sign = np.column_stack([np.ones(len(x)), standard, standard[:, i] * standard[:, j]]), 2.0 * truth - 1.0

    def loss(w):
        margin = sign * (terms @ w)
        slope = -weight * sign * np.exp(-np.logaddexp(0.0, margin))
        penalized = np.concatenate([[0.0], w[1:]])
        return weight @ np.logaddexp(0.0, -margin) + 1e-4 * w @ penalized, terms.T @ slope + 2e-4 * penalized

    start = np.zeros(terms.shape[1])
    w = minimize(loss, start, jac=True, method="L-BFGS-B", options={"maxiter": 300}).x
    w[0] -= CAUTION
    return centers, spreads, w


def main() -> None:
    """Print a line for each scene, or the fitted model."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--fit", action="store_true", help="fit the model on the objects for it")
    parser.add_argument("--captures", type=Path, metavar="FOLDER", help="captures to find floaters in as they are")
    parser.add_argument("--many", action="store_true", help="look at each scene as at one of very many splats")
    parser.add_argument("--large", type=int, metavar="N", help="scenes of so many splats instead")
    options = parser.parse_args()
    if options.many:
        contributions.MANY = 0
    if options.fit:
        known_of = []
        for _, _, splats, is_floater in made_scenes(FITTED, None):
            ellipses = occupancy_ellipses(splats)
            known_of.append((floater_evidence(splats, ellipses)[0], is_floater[ellipses.rows]))
        _tell_model(*fitted_model(known_of))
        return
    known = defaultdict(list)
    scenes = large_scenes(options.large) if options.large else made_scenes(HELD_OUT, options.captures)
    for name, kind, splats, is_floater in scenes:
        ellipses, made = found_in(splats)
        found, truth = made.at(STRENGTH), is_floater[ellipses.rows]
        hits = (found & truth).sum()
        told = hits / max(found.sum(), 1), hits / truth.sum(), (found & ~truth).sum() / (~truth).sum()
        _tell(f"{name}, {kind}", [told])
        known[kind].append(told)
    for kind, told in known.items():
        _tell(kind, told)
    _tell("all", [one for told in known.values() for one in told])
    for path in sorted(options.captures.glob("*.ply")) if options.captures is not None else []:
        splats = read_ply(path).splats
        ellipses, made = found_in(splats)
        removed = np.zeros(splats.n_splats, bool)
        removed[ellipses.rows[made.at(STRENGTH)]] = True
        sizes = ellipses.scene_scale, occupancy_ellipses(splats, removed=removed).scene_scale
        share = 100 * made.at(STRENGTH).mean()
        print(f"{path.name}: {share:.1f} % of {len(ellipses.rows)}; size {sizes[0]:.3g} → {sizes[1]:.3g}")


def _tell(name: str, told: list[tuple[float, float, float]]) -> None:
    precision, recall, lost = np.array(told).T
    print(
        f"{name}: {len(told)} scenes, precision {precision.mean():.3f} (worst {precision.min():.3f}), recall "
        f"{recall.mean():.3f} ({recall.min():.3f}), of the object {100 * lost.mean():.2f} % ({100 * lost.max():.1f} %)",
        flush=True,
    )


def _tell_model(*model: NDArray[np.float64]) -> None:
    """Print the module of weights, ready for `ruff format`."""
    assert len(model[0]) == len(EVIDENCE)
    for name, values in zip(("CENTERS", "SPREADS", "WEIGHTS"), model, strict=True):
        print(f"{name} = (" + ", ".join(f"{value:.3f}" for value in values) + ")")


if __name__ == "__main__":
    main()
