"""Colour grades: an affine map of the colour that is seen, the same from every side, and a change of opacity.

The colour of a splat is ``½ + C₀ sh0 + Σ B(d) shN`` with basis functions ``B`` of the direction it is seen from. A map
``c → A c + b`` of what is seen is therefore ``A`` on every coefficient, and an offset on the constant one alone: graded
colours keep their highlights, and a turned splat its graded ones.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.grade_options import GradeOptions
from splap_editor.core.index_spaces import FileMask
from splap_editor.core.progress import Progress, no_progress
from splap_editor.core.removal import Picked
from splap_editor.core.splats.splats import Splats

LUMA = np.array([0.2126, 0.7152, 0.0722])
"""Share of red, green and blue in the grey of a colour (Rec. 709)."""

ENCODING = 2.2
"""Colours are what a screen takes, light to the power of 1 / 2.2: so many times the light is a factor of the colour."""

MIDDLE_GREY = 0.5
BALANCE_STOPS = 0.5
"""Stops that a full temperature or tint shifts the outer channels by."""

SH_C0 = 0.28209479177387814
_BLOCK_ROWS = 1 << 14
_LEAST_LOGIT = -20.0
"""Of what is made fully transparent: an opacity of 2e-9, and a number that every program reads."""


Share = NDArray[np.floating] | FileMask
"""(N,) to which share, in [0, 1], each splat is graded."""


@dataclass(frozen=True)
class GradeStep:
    """One grade, and what it is of.

    Parameters
    ----------
    options : GradeOptions
    picked : Picked, optional
        The splats it is of; None: all.
    outside : bool
        All but these.
    """

    options: GradeOptions = field(default_factory=GradeOptions)
    picked: Picked | None = None
    outside: bool = False


def color_map(options: GradeOptions) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Find the affine map of colours in [0, 1] that a grade is.

    Parameters
    ----------
    options : GradeOptions

    Returns
    -------
    matrix : (3, 3) float64
    offset : (3,) float64
        ``c → matrix @ c + offset``. At rest exactly the identity. A grey stays grey but for the white balance, which
        keeps its luma.
    """
    t, m = BALANCE_STOPS * options.temperature, BALANCE_STOPS * options.tint
    balance = np.exp2(np.array([t + 0.5 * m, -m, -t + 0.5 * m]) / ENCODING)
    balance /= LUMA @ balance
    gains = options.contrast * np.exp2(options.exposure / ENCODING) * balance
    saturated = options.saturation * np.eye(3) + (1.0 - options.saturation) * LUMA
    matrix = saturated @ _turn_about_grey(np.radians(options.hue)) @ np.diag(gains)
    return matrix, np.full(3, MIDDLE_GREY * (1.0 - options.contrast))


def _turn_about_grey(angle: float) -> NDArray[np.float64]:
    """(3, 3) rotation of colour space about its grey axis, by Rodrigues' formula."""
    if angle == 0.0:
        return np.eye(3)
    across = np.array([[0.0, -1.0, 1.0], [1.0, 0.0, -1.0], [-1.0, 1.0, 0.0]]) / np.sqrt(3.0)
    return np.eye(3) + np.sin(angle) * across + (1.0 - np.cos(angle)) * across @ across


