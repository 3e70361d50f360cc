"""Splats reduced to what every other format holds: three scales, no filter, finite numbers."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.progress import Progress, no_progress, part_of
from splap_editor.core.splats.splats import Splats

THIN_LOG_SCALE = float(np.log(1e-6))
"""Third log-scale given to 2DGS splats on their way to 3DGS programs."""

LARGEST_LOG_SCALE = float(np.log(1e30))
"""Larger than what lies within the limit of coordinates; formats that hold scales themselves would overflow later."""

LARGEST_COEFFICIENT = np.float32(1e4)
"""Of colours: a coefficient of 2 is white already."""

BLOCK_ROWS = 1 << 15
"""Rows that are worked on at a time."""

FAINT, OPAQUE = -14.0, 14.0
"""Logits of what counts as invisible and as opaque: a millionth from 0 and from 1."""


def bare_splats(splats: Splats, largest_degree: int = 3, progress: Progress = no_progress) -> tuple[Splats, int]:
    """Bring splats to what any 3DGS program understands.

    The 3-D filter of GOF is worked into scales and opacities, 2DGS splats get
    a third scale of 1e-6, quaternions unit length, higher spherical-harmonic
    degrees go, thresholds too. Rows keep their order.

    Parameters
    ----------
    splats : Splats
    largest_degree : int
        Spherical-harmonic degree that the format holds.
    progress : Progress
        Told the share done after each part of the splats; may cancel.

    Returns
    -------
    bare : Splats
        float32, three log-scales from log 1e-6 to log 1e30, unit quaternions, finite logits within ±14.
    n_unusable : int
        Splats without a usable rotation, scale or opacity: they become invisible.
    """
    n = splats.n_splats
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        if splats.filter_radii is None:
            log_scales = np.array(splats.log_scales, np.float32)
            logits = np.array(splats.logit_opacities, np.float32)
        else:
            log_scales = np.log(splats.scales).astype(np.float32)
            logits = (np.log(splats.opacities) - np.log1p(-splats.opacities)).astype(np.float32)
        progress(0.2)
        quats = np.array(splats.quats, np.float32)
        lengths = np.sqrt(np.einsum("nc,nc->n", quats, quats))
        usable = np.isfinite(lengths) & (lengths > 0)
        usable &= ~np.isnan(log_scales).any(axis=1) & (log_scales <= LARGEST_LOG_SCALE).all(axis=1) & ~np.isnan(logits)
        quats /= lengths[:, None]
    progress(0.4)
    if splats.n_scales == 2:
        log_scales = np.column_stack([log_scales, np.full(n, THIN_LOG_SCALE, np.float32)])
    log_scales = np.maximum(log_scales, np.float32(THIN_LOG_SCALE))
    logits = np.clip(logits, FAINT, OPAQUE)
    unusable = ~usable
    if unusable.any():
        quats[unusable] = 1, 0, 0, 0
        log_scales[unusable] = THIN_LOG_SCALE
        logits[unusable] = FAINT
    progress(0.5)
    sh0 = _finite(splats.sh0, part_of(progress, 0.5, 0.6))
    shN = _finite(splats.shN[:, : (largest_degree + 1) ** 2 - 1], part_of(progress, 0.6, 1.0))
    bare = Splats(
        means=np.asarray(splats.means, np.float32),
        log_scales=log_scales,
        quats=quats,
        logit_opacities=logits,
        sh0=sh0,
        shN=shN,
    )
    progress(1.0)
    return bare, int(unusable.sum())


def row_blocks(n_rows: int, progress: Progress) -> Iterator[slice]:
    """Rows, so many at a time that ``progress`` is told a few times a second; it may cancel between them."""
    for lo in range(0, n_rows, BLOCK_ROWS):
        progress(lo / n_rows)
        yield slice(lo, min(lo + BLOCK_ROWS, n_rows))


def _finite(values: NDArray[np.floating], progress: Progress) -> NDArray[np.float32]:
    """Coefficients as float32, zero where they are no numbers, and none so large that reckoning with it overflows."""
    made: NDArray[np.float32] | None = None
    with np.errstate(over="ignore", invalid="ignore"):
        for rows in row_blocks(len(values), progress):
            cells = np.asarray(values[rows], np.float32)
            is_good = bool((np.abs(cells) <= LARGEST_COEFFICIENT).all())
            if made is None and (not is_good or values.dtype != np.float32):
                made = np.array(values, np.float32)
            if made is not None and not is_good:
                limits = -LARGEST_COEFFICIENT, LARGEST_COEFFICIENT
                made[rows] = np.clip(np.nan_to_num(cells, nan=0.0, posinf=0.0, neginf=0.0), *limits)
    return np.asarray(values, np.float32) if made is None else made


def alphas_of(logits: NDArray[np.floating]) -> NDArray[np.float64]:
    """Opacities of logits."""
    return 1.0 / (1.0 + np.exp(-np.asarray(logits, np.float64)))


def logits_of_bytes() -> NDArray[np.float32]:
    """(256,) logits of opacities stored as bytes; the ends are a quarter of a step off 0 and 1, to be finite."""
    alphas = np.arange(256) / 255
    alphas[[0, -1]] = 0.25 / 255, 1 - 0.25 / 255
    return np.log(alphas / (1 - alphas)).astype(np.float32)


def as_bytes(values: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Numbers rounded to bytes, clipped at 0 and 255."""
    return np.clip(np.rint(values), 0, 255).astype(np.uint8)
