"""The comparison's rows as Markdown and JSON: a row a method, the paper's own figures beside it in italics.

Tables, plots and the README's table are made anew from the rows that a run has kept::

    python -m tests.benchmark.paper_tables resources/evidence
"""

import argparse
import json
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.benchmark.paper_methods import METHODS, NOT_RUN
from tests.benchmark.paper_published import PUBLISHED, PUBLISHED_CATEGORIES
from tests.benchmark.paper_rows import RowFile
from tests.keys_table import with_block

TITLES = {"arap": "ARAP, ten plain iterations", "settled": "ARAP, settled", "bbw": "BBW, cage 0.3 s"}
RIVALS = ("paper", "knn10", "knn30")
"""What the editor must not be below in any category."""

EVIDENCE = Path("resources/evidence")
START, END = (
    "<!-- evidence: python -m tests.benchmark.paper_tables resources/evidence -->\n",
    "<!-- end of evidence -->\n",
)
"""What the README's table stands between."""

Row = dict[str, object]
Figures = NDArray[np.float64]


def write_evidence(rows: Sequence[Row], folder: Path) -> None:
    """Write ``paper.md``, ``paper.json`` and, where matplotlib is installed, the plots."""
    (folder / "paper.md").write_text(markdown(rows), encoding="utf-8")
    (folder / "paper.json").write_text(json.dumps(summary(rows), indent=1) + "\n", encoding="utf-8")
    try:
        from tests.benchmark.paper_plots import write_plots
    except ModuleNotFoundError:
        return
    write_plots(rows, folder)


def scene_of(row: Row) -> tuple[object, ...]:
    """What names the scene of a row."""
    return tuple(row[name] for name in ("category", "seed", "regime", "spacings", "handles", "n_pulls"))


def paired(rows: Iterable[Row]) -> list[Row]:
    """Rows of scenes on which every method that takes part at all was run: only these can be compared."""
    rows = list(rows)
    everyone = {row["candidate"] for row in rows}
    there: dict[tuple[object, ...], set[object]] = {}
    for row in rows:
        there.setdefault(scene_of(row), set()).add(row["candidate"])
    return [row for row in rows if there[scene_of(row)] == everyone]


def figures(rows: Iterable[Row], name: str) -> Figures:
    """(4,) a method's 3DPCK at the three radii and mean distance: means over pulls, then scenes, then categories."""
    by_category: dict[object, list[Figures]] = {}
    for row in rows:
        if row["candidate"] == name:
            by_category.setdefault(row["category"], []).append(np.mean(row["pulls"], axis=0))
    if not by_category:
        return np.full(4, np.nan)
    return np.mean([np.mean(scenes, axis=0) for scenes in by_category.values()], axis=0)


def main_rows(rows: Iterable[Row], solver: str) -> list[Row]:
    """Rows of one deformer on made objects, without choices within a method."""
    return paired(
        row
        for row in rows
        if row["solver"] == solver and row["spacings"] and not METHODS[str(row["candidate"])].is_ablation
    )


def summary(rows: Sequence[Row]) -> dict[str, object]:
    """Means by deformer and method: over everything, by category, density and regime."""
    result: dict[str, object] = {"commits": sorted({str(row["commit"]) for row in rows})}
    for solver in TITLES:
        chosen = main_rows(rows, solver)
        if not chosen:
            continue
        result[solver] = {
            "n_scenes": len({scene_of(row) for row in chosen}),
            "methods": {
                name: {"all": _plain(figures(chosen, name))}
                | {
                    axis: {
                        str(value): _plain(figures([row for row in chosen if row[axis] == value], name))
                        for value in dict.fromkeys(row[axis] for row in chosen)
                    }
                    for axis in ("category", "spacings", "regime")
                }
                for name in METHODS
                if any(row["candidate"] == name for row in chosen)
            },
            "below": [list(each) for each in below(chosen)],
        }
    return result


def below(rows: Sequence[Row]) -> list[tuple[str, str, float]]:
    """Categories in which the editor is below a rival at τ = .075: category, rival and by how much."""
    found = []
    for category in dict.fromkeys(str(row["category"]) for row in rows):
        here = [row for row in rows if row["category"] == category]
        for rival in RIVALS:
            behind = figures(here, rival)[1] - figures(here, "ours")[1]
            if behind > 5e-4:
                found.append((category, rival, round(float(behind), 3)))
    return found


