"""Benchmark of the check of a pose: precision and recall where contacts are known to be missing or wrong.

Objects of the paper's categories and shapes of the sample maker are pulled at ambiguous places, as they are, with
contacts taken out across the surface near the handle, and with contacts put in to what lies beside it and is far along
the true surface. A place that is told is right if it is at a contact that is wrong by the true surface, planted or not,
or between what is near along it; one that is planted counts as missed only if the pose shows it::

    python -m tests.benchmark.planted                     # objects and seeds that nothing was fitted on
    python -m tests.benchmark.planted --fit               # print the numbers of core/surface/tears.py and webs.py
    python -m tests.benchmark.planted --everyday FOLDER   # drags of everyday size on trained scenes: what is told
    python -m tests.benchmark.planted --captures FOLDER   # the same of NAME.ply with a NAME_truth.npz
    python -m tests.benchmark.planted --speed 20000 100000
"""

import argparse
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from time import perf_counter

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from splap_editor.core.graph.options import GraphOptions
from splap_editor.core.handle_nodes import Region
from splap_editor.core.pose import Pose
from splap_editor.core.splats.splats import Splats
from splap_editor.core.surface import tears, webs
from splap_editor.engine.bound_edit import Posed, bind
from splap_editor.engine.deformation_check import FlawPlace, deformation_check, posed_check, posed_surface
from splap_editor.engine.edit import Edit, Handle
from splap_editor.engine.surface import Surface, surface_of
from splap_editor.io.ply import read_ply
from splap_editor.io.sample_maker import STYLES, shape_sample, surface_splats
from tests.benchmark.fidelity import capture, held
from tests.benchmark.ground_truth import GroundTruth, Pull
from tests.benchmark.paper_objects import CATEGORIES, made_object

FITTED = (
    *(("bench", "thin", 1), ("coil", "trained", 1), ("headphone", "thin", 1), ("comb", "trained", 1)),
    *(("comb", "haze", 3), ("birdcage", "haze", 4), ("book", "thin", 3), ("bench", "haze", 5), ("coil", "thin", 6)),
)
HELD_OUT = (
    *(("fence", "thin", 7), ("bed", "trained", 8), ("basket", "thin", 9), ("ferris wheel", "trained", 7)),
    *(("figure", "haze", 7), ("harp", "haze", 7), ("windmill", "trained", 9)),
)
"""Object, style and seed; no object in both."""

SHOWN = 0.02
"""A planted contact is shown by a pose that it changes by so much, in units of s."""

NEAR = 0.03
"""A place that is told is at a planted one if it is no farther, in units of s."""

_SPLATS = (3500, 7000)

Known = tuple[NDArray[np.float64], NDArray[np.bool_]]
"""Evidence (m, e), and the true answer (m,)."""


@dataclass(frozen=True, eq=False)
class Case:
    """A pose of a scene, and what was planted in its surface.

    Parameters
    ----------
    kind : str
        ``"none"``, ``"tear"`` or ``"web"``.
    posed : Posed
    spots : list of (E, 2) int64
        Nodes of the contacts planted at each spot.
    rests : Posed
        The same handle with nothing planted.
    """

    kind: str
    posed: Posed
    rests: Posed
    spots: list[NDArray[np.int64]] = field(default_factory=list)

    @property
    def surface(self) -> Surface:
        """The planted surface, taken for what the rule made of the splats."""
        assert self.posed.surface is not None
        return self.posed.surface

    def shown(self, truth: GroundTruth) -> list[bool]:
        """Which spots the pose shows: their ends are elsewhere than without."""
        apart = [self._apart(self.posed), self._apart(self.rests)]
        more = [(a - b if self.kind == "tear" else b - a) / truth.size for a, b in zip(*apart, strict=True)]
        # One contact that comes off is no tear; one that holds is a web.
        least = 3 if self.kind == "tear" else 1
        return [len(gap) >= least and np.sort(gap)[-least] > SHOWN for gap in more]

    def _apart(self, posed: Posed) -> list[NDArray[np.float64]]:
        positions = posed.deformation.positions
        return [np.linalg.norm(positions[spot[:, 0]] - positions[spot[:, 1]], axis=1) for spot in self.spots]


