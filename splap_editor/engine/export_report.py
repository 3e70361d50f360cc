"""What an export changed, in numbers a person can check."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from splap_editor.core.adaptation.kernel_adaptation import AdaptedKernels
from splap_editor.core.splats.splats import Splats
from splap_editor.engine.edit import Edit

if TYPE_CHECKING:
    from splap_editor.engine.deformation_check import DeformationCheck


@dataclass(frozen=True)
class ExportReport:
    """Summary of a written file.

    Parameters
    ----------
    path : Path
    n_splats, n_changed : int
        Rows in the file, and rows of the source that the deformation changed.
    largest_displacement : float
        World units.
    largest_stretch : float
        Largest factor by which a splat's in-plane semi-axis grew or shrank; 1 when none did.
    n_removed : int
        Rows of the source that are not in the file.
    n_split, n_new : int
        Rows of the source that were split, and rows that came of it after those of the source.
    is_placed : bool
        Everything was moved, turned or scaled as one body.
    is_graded : bool
        Colours or opacities were changed.
    form : str
        What all splats were brought to, changed or not: "as .spz holds them"; empty where rows that did not change
        stand as they were.
    check : DeformationCheck, optional
        What the pose spoils, where it was looked at.
    """

    path: Path
    n_splats: int
    n_changed: int
    largest_displacement: float
    largest_stretch: float
    n_removed: int = 0
    is_placed: bool = False
    is_graded: bool = False
    form: str = ""
    check: "DeformationCheck | None" = None
    n_split: int = 0
    n_new: int = 0

    def __str__(self) -> str:
        kept = "none of them moved" if self.is_graded or self.form else "unchanged"
        parts = [f"{self.path.name}: {self.n_splats:,} splats, {kept}"]
        if self.n_changed:
            parts = [
                f"{self.path.name}: {self.n_changed:,} of {self.n_splats - self.n_new:,} splats changed",
                f"moved by up to {self.largest_displacement:.4g}",
                f"stretched by up to {self.largest_stretch:.3g} ×",
            ]
        parts += [f"{self.n_removed:,} removed"] if self.n_removed else []
        parts += [f"{self.n_split:,} splats split into {self.n_new:,} new rows"] if self.n_split else []
        parts += ["all of them put in their place"] if self.is_placed else []
        parts += ["colours graded"] if self.is_graded else []
        parts += [self.form] if self.form else []
        parts += [f"look at {self.check}"] if self.check is not None and self.check.places else []
        return ", ".join(parts)


def export_report(
    path: Path,
    splats: Splats,
    kernels: AdaptedKernels | None,
    edit: Edit,
    form: str = "",
    check: "DeformationCheck | None" = None,
) -> ExportReport:
    """Compare adapted kernels with the splats they came from, before these are put in their place.

    ``form`` and ``check`` are those of the report.
    """
    n_removed = edit.removal.n_removed
    n_written = splats.n_splats - n_removed
    is_placed, is_graded = not edit.place.is_identity, not edit.grading.is_identity
    if kernels is None or not kernels.changed.any():
        return ExportReport(path, n_written, 0, 0.0, 1.0, n_removed, is_placed, is_graded, form, check)
    rows = np.flatnonzero(kernels.changed)
    moved = kernels.means[rows] - np.asarray(splats.means, np.float64)[rows]
    with np.errstate(invalid="ignore", over="ignore"):
        growth = np.abs(np.asarray(kernels.log_scales)[rows] - np.asarray(splats.log_scales, np.float64)[rows])
    growth = growth[np.isfinite(growth)]
    return ExportReport(
        path,
        n_written,
        len(rows),
        float(np.linalg.norm(moved, axis=1).max()),
        float(np.exp(growth.max())) if growth.size else 1.0,
        n_removed,
        is_placed,
        is_graded,
        form,
        check,
    )