def markdown(rows: Sequence[Row]) -> str:
    """Write every table that there are rows for."""
    parts = ["# The paper's comparison on our own ground", "", _provenance(rows), ""]
    for solver in TITLES:
        chosen = main_rows(rows, solver)
        if chosen:
            parts += [_main_table(solver, chosen), _split_table(chosen, "spacings", lambda gap: f"gap {gap:g}")]
            parts += [_split_table(chosen, "regime", str), _below_line(chosen), ""]
    parts += [_neighbors_table(rows), _captures_table(rows)]
    return "\n".join(part for part in parts if part is not None).rstrip() + "\n"


def readme_table(rows: Sequence[Row]) -> str:
    """Means of every method over all scenes, by ARAP and by BBW, and the paper's own in italics."""
    chosen = {solver: main_rows(rows, solver) for solver in ("arap", "bbw")}
    head = ["method", *(f"{TITLES[solver]}: τ .05 .075 .1" for solver in chosen)]
    lines = [_line(head), _line(["---"] * len(head))]
    for name, method in METHODS.items():
        cells = []
        for solver, kept in chosen.items():
            told = PUBLISHED.get((name, solver))
            cells.append(_three(figures(kept, name)) + (f" · *{_three(told.averages)}*" if told else ""))
        if any(row["candidate"] == name for kept in chosen.values() for row in kept):
            lines.append(_line([method.title, *cells]))
    said = [f"{TITLES[solver]}, {_runs(kept)}: {_below_line(kept)}" for solver, kept in chosen.items() if kept]
    return "\n".join([*lines, "", *said]) + "\n"


def with_readme_table(text: str, rows: Sequence[Row]) -> str:
    """Put the table between the marks of a README."""
    return with_block(text, START, readme_table(rows), END)


def _runs(rows: Sequence[Row]) -> str:
    commits = ", ".join(sorted({str(row["commit"]) for row in rows}))
    n_categories = len({row["category"] for row in rows})
    return f"{len({scene_of(row) for row in rows})} scenes of {n_categories} categories at {commits}"


def _provenance(rows: Sequence[Row]) -> str:
    scenes = {scene_of(row) for row in rows}
    commits = sorted({str(row["commit"]) for row in rows})
    seconds = sum(float(row["cpu_s"]) for row in rows)
    return (
        f"{len(rows)} rows on {len(scenes)} scenes by `python -m tests.benchmark.paper` at {', '.join(commits)} "
        f"({seconds / 60:.0f} minutes of one core). Objects are procedural, made by seed; figures in italics are the "
        "paper's own, on its own data, and not to be subtracted from ours. A scene counts where every method was run "
        "on it. Each row of `rows.jsonl` names its scene, its commit and the score of every pull."
    )


def _main_table(solver: str, rows: Sequence[Row]) -> str:
    categories = list(dict.fromkeys(str(row["category"]) for row in rows))
    ceiling = figures(rows, "oracle")[1]
    n_scenes = len({scene_of(row) for row in rows})
    head = ["method", *categories, "τ .05", ".075", ".1", "of the ceiling"]
    lines = [f"## {TITLES[solver]}", "", f"3DPCK at τ = .075 by category, {n_scenes} scenes.", ""]
    lines += [_line(head), _line(["---"] * len(head))]
    for name, method in METHODS.items():
        if not any(row["candidate"] == name for row in rows):
            continue
        cells = [figures([row for row in rows if row["category"] == one], name)[1] for one in categories]
        means = figures(rows, name)
        told = PUBLISHED.get((name, solver))
        by_category = dict(zip(PUBLISHED_CATEGORIES, told.categories, strict=True)) if told else {}
        cells = [_both(cell, by_category.get(one)) for cell, one in zip(cells, categories, strict=True)]
        cells += [_both(mean, told.averages[place] if told else None) for place, mean in enumerate(means[:3])]
        lines.append(_line([method.title, *cells, _figure(means[1] / ceiling)]))
    for name, (title, why) in NOT_RUN.items():
        told = PUBLISHED.get((name, solver))
        if told:
            by_category = dict(zip(PUBLISHED_CATEGORIES, told.categories, strict=True))
            cells = [_both(None, by_category.get(one)) for one in categories]
            cells += [_both(None, average) for average in told.averages]
            lines.append(_line([f"{title} (not run: {why})", *cells, "–"]))
    return "\n".join(lines) + "\n"