class Planting:
    """A scene with a true surface, in which contacts can be planted."""

    def __init__(self, name: str, splats: Splats, truth: GroundTruth, seed: int = 0) -> None:
        self.name, self.rng = name, np.random.default_rng([seed, 5])
        self.splats, self.truth = splats, truth
        self.plain = surface_of(splats, GraphOptions())
        self.vertices = truth.vertices_of(self.plain.rest)
        self.seed = seed

    @classmethod
    def made(cls, name: str, style: str, seed: int) -> "Planting":
        """Lay splats on an object."""
        if name in CATEGORIES:
            made = made_object(name, seed)
            sample = surface_splats(made.surface, int(np.clip(made.n_splats(2.0), *_SPLATS)), STYLES[style], seed=seed)
        else:
            sample = shape_sample(name, _SPLATS[1], STYLES[style], seed=seed)
        return cls(f"{name} {style}", sample.splats, GroundTruth(sample.surface), seed)

    def cases(self, n_pulls: int) -> Iterator[Case]:
        """Pose the scene as it is, and with contacts planted; every other pull is half as far."""
        for k, pull in enumerate(self.truth.pulls(n_pulls, self.seed)):
            nodes = np.flatnonzero(np.isin(self.vertices, pull.handle))
            if not len(nodes):
                nodes = np.array([np.argmin(np.linalg.norm(self.plain.rest - pull.center, axis=1))])
            move = pull.move * (0.5 if k % 2 else 1.0)
            plain = _pulled(self.plain, nodes, move)
            yield Case("none", plain, plain)
            for kind, spots in (("tear", self.missing(pull)), ("web", self.wrong(pull))):
                if spots:
                    pairs = np.unique(np.sort(np.concatenate(spots), axis=1), axis=0)
                    rows = tuple(map(tuple, self.plain.ellipses.rows[pairs].tolist()))
                    mended = GraphOptions(cut=rows) if kind == "tear" else GraphOptions(add=rows)
                    yield Case(kind, self._posed(mended, nodes, move), plain, spots)

    def _posed(self, mended: GraphOptions, nodes: NDArray[np.int64], move: NDArray[np.float64]) -> Posed:
        # With "auto", haze that a mend names would carry.
        posed = _pulled(surface_of(self.splats, mended, near=self.plain), nodes, move)
        plain = GraphOptions()
        stages = posed.surface.stages._replace(options=plain, mends=plain)
        return replace(posed, surface=replace(posed.surface, options=plain, stages=stages))

    def missing(self, pull: Pull) -> list[NDArray[np.int64]]:
        """Graph edges to take out: those across the way from the handle, within some reach of a place near it."""
        size, edges, spots = self.truth.size, self.plain.graph.edges, []
        apart = dijkstra(self.truth.graph, indices=pull.handle, limit=0.5 * size, min_only=True)[self.vertices]
        ring = np.flatnonzero((apart > 0.04 * size) & (apart < 0.2 * size))
        for node in self.rng.choice(ring, min(2, len(ring)), replace=False):
            reach = self.rng.uniform(0.03, 0.12) * size
            inside = self.truth.distances(int(self.vertices[node]), limit=reach)[self.vertices] < np.inf
            before = apart < apart[node]
            spot = edges[inside[edges].all(axis=1) & (before[edges[:, 0]] != before[edges[:, 1]])]
            if len(spot) >= 3:
                spots.append(spot.astype(np.int64))
        return spots

    def wrong(self, pull: Pull) -> list[NDArray[np.int64]]:
        """Contacts to put in: bundles of one to eight, each to what is near in space and far along the surface."""
        rest, size, spots = self.plain.rest, self.truth.size, []
        places: list[NDArray[np.float64]] = []
        near_pull = np.flatnonzero(np.linalg.norm(rest - pull.center, axis=1) < 0.22 * size)
        for n_contacts in self.rng.permutation([1, 2, 4, 8]):
            for node in self.rng.choice(near_pull, min(25, len(near_pull)), replace=False):
                clear = all(np.linalg.norm(rest[node] - place) > 0.1 * size for place in places)
                spot = self._bundle(int(node), int(n_contacts)) if clear else None
                if spot is not None:
                    spots.append(spot)
                    places.append(rest[node])
                    break
        return spots

    def _bundle(self, node: int, n_contacts: int) -> NDArray[np.int64] | None:
        rest, size = self.plain.rest, self.truth.size
        tree = cKDTree(rest)
        apart = self.truth.distances(int(self.vertices[node]), limit=0.3 * size)[self.vertices]
        others = np.array(tree.query_ball_point(rest[node], 0.09 * size))
        others = others[np.isinf(apart[others])]
        own = np.array(tree.query(rest[node], 4 * n_contacts + 1)[1])
        own = own[apart[own] < 0.15 * size]
        if not len(others) or not len(own):
            return None
        steps = np.linalg.norm(rest[own][:, None] - rest[others][None], axis=2)
        best = np.argsort(steps, axis=None)[:n_contacts]
        a, b = np.unravel_index(best, steps.shape)
        return np.stack([own[a], others[b]], axis=1)

    # What is right ------------------------------------------------------------------------------------------------

    def is_right(self, case: Case, place: FlawPlace) -> bool:
        """Whether a place is what it is said to be, by the true surface."""
        node_of_row = self.plain.ellipses.node_of_row
        a, b = (node_of_row[rows] for rows in (place.a_rows, place.b_rows))
        if place.kind == "tear":
            pairs = np.stack([np.repeat(a, len(b)), np.tile(b, len(a))], axis=1)
            lengths = np.linalg.norm(self.plain.rest[pairs[:, 0]] - self.plain.rest[pairs[:, 1]], axis=1)
            pairs = pairs[np.argsort(lengths)[: len(a) + len(b)]]
            return bool(self.near(pairs, 2.0, 0.02).mean() > 0.5)
        graph = case.surface.graph
        about = graph.edges[np.isin(graph.edges, node_of_row[place.rows]).any(axis=1)]
        return bool((~self.near(about, 2.5, 0.04)).any())

    def near(self, pairs: NDArray[np.integer], ratio: float, more: float) -> NDArray[np.bool_]:
        """Which pairs of nodes are near along the true surface: at most so many times the straight way, and more s."""
        lengths = np.linalg.norm(self.plain.rest[pairs[:, 0]] - self.plain.rest[pairs[:, 1]], axis=1)
        ends = self.vertices[pairs].T
        return self.truth.are_near(ends[0], ends[1], ratio * lengths + more * self.truth.size)


