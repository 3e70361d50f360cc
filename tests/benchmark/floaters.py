"""Benchmark of the floater finder: precision and recall on scenes whose floaters are known.

::

    python -m tests.benchmark.floaters                       # bundled samples with made floaters
    python -m tests.benchmark.floaters --captures FOLDER     # and on every PLY of a folder
    python -m tests.benchmark.floaters --fit                 # print the model's weights, fitted on half of the scenes
"""

import argparse
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from splap_editor.core.graph.options import GraphOptions
from splap_editor.core.graph.splat_graph import splat_graph
from splap_editor.core.splats.contributions import contributions
from splap_editor.core.splats.floaters import Floaters, floaters, model_terms
from splap_editor.core.splats.main_subject import main_subject
from splap_editor.core.splats.occupancy import Ellipses, occupancy_ellipses
from splap_editor.core.splats.splats import Splats
from splap_editor.io.ply import read_ply
from splap_editor.resources import resource

SAMPLES = ("bench_2dgs", "windmill_2dgs", "tube", "coil")
STRENGTH = 0.5
FITTED, HELD_OUT = (0, 1), (2, 3, 7, 11, 12, 13)
"""Seeds of the floaters; odd ones have one half of the object nine times sparser than the other."""


def with_floaters(splats: Splats, seed: int) -> tuple[Splats, NDArray[np.bool_]]:
    """Add haze, clumps and far specks to a clean scene; also says which splats they are, inert ones left out."""
    rng = np.random.default_rng(seed)
    if seed % 2:
        splats = with_sparse_half(splats, rng)
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


def with_sparse_half(splats: Splats, rng: np.random.Generator) -> Splats:
    """A scene one half of which has a ninth of its splats, three times as large: captures are not equally dense."""
    means = np.asarray(splats.means, np.float64)
    side = (means - np.median(means, axis=0)) @ rng.normal(size=3) > 0.0
    kept = ~side | (rng.random(len(means)) < 1.0 / 9.0)
    log_scales = np.asarray(splats.log_scales, np.float64) + np.log(3.0) * side[:, None]
    return replace(splats, log_scales=log_scales).at(kept)


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


def found_in(splats: Splats) -> tuple[Ellipses, Floaters, float]:
    """Floaters of a scene, and the seconds that finding them took once there is a graph."""
    ellipses = occupancy_ellipses(splats)
    graph = splat_graph(ellipses, GraphOptions())
    start = perf_counter()
    made = floaters(splats, ellipses, graph.matrix(), contributions(splats, ellipses))
    return ellipses, made, perf_counter() - start


def made_scenes(folder: Path | None) -> Iterator[tuple[str, int, Splats, NDArray[np.bool_]]]:
    """Objects, thin and trained, with each seed's floaters."""
    paths = [resource("samples", f"{name}.ply") for name in SAMPLES]
    if folder is not None:
        paths += sorted(folder.glob("*_3dgs.ply"))
    for path in paths:
        clean = read_ply(path).splats
        for seed in (*FITTED, *HELD_OUT):
            yield path.stem, seed, *with_floaters(clean, seed)


def fitted(evidence: NDArray[np.float64], is_floater: NDArray[np.bool_], weight: NDArray[np.float64]):
    """Weights of the logistic model, with a small penalty on their squares."""
    terms, sign = model_terms(evidence), np.where(is_floater, 1.0, -1.0)

    def loss(w):
        margin = sign * (terms @ w)
        lost = np.logaddexp(0.0, -margin)
        slope = -weight * sign * np.exp(-np.logaddexp(0.0, margin))
        total = weight.sum()
        return weight @ lost / total + 1e-4 * w @ w, terms.T @ slope / total + 2e-4 * w

    return minimize(loss, np.zeros(terms.shape[1]), jac=True, method="L-BFGS-B", options={"maxiter": 500}).x


def main() -> None:
    """Print a line for each scene."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--fit", action="store_true", help="fit the model on the seeds for it")
    parser.add_argument("--captures", type=Path, metavar="FOLDER", help="captures to find floaters in as they are")
    options = parser.parse_args()
    known = []
    for name, seed, splats, is_floater in made_scenes(options.captures):
        ellipses, made, seconds = found_in(splats)
        truth = is_floater[ellipses.rows]
        known.append((name, seed, made, truth))
        _tell(f"{name} {seed}", made.at(STRENGTH), truth, seconds)
    _tell_means(known)
    if options.fit:
        pairs = [(made.evidence, truth) for _, seed, made, truth in known if seed in FITTED]
        # Every scene counts alike, and so do its floaters and what is none.
        weight = np.concatenate([np.where(t, 0.2 / t.sum(), 0.8 / (~t).sum()) for _, t in pairs])
        w = fitted(np.concatenate([e for e, _ in pairs]), np.concatenate([t for _, t in pairs]), weight)
        print("WEIGHTS = (" + ", ".join(f"{value:.3f}" for value in w) + ")")
        for name, seed, made, truth in known:
            _tell(f"fitted {name} {seed}", model_terms(made.evidence) @ w > 0.0, truth, 0.0)
    for path in sorted(options.captures.glob("*.ply")) if options.captures is not None else []:
        splats = read_ply(path).splats
        ellipses, made, seconds = found_in(splats)
        left = np.ones(splats.n_splats, bool)
        left[ellipses.rows[made.at(STRENGTH)]] = False
        cleaned = occupancy_ellipses(splats, removed=~left)
        share = 100 * made.at(STRENGTH).mean()
        sizes = f"size {ellipses.scene_scale:.3g} → {cleaned.scene_scale:.3g}"
        print(f"{path.name}: {share:.1f} % of {len(ellipses.rows)}; {sizes}; {seconds:.2f} s")


def _tell_means(known: list[tuple[str, int, Floaters, NDArray[np.bool_]]]) -> None:
    """Print means over what was not fitted, evenly dense objects and others apart."""
    for odd, words in ((0, "evenly dense"), (1, "one half sparser")):
        pairs = [(made.at(STRENGTH), truth) for _, seed, made, truth in known if seed in HELD_OUT and seed % 2 == odd]
        precisions = [(found & truth).sum() / max(found.sum(), 1) for found, truth in pairs]
        recalls = [(found & truth).sum() / truth.sum() for found, truth in pairs]
        print(
            f"held out, {words}: {len(pairs)} scenes, mean precision {np.mean(precisions):.3f}, recall "
            f"{np.mean(recalls):.3f}; worst {min(precisions):.3f}, {min(recalls):.3f}"
        )


def _tell(name: str, found: NDArray[np.bool_], truth: NDArray[np.bool_], seconds: float) -> None:
    hits = (found & truth).sum()
    print(
        f"{name}: precision {hits / max(found.sum(), 1):.3f}, recall {hits / truth.sum():.3f}, "
        f"{truth.sum()} of {len(truth)} float; {seconds:.2f} s",
        flush=True,
    )


if __name__ == "__main__":
    main()