def _split_table(rows: Sequence[Row], axis: str, told: Callable[[object], str]) -> str | None:
    values = sorted({row[axis] for row in rows}, reverse=True)
    if len(values) < 2:
        return None
    head = ["method", *(f"{told(value)}: τ .05, .075, .1" for value in values)]
    lines = [_line(head), _line(["---"] * len(head))]
    for name, method in METHODS.items():
        parts = [figures([row for row in rows if row[axis] == value], name) for value in values]
        if np.isfinite(parts).any():
            lines.append(_line([method.title, *(" ".join(map(_figure, part[:3])) for part in parts)]))
    return "\n".join(lines) + "\n"


def _below_line(rows: Sequence[Row]) -> str:
    found = below(rows)
    if not found:
        return "In no category is the editor below the paper's rule or kNN at τ = .075."
    told = ", ".join(f"{category}: {METHODS[rival].title} by {_figure(behind)}" for category, rival, behind in found)
    return f"Below a rival at τ = .075: {told}."


def _neighbors_table(rows: Sequence[Row]) -> str | None:
    """Compare the sizes of neighbourhoods, on the scenes where they were run."""
    names = ("ours10", "ours", "ours50", "geodesic10", "paper", "geodesic50", "knn10", "knn30", "knn50")
    lines = []
    for solver in TITLES:
        made = [row for row in rows if row["solver"] == solver and row["spacings"]]
        chosen = paired(row for row in made if row["candidate"] in names)
        if not chosen or not any(METHODS[str(row["candidate"])].is_ablation for row in chosen):
            continue
        n_scenes = len({scene_of(row) for row in chosen})
        for title, trio in (("SpLap Editor", names[:3]), ("Paper's rule", names[3:6]), ("kNN", names[6:])):
            cells = [_three(figures(chosen, name)) for name in trio]
            lines.append(_line([TITLES[solver], title, *cells, str(n_scenes)]))
    if not lines:
        return None
    head = ["deformer", "neighbours", "k = 10", "k = 30", "k = 50", "scenes"]
    return "\n".join(["## How many neighbours", "", _line(head), _line(["---"] * len(head)), *lines]) + "\n"


def _captures_table(rows: Sequence[Row]) -> str | None:
    """Compare on trained captures, by trainer and by where the handles are."""
    captured = [row for row in rows if not row["spacings"]]
    lines = []
    for solver in TITLES:
        chosen = paired(row for row in captured if row["solver"] == solver)
        kinds = list(dict.fromkeys((str(row["category"]), str(row["regime"]), str(row["handles"])) for row in chosen))
        for name, method in METHODS.items():
            parts = []
            for kind in kinds:
                here = [row for row in chosen if (row["category"], row["regime"], row["handles"]) == kind]
                parts.append(figures(here, name))
            if parts and np.isfinite(parts).any():
                told = PUBLISHED.get((name, solver))
                cells = [TITLES[solver], method.title, *map(_three, parts)]
                lines.append(_line([*cells, _both(None, told.nerf_synthetic if told else None)]))
        if lines:
            head = ["deformer", "method", *(f"{name}, {by}, {where}" for name, by, where in kinds), "*NeRF-Synthetic*"]
    if not lines:
        return None
    lead = "Handles *near*: where the object nearly touches itself; *spread*: farthest points. τ .05 .075 .1."
    return "\n".join(["## Trained captures", "", lead, "", _line(head), _line(["---"] * len(head)), *lines]) + "\n"


def _plain(values: Figures) -> list[float]:
    return [round(float(value), 4) for value in values]


def _three(values: Figures | Sequence[float]) -> str:
    return " ".join(map(_figure, values[:3]))


def _both(ours: float | None, published: float | None) -> str:
    parts = [] if ours is None else [_figure(ours)]
    if published is not None:
        parts.append(f"*{_figure(published)}*")
    return " ".join(parts) or "–"


def _figure(value: float) -> str:
    return f"{value:.3f}".replace("0.", ".", 1) if np.isfinite(value) else "–"


def _line(cells: Iterable[str]) -> str:
    return f"| {' | '.join(cells)} |"


def main(given: list[str] | None = None) -> None:
    """Make tables, plots and the README's table from the rows of a folder."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="where a run's rows are")
    folder = parser.parse_args(given).folder
    rows = RowFile(folder / "rows.jsonl").rows()
    write_evidence(rows, folder)
    if folder.resolve() == EVIDENCE.resolve():
        readme = Path("README.md")
        readme.write_text(with_readme_table(readme.read_text(encoding="utf-8"), rows), encoding="utf-8")


if __name__ == "__main__":
    main()