def _pulled(surface: Surface, nodes: NDArray[np.int64], move: NDArray[np.float64]) -> Posed:
    ellipses = surface.ellipses
    region = Region(ellipses.centers[nodes].mean(axis=0), 0.0, ellipses.rows[nodes])
    handle = Handle(1, "", "#ffffff", region, Pose((float(move[0]), float(move[1]), float(move[2]))))
    return bind(surface, Edit((handle,)).with_options(surface.options)).pose()


def measured(n_pulls: int) -> None:
    """Print precision and recall of held-out scenes."""
    told: Counter[tuple[str, str]] = Counter()
    for name, style, seed in HELD_OUT:
        planting, own = Planting.made(name, style, seed), Counter[tuple[str, str]]()
        for case in planting.cases(n_pulls):
            places = posed_check(case.posed).places
            for place in places:
                own[place.kind, "right" if place.kind == "spike" or planting.is_right(case, place) else "wrong"] += 1
            for spot, is_shown in zip(case.spots, case.shown(planting.truth), strict=True):
                if is_shown:
                    own[case.kind, "shown"] += 1
                    own[case.kind, "found"] += _is_found(planting, case.kind, places, np.unique(spot))
        _tell(planting.name, own)
        told += own
    _tell("all", told)


def _is_found(planting: Planting, kind: str, places: tuple[FlawPlace, ...], nodes: NDArray[np.int64]) -> bool:
    rest = planting.plain.rest
    tree = cKDTree(rest[nodes])
    told = [planting.plain.ellipses.node_of_row[place.rows] for place in places if place.kind == kind]
    return any(tree.query(rest[at])[0].min() < NEAR * planting.truth.size for at in told)


