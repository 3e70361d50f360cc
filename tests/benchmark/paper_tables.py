"""The comparison's results as Markdown: a row a method, the paper's own figures in italics."""

from collections.abc import Sequence

import numpy as np

from tests.benchmark.paper_methods import METHODS

TITLES = {"arap": "ARAP, ten plain iterations", "settled": "ARAP, settled", "bbw": "BBW, cage 0.3 s"}
PUBLISHED_PLACE = {"arap": 0, "bbw": 1}

Result = dict[str, object]


def markdown(results: Sequence[Result]) -> str:
    """Make a table a deformer: 3DPCK at .075 by category, the three averages, and the share of the ceiling."""
    solvers = list(dict.fromkeys(str(result["solver"]) for result in results))
    return "\n".join(_table(solver, [each for each in results if each["solver"] == solver]) for solver in solvers)


def _table(solver: str, results: Sequence[Result]) -> str:
    categories = list(dict.fromkeys(str(result["category"]) for result in results))
    names = list(dict.fromkeys(str(result["candidate"]) for result in results))
    ceiling = _mean(results, "oracle")
    head = ["method", *categories, ".05", ".075", ".1", "of the ceiling", "*paper, its data*"]
    lines = [f"### {TITLES[solver]}: 3DPCK (τ = .075 by category)", "", _line(head), _line(["---"] * len(head))]
    for name in names:
        means = _mean(results, name)
        by_category = [_mean([each for each in results if each["category"] == one], name)[1] for one in categories]
        share = means[1] / ceiling[1] if np.isfinite(ceiling[1]) else float("nan")
        place = PUBLISHED_PLACE.get(solver)
        published = float("nan") if place is None else METHODS[name].published[place]
        figures = [*by_category, *means, share]
        lines.append(_line([METHODS[name].title, *map(_figure, figures), _figure(published, "*")]))
    return "\n".join(lines) + "\n"


def _mean(results: Sequence[Result], name: str) -> np.ndarray:
    scores = [result["pck"] for result in results if result["candidate"] == name]
    return np.mean(scores, axis=0) if scores else np.full(3, np.nan)


def _figure(value: float, mark: str = "") -> str:
    return f"{mark}{value:.3f}{mark}".replace("0.", ".", 1) if np.isfinite(value) else "–"


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"
