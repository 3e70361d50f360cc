"""How long a stroke of Separate or Join takes to answer, and to be carried out.

On one scene, each stroke points at one place a part. A first stroke is made and not counted. Medians and worst
of processor seconds, and medians of seconds by the clock where it says "wall"; one JSON object a line::

    python -m tests.benchmark.strokes --splats 100000 1000000
    python -m tests.benchmark.strokes --splats 100000 --profile
"""

import argparse
import cProfile
import pstats
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from splap_editor.core.graph.options import GraphOptions, Joint, Separation
from splap_editor.engine.bound_edit import ready_for_drags
from splap_editor.engine.surface import Surface, surface_of
from splap_editor.io.sample_maker import shape_sample
from splap_editor.session.joint_preview import found_joint
from splap_editor.session.seam_preview import found_seam
from tests.benchmark.peers import machine, note, report

APART = 0.06
"""The two places of a stroke, in units of s."""


def strokes(surface: Surface, n_strokes: int) -> list[tuple[Separation, Joint]]:
    """Make strokes at places anywhere on the surface."""
    rest, s = surface.rest, surface.scene_scale
    rng = np.random.default_rng(3)
    made = []
    while len(made) < n_strokes:
        a = rest[rng.integers(len(rest))]
        apart = np.linalg.norm(rest - a, axis=1)
        b = rest[np.argmin(np.abs(apart - APART * s))]
        first, second = tuple(map(float, a)), tuple(map(float, b))
        made.append((Separation((first,), (second,)), Joint((first,), (second,), 1.1 * APART * s)))
    return made


class Clock:
    """``with clock("seam"):`` keeps the block's processor seconds."""

    def __init__(self) -> None:
        self.seconds: dict[str, list[float]] = defaultdict(list)

    @contextmanager
    def __call__(self, name: str) -> Iterator[None]:
        """Time a block."""
        start = time.process_time()
        yield
        self.seconds[name].append(time.process_time() - start)


def measure(n_splats: int, n_strokes: int, profile: cProfile.Profile | None) -> dict[str, object]:
    """Seconds of finding and of making each stroke, on the same scene."""
    splats = shape_sample("bench", n_splats, seed=0).splats
    surface = surface_of(splats, GraphOptions())
    ready_for_drags(surface, None)
    note(f"{n_splats} splats prepared")
    clock, parts = Clock(), defaultdict(list)
    for k, (separation, joint) in enumerate(strokes(surface, n_strokes + 1)):
        if k == 1:
            clock, parts = Clock(), defaultdict(list)
            if profile is not None:
                profile.enable()
        made = []
        with clock("separate, found"):
            parts["n_cut"].append(len(found_seam(surface, separation).rows))
        with clock("separate, made"):
            options = replace(surface.options, separate=(separation,))
            made.append(surface_of(splats, options, ellipses=surface.visible, near=surface))
        with clock("join, found"):
            parts["n_tied"].append(len(found_joint(made[0], joint).rows))
        with clock("join, made"):
            options = replace(surface.options, join=(joint,))
            made.append(surface_of(splats, options, ellipses=surface.visible, near=surface))
        for each in made:
            for name, seconds in each.timings_s.items():
                parts[f"{name}, wall"].append(seconds)
    if profile is not None:
        profile.disable()
    worst = {f"{name}, worst": max(values) for name, values in clock.seconds.items()}
    return {name: np.median(values) for name, values in (*clock.seconds.items(), *parts.items())} | worst


def main() -> None:
    """Measure what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--splats", type=int, nargs="+", default=[100_000])
    parser.add_argument("--strokes", type=int, default=5, help="of each kind (5)")
    parser.add_argument("--profile", action="store_true", help="print where the time goes")
    options = parser.parse_args()
    report(benchmark="strokes", **machine())
    for n in options.splats:
        profile = cProfile.Profile() if options.profile else None
        report(splats=n, **measure(n, options.strokes, profile))
        if profile is not None:
            pstats.Stats(profile).sort_stats("cumulative").print_stats(45)


if __name__ == "__main__":
    main()