def _tell(name: str, counts: Counter[tuple[str, str]]) -> None:
    parts = []
    for kind in ("tear", "web"):
        right, wrong, shown, found = (counts[kind, what] for what in ("right", "wrong", "shown", "found"))
        parts.append(
            f"{kind}s {right + wrong} told, precision {right / max(right + wrong, 1):.3f}, "
            f"{shown} planted, recall {found / max(shown, 1):.3f}"
        )
    print(f"{name}: {'; '.join(parts)}; {counts['spike', 'right']} spikes", flush=True)


def captures(folder: Path) -> None:
    """Print what is told of trained captures whose surface is known, pulled as far as their references and half so."""
    told: Counter[tuple[str, str]] = Counter()
    for path in sorted(folder.glob("*_truth.npz")):
        stem = path.name.removesuffix("_truth.npz")
        scene = capture(*stem.rsplit("_", 1), read_ply(path.with_name(f"{stem}.ply")).splats, np.load(path))
        planting = Planting(stem, scene.splats, scene.truth)
        own = Counter[tuple[str, str]]()
        for k, pull in enumerate(scene.pulls):
            nodes = np.flatnonzero(held(scene, pull, planting.plain.rest)[0])
            for share in (0.5, 1.0):
                posed = _pulled(planting.plain, nodes, share * pull.move)
                own += _told_of(planting, f"{stem}, pull {k + 1} × {share}", Case("none", posed, posed))
        _tell(stem, own)
        told += own
    _tell("all", told)


def _told_of(planting: Planting, title: str, case: Case) -> Counter[tuple[str, str]]:
    """What is told of a capture's pose; of webs, what is shown are wrong contacts drawn out by more than `SHOWN`."""
    own, surface, places = Counter[tuple[str, str]](), case.surface, posed_check(case.posed).places
    for place in places:
        right = "right" if place.kind == "spike" or planting.is_right(case, place) else "wrong"
        own[place.kind, right] += 1
        print(f"{title}: {place}: {right}", flush=True)
    edges = surface.graph.edges
    assert case.posed.deformation is not None
    lengths = [
        np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
        for points in (surface.rest, case.posed.deformation.positions)
    ]
    drawn = edges[lengths[1] - lengths[0] > SHOWN * planting.truth.size]
    for edge in drawn[~planting.near(drawn, 2.5, 0.04)]:
        own["web", "shown"] += 1
        own["web", "found"] += _is_found(planting, "web", places, edge)
    return own


def fit(n_pulls: int) -> None:
    """Print weights of the models, fitted on the scenes for it; every pose counts alike, and so do both answers."""
    poses = []
    for name, style, seed in FITTED:
        planting = Planting.made(name, style, seed)
        for case in planting.cases(n_pulls):
            epsilon = case.surface.graph.epsilon
            poses.append(
                (planting.near, posed_surface(case.surface, case.posed.kernels, case.posed.deformation), epsilon)
            )
    known: list[Known] = []
    for near, posed, epsilon in poses:
        pairs = posed.partings[0]
        if len(pairs):
            known.append((tears.evidence(posed, pairs, epsilon), near(pairs, 2.0, 0.02)))
    tears.WEIGHTS = _fitted("tears.WEIGHTS", known)
    found, known = [], []
    for near, posed, epsilon in poses:
        links, grown = webs.grown_links(posed)
        if len(links):
            found.append((posed, links))
            parted = tears.tears(posed, epsilon).others
            known.append((webs.evidence(posed, links, grown, parted), ~near(links, 2.5, 0.04)))
    webs.WEIGHTS = _fitted("webs.WEIGHTS", known)
    again: list[Known] = []
    for (posed, links), (weighed, is_wrong) in zip(found, known, strict=True):
        odds = weighed @ np.array(webs.WEIGHTS)
        asked = odds > webs.LOOKED_AT
        if asked.any():
            looked = np.column_stack([np.ones(len(links)), odds, webs.detours(posed, links, odds)])
            again.append((looked[asked], is_wrong[asked]))
    _fitted("webs.LOOKED_AGAIN", again)