def graded_splats(
    splats: Splats, grades: Iterable[tuple[GradeOptions, Share | None]], progress: Progress = no_progress
) -> Splats:
    """Grade the colours and opacities of splats, one grade after the other.

    Parameters
    ----------
    splats : Splats
    grades : iterable of (GradeOptions, weights)
        With the share in [0, 1], (N,) float, to which each splat is graded; None: all of them fully. In between the
        colour, and the opacity, is mixed of that before and that after.
    progress : Progress
        Told the share done; may cancel.

    Returns
    -------
    Splats
        Arrays of the same types; rows that no grade touches hold the same bits, and arrays without any such rows are
        the same arrays.
    """
    work = [(options, weights) for options, weights in grades if not options.is_identity]
    colored = [(color_map(options), weights) for options, weights in work if _changes_color(options)]
    faded = [(options.opacity, weights) for options, weights in work if options.opacity != 1.0]
    changed = splats
    if colored:
        sh0, shN = np.array(splats.sh0), np.array(splats.shN)
        for lo in range(0, splats.n_splats, _BLOCK_ROWS):
            progress(0.8 * lo / splats.n_splats)
            _grade_colors(sh0[lo : lo + _BLOCK_ROWS], shN[lo : lo + _BLOCK_ROWS], colored, lo)
        changed = replace(changed, sh0=sh0, shN=shN if shN.shape[1] else splats.shN)
    if faded:
        logits = np.array(splats.logit_opacities)
        for done, (factor, weights) in enumerate(faded):
            progress(0.8 + 0.2 * done / len(faded))
            rows = slice(None) if weights is None else np.flatnonzero(weights)
            shares = 1.0 if weights is None else np.asarray(weights, np.float64)[rows]
            logits[rows] = faded_logits(logits[rows], factor, shares)
        changed = replace(changed, logit_opacities=logits)
    progress(1.0)
    return changed


def _changes_color(options: GradeOptions) -> bool:
    return not replace(options, opacity=1.0).is_identity


def _grade_colors(
    sh0: NDArray[np.floating],
    shN: NDArray[np.floating],
    grades: list[tuple[tuple[NDArray[np.float64], NDArray[np.float64]], Share | None]],
    first: int,
) -> None:
    """Grade the coefficients of some rows (n, 3) and (n, K, 3) from ``first`` on, in place; others stay as they are."""
    n = len(sh0)
    shares = np.stack(
        [np.ones(n) if weights is None else np.asarray(weights[first : first + n], np.float64) for _, weights in grades]
    )
    rows = np.flatnonzero(shares.any(axis=0))
    if not len(rows):
        return
    constant, bands = sh0[rows].astype(np.float64), shN[rows].astype(np.float64)
    for ((matrix, offset), _), share in zip(grades, shares[:, rows], strict=True):
        lifted = (matrix @ np.full(3, 0.5) + offset - 0.5) / SH_C0
        constant += share[:, None] * (constant @ matrix.T + lifted - constant)
        bands += share[:, None, None] * (bands @ matrix.T - bands)
    sh0[rows], shN[rows] = constant, bands


def faded_logits(
    logits: NDArray[np.floating], factor: float, shares: NDArray[np.float64] | float = 1.0
) -> NDArray[np.float64]:
    """Change opacities by a factor.

    Up to 1 the opacity α becomes ``factor α``; above, ``1 - (1 - α)^factor``, that of so many layers of the splat: both
    leave what is transparent so, and neither goes beyond opaque.

    Parameters
    ----------
    logits : (n,) float
        ``log(α / (1 - α))``; +inf is opaque.
    factor : float
        At least 0.
    shares : (n,) float64 or float
        In [0, 1]: how much of the change is made.

    Returns
    -------
    (n,) float64
        Logits, no less than -20 unless they were before; NaN stays NaN.
    """
    logits = np.asarray(logits, np.float64)
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        alpha, clear = 1.0 / (1.0 + np.exp(-logits)), 1.0 / (1.0 + np.exp(logits))
        # What is left clear is worked out by itself: next to opaque, 1 - α has no digits.
        left = clear + (1.0 - factor) * alpha if factor <= 1.0 else clear**factor
        left = (1.0 - shares) * clear + shares * left
        opaque = factor * alpha if factor <= 1.0 else -np.expm1(factor * np.log1p(-alpha))
        opaque = (1.0 - shares) * alpha + shares * opaque
        faded = np.log(opaque) - np.log(left)
    faded = np.where(faded < _LEAST_LOGIT, np.minimum(logits, _LEAST_LOGIT), faded)
    return np.where(np.isnan(logits), logits, faded)
