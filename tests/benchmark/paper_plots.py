"""Plots of the comparison: 3DPCK against the radius and against density, the ceiling dashed."""

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from tests.benchmark.fidelity import RADII
from tests.benchmark.paper_methods import METHODS
from tests.benchmark.paper_tables import TITLES, Row, figures, main_rows

COLORS = {
    "ours": "#d1495b",
    "paper": "#2e4057",
    "raw graph": "#66829e",
    "knn10": "#6a994e",
    "knn30": "#a7c957",
    "mahalanobis10": "#b07d2b",
    "mahalanobis30": "#e0b458",
    "mani-gs": "#7b5ea7",
    "sugar": "#b39ddb",
    "cage": "#8d99ae",
    "oracle": "#111111",
}


def write_plots(rows: Sequence[Row], folder: Path) -> None:
    """Write ``pck-ARAP.svg`` and its like: a plot a deformer that there are rows for."""
    # The same rows give the same file.
    with mpl.rc_context({"svg.hashsalt": "splap", "svg.fonttype": "none", "font.size": 9}):
        for solver, title in TITLES.items():
            chosen = main_rows(rows, solver)
            if chosen:
                plot = _plot(chosen, title)
                plot.savefig(folder / f"pck-{solver}.svg", metadata={"Date": None, "Creator": None})


def _plot(rows: Sequence[Row], title: str) -> Figure:
    plot = Figure(figsize=(9.0, 3.6), layout="constrained")
    by_radius, by_density = plot.subplots(1, 2, sharey=True)
    spacings = sorted({float(row["spacings"]) for row in rows})
    for name, color in COLORS.items():
        if not any(row["candidate"] == name for row in rows):
            continue
        is_ceiling = name == "oracle"
        style = {"color": color, "linestyle": "--" if is_ceiling else "-", "linewidth": 2.2 if name == "ours" else 1.2}
        by_radius.plot(RADII, figures(rows, name)[:3], marker="o", markersize=3, label=METHODS[name].title, **style)
        scores = [figures([row for row in rows if row["spacings"] == gap], name)[1] for gap in spacings]
        by_density.plot(spacings, np.array(scores), marker="o", markersize=3, **style)
    by_radius.set(xlabel="τ", ylabel="3DPCK", title=f"{title}: all scenes", xticks=RADII)
    by_density.set(xlabel="gap between neighbouring parts, in splat spacings", title="τ = .075", xticks=spacings)
    for axes in (by_radius, by_density):
        axes.grid(alpha=0.3)
        axes.spines[["top", "right"]].set_visible(False)
    plot.legend(loc="outside right center", frameon=False)
    return plot