def _fitted(name: str, known: list[Known]) -> tuple[float, ...]:
    x, truth = (np.concatenate(arrays) for arrays in zip(*known, strict=True))
    weight = np.concatenate([np.full(len(each), 1.0 / max(len(each), 30)) for each, _ in known])
    weight[truth] *= 0.5 * weight[~truth].sum() / weight[truth].sum()
    weights = tuple(round(float(w), 2) for w in _logistic(x, truth, weight / weight.sum()))
    print(f"{name} = {weights}", flush=True)
    return weights


def _logistic(x, truth, weight):
    sign = 2.0 * truth - 1.0

    def loss(w):
        margin = sign * (x @ w)
        penalized = np.concatenate([[0.0], w[1:]])
        slope = -x.T @ (weight * sign * np.exp(-np.logaddexp(0.0, margin)))
        return weight @ np.logaddexp(0.0, -margin) + 1e-3 * penalized @ penalized, slope + 2e-3 * penalized

    return minimize(loss, np.zeros(x.shape[1]), jac=True, method="L-BFGS-B").x


def everyday(folder: Path, n_drags: int) -> None:
    """Print what is told of drags by 2 to 10 % of the size, of handles anywhere."""
    for path in sorted(folder.glob("*_2dgs.ply")):
        surface = surface_of(read_ply(path).splats, GraphOptions())
        rng, s = np.random.default_rng(11), surface.scene_scale
        for _ in range(n_drags):
            middle = surface.rest[rng.integers(len(surface.rest))]
            nodes = np.flatnonzero(np.linalg.norm(surface.rest - middle, axis=1) < 0.05 * s)
            move = rng.normal(size=3)
            move *= rng.uniform(0.02, 0.1) * s / np.linalg.norm(move)
            check = posed_check(_pulled(surface, nodes, move))
            print(f"{path.stem}: {np.linalg.norm(move) / s:.3f} s, {check}", *check.lines[1:4], sep="\n  ", flush=True)


def speed(sizes: list[int]) -> None:
    """Print seconds of the first check of a scene, which looks at it, and of the next ones: medians of five."""
    for n in sizes:
        surface = surface_of(shape_sample("bench", n, seed=0).splats, GraphOptions())
        center = surface.rest[0]
        nodes = np.flatnonzero(np.linalg.norm(surface.rest - center, axis=1) < 0.05 * surface.scene_scale)
        posed = _pulled(surface, nodes, np.array([0.0, 0.0, 0.1 * surface.scene_scale]))
        times = []
        for _ in range(6):
            start = perf_counter()
            deformation_check(surface, posed.kernels, posed.deformation)
            times.append(perf_counter() - start)
        print(f"{n:,} splats: first {times[0]:.3f} s, then {np.median(times[1:]):.3f} s", flush=True)


def main() -> None:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pulls", type=int, default=2, help="handles per object (2)")
    parser.add_argument("--fit", action="store_true")
    parser.add_argument("--everyday", type=Path, metavar="FOLDER", help="of trained scenes")
    parser.add_argument("--captures", type=Path, metavar="FOLDER", help="with true surfaces")
    parser.add_argument("--drags", type=int, default=10, help="per trained scene (10)")
    parser.add_argument("--speed", type=int, nargs="+", metavar="N")
    options = parser.parse_args()
    if options.fit:
        fit(options.pulls)
    elif options.everyday is not None:
        everyday(options.everyday, options.drags)
    elif options.captures is not None:
        captures(options.captures)
    elif options.speed is not None:
        speed(options.speed)
    else:
        measured(options.pulls)


if __name__ == "__main__":
    main()
