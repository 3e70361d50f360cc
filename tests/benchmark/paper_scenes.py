"""Scenes of the paper's comparison: which there are, in which order, and what those of one object share."""

import argparse
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import product
from math import gcd
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.splats.occupancy import occupancy_ellipses
from splap_editor.core.splats.splats import Splats
from splap_editor.io.sample_maker import STYLES, surface_splats
from splap_editor.io.sample_shapes import SHAPES, Surface
from tests.benchmark.fidelity import Scene
from tests.benchmark.ground_truth import GroundTruth, Pull
from tests.benchmark.paper_objects import CATEGORIES, MadeObject, made_object

FEWEST, MOST = 1_200, 40_000
"""Splats of a scene: fewer do not show the object, more show nothing new."""


MADE_CAPTURES = (("bench", "2dgs"),)
"""Captures, by name and trainer, whose true mesh is a shape of the sample maker."""


@dataclass(frozen=True)
class Case:
    """One scene of the comparison.

    Parameters
    ----------
    category : str
        Of a made object, or the name of a capture.
    seed : int
    regime : str
        How the splats lie, or who trained them.
    spacings : float
        Gap between neighbouring parts in splat spacings that is asked for; 0 for a capture.
    handles : str
        ``"near"``: where the object nearly touches itself. ``"spread"``: farthest points, pushed out along the normal.
    """

    category: str
    seed: int
    regime: str
    spacings: float
    handles: str = "near"

    @property
    def is_made(self) -> bool:
        """Whether it is laid on a procedural object."""
        return self.spacings > 0.0


@dataclass(frozen=True, eq=False)
class Subject:
    """What all scenes of one object share.

    Parameters
    ----------
    truth : GroundTruth
    pulls : list of Pull
    made : MadeObject, optional
    moved : dict
        Where the mesh takes the keypoints of each pull, by deformer; filled as they are asked for.
    """

    truth: GroundTruth
    pulls: list[Pull]
    made: MadeObject | None = None
    moved: dict[str, list[NDArray[np.float64]]] = field(default_factory=dict)


def made_cases(options: argparse.Namespace) -> list[Case]:
    """List every object in every regime and density, so that those done first are of all kinds alike.

    A round takes every object once. Within it the objects of a category differ in regime and density, and each category
    begins with another pair.
    """
    regimes = [options.regime] if options.regime else sorted(STYLES)
    n_regimes, n_spacings = len(regimes), len(options.spacings)
    # Along the diagonals: those that follow each other differ in both.
    cells = sorted(
        product(range(n_regimes), range(n_spacings)), key=lambda cell: ((cell[1] - cell[0]) % n_spacings, cell[0])
    )
    # Through all pairs before any comes again, whatever their number.
    stride = next(step for step in range(n_regimes + 1, 2 * len(cells) + 3) if gcd(step, len(cells)) == 1)
    cases = []
    for turn in range(min(options.cells, len(cells))):
        for seed in range(options.seeds):
            for category in options.categories:
                first = seed + stride * list(CATEGORIES).index(category)
                regime, density = cells[(turn + first) % len(cells)]
                cases.append(Case(category, seed, regimes[regime], options.spacings[density]))
    return cases


def captured_cases(folder: Path) -> list[Case]:
    """List the trained captures of a folder whose true mesh is known, with handles of both kinds."""
    found = [path.name.removesuffix("_truth.npz").rsplit("_", 1) for path in sorted(folder.glob("*_truth.npz"))]
    found += [(name, trainer) for name, trainer in MADE_CAPTURES if (folder / f"{name}_{trainer}.ply").exists()]
    return [Case(name, 0, trainer, 0.0, handles) for name, trainer in found for handles in ("near", "spread")]


@lru_cache(maxsize=64)
def made_subject(category: str, seed: int, n_pulls: int) -> Subject:
    """Make an object and its handles."""
    made = made_object(category, seed)
    truth = GroundTruth(made.surface)
    return Subject(truth, truth.pulls(n_pulls, seed), made)


@lru_cache(maxsize=8)
def captured_subject(path: Path, name: str, handles: str, n_pulls: int) -> Subject:
    """Read the true mesh of a capture, or make it; handles are chosen anew."""
    if path.exists():
        kept = np.load(path)
        surface = Surface(kept["V"].astype(np.float64), kept["F"].astype(np.int64), closed=True)
    else:
        surface = SHAPES[name]()
    truth = GroundTruth(surface)
    return Subject(truth, truth.pulls(n_pulls) if handles == "near" else truth.spread_pulls(n_pulls))


def scene_of(case: Case, n_pulls: int, captures: Path | None = None) -> tuple[Subject, Scene]:
    """Make the scene of a case; a capture is found in its folder."""
    if case.is_made:
        subject = made_subject(case.category, case.seed, n_pulls)
        splats = made_splats(subject.made, case)
    else:
        from splap_editor.io.ply import read_ply

        assert captures is not None, "a capture is asked for with its folder"
        stem = f"{case.category}_{case.regime}"
        subject = captured_subject(captures / f"{stem}_truth.npz", case.category, case.handles, n_pulls)
        splats = read_ply(captures / f"{stem}.ply").splats
    scene = Scene(case.category, case.regime, splats, subject.truth, occupancy_ellipses(splats), subject.pulls)
    return subject, scene


def made_splats(made: MadeObject, case: Case) -> Splats:
    """Lay the splats of a case on its object."""
    n_splats = int(np.clip(made.n_splats(case.spacings), FEWEST, MOST))
    return surface_splats(made.surface, n_splats, STYLES[case.regime], seed=case.seed).splats
