"""What is odd about the splats of a file."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from splap_editor.core.index_spaces import FileMask, FileRows
from splap_editor.core.progress import Progress, no_progress
from splap_editor.core.splats.splats import Splats

GIANT = 0.25
"""A splat is giant if one standard deviation is longer than this share of the main subject."""

_BLOCK_ROWS = 1 << 15
_UNUSABLE = {
    "scales": "{} a scale that is not a number or infinite",
    "opacities": "{} an opacity that is not a number",
    "rotations": "{} a rotation that is not finite",
    "zero_rotations": "{} a zero rotation",
    "filters": "{} a filter_3D that is not finite",
    "colours": "{} a colour that is not finite",
}


@dataclass(frozen=True, eq=False)
class Finding:
    """Something odd about some splats.

    Parameters
    ----------
    kind : str
        ``"scales"``, ``"opacities"``, ``"rotations"``, ``"zero_rotations"``,
        ``"filters"``, ``"colours"``, ``"all_zero"``, ``"duplicates"``,
        ``"giants"`` or ``"thresholds"``.
    sentence : str
        What it is, with the number of rows.
    rows : (n,) int64
        File rows concerned, ascending.
    """

    kind: str
    sentence: str
    rows: FileRows


def unusable_rows(splats: Splats, progress: Progress = no_progress) -> list[Finding]:
    """Rows that cannot be drawn or deformed: not finite, or without a rotation.

    Infinite opacity (opaque) and scales of ``-inf`` (flat) are legal. One pass
    over each column; nothing is converted. ``progress`` is told the share of
    rows, and may cancel.
    """
    found: dict[str, list[NDArray[np.int64]]] = {kind: [] for kind in _UNUSABLE}
    for lo in range(0, splats.n_splats, _BLOCK_ROWS):
        for kind, bad in _unusable(splats, slice(lo, lo + _BLOCK_ROWS)):
            found[kind].append(lo + np.flatnonzero(bad))
        progress(lo / splats.n_splats)
    findings = []
    for kind, blocks in found.items():
        rows = np.concatenate(blocks) if blocks else np.zeros(0, np.int64)
        if len(rows):
            findings.append(Finding(kind, _sentence(_UNUSABLE[kind], len(rows)), rows))
    return findings


def _unusable(splats: Splats, block: slice) -> Iterator[tuple[str, NDArray[np.bool_]]]:
    """What is unusable about some rows, of those kinds that may have any."""
    scales, quats, opacities = splats.log_scales[block], splats.quats[block], splats.logit_opacities[block]
    sh0, shN = splats.sh0[block], splats.shN[block]
    if not _finite(scales):
        yield "scales", (np.isnan(scales) | (scales == np.inf)).any(axis=1)
    if not _finite(opacities):
        yield "opacities", np.isnan(opacities)
    if not _finite(quats):
        yield "rotations", ~np.isfinite(quats).all(axis=1)
    zero = quats[:, 0] == 0
    if zero.any():
        zero[zero] = (quats[zero] == 0).all(axis=1)
        yield "zero_rotations", zero
    if splats.filter_radii is not None:
        yield "filters", ~np.isfinite(splats.filter_radii[block])
    if not (_finite(sh0) and _finite(shN)):
        yield "colours", ~(np.isfinite(sh0).all(axis=1) & np.isfinite(shN).all(axis=(1, 2)))


def lint(splats: Splats) -> list[Finding]:
    """Everything odd about the splats, worst first.

    Beside `unusable_rows`: rows that are zero throughout, positions that occur
    more than once (every row after the first), and giant splats (longer than
    `GIANT` of the main subject).
    Takes seconds per million splats.
    """
    findings = unusable_rows(splats)
    means = np.ascontiguousarray(splats.means)
    at_origin = (means == 0).all(axis=1)
    blank = at_origin & (np.asarray(splats.log_scales) == 0).all(axis=1) & (np.asarray(splats.quats) == 0).all(axis=1)
    _add(findings, "all_zero", "{} zeros in every column", blank)
    order = np.lexsort(means.T)
    same = (means[order[1:]] == means[order[:-1]]).all(axis=1)
    # A stable sort keeps file order among equals, so the first of them is spared.
    duplicates = np.zeros(len(means), bool)
    duplicates[order[1:]] = same
    _add(findings, "duplicates", "{} the position of an earlier splat", duplicates)
    usable = np.isfinite(means).all(axis=1) & np.isfinite(splats.opacities)
    # Looking for neighbours needs scipy, which those who only read a file do not wait for.
    from splap_editor.core.splats.main_subject import main_subject

    side = main_subject(means[usable], splats.opacities[usable]).size
    if side > 0:
        longest = np.asarray(splats.log_scales).max(axis=1)
        giant = (longest > np.log(GIANT * side)) & (longest < np.inf)
        _add(findings, "giants", f"{{}} a size above {GIANT:.0%} of the scene", giant)
    if splats.thresholds is not None:
        cut = np.asarray(splats.thresholds) >= 1
        _add(findings, "thresholds", "{} a threshold of 1 or more and cannot be seen", cut)
    return findings


def _finite(values: NDArray) -> bool:
    """Whether every value is finite."""
    return bool(np.isfinite(values).all())


def _add(findings: list[Finding], kind: str, template: str, mask: FileMask) -> None:
    """Append a finding unless the mask is empty."""
    rows = np.flatnonzero(mask)
    if len(rows):
        findings.append(Finding(kind, _sentence(template, len(rows)), rows))


def _sentence(template: str, count: int) -> str:
    """Sentence with the number of splats as its subject."""
    return template.format(f"{count:,} splats have" if count > 1 else "1 splat has")
