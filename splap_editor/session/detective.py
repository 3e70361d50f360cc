"""What a file's numbers were taken for, and what is odd about them."""

from dataclasses import dataclass

import numpy as np

from splap_editor.core.graph.carriers import MOST_FAINT, SOLID
from splap_editor.core.index_spaces import FileRows
from splap_editor.core.splats.occupancy import Ellipses, InertReason
from splap_editor.core.splats.splats import Splats
from splap_editor.engine.scene_info import flatness
from splap_editor.io.layout import Layout
from splap_editor.io.lint import lint

HAZY = 0.05
"""With a larger share of faint splats a scene is called hazy, unless its splats are flat."""

ROUND = 0.6
"""A splat is nearly round if its smallest scale is more than this share of its middle one."""


@dataclass(frozen=True, eq=False)
class Oddity:
    """Something odd about some splats.

    Parameters
    ----------
    sentence : str
        What it is, with the number of rows.
    rows : (n,) int64
        File rows concerned, ascending.
    """

    sentence: str
    rows: FileRows


def oddities(splats: Splats, ellipses: Ellipses) -> list[Oddity]:
    """Everything odd about the splats of a scene, worst first; takes seconds per million splats.

    Beside what `io.lint.lint` finds: splats that take no part in the surface because they are too faint or have no
    size, and those so round that their normal is a guess.
    """
    found = [Oddity(f"{finding.sentence}.", finding.rows) for finding in lint(splats)]
    for reason, words in (
        (InertReason.TRANSPARENT, "too faint to shape the surface"),
        (InertReason.ZERO_SIZE, "without any size"),
    ):
        inert = np.flatnonzero(ellipses.inert == reason)
        if len(inert):
            share = 100 * len(inert) / splats.n_splats
            found.append(Oddity(f"{_splats(len(inert))} {words} ({share:.2g} % of all).", inert))
    rows = round_rows(splats)
    if len(rows):
        found.append(Oddity(f"{_splats(len(rows))} nearly round: which way they face is a guess.", rows))
    return found


def round_rows(splats: Splats) -> FileRows:
    """File rows of the splats whose smallest scale is nearly as large as their middle one."""
    if splats.n_scales == 2:
        return np.zeros(0, np.int64)
    scales = np.sort(np.asarray(splats.log_scales, np.float64), axis=1)
    with np.errstate(invalid="ignore"):
        return np.flatnonzero(scales[:, 0] - scales[:, 1] > np.log(ROUND))


def reading(layout: Layout, splats: Splats) -> str:
    """Say which activations and which normal axis the columns were read with."""
    opacity = "opacities as they are" if layout.activated_opacity else "opacities through a sigmoid"
    if layout.normal_axis is None:
        normal = "the thinnest axis is the normal"
    else:
        normal = f"axis {layout.normal_axis} is the normal"
    extra = ", a filter widens them" if splats.filter_radii is not None else ""
    cut = ", thresholds cut them" if splats.thresholds is not None else ""
    return f"scales through exp{extra}{cut}; {opacity}; {normal}"


def verdict(splats: Splats) -> tuple[str, str]:
    """Say how far to trust the graph, from how flat the splats are and how many are faint.

    A few connections through the air are enough to tear or tether a part, so a
    scene is as trustworthy as the worse of its splats: thick ones and haze reach
    across gaps, however flat the others are.

    Returns
    -------
    sentence : str
    tone : str
        ``""`` or ``"warning"``.
    """
    if splats.is_flat:
        return "Flat splats: connections follow the surface.", ""
    shares = flatness(splats)
    middle, high = shares["p50"], shares["p95"]
    hazy = float(np.mean(splats.opacities < SOLID))
    if hazy > MOST_FAINT:
        return (
            "Most splats are faint: haze and surface cannot be told apart. Do not trust thin parts and gaps.",
            "warning",
        )
    if hazy > HAZY:
        return (
            f"Haze: {hazy:.0%} of the splats are fainter than {SOLID:g}; they follow the surface and hold nothing "
            "together. What lies behind them may still connect across gaps: separate what touches.",
            "warning",
        )
    if middle < 0.3 and high >= 0.5:
        return "Flat and thick splats mixed: connections may cross narrow gaps. Separate parts that touch.", "warning"
    if middle < 0.3:
        return "Mostly flat: connections are good; look at thin parts and gaps.", ""
    if middle < ROUND:
        return "Thick splats: some connections may cross gaps. Look at the graph before bending thin parts.", "warning"
    return "Nearly round splats: neighbours go by distance alone. Do not trust thin parts and gaps.", "warning"


def _splats(count: int) -> str:
    return f"{count:,} splats are" if count > 1 else "1 splat is"
